//! `gs-chroma frames`.

use std::path::PathBuf;

use clap::Args;

use super::{
    CliError,
    network::NetworkArguments,
    next, print,
    progress::Progress,
    values::{Rate, rate},
};
use crate::run::{Frames, FramesOptions, frames};

/// Color the photos themselves: each with its own lightness at its full size, and the scene's
/// colors.
#[derive(Args)]
pub struct FramesCommand {
    /// Colored run folder [default: newest under runs/].
    run: Option<PathBuf>,
    /// Folder for the pictures, PNG of 8 bits, or of 16 where a photo has them; or a film
    /// (.mp4, .mov, .mkv), which ffmpeg writes.
    #[arg(short, long, value_name = "DIR|FILM")]
    output: PathBuf,
    /// Who colors what the scene does not show (sky, what moved) [default: the run's teachers].
    #[arg(long, value_name = "NAME|FILE.onnx|DIR|photos")]
    teacher: Option<PathBuf>,
    #[command(flatten)]
    network: NetworkArguments,
    /// Folder of painted hints, for what the scene does not show: a stroke on the sky colors the
    /// sky, in the photos before and after as well [default: the run's].
    #[arg(long, value_name = "DIR", conflicts_with = "teacher_alone")]
    hints: Option<PathBuf>,
    /// Leave the scene out: the teacher's own pictures, to compare with.
    #[arg(long)]
    teacher_alone: bool,
    /// Frames a second of a film: 24, or 24000/1001 [default: as the film that the photos come
    /// from, or 24].
    #[arg(long, value_name = "RATE", value_parser = rate)]
    frame_rate: Option<Rate>,
    /// COLMAP folder with the photos, when it is not where `fit` found it.
    #[arg(long, value_name = "COLMAP_DIR")]
    colmap: Option<PathBuf>,
    /// Print what was done as JSON.
    #[arg(long)]
    json: bool,
}

impl FramesCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        let options = FramesOptions {
            run: self.run,
            colmap: self.colmap,
            teacher: self.teacher,
            teacher_settings: self.network.settings(),
            output: self.output,
            hints: self.hints,
            teacher_alone: self.teacher_alone,
            frame_rate: self.frame_rate.map(|Rate(rate)| rate),
        };
        let mut progress = Progress::through(options.stages());
        let done = frames(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        if self.json {
            let text = serde_json::to_string_pretty(&done);
            return print(text.unwrap_or_default());
        }
        print(summary(&done, options.teacher_alone))?;
        let next = next::export(options.run.as_deref());
        progress.close(&[&done.output], &next)
    }
}

fn summary(done: &Frames, teacher_alone: bool) -> String {
    if teacher_alone {
        return format!("colored {} photos by the teacher alone", done.photos);
    }
    let carried = match done.carried {
        0 => String::new(),
        count => format!("; {count} without a pose take their colors from their neighbors"),
    };
    let painted = match done.painted {
        0 => String::new(),
        count => format!("; {count} show strokes on what it does not cover"),
    };
    format!(
        "colored {} photos: the scene covers {:.0} % of the {} with a pose{carried}{painted}",
        done.photos,
        100.0 * done.covered,
        done.placed,
    )
}
