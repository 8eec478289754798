//! Whether photos, poses and points contradict each other.
//!
//! Two figures tell. Of the model alone: how far from its observations a point projects. Of the
//! photos: how the colors that COLMAP gave its points correlate with what a photo shows where it
//! saw them. Bounds and what was measured are in docs/soundness.md.

mod cause;
mod colors;
mod coverage;
mod doubts;
mod reprojection;

use std::{collections::BTreeSet, path::PathBuf};

pub use cause::Cause;
pub(crate) use colors::correlation;
pub use colors::{Agreement, PointColors};
pub use coverage::{FEW_POINTS, Unseeing};
pub use doubts::{Levels, doubts};
pub use reprojection::{Reprojection, observe_where_projected};

use crate::capture::{Capture, Rejected};

/// Observations of which the median is a figure.
const ENOUGH: usize = 30;

/// Photos and model contradict each other as a whole.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Contradiction {
    /// Points do not project to where they were seen.
    #[error(
        "{}: the model contradicts itself: {}; {cause}", .root.display(), distance(*.error)
    )]
    Model {
        /// The COLMAP folder.
        root: PathBuf,
        /// The median reprojection error in pixels at working size; infinite where most points
        /// are behind the cameras that saw them.
        error: f64,
        /// What is likely wrong.
        cause: Cause,
    },
    /// Photos do not show what COLMAP saw.
    #[error(
        "{}: {} of {judged} photos ({}) do not show what COLMAP saw: what they show at its points correlates with the points' colors by {median:.3} in the median, below {:.1}; they are turned, cropped, renamed or others: put the photos there that COLMAP saw",
        .images.display(), .photos.len(), listed(.photos.iter().map(|photo| photo.name.as_str())), colors::LEAST
    )]
    Photos {
        /// The folder of the photos.
        images: PathBuf,
        /// Those that do not.
        photos: Vec<Rejected>,
        /// Photos that show enough points for a figure.
        judged: usize,
        /// The correlation of the photo in the middle.
        median: f64,
    },
}

/// Photos that contradict the model.
#[derive(Clone, Debug, PartialEq)]
pub enum Contradictory {
    /// All together.
    All(Contradiction),
    /// Single ones, by name.
    Some(Vec<Rejected>),
}

/// A reprojection error in words.
fn distance(error: f64) -> String {
    match error.is_finite() {
        true => format!("the median reprojection error is {error:.1} px"),
        false => "most points lie behind the cameras that saw them".to_owned(),
    }
}

/// Photos in the order of their views: names, and the photo of each view.
fn photos(capture: &Capture) -> (Vec<&str>, Vec<usize>) {
    let mut names: Vec<&str> = Vec::new();
    let mut of_view = Vec::with_capacity(capture.views.len());
    for view in &capture.views {
        if names.last() != Some(&view.photo.as_str()) {
            names.push(&view.photo);
        }
        of_view.push(names.len() - 1);
    }
    (names, of_view)
}

/// The value in the middle, if there is one; not-a-numbers are not allowed.
fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (middle < values.len()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// So many names in words, the first of them by name.
pub(crate) fn listed<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    /// More would fill the screen.
    const NAMED: usize = 5;
    let names: BTreeSet<&str> = names.into_iter().collect();
    let mut words: Vec<&str> = names.iter().take(NAMED).copied().collect();
    let more = names.len().saturating_sub(NAMED);
    let rest = format!("{more} more");
    if more > 0 {
        words.push(&rest);
    }
    words.join(", ")
}

#[cfg(test)]
mod tests;
