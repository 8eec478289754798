//! `gs-chroma plan`.

use std::path::PathBuf;

use clap::Args;

use super::{
    CliError,
    effects::EffectArguments,
    next,
    photos::Photos,
    print,
    progress::Progress,
    values::{PRESETS, one_of},
};
use crate::run::{PlanOptions, Planned, Preset, plan};

/// Say which effects a capture calls for, and why, without fitting it.
#[derive(Args)]
pub struct Plan {
    /// Folder with images/ and a COLMAP model (sparse/0, sparse or the folder itself).
    colmap_dir: PathBuf,
    /// How much work `fit` would put in [default: paper on a GPU, draft without one].
    #[arg(long, value_parser = one_of(PRESETS))]
    preset: Option<Preset>,
    #[command(flatten)]
    photos: Photos,
    #[command(flatten)]
    effects: EffectArguments,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Plan {
    pub(super) fn run(self) -> Result<(), CliError> {
        let options = PlanOptions {
            colmap_dir: self.colmap_dir,
            preset: self.preset,
            load: self.photos.options(),
            overrules: self.effects.overrules(),
        };
        let mut progress = Progress::through(options.stages());
        let Planned { plan, soundness } = plan(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        if self.json {
            let report = crate::report::EffectReport::of(&plan.decisions);
            print(format_args!(
                "{:#}",
                serde_json::json!({
                    "effects": report,
                    "soundness": soundness,
                    "warnings": progress.warnings,
                })
            ))
        } else {
            print(plan)?;
            progress.close(&[], &next::fit_as_planned())
        }
    }
}
