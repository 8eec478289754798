//! Stopping goals of a training, besides early stopping
//! ([`LumaSettings::stop_when_flat`](super::LumaSettings::stop_when_flat)).

use serde::{Deserialize, Serialize};

/// Stopping goal of a training.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
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
    /// A PSNR of the [watched](super::LumaTrainer::watch) views: once it is reached, training
    /// settles and ends. Without it training ends as it would otherwise.
    Reach {
        /// Decibels.
        psnr: f64,
        /// Wall seconds, if they are limited.
        within: Option<f64>,
    },
}

impl Goal {
    /// Seconds that there are, if they are limited.
    pub fn seconds(self) -> Option<f64> {
        match self {
            Self::Fixed => None,
            Self::Within { seconds } => Some(seconds),
            Self::Reach { within, .. } => within,
        }
    }

    /// The PSNR that is to be reached, in dB.
    pub fn psnr(self) -> Option<f64> {
        match self {
            Self::Reach { psnr, .. } => Some(psnr),
            Self::Fixed | Self::Within { .. } => None,
        }
    }

    /// The same with so many seconds, where they are limited at all.
    pub fn with_seconds(self, limited: f64) -> Self {
        match self {
            Self::Fixed | Self::Reach { within: None, .. } => self,
            Self::Within { .. } => Self::Within { seconds: limited },
            Self::Reach { psnr, .. } => Self::Reach {
                psnr,
                within: Some(limited),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_change_only_where_there_are_some() {
        let reach = |within| Goal::Reach { psnr: 25.0, within };
        let goals = [
            Goal::Fixed,
            Goal::Within { seconds: 9.0 },
            reach(None),
            reach(Some(9.0)),
        ];
        let seconds = goals.map(|goal| goal.with_seconds(5.0).seconds());
        assert_eq!(seconds, [None, Some(5.0), None, Some(5.0)]);
        assert!(
            goals
                .iter()
                .all(|goal| goal.with_seconds(5.0).psnr() == goal.psnr())
        );
    }

    #[test]
    fn json_names_the_kind() {
        let reach = Goal::Reach {
            psnr: 25.0,
            within: None,
        };
        let text = serde_json::to_string(&reach).unwrap();
        assert_eq!(text, r#"{"kind":"reach","psnr":25.0,"within":null}"#);
        assert_eq!(serde_json::from_str::<Goal>(&text).unwrap(), reach);
        assert_eq!(
            serde_json::to_string(&Goal::Fixed).unwrap(),
            r#"{"kind":"fixed"}"#
        );
    }
}
