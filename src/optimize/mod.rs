//! What both stages of training share: Adam, the log of losses, the order of views.

mod adam;
mod loss_log;
mod order;
mod traffic;

pub use adam::{Adam, AdamKernel, AdamParameters, AdamState};
pub use loss_log::{LossLog, SumLossKernel, SumLossParameters};
pub use order::view_at;
pub use traffic::{Load, minimum_bytes};
