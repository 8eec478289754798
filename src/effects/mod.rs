//! Which effects of image formation a scene calls for.
//!
//! Each effect has a number that speaks for it, found in the capture or in a short
//! probing training, and a threshold. What is off is in no kernel and no buffer.

mod direction;
mod exposure;
mod outliers;
mod plan;
mod tracks;

pub use direction::left_out_errors;
pub use exposure::{Exposures, find_exposures};
pub use outliers::outlier_share;
pub use plan::{Decider, Decision, Effect, Overrules, Plan};
pub use tracks::{Sample, sample_tracks};
