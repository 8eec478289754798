//! `gs-chroma tradeoff`.

use std::path::PathBuf;

use clap::{Args, Command, builder::PossibleValuesParser};

use super::{
    CliError,
    headings::{BUDGET, OUTPUT, TEACHER},
    next, print,
    progress::Progress,
    values::{PRESETS, folder, one_of, positive},
};
use crate::{
    run::Preset,
    tell::Stage,
    tradeoff::{FILES, PointStage, TradeoffOptions, front_table, knob_names, tradeoff},
};

/// Measure quality against time on your own photos and device.
///
/// The first fit, and colorize with --teacher, already show what less time costs; then one setting
/// at a time is changed, the most useful first. The same command continues after an
/// interruption.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma tradeoff house
  gs-chroma tradeoff house --preset balanced -- --max-side 800 --masks off
  gs-chroma tradeoff house --teacher ddcolor-tiny --knobs rounds --budget 60")]
pub struct Tradeoff {
    /// COLMAP folder with images/ and sparse/, or one with transforms.json.
    colmap_dir: PathBuf,
    /// Folder for points and results [default: runs/<folder name>-tradeoff].
    #[arg(short, long, help_heading = OUTPUT, value_name = "DIR", value_parser = folder())]
    output: Option<PathBuf>,
    /// Network or folder of colored photos, for points in color.
    #[arg(long, help_heading = TEACHER, value_name = "TEACHER")]
    teacher: Option<PathBuf>,
    /// Preset around which settings change [default: paper on a GPU, else draft].
    #[arg(long, value_parser = one_of(PRESETS), help_heading = BUDGET)]
    preset: Option<Preset>,
    /// Minutes for all points together [default: four times the base's].
    ///
    /// Earlier starts included.
    #[arg(long, help_heading = BUDGET, value_name = "MIN", value_parser = positive::<f64>)]
    budget: Option<f64>,
    /// Settings to change [default: all].
    #[arg(long, help_heading = BUDGET, value_name = "A,B,…", value_delimiter = ',', value_parser = PossibleValuesParser::new(knob_names()))]
    knobs: Vec<String>,
    /// Print tradeoff.json.
    #[arg(long, help_heading = OUTPUT)]
    json: bool,
    /// Options of every fit, after `--`.
    #[arg(last = true, value_name = "OPTIONS OF FIT")]
    fit: Vec<String>,
}

impl Tradeoff {
    pub(super) fn run(self, program: Command) -> Result<(), CliError> {
        let preset = self.preset.iter();
        let preset = preset.flat_map(|preset| ["--preset".to_owned(), preset.to_string()]);
        let fit: Vec<String> = preset.chain(self.fit).collect();
        let words = ["gs-chroma", "fit", "scene", "-o", "point", "--album"].map(str::to_owned);
        if let Err(error) = program.try_get_matches_from(words.iter().chain(&fit)) {
            error.exit();
        }
        let mut progress = Progress::through(vec![Stage::Sweep]);
        let options = TradeoffOptions {
            colmap_dir: self.colmap_dir,
            output: self.output,
            fit,
            teacher: self.teacher,
            budget: self.budget.map(|minutes| 60.0 * minutes),
            knobs: self.knobs,
        };
        let (folder, sweep) = tradeoff(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        if self.json {
            return print(sweep.to_json());
        }
        for stage in PointStage::ALL {
            if let Some(table) = front_table(&sweep, stage) {
                print(format_args!("{table}\n"))?;
            }
        }
        let wrote = FILES.map(|file| folder.join(file));
        let [.., page] = &wrote;
        progress.close(&wrote.each_ref().map(PathBuf::as_path), &next::look(page))
    }
}
