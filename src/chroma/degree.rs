//! Which degree of the chroma harmonics the views prove useful.

use std::sync::Arc;

use super::{ChromaSettings, ChromaView, Solver, distil};
use crate::{
    gpu::GpuError,
    raster::Raster,
    splats::{Splats, sh},
};

/// Every so many views are held back to judge by.
const HELD_BACK: usize = 5;

/// A higher degree must lower the loss on the views held back by this share: less is
/// within what the choice of these views amounts to.
pub const LEAST_GAIN: f64 = 0.03;

/// The degree that was chosen, and what each that was tried gave.
#[derive(Clone, Debug, PartialEq)]
pub struct ChosenDegree {
    /// The lowest degree that no higher one beats by enough.
    pub degree: u32,
    /// Mean loss on the views held back, in CIELAB units, from degree 0 on.
    pub losses: Vec<f64>,
}

/// Distils most of `views` at degree 0, 1 and so on, as long as those held back gain.
/// Fewer than two views prove nothing: degree 0.
///
/// # Errors
/// [`GpuError`] when it does not fit or the device is lost.
pub fn choose_degree(
    raster: &Arc<Raster>,
    settings: &ChromaSettings,
    extent: f64,
    splats: &Splats,
    views: &[ChromaView],
) -> Result<ChosenDegree, GpuError> {
    let (mut kept, mut held_back) = (Vec::new(), Vec::new());
    for (i, view) in views.iter().enumerate() {
        let to = if i % HELD_BACK == HELD_BACK / 2 {
            &mut held_back
        } else {
            &mut kept
        };
        to.push(view.clone());
    }
    let mut losses: Vec<f64> = Vec::new();
    if kept.is_empty() || held_back.is_empty() {
        return Ok(ChosenDegree { degree: 0, losses });
    }
    for degree in 0..=sh::MAX_DEGREE {
        let settings = ChromaSettings {
            sh_degree: degree,
            ..settings.clone()
        };
        let ignore = &mut |_| ();
        let found = distil(raster, &settings, extent, splats, kept.clone(), ignore)?;
        let mut judge = Solver::new(raster.clone(), &settings, extent, splats, &held_back)?;
        let loss = judge.objective(&found.chroma)?;
        let gains = (losses.last()).is_none_or(|before| loss < before * (1.0 - LEAST_GAIN));
        losses.push(loss);
        if !gains {
            return Ok(ChosenDegree {
                degree: degree - 1,
                losses,
            });
        }
    }
    Ok(ChosenDegree {
        degree: sh::MAX_DEGREE,
        losses,
    })
}
