//! `seams`: whether a scene that was put together shows where.

use std::{collections::HashMap, path::PathBuf};

use serde::Serialize;

use super::{
    Event, Observer, RunError, RunFolder, Stage,
    merge::capture_of,
    scene::{Frame, read_splats},
};
use crate::{
    blocks::{Job, Region, Seen},
    capture::Capture,
    color::{ciede2000, srgb_to_lab},
    report::LumaView,
    splats::{Splats, nearest_neighbors, sh},
};

/// A view shows a border where no block's cell has as large a share of what it shows.
const WITHIN_ONE: f64 = 0.9;

/// Neighbors of each Gaussian whose colors are compared with its own.
const NEIGHBORS: usize = 4;

/// Fainter Gaussians are not compared: nothing shows their color, nothing tells it.
const OPACITY: f64 = 0.1;

/// What `seams` is asked to do.
#[derive(Clone, Debug)]
pub struct SeamsOptions {
    /// The job's folder.
    pub job: PathBuf,
    /// The run that `merge` made of it.
    pub run: PathBuf,
    /// A run of the same photos that was never divided.
    pub against: Option<PathBuf>,
}

/// Held-out views that show a border of two blocks' cells, and all others.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SeamViews {
    /// Views that show a border.
    pub across: ViewMean,
    /// Views that show, but for a tenth, one block's cell.
    pub inside: ViewMean,
}

/// The mean of some held-out views.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ViewMean {
    /// How many there are.
    pub views: usize,
    /// Their mean PSNR in dB; none without any.
    pub psnr: Option<f64>,
    /// By how much that is more than of the run that was never divided, in dB.
    pub gain: Option<f64>,
}

/// Colors of neighbors: mean ΔE00 of pairs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SeamColors {
    /// Pairs in two blocks' cells.
    pub across: PairMean,
    /// Pairs in one block's cell, as near to another's as that reaches when it is trained.
    pub beside: PairMean,
    /// All other pairs.
    pub inside: PairMean,
}

/// The mean of some pairs of neighbors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PairMean {
    /// How many there are.
    pub pairs: usize,
    /// Mean ΔE00; none without any.
    pub delta_e: Option<f64>,
    /// The same of the pairs' a and b alone, both at their mean lightness.
    pub hue: Option<f64>,
}

/// What `seams` finds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Seams {
    /// Gray pictures of held-out views.
    pub views: SeamViews,
    /// Colors of Gaussians, once the run is colored.
    pub colors: Option<SeamColors>,
}

/// Compares what lies across the borders of a job's blocks with what lies inside.
///
/// # Errors
/// [`RunError`].
pub fn seams(options: &SeamsOptions, observe: &mut Observer<'_>) -> Result<Seams, RunError> {
    observe(Event::begins(Stage::Model));
    let job = Job::read(&options.job)?;
    let run = RunFolder::at(&options.run);
    let report = run.read_report()?;
    let capture = capture_of(&job, &report.capture.load)?;
    let against = match &options.against {
        Some(path) => Some(RunFolder::at(path).read_report()?.luma.held_out_views),
        None => None,
    };
    let views = &report.luma.held_out_views;
    let views = seam_views(&capture, &job, views, against.as_deref());
    observe(Event::begins(Stage::Pairs));
    let colors = match report.chroma.is_some() && run.color().is_file() {
        true => {
            let (splats, _) = read_splats(&run.color(), Frame::World(capture.offset), observe)?;
            Some(seam_colors(&splats, &job, &capture))
        }
        false => None,
    };
    Ok(Seams { views, colors })
}

