//! `gs-chroma colorize`.

use std::path::PathBuf;

use clap::Args;

use super::{print, progress::Progress};
use crate::chroma::SolverKind;
use crate::report::timings_table;
use crate::run::{ColorizeOptions, RunError, colorize};

/// Colour a trained run with a colorization network or a folder of coloured photos.
#[derive(Args)]
pub struct Colorize {
    /// Run folder, or a gray .ply with --colmap [default: newest under runs/].
    run: Option<PathBuf>,
    /// A colorization network (.onnx) or a folder of coloured photos named like the originals.
    #[arg(long, value_name = "FILE.onnx|DIR")]
    teacher: PathBuf,
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

impl Colorize {
    pub(super) fn run(self) -> Result<(), RunError> {
        let mut progress = Progress::default();
        let options = ColorizeOptions {
            run: self.run,
            teacher: self.teacher,
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
