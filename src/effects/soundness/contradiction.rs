//! Contradictions of photos, poses and points, and their causes.

use std::{fmt, path::PathBuf};

use super::photos::listed;
use crate::capture::Rejected;

/// Correlation of a photo with the points' colors from which on it is the one that COLMAP saw.
/// The lowest photo of any sound scene tried has 0.69; turned, mirrored, renumbered and much
/// cropped ones have at most 0.21 in the median.
pub(super) const LEAST: f64 = 0.3;

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
        /// Likely cause.
        cause: Cause,
    },
    /// Photos do not show what COLMAP saw.
    #[error(
        "{}: {} of {judged} photos ({}) do not show what COLMAP saw: what they show at its points correlates with the points' colors by {median:.3} in the median, below {:.1}; they are turned, cropped, renamed or others: put the photos there that COLMAP saw",
        .images.display(), .photos.len(), listed(.photos.iter().map(|photo| photo.name.as_str())), LEAST
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
pub(super) fn distance(error: f64) -> String {
    match error.is_finite() {
        true => format!("the median reprojection error is {error:.1} px"),
        false => "most points lie behind the cameras that saw them".to_owned(),
    }
}

/// Likely cause of a contradictory model: a correction of it makes the points project to their
/// observations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cause {
    /// Poses are camera-to-world.
    CameraToWorld,
    /// Cameras look along -z, y up.
    OpenGl,
    /// Both.
    CameraToWorldOpenGl,
    /// Intrinsics are those of other photos: the focal length is so many times what it should
    /// be, and the principal point may be off too.
    Intrinsics(f64),
    /// The principal point is that of other photos.
    PrincipalPoint,
    /// Observations are in pixels of pictures so many times as large as the cameras'.
    Observations(f64),
    /// None of these.
    Unknown,
}

impl fmt::Display for Cause {
    /// The cause and the remedy.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::CameraToWorld => f.write_str(
                "its poses are camera-to-world: invert them, images.txt holds world-to-camera ones",
            ),
            Self::OpenGl => f.write_str(
                "its cameras have OpenGL's axes: turn y and z of each camera around, COLMAP's y points down and z forward",
            ),
            Self::CameraToWorldOpenGl => f.write_str(
                "its poses are camera-to-world with OpenGL's axes: turn y and z of each camera around and invert the poses",
            ),
            Self::Intrinsics(ratio) => write!(
                f,
                "its intrinsics are those of other photos, with a focal length {ratio:.2} times what it should be: scale focal lengths and principal points to the width and height of the cameras"
            ),
            Self::PrincipalPoint => f.write_str(
                "its principal points are those of other photos: give those of photos of the cameras' width and height",
            ),
            Self::Observations(ratio) => write!(
                f,
                "its observations are in pixels of pictures {ratio:.2} times as large as the cameras say: scale them"
            ),
            Self::Unknown => f.write_str(
                "its poses, intrinsics and points do not belong together: export all three from COLMAP again",
            ),
        }
    }
}
