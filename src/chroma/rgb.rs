//! RGB harmonics by the chroma solver. Two channels are two channels: red with green,
//! then blue with nothing.

use std::sync::Arc;

use super::{
    ChromaSettings, ChromaView, Solver, UNBOUNDED,
    bake_rgb::{bake_rgb, darkest},
    native_rgb,
    teacher::AbImage,
};
use crate::{
    capture::Camera,
    gpu::GpuError,
    raster::{Field, Geometry, Raster, Renderer, constants::NEAR_SHARE},
    splats::{ShField, Splats, sh},
};

/// The solver's loss is made for CIELAB units, 100 of which span black to white.
const UNITS: f32 = 100.0;

/// Views that the bake is fitted to at most; more of one scene say little new.
const BAKE_VIEWS: usize = 16;

/// Times that the bake is fitted to what is missing. The solver does not know that no
/// Gaussian gets darker than black nor a pixel brighter than white: another time works
/// on what is really shown.
const BAKE_TIMES: usize = 2;

/// Rounds at half the size, and at full size, of each of these times, where harmonics have
/// floors; without, more make views worse that are not fitted to (docs/decisions.md).
const BOUNDED_ROUNDS: usize = 6;

/// A view and the colours wanted in its picture.
#[derive(Clone, Debug)]
pub struct RgbView {
    /// Where the picture is taken from.
    pub camera: Camera,
    /// sRGB-encoded, `[height, width]`; differences may be negative.
    pub wanted: Vec<[f32; 3]>,
    /// How much each pixel counts, `[height, width]`; `None` where all count 1.
    pub weights: Option<Vec<f32>>,
}

/// Fits RGB harmonics to coloured pictures on the frozen geometry of `luma`: what training
/// RGB splats on a teacher's pictures would give on this geometry.
///
/// # Errors
/// [`GpuError`] when it does not fit or the device is lost.
pub fn fit_rgb(
    raster: &Arc<Raster>,
    settings: &ChromaSettings,
    extent: f64,
    luma: &Splats,
    views: &[RgbView],
) -> Result<ShField, GpuError> {
    let mut sh = solve(raster, settings, extent, luma, views, false)?;
    let stride = 3 * sh::coefficient_count(sh.degree);
    for of_splat in sh.coefficients.chunks_exact_mut(stride) {
        for constant in &mut of_splat[..3] {
            *constant -= (0.5 / sh::C0) as f32;
        }
    }
    let mut splats = Splats { sh, ..luma.clone() };
    refine(raster, settings, extent, &mut splats, views, 1)?;
    Ok(splats.sh)
}

/// RGB Gaussians that look like `luma` with `chroma`: each Gaussian by itself first
/// ([`bake_rgb`]), then their constant harmonics moved together so that the exported
/// pictures of `cameras` come close to the native ones.
///
/// # Errors
/// [`GpuError`] when it does not fit or the device is lost.
pub fn bake(
    raster: &Arc<Raster>,
    extent: f64,
    luma: &Splats,
    chroma: &ShField,
    cameras: &[Camera],
) -> Result<Splats, GpuError> {
    let step = cameras.len().div_ceil(BAKE_VIEWS).max(1);
    let mut renderer = renderer(raster, extent, luma, &[&luma.sh, chroma])?;
    let views = (cameras.iter().step_by(step))
        .map(|camera| {
            let pictures = renderer.render(camera)?;
            Ok(RgbView {
                camera: camera.clone(),
                wanted: native_rgb(&pictures[0], &pictures[1]),
                weights: None,
            })
        })
        .collect::<Result<Vec<_>, GpuError>>()?;
    drop(renderer);
    let mut baked = bake_rgb(luma, chroma);
    let settings = ChromaSettings::exact();
    refine(raster, &settings, extent, &mut baked, &views, BAKE_TIMES)?;
    Ok(baked)
}

/// Moves the harmonics of RGB Gaussians, up to the degree of `settings`, by what their
/// pictures lack, so many times. Constant harmonics stay where something shows.
fn refine(
    raster: &Arc<Raster>,
    settings: &ChromaSettings,
    extent: f64,
    splats: &mut Splats,
    views: &[RgbView],
    times: usize,
) -> Result<(), GpuError> {
    // What harmonics beyond the constant one become is not known before.
    let bounded = settings.sh_degree == 0;
    let rounds = if bounded { BOUNDED_ROUNDS } else { 4 };
    let settings = ChromaSettings {
        warm_scales: 1,
        warm_rounds: rounds,
        rounds,
        fills: false,
        ..settings.clone()
    };
    let stride = |degree| 3 * sh::coefficient_count(degree);
    if bounded {
        let least = least_constants(splats);
        let constants = (splats.sh.coefficients).chunks_exact_mut(stride(splats.sh.degree));
        for (of_splat, least) in constants.zip(least) {
            for (constant, least) in of_splat.iter_mut().zip(least) {
                *constant = constant.max(least);
            }
        }
    }
    for _ in 0..times {
        let missing = missing(raster, extent, splats, views)?;
        let moved = solve(raster, &settings, extent, splats, &missing, bounded)?;
        let of_splat = (splats.sh.coefficients).chunks_exact_mut(stride(splats.sh.degree));
        for (out, by) in of_splat.zip(moved.coefficients.chunks_exact(stride(moved.degree))) {
            for (value, by) in out.iter_mut().zip(by) {
                *value += by;
            }
        }
    }
    Ok(())
}

