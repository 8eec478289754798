//! Held-out PSNR of a merged scene across block borders and inside blocks.

use std::collections::HashMap;

use crate::{
    blocks::{Job, PhotoCoverage},
    capture::Capture,
    report::LumaView,
};

/// A view shows a border where no block's cell has as large a share of what it shows.
const WITHIN_ONE: f64 = 0.9;

/// Held-out views that show a border of two blocks' cells, and all others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamViews {
    /// Views that show a border.
    pub across: ViewMean,
    /// Views that show, but for a tenth, one block's cell.
    pub inside: ViewMean,
}

/// The mean of some held-out views.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewMean {
    pub views: usize,
    /// Their mean PSNR in dB; none without any.
    pub psnr: Option<f64>,
}

/// Means over held-out views that show a border, and over the others.
pub(super) fn seam_views(capture: &Capture, job: &Job, views: &[LumaView]) -> SeamViews {
    let cores: Vec<_> = job.blocks.iter().map(|block| block.core).collect();
    let seen = PhotoCoverage::count(capture, &job.ground, &cores);
    let place: HashMap<&str, usize> = (seen.photos.iter().map(String::as_str)).zip(0..).collect();
    let photo_of: HashMap<&str, &str> = (capture.views.iter())
        .map(|view| (view.name.as_str(), view.photo.as_str()))
        .collect();
    // PSNR across and inside.
    let mut found = [const { Vec::new() }; 2];
    for view in views {
        let photo = photo_of
            .get(view.name.as_str())
            .and_then(|photo| place.get(photo));
        let Some(&photo) = photo else { continue };
        let most = (0..cores.len())
            .map(|core| seen.share(core, photo))
            .fold(0.0, f64::max);
        found[usize::from(most >= WITHIN_ONE)].push(view.quality.psnr_of_scene());
    }
    let [across, inside] = found.map(|psnrs| ViewMean {
        views: psnrs.len(),
        psnr: (!psnrs.is_empty()).then(|| psnrs.iter().sum::<f64>() / psnrs.len() as f64),
    });
    SeamViews { across, inside }
}