/// Means over held-out views that show a border, and over the others.
pub(super) fn seam_views(
    capture: &Capture,
    job: &Job,
    views: &[LumaView],
    against: Option<&[LumaView]>,
) -> SeamViews {
    let cores: Vec<_> = job.blocks.iter().map(|block| block.core).collect();
    let seen = Seen::count(capture, &job.ground, &cores);
    let place: HashMap<&str, usize> = (seen.photos.iter().map(String::as_str)).zip(0..).collect();
    let photo_of: HashMap<&str, &str> = (capture.views.iter())
        .map(|view| (view.name.as_str(), view.photo.as_str()))
        .collect();
    let others: Option<HashMap<&str, f64>> = against.map(|views| {
        let psnr = |view: &LumaView| view.quality.psnr_of_scene();
        views
            .iter()
            .map(|view| (view.name.as_str(), psnr(view)))
            .collect()
    });
    // Across and inside: PSNR, and what is gained.
    let mut found = [const { (Vec::new(), Vec::new()) }; 2];
    for view in views {
        let photo = photo_of
            .get(view.name.as_str())
            .and_then(|photo| place.get(photo));
        let Some(&photo) = photo else { continue };
        let most = (0..cores.len())
            .map(|core| seen.share(core, photo))
            .fold(0.0, f64::max);
        let (psnrs, gains) = &mut found[usize::from(most >= WITHIN_ONE)];
        psnrs.push(view.quality.psnr_of_scene());
        let other = others
            .as_ref()
            .and_then(|others| others.get(view.name.as_str()));
        gains.extend(other.map(|other| view.quality.psnr_of_scene() - other));
    }
    let [across, inside] = found.map(|(psnrs, gains)| ViewMean {
        views: psnrs.len(),
        psnr: mean(&psnrs),
        gain: mean(&gains),
    });
    SeamViews { across, inside }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Means over pairs of neighbors.
fn seam_colors(splats: &Splats, job: &Job, capture: &Capture) -> SeamColors {
    let shown: Vec<usize> = (splats.opacities().enumerate())
        .filter(|&(_, opacity)| opacity >= OPACITY)
        .map(|(i, _)| i)
        .collect();
    let means: Vec<[f32; 3]> = shown.iter().map(|&i| splats.means[i]).collect();
    let labs: Vec<[f64; 3]> = shown.iter().map(|&i| lab_of(splats.sh.of(i))).collect();
    let regions = |area: fn(&crate::blocks::Block) -> crate::blocks::Area| -> Vec<Region> {
        let region = |block| Region {
            ground: job.ground,
            area: area(block),
            offset: capture.offset,
        };
        job.blocks.iter().map(region).collect()
    };
    let (cores, nears) = (regions(|block| block.core), regions(|block| block.near));
    // Which cell a place is in, and whether another block is trained on it, too.
    let at: Vec<(Option<usize>, bool)> = (means.iter())
        .map(|&mean| {
            let core = cores.iter().position(|core| core.holds(mean));
            let near = nears.iter().filter(|near| near.holds(mean)).count();
            (core, near > 1)
        })
        .collect();
    let mut sums = [[0.0; 3]; 3];
    for (i, neighbors) in nearest_neighbors(&means, NEIGHBORS).iter().enumerate() {
        for j in neighbors.iter().map(|&j| j as usize) {
            let kind = match (at[i].0 != at[j].0, at[i].1 && at[j].1) {
                (true, _) => 0,
                (false, true) => 1,
                (false, false) => 2,
            };
            let [a, b] = [labs[i], labs[j]];
            let level = 0.5 * (a[0] + b[0]);
            let hue = ciede2000([level, a[1], a[2]], [level, b[1], b[2]]);
            for (sum, value) in sums[kind].iter_mut().zip([1.0, ciede2000(a, b), hue]) {
                *sum += value;
            }
        }
    }
    let [across, beside, inside] = sums.map(|[pairs, delta_e, hue]| {
        let mean = |sum: f64| (pairs > 0.0).then(|| sum / pairs);
        PairMean {
            pairs: pairs as usize,
            delta_e: mean(delta_e),
            hue: mean(hue),
        }
    });
    SeamColors {
        across,
        beside,
        inside,
    }
}

/// The color that constant harmonics show, in CIELAB.
fn lab_of(coefficients: &[f32]) -> [f64; 3] {
    let rgb = [0, 1, 2].map(|channel| {
        let value = coefficients.get(channel).copied().unwrap_or(0.0);
        (0.5 + sh::C0 * f64::from(value)).clamp(0.0, 1.0)
    });
    srgb_to_lab(rgb)
}
