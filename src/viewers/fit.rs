//! The fit: Adam on scales, opacities and colors, a view of a viewer an iteration.

use std::sync::Arc;

use super::{
    Pictures, Viewer, bound,
    kernels::{Largest, ViewerKernels},
    packed,
};
use crate::{
    capture::{Camera, view_at},
    chroma::pack_rgb,
    gpu::{Buffer, Gpu, GpuError, Kernel, shaders},
    raster::{AdamStep, Model, Raster, ViewUniform, constants::*},
    splats::{Splats, sh},
};

/// Iterations between two looks at whether the tile lists had room.
const LOOK_EVERY: usize = 25;

/// Entries of tile lists for each Gaussian to begin with, and how much more than what was
/// needed they get.
const ENTRIES_PER_SPLAT: usize = 8;
const MORE_ROOM: f64 = 1.5;

/// Seed of the order of views.
const SEED: u64 = 0;

/// Factor on scales that makes up for PlayCanvas' narrower Gaussians: it cuts tails off and blurs
/// less.
const PLAYCANVAS_WIDER: f32 = 1.1;

/// Settings of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitSettings {
    /// Steps of Adam for each viewer.
    pub iterations: usize,
    /// Rate of the log-scales at first.
    pub log_scales: f64,
    /// Rate of the opacity logits at first.
    pub opacity_logits: f64,
    /// Rate of the constant harmonics at first.
    pub sh_constant: f64,
    /// Rate of the other harmonics at first.
    pub sh_rest: f64,
    /// Share of the rates that is left at the end; they fall by the same factor a step.
    pub settled: f64,
    /// Share of the way after which log-scales stay at the steps that Spark keeps them in, for
    /// opacities and colors to make up for; where nothing but Spark is fitted to.
    pub scales_stay: f64,
}

impl FitSettings {
    /// Settings of the export. Scales are what viewers differ in most: with five times the rate of
    /// colors 100 iterations come as far as 400 with the same (docs/experiments.md).
    pub const DEFAULT: Self = Self {
        iterations: 100,
        log_scales: 5e-2,
        opacity_logits: 3e-2,
        sh_constant: 1e-2,
        sh_rest: 1e-3,
        settled: 0.05,
        scales_stay: 0.5,
    };

    /// Rates at a share of the way: of geometry and of harmonics of a degree, a plane each.
    /// Centers and rotations stay.
    fn rates(&self, share: f64, degree: u32) -> [Vec<f32>; 2] {
        let left = self.settled.powf(share);
        let rate = |at_first: f64| (at_first * left) as f32;
        let mut geometry = vec![0.0; GEOMETRY_PLANES];
        geometry[PLANE_LOG_SCALE..PLANE_OPACITY].fill(rate(self.log_scales));
        geometry[PLANE_OPACITY] = rate(self.opacity_logits);
        let mut field = vec![rate(self.sh_rest); 3 * sh::coefficient_count(degree)];
        field[..3].fill(rate(self.sh_constant));
        [geometry, field]
    }
}

/// Start of a fit to these viewers: constant colors between black and white, scales as much wider
/// as they are on average; for Spark alone, centers and rotations as it keeps them.
pub fn start(viewers: &[Viewer], splats: &Splats) -> Splats {
    let mut start = match viewers {
        [Viewer::Spark] => packed::placed(splats),
        _ => splats.clone(),
    };
    bound(&mut start);
    let narrow = viewers.iter().filter(|&&v| v == Viewer::PlayCanvas).count();
    let wider = PLAYCANVAS_WIDER.ln() * narrow as f32 / viewers.len().max(1) as f32;
    for scale in start.log_scales.as_flattened_mut() {
        *scale += wider;
    }
    start
}

