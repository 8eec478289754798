//! `gs-chroma tradeoff`.

use std::path::PathBuf;

use clap::{Args, builder::PossibleValuesParser};

use super::{
    CliError,
    effects::EffectArguments,
    luma::LumaArguments,
    next,
    photos::Photos,
    print,
    progress::Progress,
    values::{PRESETS, one_of, positive},
};
use crate::run::{Preset, Stage};
use crate::tradeoff::{FILES, PointStage, TradeoffOptions, front_table, knob_names, tradeoff};

/// Find out what quality costs in time, on these photos and this device: runs `fit` (and
/// `colorize`) with knobs turned around the preset, and draws quality against seconds.
#[derive(Args)]
pub struct Tradeoff {
    /// Folder with images/ and a COLMAP model (sparse/0, sparse or the folder itself).
    colmap_dir: PathBuf,
    /// Folder for points and results; one that has some goes on [default:
    /// runs/<folder name>-tradeoff].
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// A colorization network or a folder of colored photos, for points in color.
    #[arg(long, value_name = "NAME|FILE.onnx|DIR")]
    teacher: Option<PathBuf>,
    /// What knobs are turned around [default: paper on a GPU, draft without one].
    #[arg(long, value_parser = one_of(PRESETS))]
    preset: Option<Preset>,
    #[command(flatten)]
    luma: LumaArguments,
    /// Minutes that all points may take together, earlier starts included; the base runs
    /// anyway.
    #[arg(long, value_name = "MINUTES", default_value_t = 30.0, value_parser = positive::<f64>)]
    budget: f64,
    /// Knobs to turn [default: all].
    #[arg(long, value_name = "A,B,…", value_delimiter = ',', value_parser = PossibleValuesParser::new(knob_names()))]
    knobs: Vec<String>,
    #[command(flatten)]
    photos: Photos,
    #[command(flatten)]
    effects: EffectArguments,
    /// Print tradeoff.json.
    #[arg(long)]
    json: bool,
}

impl Tradeoff {
    pub(super) fn run(self) -> Result<(), CliError> {
        let mut progress = Progress::through(vec![Stage::Sweep]);
        let options = TradeoffOptions {
            colmap_dir: self.colmap_dir,
            output: self.output,
            preset: self.preset,
            settings: self.luma.overlay()?,
            load: self.photos.options(),
            overrules: self.effects.overrules(),
            teacher: self.teacher,
            budget: 60.0 * self.budget,
            knobs: self.knobs,
        };
        let (folder, sweep) = tradeoff(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        if self.json {
            return print(sweep.to_json());
        }
        for stage in [PointStage::Luma, PointStage::Color] {
            if let Some(table) = front_table(&sweep, stage) {
                print(format_args!("{table}\n"))?;
            }
        }
        let wrote = FILES.map(|file| folder.join(file));
        let [.., page] = &wrote;
        progress.close(&wrote.each_ref().map(PathBuf::as_path), &next::look(page))
    }
}
