//! Options of `prepare`, and names in the folder that it makes.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::CameraMotion;

/// Folder of the masks.
pub(super) const MASKS: &str = "masks";

/// Folder of the 8-bit copies that COLMAP reads.
pub(super) const STRETCHED: &str = "stretched";

/// COLMAP's features and matches.
pub(super) const DATABASE: &str = "database.db";

/// COLMAP's models.
pub(super) const SPARSE: &str = "sparse";

/// The file that says which film it is.
pub(super) const FILM: &str = "film.json";

/// Options of `prepare`; `None` is decided by the input.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PrepareOptions {
    /// A film, or a folder of photos.
    #[serde(skip)]
    pub input: PathBuf,
    /// The folder for `fit`: a new one, or one that was prepared before.
    #[serde(skip)]
    pub output: PathBuf,
    /// Start of the shot in the film, in seconds; the longest shot by default.
    pub start: Option<f64>,
    /// End of the shot, in seconds; the next cut by default.
    pub end: Option<f64>,
    /// Number of the shot in the film, from 1, in place of its start.
    #[serde(skip)]
    pub shot: Option<usize>,
    /// From when to when each shot of the film lasts, in seconds, where that is known.
    #[serde(skip)]
    pub known_shots: Option<Vec<[f64; 2]>>,
    /// Frames a second of numbered pictures: numerator and denominator; by default their own.
    #[serde(default)]
    pub frame_rate: Option<[u32; 2]>,
    /// Frames a second that get a pose; 30 to 120 in all by default.
    pub per_second: Option<f64>,
    /// A mask for all photos.
    pub mask: Option<PathBuf>,
    /// A folder of masks by the photos' names.
    pub masks: Option<PathBuf>,
    /// Photos that share a camera; all of a film, and those of one folder that have one size.
    pub cameras: Option<Cameras>,
    /// COLMAP's name of the camera model.
    pub lens: String,
    /// The camera's motion; found out from the matches.
    #[serde(default)]
    pub camera: Option<CameraMotion>,
    /// Pairs of photos that are matched; each frame of a film with those next to it.
    pub matching: Option<Matching>,
    /// True if `pycolmap` is installed where COLMAP is missing.
    #[serde(skip)]
    pub install: bool,
    /// True if all results are made anew.
    #[serde(skip)]
    pub force: bool,
}

/// Groups of photos that share one camera with one lens.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Cameras {
    /// One camera took all photos.
    One,
    /// Those of one folder.
    Folder,
    /// Each its own, as where the lens zooms; from its EXIF data where it has some.
    Photo,
}

/// Pairs of photos that are matched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Matching {
    /// Each with its neighbors by name, and ever fewer farther away.
    Sequential,
    /// Each with each.
    Exhaustive,
}
