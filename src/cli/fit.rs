//! `gs-chroma fit`.

use std::path::PathBuf;

use clap::{Args, error::ErrorKind};

use super::{
    CliError,
    checkpoint::CheckpointArguments,
    effects::EffectArguments,
    headings::{BUDGET, EXPERT, OUTPUT, TEACHER},
    luma::LumaArguments,
    network::NetworkArguments,
    next,
    photos::Photos,
    print,
    progress::Progress,
    usage::refuse,
    values::{PRESETS, folder, one_of, positive},
    view::ViewArguments,
};
use crate::capture::LoadOptions;
use crate::effects::Overrules;
use crate::luma::Goal;
use crate::report::timings_table;
use crate::run::{AheadOptions, FitOptions, Init, Preset, fit};

/// Rows of the curve that is printed.
const CURVE_ROWS: usize = 8;

/// Train a gray scene, geometry and luminance, on photos with COLMAP poses.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma plan house
  gs-chroma fit house -o runs/house --preset draft
  gs-chroma fit house -o runs/house --preset balanced --view

A finished run is trained further with its own photos and settings:
  gs-chroma fit runs/house --iterations 5000")]
pub struct Fit {
    /// COLMAP folder with images/ and sparse/, a finished run to train further, or a block of a
    /// job of `partition`.
    #[arg(value_name = "COLMAP_DIR|RUN|BLOCK")]
    colmap_dir: PathBuf,
    /// How much work to do [default: paper on a GPU, else draft].
    #[arg(long, value_parser = one_of(PRESETS), help_heading = BUDGET)]
    preset: Option<Preset>,
    /// Finish in this many minutes: chooses photo size, Gaussians and iterations.
    ///
    /// With --preset, no more work than that. Counts everything from start to end.
    #[arg(long, value_name = "MIN", value_parser = positive::<f64>, conflicts_with = "iterations", help_heading = BUDGET)]
    time_limit: Option<f64>,
    /// Stop once held-out views reach this mean PSNR, in dB.
    ///
    /// Settles before it ends. At most the work of --preset [default: paper]; exit code 1 if the
    /// target is out of reach.
    #[arg(long, value_name = "DB", value_parser = positive::<f64>, conflicts_with = "iterations", help_heading = BUDGET)]
    target_psnr: Option<f64>,
    #[command(flatten)]
    luma: LumaArguments,
    /// Measure held-out views at this longer side, in pixels [default: size of training].
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(16..), hide = true)]
    measure_side: Option<u32>,
    #[command(flatten)]
    effects: EffectArguments,
    #[command(flatten)]
    photos: Photos,
    /// Ask this network for colors during training, so that colorize need not; repeatable.
    #[arg(long, value_name = "NAME|FILE.onnx", help_heading = TEACHER)]
    teacher: Vec<PathBuf>,
    #[command(flatten)]
    network: NetworkArguments,
    /// Run folder to write [default: runs/<folder name>].
    #[arg(short, long, value_name = "RUN", value_parser = folder(), help_heading = OUTPUT)]
    output: Option<PathBuf>,
    #[command(flatten)]
    checkpoints: CheckpointArguments,
    #[command(flatten)]
    view: ViewArguments,
    /// Print the report as JSON.
    #[arg(long, help_heading = OUTPUT)]
    json: bool,
    /// Time every kernel and print a table.
    #[arg(long, help_heading = EXPERT, hide_short_help = true)]
    timings: bool,
    /// Start from the Gaussians of a splat file instead of COLMAP's points.
    #[arg(long, value_name = "FILE.ply", help_heading = EXPERT, hide_short_help = true)]
    init: Option<PathBuf>,
    /// Go on with a trained block of a job, with what its neighbors have around its cell in this
    /// run of `merge`.
    #[arg(long, value_name = "MERGED", help_heading = EXPERT, hide_short_help = true)]
    around: Option<PathBuf>,
}

