//! RGB harmonics fitted to pictures, as viewers draw them: no Gaussian gets darker than
//! black, and no pixel brighter than white.

use std::ops::ControlFlow;

use super::gaussian::{bake_rgb, darkest};
use crate::{
    chroma::{
        ChromaError, ChromaObserver, ChromaProgress, ChromaSettings, FrozenField, IrlsSolver,
        Targets, Task, native_rgb,
    },
    splats::{ShField, Splats, sh},
};

/// Views that the bake is fitted to at most; more of one scene say little new.
const BAKE_VIEWS: usize = 16;

/// Rounds of the bake, all at full size: pictures of half the size are blurred otherwise, and
/// what is right for them is wrong for these. Twelve bring one percent (docs/experiments.md).
const BAKE_ROUNDS: usize = 8;

/// Fits RGB harmonics, up to the degree of `settings`, to the colored pictures of `tasks`:
/// what training RGB splats on a teacher's pictures would give on this geometry.
///
/// # Errors
/// As [`solve`](crate::chroma::solve).
pub fn fit_rgb(
    frozen: &dyn FrozenField,
    settings: &ChromaSettings,
    targets: &Targets,
    tasks: Vec<Task>,
    observe: &mut ChromaObserver<'_>,
) -> Result<ShField, ChromaError> {
    // Mid-gray.
    let start = ShField::zeros(frozen.primitives().count(), settings.sh_degree, 3);
    let mut solver = IrlsSolver::starting_at(frozen, settings, targets, tasks, &start)?;
    solver.run(observe)?;
    solver.chroma()
}

/// Progress of a bake.
pub(in crate::chroma) enum BakeStep {
    /// This view is drawn next.
    Drawing { view: usize, total: usize },
    /// Progress of the solver.
    Solving(ChromaProgress),
}

/// RGB Gaussians that look like `luma` with `chroma`: each Gaussian by itself first
/// ([`bake_rgb`]), then their constant harmonics moved together so that the exported
/// pictures come close to the native ones, in an even choice of the frozen views. Losses are
/// told in hundredths of the way from black to white.
///
/// # Errors
/// As [`solve`](crate::chroma::solve).
pub fn bake(
    frozen: &dyn FrozenField,
    luma: &Splats,
    chroma: &ShField,
    observe: &mut ChromaObserver<'_>,
) -> Result<Splats, ChromaError> {
    bake_telling(frozen, luma, chroma, &mut |step| match step {
        BakeStep::Drawing { .. } => ControlFlow::Continue(()),
        BakeStep::Solving(progress) => observe(progress),
    })
}

/// [`bake`] that tells of what it draws before as well.
pub(in crate::chroma) fn bake_telling(
    frozen: &dyn FrozenField,
    luma: &Splats,
    chroma: &ShField,
    observe: &mut dyn FnMut(BakeStep) -> ControlFlow<()>,
) -> Result<Splats, ChromaError> {
    let settings = ChromaSettings {
        rounds: BAKE_ROUNDS,
        ..ChromaSettings::exact()
    };
    let mut baked = bake_rgb(luma, chroma);
    let room = raise_to_black(&mut baked);
    // What is missing is linear in what the Gaussians are moved by: these are Gaussians
    // around mid-gray, of which none is black.
    let unmoved = ShField::zeros(frozen.primitives().count(), 0, 3);
    let (targets, tasks) = missing(frozen, [&luma.sh, chroma, &baked.sh, &unmoved], observe)?;
    let mut solver = IrlsSolver::starting_at(frozen, &settings, &targets, tasks, &unmoved)?;
    solver.set_floors(&room);
    solver.run(&mut |progress| observe(BakeStep::Solving(progress)))?;
    let moved = solver.chroma()?;
    let stride = 3 * sh::coefficient_count(baked.sh.degree);
    let of_splats = baked.sh.coefficients.chunks_exact_mut(stride);
    for (of_splat, by) in of_splats.zip(moved.coefficients.chunks_exact(3)) {
        for (constant, by) in of_splat.iter_mut().zip(by) {
            *constant += by;
        }
    }
    Ok(baked)
}

/// Difference of the native pictures to `exported`, on top of the picture of `unmoved`. Wanted
/// pictures hold 0 to 1: what lacks more than half of that is asked for in part.
fn missing(
    frozen: &dyn FrozenField,
    [luma, chroma, exported, unmoved]: [&ShField; 4],
    observe: &mut dyn FnMut(BakeStep) -> ControlFlow<()>,
) -> Result<(Targets, Vec<Task>), ChromaError> {
    let (luma, chroma) = (frozen.colors(luma)?, frozen.colors(chroma)?);
    let (exported, unmoved) = (frozen.colors(exported)?, frozen.colors(unmoved)?);
    let mut targets = Targets::new(1);
    let step = frozen.views().div_ceil(BAKE_VIEWS).max(1);
    let total = frozen.views().div_ceil(step);
    let tasks = (0..frozen.views())
        .step_by(step)
        .enumerate()
        .map(|(drawn, view)| {
            if observe(BakeStep::Drawing { view: drawn, total }).is_break() {
                return Err(ChromaError::Cancelled);
            }
            let pictures = frozen.draw(view, &[&luma, &chroma, &exported, &unmoved])?;
            let native = native_rgb(&pictures[0], &pictures[1]);
            // Viewers clip: nothing is missing beyond white.
            let shown = pictures[2].shown();
            let around = pictures[3].pixels.as_chunks::<3>().0;
            let wanted: Vec<[f32; 3]> = (native.iter().zip(&shown).zip(around))
                .map(|((native, shown), around)| {
                    [0, 1, 2].map(|c| around[c] + native[c] - shown[c])
                })
                .collect();
            let size = [pictures[0].width, pictures[0].height];
            let target = targets.push_rgb(size, &wanted, None)?;
            Ok(Task { view, target })
        })
        .collect::<Result<_, ChromaError>>()?;
    Ok((targets, tasks))
}

/// Raises constant harmonics to the least with which a Gaussian shows from somewhere:
/// viewers draw no channel darker than black, so below these nothing changes any more.
/// Gives how far each may still fall, 0 or less, as planes `[3, N]`.
fn raise_to_black(splats: &mut Splats) -> Vec<f32> {
    let count = splats.len();
    let stride = 3 * sh::coefficient_count(splats.sh.degree);
    let mut room = vec![0.0; 3 * count];
    let of_splats = splats.sh.coefficients.chunks_exact_mut(stride);
    for (i, of_splat) in of_splats.enumerate() {
        for channel in 0..3 {
            let mut rest = of_splat[3..].iter().skip(channel).step_by(3).copied();
            let least = ((darkest(&mut rest) - 0.5) / sh::C0) as f32;
            of_splat[channel] = of_splat[channel].max(least);
            room[channel * count + i] = least - of_splat[channel];
        }
    }
    room
}
