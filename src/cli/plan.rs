//! `gs-chroma plan`.

use std::path::PathBuf;

use clap::Args;

use super::{effects::EffectArguments, print, progress::Progress};
use crate::run::{PlanOptions, Preset, RunError, plan};

/// Say which effects a capture calls for, and why, without training.
#[derive(Args)]
pub struct Plan {
    /// Folder with images/ and a COLMAP model (sparse/0, sparse or the folder itself).
    colmap_dir: PathBuf,
    /// How much work `fit` would put in [default: paper on a GPU, draft without one].
    #[arg(long, value_enum)]
    preset: Option<Preset>,
    /// Scale photos down until their longer side has this many pixels.
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(16..))]
    max_side: Option<u32>,
    #[command(flatten)]
    effects: EffectArguments,
    /// Train on all views; by default every 8th is held out to measure with.
    #[arg(long)]
    no_holdout: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Plan {
    pub(super) fn run(self) -> Result<(), RunError> {
        let mut progress = Progress::default();
        let options = PlanOptions {
            colmap_dir: self.colmap_dir,
            preset: self.preset,
            max_side: self.max_side,
            overrules: self.effects.overrules(),
            holdout: !self.no_holdout,
        };
        let plan = plan(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        if self.json {
            let report = crate::report::EffectReport::of(&plan);
            print(format_args!(
                "{:#}",
                serde_json::json!({ "effects": report })
            ))
        } else {
            print(plan)
        }
    }
}
