//! `gs-chroma fit`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{effects::EffectArguments, photos::Photos, print, progress::Progress};
use crate::chroma::teacher::TeacherSettings;
use crate::luma::{Densification, FLAT, Numerics};
use crate::report::timings_table;
use crate::run::{AheadOptions, FitOptions, Preset, RunError, fit};

/// Rows of the curve that is printed.
const CURVE_ROWS: usize = 8;

/// Train geometry and luminance on a folder of photos with COLMAP poses.
#[derive(Args)]
pub struct Fit {
    /// Folder with images/ and a COLMAP model (sparse/0, sparse or the folder itself).
    colmap_dir: PathBuf,
    /// Run folder to write [default: runs/<folder name>].
    #[arg(short, long, value_name = "RUN")]
    output: Option<PathBuf>,
    /// How much work to put in [default: paper on a GPU, draft without one].
    #[arg(long, value_enum)]
    preset: Option<Preset>,
    /// Luma iterations instead of the preset's; all of them, also where the curve is flat.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    iterations: Option<u32>,
    #[command(flatten)]
    photos: Photos,
    /// Never keep more Gaussians than this.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    max_splats: Option<u32>,
    /// How Gaussians come and go: split where the loss pulls, or put faint ones where others are.
    #[arg(long, value_enum, default_value_t = Densify::Split)]
    densify: Densify,
    /// Share of the iterations, from the first on, that see photos at half their size.
    #[arg(long, value_name = "0..1", default_value_t = 0.0, value_parser = share)]
    coarse: f64,
    /// Take no more of the device's memory than this; fewer Gaussians if need be.
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u32).range(1..))]
    memory_limit: Option<u32>,
    /// End where twice the iterations would bring less than so many dB on held-out views
    /// (0.1 if no number follows), with what was best on the way [default: 0.3 in the preset
    /// balanced, 0.1 in paper, unless --iterations, --time-limit or --target-psnr says how much
    /// is to be done; else never].
    #[arg(long, value_name = "DB", num_args = 0..=1, require_equals = true, value_parser = decibels)]
    stop_when_flat: Option<Option<f64>>,
    /// Choose iterations, Gaussians and photo size so that all is done in so many minutes; with
    /// --preset, no more work than that.
    #[arg(long, value_name = "MIN", value_parser = minutes, conflicts_with = "iterations")]
    time_limit: Option<f64>,
    /// Try with more and more work until held-out views have this PSNR in dB; at most that of
    /// --preset [default: paper].
    #[arg(long, value_name = "DB", value_parser = decibels, conflicts_with = "iterations")]
    target_psnr: Option<f64>,
    /// Measure held-out views at this longer side instead of the one that is trained on.
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(16..))]
    measure_side: Option<u32>,
    #[command(flatten)]
    effects: EffectArguments,
    /// How accurately training computes: alpha-min=0.00001..0.1, transmittance-min=0..0.5,
    /// depth-bits=32|24|16, storage=full|half, ssim-window=11|7|5, adam=exact|lazy. What is
    /// measured, drawn and written is always computed as viewers do.
    #[arg(long, value_name = "KEY=VALUE[,…]")]
    numerics: Option<Numerics>,
    /// Ask this colorization network about the photos while luma trains, so that `colorize` need
    /// not; may be given more than once.
    #[arg(long, value_name = "FILE.onnx")]
    teacher: Vec<PathBuf>,
    /// What the network takes and gives, as for `colorize`.
    #[arg(long, value_name = "NAME|FILE.toml", requires = "teacher")]
    teacher_profile: Option<String>,
    /// Side in pixels at which it sees photos, as for `colorize`.
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(1..=8192), requires = "teacher")]
    teacher_size: Option<u32>,
    /// Seed of every random choice: same seed, same bytes.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Start from these Gaussians instead of COLMAP's points.
    #[arg(long, value_name = "FILE.ply")]
    init: Option<PathBuf>,
    /// Time every kernel, and print a table of it.
    #[arg(long)]
    timings: bool,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

impl Fit {
    pub(super) fn run(self) -> Result<(), RunError> {
        let mut progress = Progress::default();
        let options = FitOptions {
            colmap_dir: self.colmap_dir,
            output: self.output,
            preset: self.preset,
            iterations: self.iterations.map(|n| n as usize),
            load: self.photos.options(),
            max_splats: self.max_splats.map(|n| n as usize),
            overrules: self.effects.overrules(),
            seed: self.seed,
            init: self.init,
            densification: match self.densify {
                Densify::Split => Densification::Split,
                Densify::Relocate => Densification::Relocate,
            },
            coarse: self.coarse,
            memory_limit: self.memory_limit.map(|mib| u64::from(mib) << 20),
            stop_when_flat: self.stop_when_flat.map(|gain| gain.unwrap_or(FLAT)),
            time_limit: self.time_limit.map(|minutes| 60.0 * minutes),
            target_psnr: self.target_psnr,
            measure_side: self.measure_side,
            timings: self.timings,
            numerics: self.numerics.unwrap_or_default(),
            ahead: AheadOptions {
                teachers: self.teacher,
                settings: TeacherSettings {
                    profile: self.teacher_profile,
                    size: self.teacher_size,
                    ..TeacherSettings::default()
                },
            },
        };
        let (folder, report) = fit(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        if self.json {
            print(report.to_json())?;
        } else {
            if let Some(curve) = report.curve_table(CURVE_ROWS) {
                print(curve)?;
            }
            print(report.luma_summary())?;
            print(format_args!("wrote {}", folder.luma().display()))?;
            if let Some(rows) = &report.luma.timings {
                print(timings_table(rows))?;
            }
        }
        Ok(())
    }
}

/// Ways in which Gaussians come and go.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Densify {
    /// 3D Gaussian Splatting's way.
    Split,
    /// The way of 3DGS as Markov chain Monte Carlo.
    Relocate,
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(share),
        _ => Err("not a number from 0 to 1".to_owned()),
    }
}

fn decibels(text: &str) -> Result<f64, String> {
    positive(text).ok_or_else(|| "not a number of dB above 0".to_owned())
}

fn minutes(text: &str) -> Result<f64, String> {
    positive(text).ok_or_else(|| "not a number of minutes above 0".to_owned())
}

fn positive(text: &str) -> Option<f64> {
    let number: f64 = text.parse().ok()?;
    (number > 0.0 && number.is_finite()).then_some(number)
}
