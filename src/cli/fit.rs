//! `gs-chroma fit`.

use std::path::PathBuf;

use clap::{Args, CommandFactory, error::ErrorKind};

use super::{
    Cli, CliError,
    checkpoint::CheckpointArguments,
    effects::EffectArguments,
    luma::LumaArguments,
    network::NetworkArguments,
    next,
    photos::Photos,
    print,
    progress::Progress,
    values::{PRESETS, one_of, positive},
    view::ViewArguments,
};
use crate::capture::LoadOptions;
use crate::effects::Overrules;
use crate::luma::Goal;
use crate::report::timings_table;
use crate::run::{AheadOptions, FitOptions, Init, Preset, fit};

/// Rows of the curve that is printed.
const CURVE_ROWS: usize = 8;

/// Train geometry and luminance on a folder of photos with COLMAP poses.
#[derive(Args)]
pub struct Fit {
    /// Folder with images/ and a COLMAP model (sparse/0, sparse or the folder itself); a run
    /// that is to go on, with its photos, effects and settings, for --iterations more; or a block
    /// of a job of `partition`, or its coarse model.
    #[arg(value_name = "COLMAP_DIR|RUN|BLOCK")]
    colmap_dir: PathBuf,
    /// Run folder to write [default: runs/<folder name>].
    #[arg(short, long, value_name = "RUN")]
    output: Option<PathBuf>,
    /// How much work to put in [default: paper on a GPU, draft without one].
    #[arg(long, value_parser = one_of(PRESETS))]
    preset: Option<Preset>,
    #[command(flatten)]
    photos: Photos,
    #[command(flatten)]
    luma: LumaArguments,
    /// Choose iterations, Gaussians and photo size so that all is done in so many minutes; with
    /// --preset, no more work than that.
    #[arg(long, value_name = "MIN", value_parser = positive::<f64>, conflicts_with = "iterations")]
    time_limit: Option<f64>,
    /// End once held-out views have this PSNR in dB, and have settled; at most with the work of
    /// --preset [default: paper].
    #[arg(long, value_name = "DB", value_parser = positive::<f64>, conflicts_with = "iterations")]
    target_psnr: Option<f64>,
    /// Measure held-out views at this longer side instead of the one that is trained on.
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(16..))]
    measure_side: Option<u32>,
    #[command(flatten)]
    effects: EffectArguments,
    /// Ask this colorization network about the photos while luma trains, so that `colorize` need
    /// not; may be given more than once.
    #[arg(long, value_name = "NAME|FILE.onnx")]
    teacher: Vec<PathBuf>,
    #[command(flatten)]
    network: NetworkArguments,
    /// Start from these Gaussians instead of COLMAP's points.
    #[arg(long, value_name = "FILE.ply")]
    init: Option<PathBuf>,
    #[command(flatten)]
    checkpoints: CheckpointArguments,
    #[command(flatten)]
    view: ViewArguments,
    /// Time every kernel, and print a table of it.
    #[arg(long)]
    timings: bool,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

/// Ends the program as one that was called wrongly.
pub(super) fn refuse(reason: &str) -> ! {
    Cli::command()
        .error(ErrorKind::ArgumentConflict, reason)
        .exit()
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
        let overlay = self.luma.overlay()?;
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
                        "a run goes on with its own photos, effects, preset and Gaussians: leave out the options that name others",
                    );
                }
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
