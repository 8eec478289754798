//! A whole job with the library alone: photos with poses in, a colored splat file out.
//!
//! `cargo run --release --example color_scene -- COLMAP_DIR OUT.ply`

use std::{env, error::Error, ops::ControlFlow, path::PathBuf, sync::Arc};

use gs_chroma::{
    capture::{Dataset, LoadOptions},
    chroma::{
        self, ChromaSettings, Colorizer, ColorizerError, ViewTarget,
        teacher::{AbImage, GrayImage, Query},
    },
    gpu::Gpu,
    luma::{self, LumaEvent, LumaSettings},
    splats::ply,
};

/// Colors every photo sepia; a network would look at its pixels.
struct Sepia;

impl Colorizer for Sepia {
    fn colorize(
        &mut self,
        _: Query<'_>,
        photo: GrayImage<'_>,
    ) -> Result<Option<ViewTarget>, ColorizerError> {
        let (width, height) = (photo.width, photo.height);
        let ab = vec![[6.0, 18.0]; photo.pixels.len()];
        let ab = AbImage { width, height, ab };
        Ok(Some(ab.into()))
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = env::args_os().skip(1).map(PathBuf::from);
    let (Some(dir), Some(out)) = (arguments.next(), arguments.next()) else {
        return Err("usage: color_scene COLMAP_DIR OUT.ply".into());
    };
    let options = LoadOptions {
        max_side: Some(160),
        ..LoadOptions::default()
    };
    let dataset = Arc::new(Dataset::open(&dir, &options, &mut |_| {})?);
    let gpu = Gpu::open()?;
    let scene = luma::fit(&gpu, &dataset, &LumaSettings::new(300), &mut |event| {
        if let LumaEvent::Training(progress) = event {
            println!(
                "iteration {}: loss {:.4}",
                progress.iteration, progress.loss
            );
        }
        ControlFlow::Continue(())
    })?;
    let settings = ChromaSettings::irls();
    let go_on = &mut |_: chroma::ColorizeEvent<'_>| ControlFlow::Continue(());
    let colored = chroma::colorize(
        &scene.raster(&gpu),
        &dataset,
        &scene.splats,
        &mut Sepia,
        &settings,
        go_on,
    )?;
    ply::write_ply(&out, &colored.splats, dataset.capture.offset, &[])?;
    println!("{} Gaussians in {}", colored.splats.len(), out.display());
    Ok(())
}