/// Draws `fields` on the geometry of `splats`.
fn renderer(
    raster: &Arc<Raster>,
    extent: f64,
    splats: &Splats,
    fields: &[&ShField],
) -> Result<Renderer, GpuError> {
    let gpu = &raster.gpu;
    let fields = fields.iter().map(|field| Field::upload(gpu, field));
    Renderer::new(
        raster.clone(),
        Geometry::upload(gpu, splats)?,
        fields.collect::<Result<_, _>>()?,
        NEAR_SHARE * extent,
    )
}

/// What the pictures of RGB Gaussians lack to be those wanted.
fn missing(
    raster: &Arc<Raster>,
    extent: f64,
    splats: &Splats,
    views: &[RgbView],
) -> Result<Vec<RgbView>, GpuError> {
    let mut renderer = renderer(raster, extent, splats, &[&splats.sh])?;
    (views.iter())
        .map(|view| {
            let pictures = renderer.render(&view.camera)?;
            let shown = pictures[0].pixels.chunks_exact(3);
            let missing = |(wanted, shown): (&[f32; 3], &[f32])| {
                // Viewers clip what they show: nothing is missing beyond white.
                [0, 1, 2].map(|c| wanted[c] - shown[c].clamp(0.0, 1.0))
            };
            Ok(RgbView {
                wanted: view.wanted.iter().zip(shown).map(missing).collect(),
                ..view.clone()
            })
        })
        .collect()
}

/// The least constant harmonics of RGB Gaussians with which they show from somewhere:
/// viewers draw no channel darker than black, so below these nothing changes any more.
fn least_constants(splats: &Splats) -> Vec<[f32; 3]> {
    let stride = 3 * sh::coefficient_count(splats.sh.degree);
    let of_splat = |coefficients: &[f32]| {
        [0, 1, 2].map(|channel| {
            let mut rest = coefficients[3..].iter().skip(channel).step_by(3).copied();
            ((darkest(&mut rest) - 0.5) / sh::C0) as f32
        })
    };
    (splats.sh.coefficients.chunks_exact(stride))
        .map(of_splat)
        .collect()
}

/// How far the constant harmonics of `channels` may fall, in the solver's units, `[2, N]`.
fn floors(splats: &Splats, channels: &[usize]) -> Vec<f32> {
    let n = splats.len();
    let stride = 3 * sh::coefficient_count(splats.sh.degree);
    let mut floors = vec![UNBOUNDED; 2 * n];
    for (i, least) in least_constants(splats).into_iter().enumerate() {
        for (plane, &channel) in channels.iter().enumerate() {
            let constant = splats.sh.coefficients[i * stride + channel];
            floors[plane * n + i] = UNITS * (least[channel] - constant).min(0.0);
        }
    }
    floors
}

/// The field whose blend is wanted, without the offset of mid-gray: `bounded` to where
/// `splats` with it are not darker than black.
fn solve(
    raster: &Arc<Raster>,
    settings: &ChromaSettings,
    extent: f64,
    splats: &Splats,
    views: &[RgbView],
    bounded: bool,
) -> Result<ShField, GpuError> {
    let mut rgb = ShField::zeros(splats.len(), settings.sh_degree, 3);
    for channels in [&[0, 1][..], &[2]] {
        let pair = |view: &RgbView| ChromaView {
            camera: view.camera.clone(),
            wanted: AbImage {
                width: view.camera.width,
                height: view.camera.height,
                ab: (view.wanted.iter())
                    .map(|rgb| {
                        let mut pair = [0.0; 2];
                        for (out, &channel) in pair.iter_mut().zip(channels) {
                            *out = UNITS * rgb[channel];
                        }
                        pair
                    })
                    .collect(),
            },
            weights: view.weights.clone(),
        };
        let views: Vec<ChromaView> = views.iter().map(pair).collect();
        let mut solver = Solver::new(raster.clone(), settings, extent, splats, &views)?;
        if bounded {
            solver.set_floors(&floors(splats, channels));
        }
        solver.run(&mut |_| ())?;
        let found = solver.chroma()?;
        let (from, to) = (
            found.coefficients.chunks_exact(2),
            rgb.coefficients.chunks_exact_mut(3),
        );
        for (from, to) in from.zip(to) {
            for (value, &channel) in from.iter().zip(channels) {
                to[channel] = value / UNITS;
            }
        }
    }
    Ok(rgb)
}
