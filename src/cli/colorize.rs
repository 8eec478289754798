//! `gs-chroma colorize`.

use std::path::PathBuf;

use clap::{Args, CommandFactory, ValueEnum, error::ErrorKind};

use super::{Cli, print, progress::Progress};
use crate::chroma::{SolverKind, teacher};
use crate::report::timings_table;
use crate::run::{ColorizeOptions, RunError, TeachOptions, colorize};

/// How a teacher's small picture becomes as large as the photo.
#[derive(Clone, Copy, ValueEnum)]
enum Upsample {
    /// Along the photo's edges.
    Guided,
    /// Evenly: colours spill over edges.
    Bilinear,
}

/// Colour a trained run with a colorization network or a folder of coloured photos.
#[derive(Args)]
pub struct Colorize {
    /// Run folder, or a gray .ply with --colmap [default: newest under runs/].
    run: Option<PathBuf>,
    /// A colorization network (.onnx) or a folder of coloured photos named like the originals;
    /// given more than once, their mean.
    #[arg(long, value_name = "FILE.onnx|DIR", required_unless_present = "hints")]
    teacher: Vec<PathBuf>,
    /// What each teacher counts, in their order [default: all the same].
    #[arg(long, value_name = "N,N,…", value_delimiter = ',', value_parser = weight, requires = "teacher")]
    weights: Vec<f32>,
    /// What the network takes and gives: a profile (ddcolor, siggraph17, siggraph17-full, eccv16,
    /// caffe-v2, bigcolor, deoldify, deoldify-browser) or a manifest [default: FILE.toml beside
    /// FILE.onnx, or what its inputs and outputs tell].
    #[arg(long, value_name = "NAME|FILE.toml", requires = "teacher")]
    teacher_profile: Option<String>,
    /// Side in pixels at which a network sees photos, where it leaves that open [default: the profile's].
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(1..=8192), requires = "teacher")]
    teacher_size: Option<u32>,
    /// How a teacher's small picture becomes as large as the photo.
    #[arg(long, value_enum, default_value_t = Upsample::Guided)]
    upsample: Upsample,
    /// How strong the teachers' colours become; hints stay as painted.
    #[arg(long, value_name = "0..1", default_value_t = 1.0, value_parser = strength)]
    strength: f32,
    /// A folder of hints: PNG images named like the photos, colour painted on transparency.
    #[arg(long, value_name = "DIR")]
    hints: Option<PathBuf>,
    /// Coloured splat file to write [default: color.ply in the run folder].
    #[arg(short, long, value_name = "FILE.ply")]
    output: Option<PathBuf>,
    /// Last iteration, counted from the start of `fit` [default: the preset's].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    until: Option<u32>,
    /// How chroma is solved for.
    #[arg(long, value_enum, default_value_t = SolverKind::Irls)]
    solver: SolverKind,
    /// Degree of the chroma's dependence on the direction of view.
    #[arg(long, value_name = "0..3", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=3))]
    sh_degree: u32,
    /// COLMAP folder with the photos, when it is not where `fit` found it.
    #[arg(long, value_name = "COLMAP_DIR")]
    colmap: Option<PathBuf>,
    /// Time every kernel, and print a table of it.
    #[arg(long)]
    timings: bool,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

/// A teacher's weight.
fn weight(text: &str) -> Result<f32, String> {
    let weight = text
        .parse()
        .ok()
        .filter(|&w: &f32| w > 0.0 && w.is_finite());
    weight.ok_or_else(|| "must be a number above 0".to_owned())
}

/// A share.
fn strength(text: &str) -> Result<f32, String> {
    let share = text
        .parse()
        .ok()
        .filter(|share| (0.0..=1.0).contains(share));
    share.ok_or_else(|| "must be a number from 0 to 1".to_owned())
}

impl Colorize {
    /// The teachers with their weights; ends the program where these are not as
    /// many.
    fn teachers(&self) -> Vec<(PathBuf, f32)> {
        let (teachers, weights) = (&self.teacher, &self.weights);
        if !weights.is_empty() && weights.len() != teachers.len() {
            let message = format!(
                "--weights names {} numbers for {} teachers: give one for each --teacher",
                weights.len(),
                teachers.len()
            );
            Cli::command()
                .error(ErrorKind::WrongNumberOfValues, message)
                .exit();
        }
        let weights = weights.iter().copied().chain(std::iter::repeat(1.0));
        teachers.iter().cloned().zip(weights).collect()
    }

    pub(super) fn run(self) -> Result<(), RunError> {
        let mut progress = Progress::default();
        let options = ColorizeOptions {
            teach: TeachOptions {
                teachers: self.teachers(),
                settings: teacher::TeacherSettings {
                    profile: self.teacher_profile,
                    size: self.teacher_size,
                    upsample: match self.upsample {
                        Upsample::Guided => teacher::Upsample::Guided,
                        Upsample::Bilinear => teacher::Upsample::Bilinear,
                    },
                },
                strength: self.strength,
                hints: self.hints,
            },
            run: self.run,
            output: self.output,
            until: self.until.map(|n| n as usize),
            solver: self.solver,
            sh_degree: self.sh_degree,
            colmap: self.colmap,
            timings: self.timings,
        };
        let (output, report) = colorize(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        if self.json {
            print(report.to_json())?;
        } else {
            print(report.chroma_summary())?;
            print(format_args!("wrote {}", output.ply.display()))?;
            if let Some(sheet) = output.contact_sheet {
                print(format_args!("wrote {}", sheet.display()))?;
            }
            let chroma = report.chroma.as_ref();
            if let Some(rows) = chroma.and_then(|chroma| chroma.timings.as_ref()) {
                print(timings_table(rows))?;
            }
        }
        Ok(())
    }
}
