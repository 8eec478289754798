//! What ends a training, besides a curve that is flat
//! ([`LumaSettings::stop_when_flat`](super::LumaSettings::stop_when_flat)).

use serde::{Deserialize, Serialize};

/// What ends a training.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum Goal {
    /// The iterations of its settings.
    #[default]
    Fixed,
    /// Time: the schedule is stretched or squeezed to end with it.
    Within {
        /// Wall seconds.
        seconds: f64,
    },
}

impl Goal {
    /// Seconds that there are, if they are limited.
    pub fn seconds(&self) -> Option<f64> {
        match *self {
            Self::Fixed => None,
            Self::Within { seconds } => Some(seconds),
        }
    }
}