/// Moves scales, opacities and colors of an RGB scene, from `splats` on, until the viewers'
/// pictures for `cameras` come near those that are wanted there; of several viewers each has
/// its turn. `observe` hears of iterations done and in all. The same input gives the same bytes
/// on the same machine.
pub fn fit(
    raster: &Arc<Raster>,
    viewers: &[Viewer],
    splats: &Splats,
    (cameras, wanted): (&[Camera], &Pictures),
    extent: f64,
    settings: &FitSettings,
    observe: &mut dyn FnMut(usize, usize),
) -> Result<Splats, GpuError> {
    let gpu = &raster.gpu;
    let (count, degree) = (splats.len(), splats.sh.degree);
    let views: Vec<ViewUniform> = (cameras.iter())
        .map(|camera| ViewUniform::new(camera, NEAR_SHARE * extent, count, degree))
        .collect();
    let largest: Largest = [
        views.iter().map(ViewUniform::pixel_count).max(),
        views.iter().map(ViewUniform::tile_count).max(),
    ]
    .map(|most| most.unwrap_or(1));
    let words: Vec<Vec<u32>> = (wanted.iter())
        .map(|picture| picture.iter().map(|&rgb| pack_rgb(rgb)).collect())
        .collect();
    let target = Buffer::<u32>::zeros(gpu, "wanted", largest[0])?;
    let loss = Kernel::new(gpu, "rgb_loss", shaders::RGB_LOSS);
    let model = Model::upload(gpu, splats)?;
    let steps = [
        AdamStep::new(gpu, GEOMETRY_PLANES, count)?,
        AdamStep::new(gpu, 3 * sh::coefficient_count(degree), count)?,
    ];
    let scene = (&model, &steps);
    let room = count * ENTRIES_PER_SPLAT;
    let mut easels = Vec::new();
    for &viewer in viewers {
        let kernels = ViewerKernels::new(raster, viewer);
        let canvas = kernels.canvas(&loss, &target, scene, largest, room)?;
        easels.push((kernels, canvas));
    }
    let total = settings.iterations * viewers.len();
    let stay = match viewers {
        [Viewer::Spark] => (settings.scales_stay * total as f64) as usize,
        _ => total,
    };
    for iteration in 0..total {
        let turn = iteration % viewers.len();
        let view = view_at(SEED, views.len(), iteration / viewers.len());
        let mut rates = settings.rates(iteration as f64 / total as f64, degree);
        if iteration == stay {
            round_scales(gpu, &model)?;
        }
        if iteration >= stay {
            rates[0][PLANE_LOG_SCALE..PLANE_OPACITY].fill(0.0);
        }
        set(gpu, &steps, iteration, &rates);
        target.write(gpu, &words[view]);
        let (kernels, canvas) = &easels[turn];
        kernels.step(canvas, &loss, &views[view]);
        let done = iteration + 1;
        if done.is_power_of_two() || done.is_multiple_of(LOOK_EVERY) || done == total {
            for (kernels, canvas) in &mut easels {
                if let Some(needed) = kernels.overflow(canvas)? {
                    let room = (needed as f64 * MORE_ROOM) as usize;
                    *canvas = kernels.canvas(&loss, &target, scene, largest, room)?;
                }
            }
            observe(done, total);
        }
    }
    model.download(gpu)
}

/// Moves log-scales to the steps that Spark keeps them in.
fn round_scales(gpu: &Gpu, model: &Model) -> Result<(), GpuError> {
    let buffer = &model.geometry.planes;
    let mut planes = buffer.read(gpu)?;
    for value in &mut planes[PLANE_LOG_SCALE * model.len()..PLANE_OPACITY * model.len()] {
        *value = packed::log_scale(*value);
    }
    buffer.write(gpu, &planes);
    Ok(())
}

/// Rates of the next step.
fn set(gpu: &Gpu, steps: &[AdamStep; 2], iteration: usize, rates: &[Vec<f32>; 2]) {
    let number = u32::try_from(iteration + 1).unwrap_or(u32::MAX);
    for (step, rates) in steps.iter().zip(rates) {
        step.set(gpu, number, rates);
    }
}
