//! Minimum memory traffic of the kernels, if every input is read once and the caches hold the rest:
//! the bound on their speed.

use serde::{Deserialize, Serialize};

use super::{AdamSteps, RasterNumerics, Storage};

/// Average size of what the kernels of a stage worked on, a dispatch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Load {
    /// Number of Gaussians.
    pub splats: f64,
    /// Gaussians in view.
    pub visible: f64,
    /// Entries of the tile lists.
    pub instances: f64,
    /// Entries that the tile lists have room for.
    pub capacity: f64,
    /// Number of pixels of the picture.
    pub pixels: f64,
    /// Number of tiles of 16 × 16 pixels.
    pub tiles: f64,
    /// Channels of the picture: 1 in stage 1, 2 in stage 2.
    pub channels: f64,
    /// Spherical-harmonic planes of all channels.
    pub sh_planes: f64,
    /// Numerical accuracy.
    pub numerics: RasterNumerics,
}

/// Words of a projected Gaussian.
const PROJECTED: f64 = 8.0;

/// Words that a tile list leads blending to: slot, index, center, conic and
/// opacity; the color comes on top.
const LISTED: f64 = 8.0;

/// Words of a step of one Gaussian's geometry: value and both moments, in and out.
const GEOMETRY_STEP: f64 = 6.0 * 11.0;

/// 32-bit words that a dispatch of one of this module's kernels must read and write at
/// least; `None` for a kernel of another.
pub fn minimum_words(kernel: &str, load: &Load) -> Option<f64> {
    let Load {
        splats,
        visible,
        instances,
        capacity,
        pixels,
        tiles,
        channels,
        sh_planes,
        numerics,
    } = *load;
    let trains_geometry = channels == 1.0;
    let trained = f64::from(u8::from(trains_geometry));
    // With the geometry, Adam's step is taken at once: value and moments in and out.
    let sh_step = if trains_geometry { 6.0 } else { 1.0 } * sh_planes;
    // What an instance's gradient takes: seven figures for the geometry, the color; on
    // frozen geometry four, gradient and curvature.
    let partial = if trains_geometry { channels + 7.0 } else { 4.0 };
    // And as it waits for its sum.
    let halved = trains_geometry && numerics.storage == Storage::Half;
    let stored = if halved { 0.5 } else { 1.0 } * partial;
    // Gaussians whose parameters move.
    let lazy = trains_geometry && numerics.adam == AdamSteps::Lazy;
    let moved = if lazy { visible } else { splats };
    let digit_passes = [
        f64::from(numerics.depth_bits / 8),
        ((tiles + 1.0).log2() / 8.0).ceil().max(1.0),
    ];
    let passes = digit_passes[0] + digit_passes[1];
    let keys = (digit_passes[0] * visible + digit_passes[1] * instances) / passes;
    let histograms = (digit_passes[0] * splats + digit_passes[1] * capacity) / 2048.0 * 256.0;
    // A scan runs over flags, over counts and over each pass's histogram.
    let scanned = (2.0 * splats + histograms) / (2.0 + passes);
    let words = match kernel {
        "project" => 13.0 * splats + (PROJECTED + 1.0) * visible,
        "compact" => splats + 3.0 * visible,
        "scan_reduce" => scanned,
        "scan_sums" => 2.0 * scanned / 1024.0,
        "scan_whole" => 3.0 * scanned,
        "scan_apply" => 2.0 * scanned,
        "sort_count" => keys,
        "sort_scatter" => 4.0 * keys,
        // The average of counting and emitting.
        "tile_lists" => (PROJECTED + 2.5) * visible + 1.5 * instances,
        "tile_ranges" => 2.0 * tiles,
        "shade" => splats + (3.0 + sh_planes + channels) * visible,
        "blend" => (LISTED + channels) * instances + (channels + 1.0) * pixels,
        "sum_loss" => tiles,
        "blend_backward" => {
            let of_pixel = if trains_geometry {
                2.0 * channels
            } else {
                partial
            } + 1.0;
            (LISTED + channels * trained + stored) * instances + of_pixel * pixels
        }
        "sum_instances" => stored * instances + (partial + 2.0) * visible,
        "shade_backward" => {
            splats + (3.0 + 2.0 * channels) * visible + (3.0 * trained + sh_step) * moved
        }
        "project_backward" => {
            splats + (PROJECTED + partial + 7.0) * visible + GEOMETRY_STEP * moved
        }
        // Gradient, value and both moments in, the latter three out.
        "adam" => 7.0 * sh_planes * splats,
        _ => return None,
    };
    Some(words)
}
