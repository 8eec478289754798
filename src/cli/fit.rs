//! `gs-chroma fit`.

use std::path::PathBuf;

use clap::{Args, error::ErrorKind};

use super::{
    CliError,
    checkpoint::CheckpointArguments,
    effects::EffectArguments,
    headings::{BUDGET, EXPERT, OUTPUT},
    luma::LumaArguments,
    next,
    photos::Photos,
    print,
    progress::Progress,
    usage::refuse,
    values::{PRESETS, folder, one_of, positive},
    view::ViewArguments,
};
use crate::{
    capture::LoadOptions,
    effects::Overrules,
    luma::{DensifyRules, Goal},
    report::timings_table,
    run::{FitRequest, Init, Preset, fit},
};

/// Rows of the curve that is printed.
const CURVE_ROWS: usize = 8;

/// Train a gray scene, geometry and luminance, on photos with poses.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma plan house
  gs-chroma fit house -o runs/house --preset draft
  gs-chroma fit house -o runs/house --preset balanced --view

A finished run is trained further with its own photos and settings:
  gs-chroma fit runs/house --iterations 5000")]
pub struct Fit {
    /// COLMAP folder, one with transforms.json, a run to train further, or a block.
    ///
    /// Blocks are those of a job of `partition`.
    #[arg(value_name = "COLMAP_DIR|RUN|BLOCK")]
    colmap_dir: PathBuf,
    /// How much work to do [default: paper on a GPU, else draft].
    #[arg(long, value_parser = one_of(PRESETS), help_heading = BUDGET)]
    preset: Option<Preset>,
    /// Train as the ChromaDistill paper does.
    ///
    /// --preset paper, all 15,000 iterations, --densify 3dgs, --sh-degree 3. With --iterations the
    /// same schedule in proportion.
    #[arg(long, conflicts_with_all = ["preset", "densify", "stop_when_flat", "time_limit", "target_psnr"], help_heading = EXPERT)]
    as_paper: bool,
    /// Finish in this many minutes; chooses the settings.
    ///
    /// They are photo size, Gaussians and iterations; with --preset, no more work than that. Counts
    /// everything from start to end.
    #[arg(long, value_name = "MIN", value_parser = positive::<f64>, conflicts_with = "iterations", help_heading = BUDGET)]
    time_limit: Option<f64>,
    /// Stop once held-out views reach this PSNR, in dB.
    ///
    /// Their mean counts. Settles before it ends. At most the work of --preset [default: paper];
    /// exit code 1 if the target is out of reach.
    #[arg(long, value_name = "DB", value_parser = positive::<f64>, conflicts_with = "iterations", help_heading = BUDGET)]
    target_psnr: Option<f64>,
    #[command(flatten)]
    luma: LumaArguments,
    /// Measure held-out views at this longer side, in pixels [default: size of training].
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(16..), hide = true)]
    measure_side: Option<u32>,
    /// Keep pictures of a held-out view during training, in album/ of the run folder.
    #[arg(long, hide = true)]
    album: bool,
    #[command(flatten)]
    effects: EffectArguments,
    #[command(flatten)]
    photos: Photos,
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
    #[arg(long, help_heading = EXPERT)]
    timings: bool,
    /// Start from the Gaussians of a splat file instead of COLMAP's points.
    #[arg(long, value_name = "FILE.ply", help_heading = EXPERT)]
    init: Option<PathBuf>,
    /// Continue a trained block beside its neighbors in this run of `merge`.
    #[arg(long, value_name = "MERGED", help_heading = EXPERT)]
    around: Option<PathBuf>,
}

