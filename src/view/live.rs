//! The page of a command that goes on.

use std::{collections::BTreeMap, path::Path, sync::Arc};

use image::{GrayImage, RgbImage};
use serde_json::{Value, json};

use super::{
    about,
    content::{Content, gray, upright},
    pack,
};
use crate::{
    raster::constants::NEAR_SHARE,
    run::RunError,
    subject::{Live, SceneKind},
};

/// A command that goes on, as a page shows it.
pub struct LiveContent {
    name: String,
    live: Arc<Live>,
}

impl LiveContent {
    /// The command that makes the run `folder`.
    pub fn new(folder: &Path, live: Arc<Live>) -> Self {
        let name = folder.file_name().unwrap_or(folder.as_os_str());
        Self {
            name: name.to_string_lossy().into_owned(),
            live,
        }
    }
}

impl Content for LiveContent {
    fn about(&self) -> Result<Value, RunError> {
        let state = self.live.ask();
        let kinds = [SceneKind::Color, SceneKind::Luma];
        let stamps: BTreeMap<&str, u32> = (kinds.iter())
            .filter_map(|&kind| Some((kind.name(), state.scenes[kind as usize].as_ref()?.stamp)))
            .collect();
        let dataset = state.dataset.as_deref();
        Ok(json!({
            "name": self.name,
            // In alphabetical order the colored one is first.
            "scenes": stamps.keys().collect::<Vec<_>>(),
            "stamps": stamps,
            "live": state.doing,
            "near": dataset.map(|dataset| NEAR_SHARE * dataset.extent),
            "start": null,
            "cameras": dataset.map_or_else(Vec::new, |dataset| about::cameras(dataset, None)),
            "first": dataset.map_or(0, about::first),
            "photos": dataset.is_some(),
            "teacher": false,
            "figures": [],
            "curves": {
                "psnr": about::thinned(&state.psnr),
                "loss": about::thinned(&state.losses),
            },
            "plan": about::plan(&state.plan),
        }))
    }

    fn scene(&self, kind: SceneKind) -> Result<Option<Arc<Vec<u8>>>, RunError> {
        let scene = self.live.scene(kind);
        Ok(scene.map(|scene| Arc::new(pack(&scene.splats, scene.drawn))))
    }

    fn photo(&self, view: usize) -> Result<Option<GrayImage>, RunError> {
        let upright = upright(self.live.ask().dataset.as_deref(), view);
        Ok(self
            .live
            .photo(view)?
            .and_then(|photo| gray(&photo, upright)))
    }

    fn teacher(&self, _: usize) -> Result<Option<RgbImage>, RunError> {
        Ok(None)
    }
}
