//! `gs-chroma doctor`.

use clap::Args;

use super::{CliError, bar::Bar, next, print, progress::Progress};
use crate::{
    doctor::{Diagnosis, STEPS, measured},
    gpu::Gpu,
    run::RunError,
};

/// Check this device's kernels against an exact reference.
///
/// Compares with f64 code on random scenes and on hard cases. Exit code 1 if any check fails.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma doctor
  WGPU_ADAPTER_NAME=llvmpipe gs-chroma doctor --json")]
pub struct Doctor {
    /// Print as JSON.
    #[arg(long)]
    json: bool,
}

impl Doctor {
    pub(super) fn run(self) -> Result<(), CliError> {
        let mut progress = Progress::default();
        let gpu = Gpu::open().map_err(RunError::from)?;
        let bar = Bar::begin("checks", None);
        let diagnosis = Diagnosis::of(&gpu, &mut |index, name| {
            bar.update(index, STEPS, name);
        })
        .map_err(RunError::from)?;
        bar.end(false);
        if self.json {
            // Numbers and strings only: this cannot fail.
            let json = serde_json::to_string_pretty(&diagnosis).unwrap_or_default();
            print(json)?;
        } else {
            print(format_args!(
                "adapter: {} ({}, {})\ndriver: {}\nlargest binding: {} MiB\nfeatures: {}\n\n{}\n{}",
                diagnosis.adapter,
                diagnosis.backend,
                if diagnosis.software {
                    "software"
                } else {
                    "hardware"
                },
                diagnosis.driver,
                diagnosis.max_binding_bytes >> 20,
                if diagnosis.features.is_empty() {
                    "none needed".to_owned()
                } else {
                    diagnosis.features.join(", ")
                },
                measured::table(&diagnosis.kernels),
                diagnosis.case_table(),
            ))?;
        }
        match diagnosis.failures() {
            0 if self.json => Ok(()),
            0 => progress.close(&[], &next::teachers()),
            failed => Err(CliError::Unsound {
                failed,
                checks: diagnosis.checks(),
                adapter: diagnosis.adapter,
            }),
        }
    }
}
