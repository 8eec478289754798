//! `colored.changes.json`: where each frame's colors come from.

use serde::Serialize;
use serde_json::Value;

use crate::{
    capture::Signal,
    report::{FileReport, TeacherReport},
    store::Codec,
};

/// `colored.changes.json`, beside `colored.mov` or the folder `colored`. Lightness is the source's
/// everywhere.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ChangeReport {
    /// Version of gs-chroma.
    pub program: &'static str,
    /// The film or photos.
    pub source: ChangedSource,
    /// The film or folder in color.
    pub output: ChangedOutput,
    /// Networks and folders that gave colors to what the scene does not show.
    pub teachers: Vec<TeacherReport>,
    /// The run's files.
    pub scene: Vec<FileReport>,
    /// Networks and folders that the scene's colors come from.
    pub scene_teachers: Option<Vec<TeacherReport>>,
    /// The folder of painted hints; `None` without.
    pub hints: Option<String>,
    /// Options of `frames`.
    pub settings: Value,
    /// Each frame in order.
    pub frames: Vec<ChangedFrame>,
}

/// The film or photos.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ChangedSource {
    /// The film's file, the names of its numbered pictures, or the COLMAP folder, absolute.
    pub path: String,
    /// SHA-256 of the film's file, or of the shot's numbered pictures one after the other (`cat`);
    /// `None` of photos, and if the film is gone.
    pub sha256: Option<String>,
    /// Frames a second: numerator and denominator; `None` of photos.
    pub frame_rate: Option<[u32; 2]>,
    /// When the first frame is shown in the film, in seconds; `None` of photos.
    pub start: Option<f64>,
    /// The pictures as the film's file has them; `None` of photos.
    pub signal: Option<Signal>,
}

/// The film or folder in color.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ChangedOutput {
    /// Its path.
    pub path: String,
    /// SHA-256 of the film; `None` of a folder.
    pub sha256: Option<String>,
    /// Codec of the film or the pictures.
    pub codec: Codec,
    /// Frames a second: numerator and denominator.
    pub frame_rate: [u32; 2],
    /// Time code of the first frame; `None` if the source has none.
    pub timecode: Option<String>,
    /// `progressive`.
    pub field_order: &'static str,
}

/// A frame, and the shares of its pixels by the source of their colors; together 1.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ChangedFrame {
    /// From 1, in the shot.
    pub number: usize,
    /// Name of its picture.
    pub name: String,
    /// Time code in the source; `None` if it has none.
    pub timecode: Option<String>,
    /// True if it has a pose in the scene.
    pub pose: bool,
    /// Share that takes the scene's color, weighted by the confidence in it.
    pub scene: f64,
    /// Share that takes the teacher's, from this frame alone.
    pub teacher: f64,
    /// Share that takes the teacher's, drawn towards the frame before along optical flow.
    pub steadied: f64,
    /// Share carried along optical flow from other frames.
    pub interpolated: f64,
    /// Share spread from the pixels around.
    pub spread: f64,
    /// Share that somebody painted.
    pub painted: f64,
}
