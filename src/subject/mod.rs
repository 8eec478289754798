//! The scene and the photos that a command works on.

mod error;
pub(crate) mod foreign;
mod live;
mod opened;
pub(crate) mod scene;
pub(crate) mod sound;

pub use error::SubjectError;
pub use live::Live;
pub(crate) use live::LiveCheckpoints;
pub(crate) use opened::{LockMode, Opened, Run, Scene};

/// One of a run's scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneKind {
    /// `color.ply`.
    Color,
    /// `luma.ply`.
    Luma,
}

impl SceneKind {
    /// Name on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Color => "color",
            Self::Luma => "luma",
        }
    }
}
