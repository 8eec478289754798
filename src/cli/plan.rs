//! `gs-chroma plan`.

use std::path::PathBuf;

use clap::Args;

use super::{
    CliError,
    effects::EffectArguments,
    headings::{BUDGET, OUTPUT},
    next,
    photos::Photos,
    print,
    progress::Progress,
    values::{PRESETS, one_of},
};
use crate::run::{PlanOptions, PlanReport, Preset, plan};

/// List the effects your photos need, without training.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma plan house
  gs-chroma plan house --json")]
pub struct Plan {
    /// COLMAP folder with images/ and sparse/, or one with transforms.json.
    colmap_dir: PathBuf,
    /// How much work fit would do [default: paper on a GPU, else draft].
    #[arg(long, value_parser = one_of(PRESETS), help_heading = BUDGET)]
    preset: Option<Preset>,
    /// Iterations that fit would do: trials are a share of them [default: the preset's].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = BUDGET)]
    iterations: Option<u32>,
    #[command(flatten)]
    photos: Photos,
    #[command(flatten)]
    effects: EffectArguments,
    /// Print the plan as JSON, with the cost of each effect.
    #[arg(long, help_heading = OUTPUT)]
    json: bool,
}

impl Plan {
    pub(super) fn run(self) -> Result<(), CliError> {
        let options = PlanOptions {
            colmap_dir: self.colmap_dir,
            preset: self.preset,
            iterations: self.iterations.map(|count| count as usize),
            load: self.photos.options(),
            overrules: self.effects.overrules(),
        };
        let mut progress = Progress::through(options.stages());
        let PlanReport { plan, soundness } = plan(&options, &mut |event| progress.show(&event))?;
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
