//! `gs-chroma auto`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::{
    CliError,
    headings::{BUDGET, OUTPUT, TEACHER},
    interrupt::interrupt,
    network::NetworkArguments,
    next,
    prepare::InputArguments,
    print,
    progress::Progress,
    values::{PRESETS, folder, one_of},
};
use crate::{
    auto::{AutoEvent, AutoOptions, Results, Step, auto},
    run::Preset,
};

/// Do everything: from a film or photos to a colored scene, colored photos and a page.
///
/// Runs prepare, fit, colorize, frames, export and eval. Steps whose result is there are skipped,
/// so the same command continues after an interruption.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma teacher fetch ddcolor-tiny
  gs-chroma auto photos/ --teacher ddcolor-tiny -o out
  gs-chroma auto film.mp4 --start 1:05 --seconds 20 --teacher ddcolor-tiny -o out")]
pub struct Auto {
    #[command(flatten)]
    input: InputArguments,
    /// Folder for everything.
    #[arg(short, long, value_name = "DIR", value_parser = folder(), help_heading = OUTPUT)]
    output: PathBuf,
    /// Network (name or .onnx), folder of colored photos, or photos for their own colors.
    #[arg(long, help_heading = TEACHER, value_name = "NAME|FILE.onnx|DIR|photos")]
    teacher: PathBuf,
    #[command(flatten)]
    network: NetworkArguments,
    /// Folder of painted strokes, as for colorize.
    #[arg(long, help_heading = TEACHER, value_name = "DIR")]
    hints: Option<PathBuf>,
    /// How much work to do [default: paper on a GPU, else draft].
    #[arg(long, value_parser = one_of(PRESETS), help_heading = BUDGET)]
    preset: Option<Preset>,
    /// Print the paths of all results as JSON.
    #[arg(long, help_heading = OUTPUT)]
    json: bool,
}

impl Auto {
    pub(super) fn run(self) -> Result<(), CliError> {
        let output = self.output;
        let options = AutoOptions {
            prepare: self.input.options(output.join("house"), false),
            output,
            teacher: self.teacher,
            teacher_settings: self.network.settings(),
            hints: self.hints,
            preset: self.preset,
            interrupt: interrupt(),
        };
        let mut whole = Progress::default();
        let mut progress = Progress::default();
        let results = auto(&options, &mut |told| match told {
            AutoEvent::Begins(step, stages) => {
                whole.join(&mut progress);
                eprintln!("{}", heading(step, ""));
                progress = Progress::through(stages);
            }
            AutoEvent::Skips(step) => {
                whole.join(&mut progress);
                eprintln!("{}", heading(step, ": its result is there"));
            }
            AutoEvent::Event(event) => progress.show(&event),
        })?;
        whole.join(&mut progress);
        if self.json {
            let text = serde_json::to_string_pretty(&results);
            return print(text.unwrap_or_default());
        }
        print(in_words(&results))?;
        whole.close(&[], &next::look(&results.page))
    }
}

/// Heading of a step, with its number and the count of steps.
fn heading(step: Step, more: &str) -> String {
    let place = Step::ALL.iter().position(|&other| other == step);
    let (place, of) = (place.unwrap_or_default() + 1, Step::ALL.len());
    format!("step {place} of {of}, {}{more}", step.command())
}

/// Paths of the results, a line each.
fn in_words(results: &Results) -> String {
    let lines: [(&Path, &str); 6] = [
        (&results.colored, "the photos in color"),
        (&results.scene, "the scene, for viewers of splats"),
        (
            &results.contact_sheet,
            "photos, gray, teacher and scene side by side",
        ),
        (&results.page, "what was measured"),
        (
            &results.run,
            "the run: `colorize`, `frames`, `eval` continue from it",
        ),
        (&results.house, "frames, masks and poses"),
    ];
    let paths = lines.map(|(path, _)| path.display().to_string());
    let width = paths
        .iter()
        .map(|path| path.chars().count())
        .max()
        .unwrap_or_default();
    let line = |(path, (_, what)): (&String, &(&Path, &str))| format!("{path:width$}  {what}");
    paths
        .iter()
        .zip(&lines)
        .map(line)
        .collect::<Vec<_>>()
        .join("\n")
}
