//! `gs-chroma export`.

use std::path::PathBuf;

use clap::Args;

use super::{CliError, print};
use crate::run::export;

/// Write a run's scene as a splat file in the photos' own coordinates.
#[derive(Args)]
pub struct Export {
    /// Run folder [default: newest under runs/].
    run: Option<PathBuf>,
    /// Splat file to write.
    #[arg(short, long, value_name = "FILE.ply")]
    output: PathBuf,
    /// Write the luminance although the scene is colored.
    #[arg(long)]
    luma: bool,
}

impl Export {
    pub(super) fn run(self) -> Result<(), CliError> {
        let count = export(self.run.as_deref(), &self.output, self.luma)?;
        print(format_args!(
            "wrote {count} Gaussians to {}",
            self.output.display()
        ))?;
        Ok(())
    }
}
