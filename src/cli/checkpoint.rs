//! Checkpoints, wherever a command keeps some.

use clap::Args;

use super::{
    headings::{EXPERT, OUTPUT},
    interrupt::interrupt,
    values::positive,
};
use crate::store::{CheckpointOptions, EVERY};

/// Options of checkpoints.
#[derive(Args)]
pub struct CheckpointArguments {
    /// Continue from the run's checkpoint, if there is one.
    #[arg(long, help_heading = OUTPUT)]
    resume: bool,
    /// Minutes between checkpoints; more if they take over 2 % of the time.
    #[arg(long, help_heading = EXPERT, value_name = "MIN|off", default_value = EVERY.to_string(), value_parser = minutes)]
    checkpoint: Minutes,
}

/// Minutes, if any.
#[derive(Clone, Copy, Debug)]
struct Minutes(Option<f64>);

fn minutes(text: &str) -> Result<Minutes, String> {
    match text {
        "off" => Ok(Minutes(None)),
        _ => positive(text)
            .map(|minutes| Minutes(Some(minutes)))
            .map_err(|reason| reason + ", or off"),
    }
}

impl CheckpointArguments {
    /// The checkpoint options; the next signal interrupts the work.
    pub(super) fn options(&self) -> CheckpointOptions {
        CheckpointOptions {
            resume: self.resume,
            every: self.checkpoint.0,
            interrupt: interrupt(),
        }
    }
}
