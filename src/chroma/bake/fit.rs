//! RGB harmonics fitted to pictures: the RGB of the drawing is that of viewers, no
//! Gaussian gets darker than black, and no pixel brighter than white.

use std::ops::ControlFlow;

use super::gaussian::{bake_rgb, darkest};
use crate::{
    chroma::{
        ChromaError, ChromaSettings, FrozenViews, IrlsSolver, Targets, Task, UNBOUNDED, native_rgb,
    },
    raster::Field,
    splats::{ShField, Splats, sh},
};

/// Views that the bake is fitted to at most; more of one scene say little new.
const BAKE_VIEWS: usize = 16;

/// Rounds of the bake at half the size, and at full size; more make views worse that are
/// not fitted to (docs/decisions.md).
const BAKE_ROUNDS: [usize; 2] = [6, 6];

/// Fits RGB harmonics, up to the degree of `settings`, to the colored pictures of `tasks`:
/// what training RGB splats on a teacher's pictures would give on this geometry.
///
/// # Errors
/// As [`solve`](crate::chroma::solve).
pub fn fit_rgb(
    frozen: &FrozenViews,
    settings: &ChromaSettings,
    targets: &Targets,
    tasks: Vec<Task>,
) -> Result<ShField, ChromaError> {
    // Mid-gray.
    let start = ShField::zeros(frozen.splat_count(), settings.sh_degree, 3);
    let mut solver = IrlsSolver::starting_at(frozen, settings, targets, tasks, &start)?;
    solver.run(&mut |_| ControlFlow::Continue(()))?;
    solver.chroma()
}

/// RGB Gaussians that look like `luma` with `chroma`: each Gaussian by itself first
/// ([`bake_rgb`]), then their constant harmonics moved together so that the exported
/// pictures come close to the native ones, in an even choice of the frozen views.
///
/// # Errors
/// As [`solve`](crate::chroma::solve).
pub fn bake(frozen: &FrozenViews, luma: &Splats, chroma: &ShField) -> Result<Splats, ChromaError> {
    let settings = ChromaSettings {
        coarse_scales: 1,
        coarse_rounds: BAKE_ROUNDS[0],
        rounds: BAKE_ROUNDS[1],
        ..ChromaSettings::exact()
    };
    let gpu = frozen.gpu();
    let fields = [Field::upload(gpu, &luma.sh)?, Field::upload(gpu, chroma)?];
    let mut targets = Targets::new(settings.target_scales());
    let step = frozen.len().div_ceil(BAKE_VIEWS).max(1);
    let tasks = (0..frozen.len())
        .step_by(step)
        .map(|view| {
            let pictures = frozen.draw(view, &fields.each_ref())?;
            let size = [pictures[0].width, pictures[0].height];
            let native = native_rgb(&pictures[0], &pictures[1]);
            let target = targets.push_rgb(size, &native, None)?;
            Ok(Task { view, target })
        })
        .collect::<Result<Vec<_>, ChromaError>>()?;
    drop(fields);
    let mut baked = bake_rgb(luma, chroma);
    let floors = raise_to_black(&mut baked);
    let start = &baked.sh;
    let mut solver = IrlsSolver::starting_at(frozen, &settings, &targets, tasks, start)?;
    solver.set_floors(&floors);
    solver.run(&mut |_| ControlFlow::Continue(()))?;
    baked.sh = solver.chroma()?;
    Ok(baked)
}

/// Raises constant harmonics to the least with which a Gaussian shows from somewhere:
/// viewers draw no channel darker than black, so below these nothing changes any more.
/// Gives them as planes `[3, N]`.
fn raise_to_black(splats: &mut Splats) -> Vec<f32> {
    let count = splats.len();
    let stride = 3 * sh::coefficient_count(splats.sh.degree);
    let mut floors = vec![UNBOUNDED; 3 * count];
    let of_splats = splats.sh.coefficients.chunks_exact_mut(stride);
    for (i, of_splat) in of_splats.enumerate() {
        for channel in 0..3 {
            let mut rest = of_splat[3..].iter().skip(channel).step_by(3).copied();
            let least = ((darkest(&mut rest) - 0.5) / sh::C0) as f32;
            floors[channel * count + i] = least;
            of_splat[channel] = of_splat[channel].max(least);
        }
    }
    floors
}
