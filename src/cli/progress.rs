//! Progress on standard error; nothing where that is no terminal.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use super::printable;
use crate::run::{Event, Stage};

/// Shows the events of a run as progress bars and lines.
#[derive(Default)]
pub struct Progress {
    bar: Option<(Stage, ProgressBar)>,
    /// All warnings so far.
    pub warnings: Vec<String>,
}

impl Progress {
    /// Shows one event.
    pub fn show(&mut self, event: &Event) {
        match event {
            Event::Note(line) => self.print(line),
            Event::Warning(line) => {
                self.print(&format!("warning: {line}"));
                self.warnings.push(line.clone());
            }
            Event::Progress {
                stage,
                done,
                total,
                message,
            } => {
                if self.bar.as_ref().is_none_or(|(shown, _)| shown != stage) {
                    self.finish();
                    self.bar = Some((*stage, bar(&stage.to_string(), *total)));
                }
                if let Some((_, bar)) = &self.bar {
                    bar.set_position(*done as u64);
                    bar.set_message(printable::line(message));
                }
            }
        }
    }

    /// Prints a line above the bar.
    fn print(&self, line: &str) {
        let line = printable::line(line);
        match &self.bar {
            Some((_, bar)) if !bar.is_hidden() => bar.println(line),
            _ => eprintln!("{line}"),
        }
    }

    /// Leaves the last state of the bar on the screen.
    pub fn finish(&mut self) {
        if let Some((_, bar)) = self.bar.take() {
            bar.abandon();
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.finish();
    }
}

/// A bar that counts to `total`.
pub(super) fn bar(name: &str, total: usize) -> ProgressBar {
    let style =
        ProgressStyle::with_template("{prefix:>9} {bar:30} {pos}/{len} {per_sec} ETA {eta} {msg}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(total as u64)
        .with_style(style)
        .with_prefix(name.to_owned());
    bar.enable_steady_tick(Duration::from_millis(500));
    bar
}
