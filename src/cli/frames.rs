//! `gs-chroma frames`.

use std::path::PathBuf;

use clap::Args;

use super::{
    CliError,
    headings::{INPUT, OUTPUT, TEACHER},
    network::NetworkArguments,
    next, print,
    progress::Progress,
    values::{Rate, folder_or_film, one_of, rate},
};
use crate::{
    run::{Frames, FramesOptions, frames},
    store::Codec,
};

pub(super) const CODECS: &[(Codec, &str)] = &[
    (Codec::H264, "8 bits, for looking at: .mp4, .mov, .mkv"),
    (Codec::Ffv1, "Without loss, in the source's depth: .mkv"),
    (Codec::Prores, "ProRes 422 HQ, 10 bits: .mov"),
    (Codec::Prores4444, "ProRes 4444, 10 bits: .mov"),
    (Codec::Dnxhr, "DNxHR HQX, 10 bits: .mxf, .mov"),
    (Codec::Png, "A folder of PNG, 8 or 16 bits"),
    (Codec::Tiff, "A folder of TIFF, 16 bits"),
    (
        Codec::Exr,
        "A folder of OpenEXR, 16-bit floats of linear light",
    ),
    (Codec::Dpx, "A folder of DPX, 10 bits"),
];

/// Color the photos themselves, as pictures or as a film.
///
/// Each photo keeps its own lightness and full size, and takes the scene's colors.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma frames runs/house -o colored/
  gs-chroma frames runs/house -o colored.mp4
  gs-chroma frames runs/house -o colored.mov --codec prores4444")]
pub struct FramesCommand {
    /// Colored run folder [default: newest under runs/].
    run: Option<PathBuf>,
    /// Folder for pictures, or a film, by FFmpeg.
    ///
    /// Films are .mp4, .mov, .mkv, .m4v or .mxf.
    #[arg(short, long, help_heading = OUTPUT, value_name = "DIR|FILM", value_parser = folder_or_film())]
    output: PathBuf,
    /// Teacher for what the scene does not show [default: the run's].
    ///
    /// Such as the sky.
    #[arg(long, help_heading = TEACHER, value_name = "TEACHER")]
    teacher: Option<PathBuf>,
    #[command(flatten)]
    network: NetworkArguments,
    /// Folder of strokes on what the scene does not show [default: the run's].
    ///
    /// A stroke on the sky colors the sky, in up to 200 photos before and after.
    #[arg(long, help_heading = TEACHER, value_name = "DIR", conflicts_with = "teacher_alone")]
    hints: Option<PathBuf>,
    /// Write the teacher's own pictures, without the scene, for comparison.
    #[arg(long, help_heading = TEACHER)]
    teacher_alone: bool,
    /// How films or pictures are coded [default: as the source].
    ///
    /// docs/guides/old-film.md lists what a source becomes.
    #[arg(long, help_heading = OUTPUT, value_name = "CODEC", value_parser = one_of(CODECS))]
    codec: Option<Codec>,
    /// Frames per second, such as 24000/1001 [default: the source's, or 24].
    #[arg(long, alias = "frame-rate", help_heading = OUTPUT, value_name = "RATE", value_parser = rate)]
    fps: Option<Rate>,
    /// COLMAP folder, if it has moved since fit.
    #[arg(long, help_heading = INPUT, value_name = "COLMAP_DIR")]
    colmap: Option<PathBuf>,
    /// Print what was done as JSON.
    #[arg(long, help_heading = OUTPUT)]
    json: bool,
}

impl FramesCommand {
    /// The request.
    pub(super) fn options(self) -> FramesOptions {
        FramesOptions {
            run: self.run,
            colmap: self.colmap,
            teacher: self.teacher,
            teacher_settings: self.network.settings(),
            output: self.output,
            hints: self.hints,
            teacher_alone: self.teacher_alone,
            codec: self.codec,
            frame_rate: self.fps.map(|Rate(rate)| rate),
        }
    }

    pub(super) fn run(self) -> Result<(), CliError> {
        let json = self.json;
        let options = self.options();
        let mut progress = Progress::through(options.stages());
        let done = frames(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        if json {
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
        count => format!("; {count} without a pose take colors from their neighbors"),
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
