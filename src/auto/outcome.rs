//! Results of a film of several shots.

use std::path::PathBuf;

use serde::Serialize;

use super::Results;
use crate::prepare::CameraMotion;

/// Colors of a shot whose scene cannot be found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Fallback {
    /// Its frames stay gray.
    #[default]
    Gray,
    /// The teacher's, steadied along the optical flow.
    Teacher,
}

/// Outcome of a shot.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Outcome {
    /// It has a scene.
    Scene(Box<Results>),
    /// It has none, for a reason, and its frames are as the fallback has them.
    Fallback {
        /// How they were colored.
        colors: Fallback,
        /// The error.
        reason: String,
    },
    /// It shows nothing: black frames between shots.
    Blank,
}

/// A shot of the film, or blank frames between two.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ReelShot {
    /// Begin and end, in seconds.
    pub span: [f64; 2],
    /// Outcome.
    pub outcome: Outcome,
    /// Motion of its camera; `None` if not known.
    pub camera: Option<CameraMotion>,
    /// The shot in color.
    pub colored: PathBuf,
    /// Wall time, in seconds.
    pub seconds: f64,
    /// All that is doubtful.
    pub warnings: Vec<String>,
}

/// Results of a film.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Reel {
    /// The film in color, of the length of the original, with its sound.
    pub colored: PathBuf,
    /// Page of the shots.
    pub page: PathBuf,
    /// File of the shots' times.
    pub times: PathBuf,
    /// Shots, and blank frames between them, in order.
    pub shots: Vec<ReelShot>,
}
