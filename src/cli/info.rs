//! `gs-chroma info`.

use std::path::PathBuf;

use clap::Args;

use super::{CliError, print, progress::Progress};
use crate::run::info;

/// Say what a run, a splat file or a COLMAP folder holds.
#[derive(Args)]
pub struct Info {
    /// Run folder, splat file or COLMAP folder.
    path: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Info {
    pub(super) fn run(self) -> Result<(), CliError> {
        let mut progress = Progress::default();
        let value = info(&self.path, &mut |event| progress.show(&event))?;
        if self.json {
            print(format_args!("{value:#}"))?;
        } else {
            print_lines("", &value)?;
        }
        Ok(())
    }
}

/// Prints a JSON value as `key: value` lines, nested keys joined by dots.
fn print_lines(key: &str, value: &serde_json::Value) -> Result<(), CliError> {
    match value {
        serde_json::Value::Object(map) => {
            for (name, value) in map {
                let key = if key.is_empty() {
                    name.clone()
                } else {
                    format!("{key}.{name}")
                };
                print_lines(&key, value)?;
            }
            Ok(())
        }
        serde_json::Value::String(text) => print(format_args!("{key}: {text}")),
        other => print(format_args!("{key}: {other}")),
    }
}
