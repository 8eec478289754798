//! The lightness of other photos on frozen geometry.

use std::sync::Arc;

use super::{
    ChromaError, ChromaObserver, ChromaSettings, FrozenViews, IrlsSolver, MemoryBudget, Targets,
    Task, masked_weights, solve::SEEN,
};
use crate::{
    capture::{Camera, Dataset},
    raster::{ColorKind, Raster},
    splats::{Splats, sh},
};

/// Rounds of least squares at most; harmonics of degree 3 settle in some forty.
const ROUNDS: usize = 45;

/// The Gaussians of `luma` with luma harmonics, up to its degree, that are found anew from the
/// training photos of `dataset`: what was trained in one light, in another. Losses are told in
/// hundredths of the way from black to white.
///
/// # Errors
/// [`ChromaError`] of a photo or the device; [`ChromaError::Cancelled`] where `observe` says so.
pub fn relight(
    raster: &Arc<Raster>,
    dataset: &Dataset,
    luma: &Splats,
    memory_limit: Option<u64>,
    observe: &mut ChromaObserver<'_>,
) -> Result<Splats, ChromaError> {
    let mut targets = Targets::new(1);
    let (mut tasks, mut cameras) = (Vec::<Task>::new(), Vec::<Camera>::new());
    dataset.visit(&dataset.split.train, |view, photo| {
        let gray: Vec<[f32; 3]> = photo.gray_values().into_iter().map(|v| [v; 3]).collect();
        let weights = masked_weights(None, photo);
        let size = [photo.width, photo.height];
        tasks.push(Task {
            view: cameras.len(),
            target: targets.push_rgb(size, &gray, weights.as_deref())?,
        });
        cameras.push(dataset.cameras[view].clone());
        Ok::<_, ChromaError>(())
    })?;
    let settings = ChromaSettings {
        sh_degree: luma.sh.degree,
        rounds: ROUNDS,
        ..ChromaSettings::exact()
    };
    let room = MemoryBudget {
        limit: memory_limit,
        color: ColorKind::Rgb,
        sh_degree: luma.sh.degree,
        weighted: targets.weighted(),
        streams: true,
    };
    let frozen = FrozenViews::new(raster, luma, dataset.extent, &cameras, 1, room)?;
    let start = luma.sh.to_rgb();
    let mut solver = IrlsSolver::starting_at(&frozen, &settings, &targets, tasks, &start)?;
    solver.run(observe)?;
    // Three channels that want the same stay the same.
    let found = solver.chroma()?.coefficients.into_iter().step_by(3);
    let stride = sh::coefficient_count(luma.sh.degree);
    let seen = solver.seen()?;
    let mut lit = luma.clone();
    for (i, (coefficient, found)) in lit.sh.coefficients.iter_mut().zip(found).enumerate() {
        // What no photo shows stays as it was.
        if seen[i / stride] >= SEEN {
            *coefficient = found;
        }
    }
    Ok(lit)
}