impl Fit {
    pub(super) fn run(self) -> Result<(), CliError> {
        let seconds = self.time_limit.map(|minutes| 60.0 * minutes);
        let goal = match (self.target_psnr, seconds) {
            (Some(psnr), within) => Goal::Reach { psnr, within },
            (None, Some(seconds)) => Goal::Within { seconds },
            (None, None) => Goal::Fixed,
        };
        let (load, overrules) = (self.photos.options(), self.effects.overrules());
        let overlay = self.luma.overlay();
        let asked = match FitOptions::continuing(&self.colmap_dir)? {
            Some(run) => {
                if [
                    load != LoadOptions::default(),
                    overrules != Overrules::default(),
                    self.preset.is_some(),
                    self.init.is_some(),
                ]
                .contains(&true)
                {
                    refuse(
                        ErrorKind::ArgumentConflict,
                        "a run continues with its own photos, effects, preset and Gaussians: leave out the options that name others",
                    );
                }
                let run = match &self.around {
                    Some(merged) => run.among(merged)?,
                    None => run,
                };
                FitOptions {
                    output: self.output.or(run.output),
                    measure_side: self.measure_side.or(run.measure_side),
                    settings: Box::new(move |settings| {
                        (run.settings)(settings);
                        overlay(settings);
                    }),
                    ..run
                }
            }
            None if self.around.is_some() => refuse(
                ErrorKind::ArgumentConflict,
                "--around goes on with a trained block: train it first",
            ),
            None => match FitOptions::of_block(&self.colmap_dir)? {
                Some(block) => {
                    let photos = LoadOptions {
                        max_side: None,
                        ..load.clone()
                    };
                    let effects = Overrules {
                        sh_degree: None,
                        ..overrules.clone()
                    };
                    let asks = photos != LoadOptions::default() || effects != Overrules::default();
                    if block.inherits() && asks {
                        refuse(
                            ErrorKind::ArgumentConflict,
                            "a block has the photos' options and effects of its job's coarse model: give them to that",
                        );
                    }
                    let inherited = block.inherits();
                    FitOptions {
                        output: self.output.or(block.output),
                        preset: self.preset.or(block.preset),
                        settings: Box::new(move |settings| {
                            (block.settings)(settings);
                            overlay(settings);
                        }),
                        load: match inherited {
                            true => LoadOptions {
                                max_side: load.max_side,
                                ..block.load
                            },
                            false => LoadOptions {
                                chosen: block.load.chosen,
                                ..load
                            },
                        },
                        overrules: match inherited {
                            true => Overrules {
                                sh_degree: overrules.sh_degree,
                                ..block.overrules
                            },
                            false => overrules,
                        },
                        init: self.init.map(Init::File),
                        measure_side: self.measure_side,
                        ..block
                    }
                }
                None => FitOptions {
                    output: self.output,
                    preset: self.preset,
                    settings: overlay,
                    load,
                    overrules,
                    init: self.init.map(Init::File),
                    measure_side: self.measure_side,
                    ..FitOptions::new(self.colmap_dir)
                },
            },
        };
        let options = FitOptions {
            goal,
            timings: self.timings,
            checkpoints: self.checkpoints.options(),
            ahead: AheadOptions {
                teachers: self.teacher,
                settings: self.network.settings(),
            },
            ..asked
        };
        let asked = options.ahead.teachers.first().cloned();
        let run = options.output.as_ref().unwrap_or(&options.colmap_dir);
        let live = self.view.begin(run)?;
        let options = FitOptions {
            live: live.clone(),
            ..options
        };
        let mut progress = Progress::through(options.stages());
        let (folder, report) = fit(&options, &mut |event| {
            live.iter().for_each(|live| live.tell(&event));
            progress.show(&event);
        })?;
        progress.finish();
        if self.json {
            print(report.to_json())?;
        } else {
            if let Some(curve) = report.curve_table(CURVE_ROWS) {
                print(curve)?;
            }
            print(report.luma_summary())?;
            if let Some(rows) = &report.luma.timings {
                print(timings_table(rows))?;
            }
            let next = next::colorize(folder.path(), asked.as_deref());
            let wrote = [folder.luma(), folder.contact_sheet()];
            let wrote = wrote.each_ref().map(PathBuf::as_path);
            progress.close_with(folder.path(), &wrote, &next)?;
        }
        Ok(())
    }
}
