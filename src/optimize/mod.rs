//! What both stages of training share: Adam and the log of losses.

mod adam;
mod loss_log;

pub use adam::{Adam, AdamKernel, AdamParameters};
pub use loss_log::{LossLog, SumLossKernel, SumLossParameters};
