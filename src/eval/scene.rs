//! Subject of the evaluation: a scene with its photos, its luma and its colors.

use super::Reference;
use crate::{
    capture::{Dataset, Exposure, Photo},
    splats::{ShField, Splats},
};

pub struct ColoredScene {
    /// Its photos.
    pub dataset: Dataset,
    /// Exposure of each view's photo.
    pub exposures: Vec<Exposure>,
    /// Geometry and luma.
    pub luma: Splats,
    /// Native a/b, where they are known.
    pub chroma: Option<ShField>,
    /// RGB of the exported file, on the same geometry.
    pub exported: ShField,
}

impl ColoredScene {
    /// The photo of a view, to compare pictures of it with.
    pub fn reference<'a>(&self, view: usize, photo: &'a Photo) -> Reference<'a> {
        Reference {
            photo,
            exposure: self.exposures[view],
        }
    }

    /// The name of the photos' folder.
    pub fn name(&self) -> String {
        let root = &self.dataset.capture.root;
        let name = root.canonicalize().ok();
        let name = name.as_ref().unwrap_or(root).file_name();
        name.map_or("scene".into(), |n| n.to_string_lossy())
            .into_owned()
    }
}