impl Fit {
    pub(super) fn run(self) -> Result<(), CliError> {
        let request = self.request()?;
        let run = request.output.as_ref().unwrap_or(&request.colmap_dir);
        let live = self.view.begin(run)?;
        let request = FitRequest {
            live: live.clone(),
            ..request
        };
        let mut progress = Progress::through(request.stages());
        let (folder, report) = fit(&request, &mut |event| {
            live.iter().for_each(|live| live.tell(&event));
            progress.show(&event);
        })?;
        progress.finish();
        if self.json {
            return print(report.to_json());
        }
        if let Some(curve) = report.curve_table(CURVE_ROWS) {
            print(curve)?;
        }
        print(report.luma_summary())?;
        if let Some(rows) = &report.luma.timings {
            print(timings_table(rows))?;
        }
        let next = next::colorize(folder.path());
        let wrote = [folder.luma(), folder.contact_sheet()];
        let wrote = wrote.each_ref().map(PathBuf::as_path);
        progress.close_with(folder.path(), &wrote, &next)
    }

    /// The request: what the first argument names, with what else is given over it.
    fn request(&self) -> Result<FitRequest, CliError> {
        let (load, mut overrules) = (
            self.photos.clone().options(),
            self.effects.clone().overrules(),
        );
        let mut overlay = self.luma.overlay();
        let paper = self.as_paper.then_some(Preset::Paper);
        if self.as_paper {
            overrules.sh_degree = overrules.sh_degree.or(Some(3));
            overlay.rules = Some(DensifyRules::Published);
        }
        let asked = match FitRequest::continuing(&self.colmap_dir)? {
            Some(run) => self.further(run, &load, &overrules)?,
            None if self.around.is_some() => refuse(
                ErrorKind::ArgumentConflict,
                "--around continues a trained block: train it first",
            ),
            None => match FitRequest::of_block(&self.colmap_dir)? {
                Some(block) => of_block(block, load, overrules),
                None => FitRequest {
                    load,
                    overrules,
                    ..FitRequest::new(self.colmap_dir.clone())
                },
            },
        };
        let seconds = self.time_limit.map(|minutes| 60.0 * minutes);
        Ok(FitRequest {
            output: self.output.clone().or(asked.output),
            preset: paper.or(self.preset).or(asked.preset),
            settings: overlay.over(asked.settings),
            measure_side: self.measure_side.or(asked.measure_side),
            album: self.album,
            init: self.init.clone().map(Init::File).or(asked.init),
            goal: match (self.target_psnr, seconds) {
                (Some(psnr), within) => Goal::Reach { psnr, within },
                (None, Some(seconds)) => Goal::Within { seconds },
                (None, None) => Goal::Fixed,
            },
            timings: self.timings,
            checkpoints: self.checkpoints.options(),
            ..asked
        })
    }

    /// A run that goes on with what it was made from.
    fn further(
        &self,
        run: FitRequest,
        load: &LoadOptions,
        overrules: &Overrules,
    ) -> Result<FitRequest, CliError> {
        let names_others = *load != LoadOptions::default()
            || *overrules != Overrules::default()
            || self.preset.is_some()
            || self.as_paper
            || self.init.is_some();
        if names_others {
            refuse(
                ErrorKind::ArgumentConflict,
                "a run continues with its own photos, effects, preset and Gaussians: leave out the options that name others",
            );
        }
        match &self.around {
            Some(merged) => Ok(run.among(merged)?),
            None => Ok(run),
        }
    }
}

/// A block with what is asked for over what its job's coarse model has decided.
fn of_block(block: FitRequest, load: LoadOptions, overrules: Overrules) -> FitRequest {
    if !block.inherits() {
        return FitRequest {
            load: LoadOptions {
                chosen: block.load.chosen,
                ..load
            },
            overrules,
            ..block
        };
    }
    let own = (load.max_side, overrules.sh_degree);
    let shared = LoadOptions {
        max_side: None,
        ..load
    };
    let effects = Overrules {
        sh_degree: None,
        ..overrules
    };
    if shared != LoadOptions::default() || effects != Overrules::default() {
        refuse(
            ErrorKind::ArgumentConflict,
            "a block has the photos' options and effects of its job's coarse model: give them to that",
        );
    }
    FitRequest {
        load: LoadOptions {
            max_side: own.0,
            ..block.load
        },
        overrules: Overrules {
            sh_degree: own.1,
            ..block.overrules
        },
        ..block
    }
}
