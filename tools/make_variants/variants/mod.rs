//! Scenes made from a scene. Tests take this module as it is.

mod arc;
mod brush;
mod defects;
mod depth;
mod distances;
mod error;
mod exposure;
mod gloss;
mod lens;
mod places;
mod resample;
mod scene;
mod sky;
mod warp;
mod write;

#[cfg(test)]
mod tests;

use std::path::Path;

pub use error::Error;
use scene::Scene;

/// Variants of a scene. For each but the last five there is a control: made in the same way,
/// without the effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Variant {
    /// A wide lens: COLMAP's OPENCV model, which bends the corners by a tenth
    Barrel,
    /// OPENCV with coefficients that move no pixel by more than 0.3
    BarrelControl,
    /// A fisheye with the photos' field: COLMAP's OPENCV_FISHEYE model
    Fisheye,
    /// OPENCV_FISHEYE with the coefficients that make it a pinhole
    FisheyeControl,
    /// Every training photo has its own gain (0.77 to 1.3) and offset (up to 0.04)
    Exposure,
    /// Gains and offsets a hundredth of these
    ExposureControl,
    /// Every other photo has a quarter of the size
    Distances,
    /// All photos have half the size
    DistancesControl,
    /// Specks, hairs and scratches on every training photo, a passer-by on each third
    Dust,
    /// The same photos, clean
    DustControl,
    /// The far part of the scene is a sky, and its points are missing
    Sky,
    /// As many points are missing, from anywhere
    SkyControl,
    /// A watermark and a passer-by on every training photo, and masks of both
    Masked,
    /// The same photos, clean, without masks
    MaskedControl,
    /// Patches of the scene brighten to one side and darken to the other
    Gloss,
    /// The same photos, with no more shine than they have
    GlossControl,
    /// 16-bit gray PNG that uses 0.2 to 0.35 of the range
    Sixteen,
    /// 8-bit gray PNG of the same
    SixteenControl,
    /// 32-bit float TIFF of linear radiance
    InfraredTiff,
    /// Dust on three times as much of each photo, as on worn film; the clean photos are
    /// `dust-control`'s
    HeavyDust,
    /// A fifth of the gains and offsets of `exposure`, whose control is this one's too
    Flicker,
    /// Eleven photos that are turned to one side
    Arc,
    /// The far part of the scene is one plain gray, and its points are missing
    Backdrop,
}

/// Makes a variant of the scene in the folder `source` and writes it to the folder `out`.
/// Says in a line what was made.
///
/// # Errors
/// If the source cannot be read, or does not suit the variant; if `out` exists or cannot
/// be written. Then nothing is left at `out`.
pub fn make(source: &Path, variant: Variant, out: &Path, seed: u64) -> Result<String, Error> {
    if out.exists() {
        return Err(Error::Exists { path: out.into() });
    }
    let mut scene = Scene::read(source)?;
    let note = match variant {
        Variant::Barrel => warp::barrel(&mut scene, true),
        Variant::BarrelControl => warp::barrel(&mut scene, false),
        Variant::Fisheye => warp::fisheye(&mut scene, true),
        Variant::FisheyeControl => warp::fisheye(&mut scene, false),
        Variant::Exposure => exposure::vary(&mut scene, 1.0, seed),
        Variant::ExposureControl => exposure::vary(&mut scene, 0.01, seed),
        Variant::Flicker => exposure::vary(&mut scene, 0.2, seed),
        Variant::Distances => distances::quarter(&mut scene),
        Variant::DistancesControl => distances::halve(&mut scene),
        Variant::Dust => defects::dust(&mut scene, defects::DUST_AREA, seed),
        Variant::HeavyDust => defects::dust(&mut scene, defects::HEAVY_DUST_AREA, seed),
        Variant::Sky => sky::open(&mut scene),
        Variant::Arc => arc::short(&mut scene),
        Variant::Backdrop => sky::backdrop(&mut scene),
        Variant::SkyControl => sky::thin(&mut scene, seed),
        Variant::Masked => defects::masked(&mut scene, seed),
        Variant::Gloss => gloss::polish(&mut scene, seed),
        Variant::DustControl | Variant::MaskedControl | Variant::GlossControl => {
            "photos as they were".into()
        }
        Variant::Sixteen => depth::sixteen(&mut scene),
        Variant::SixteenControl => depth::eight(&mut scene),
        Variant::InfraredTiff => depth::float(&mut scene),
    };
    write::scene(&scene, out)?;
    let (views, points) = (scene.views.len(), scene.points.len());
    let held_out = scene.views.iter().filter(|view| view.held_out).count();
    Ok(format!(
        "{views} views ({held_out} held out), {points} points; {note}"
    ))
}

/// A random generator for one view of a scene, independent of the others'.
fn random(seed: u64, view: usize) -> fastrand::Rng {
    let mut seeds = fastrand::Rng::with_seed(seed);
    let mine = std::iter::repeat_with(|| seeds.u64(..)).nth(view);
    fastrand::Rng::with_seed(mine.expect("endless"))
}
