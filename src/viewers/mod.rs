//! Viewers' pictures of a scene, and scenes fitted to them.
//!
//! Viewers do not draw alike: PlayCanvas' engine cuts a Gaussian's tails off and blurs it less,
//! Spark packs a Gaussian into 16 bytes, and neither knows by itself that a scene was trained
//! antialiased. [`fit`] moves scales, opacities and colors until a viewer's
//! pictures are those that the scene has here. docs/viewers.md has what the viewers themselves
//! draw, beside what [`Viewer::drawing`] says that they do.

mod fit;
mod kernels;
mod packed;

pub use fit::{FitSettings, fit, start};

use std::sync::Arc;

use crate::{
    capture::Camera,
    gpu::GpuError,
    measure::reported_psnr,
    raster::{Falloff, Raster, RasterOptions, SceneRenderer},
    splats::{Splats, sh},
};

/// A viewer that scenes are fitted to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Viewer {
    /// Spark, set as 3D Gaussian splatting draws: every Gaussian to its end, blurred by 0.3 px².
    Spark,
    /// PlayCanvas' engine, which SuperSplat is built on.
    PlayCanvas,
}

serde_plain::derive_display_from_serialize!(Viewer);

impl Viewer {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Spark, Self::PlayCanvas];

    /// Drawing options of the viewer. Neither antialiases by default.
    pub fn drawing(self) -> RasterOptions {
        RasterOptions {
            antialiased: false,
            falloff: match self {
                Self::Spark => Falloff::Gaussian,
                Self::PlayCanvas => Falloff::PlayCanvas,
            },
        }
    }

    /// An RGB scene as it keeps it.
    fn kept(self, splats: &Splats) -> Splats {
        match self {
            Self::Spark => packed::packed(splats),
            Self::PlayCanvas => splats.clone(),
        }
    }
}

/// Whom a file is written for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ViewerChoice {
    /// Spark (three.js), a Gaussian in 16 bytes.
    Spark,
    /// PlayCanvas' engine.
    PlayCanvas,
    /// All viewers: the compromise.
    Any,
}

impl ViewerChoice {
    /// The viewers that are meant.
    pub fn viewers(self) -> &'static [Viewer] {
        match self {
            Self::Spark => &[Viewer::Spark],
            Self::PlayCanvas => &[Viewer::PlayCanvas],
            Self::Any => &Viewer::ALL,
        }
    }
}

/// Pictures of a scene, `[cameras][height, width]`, sRGB in [0, 1].
pub type Pictures = Vec<Vec<[f32; 3]>>;

/// Draws `splats` for each camera.
pub fn pictures(
    raster: &Arc<Raster>,
    splats: &Splats,
    drawn: RasterOptions,
    cameras: &[Camera],
    extent: f64,
) -> Result<Pictures, GpuError> {
    let raster = raster.drawing(drawn);
    let mut renderer = SceneRenderer::of(&raster, splats, &[&splats.sh], extent)?;
    let shown = cameras.iter().map(|camera| {
        let pictures = renderer.render(camera)?;
        Ok(pictures.first().map(|p| p.shown()).unwrap_or_default())
    });
    shown.collect()
}

/// Mean PSNR in dB of `viewer`'s pictures of an RGB scene against those that are wanted, over the
/// cameras.
pub fn shown_psnr(
    raster: &Arc<Raster>,
    viewer: Viewer,
    splats: &Splats,
    wanted: &Pictures,
    cameras: &[Camera],
    extent: f64,
) -> Result<f64, GpuError> {
    let kept = viewer.kept(splats);
    let shown = pictures(raster, &kept, viewer.drawing(), cameras, extent)?;
    let each = (shown.iter().zip(wanted))
        .map(|(shown, wanted)| reported_psnr(shown.as_flattened(), wanted.as_flattened()));
    Ok(each.sum::<f64>() / wanted.len() as f64)
}

/// The same scene with three channels, which a gray one shows alike.
pub fn in_rgb(splats: &Splats) -> Splats {
    Splats {
        sh: splats.sh.to_rgb(),
        ..splats.clone()
    }
}

/// Keeps constant colors between black and white.
fn bound(splats: &mut Splats) {
    let stride = 3 * sh::coefficient_count(splats.sh.degree);
    let end = (0.5 / sh::C0) as f32;
    for of_splat in splats.sh.coefficients.chunks_exact_mut(stride) {
        for constant in &mut of_splat[..3] {
            *constant = constant.clamp(-end, end);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::splats::ShField;

    fn gray(value: f32) -> Splats {
        Splats {
            means: vec![[0.0; 3]],
            quats: vec![[1.0, 0.0, 0.0, 0.0]],
            log_scales: vec![[0.0; 3]],
            opacity_logits: vec![0.0],
            sh: ShField {
                degree: 0,
                channels: 1,
                coefficients: vec![value],
            },
        }
    }

    #[test]
    fn gray_scenes_have_three_channels_alike() {
        let colored = in_rgb(&gray(0.25));
        assert_eq!(colored.sh.coefficients, [0.25; 3]);
        assert_eq!(in_rgb(&colored), colored);
    }
}
