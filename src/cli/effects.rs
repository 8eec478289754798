//! Arguments that overrule the plan of effects.

use clap::{Args, error::ErrorKind};

use super::{headings, usage::refuse, values::one_of};
use crate::effects::{Effect, Overrules};

/// Those of stage 1.
const EFFECTS: &[(Effect, &str)] = &[
    (Effect::Lens, "Lens distortion"),
    (Effect::Masks, "Masks"),
    (Effect::Exposure, "Changing exposure, flicker"),
    (Effect::Robust, "Outliers: dust, scratches"),
    (
        Effect::Antialias,
        "Antialiasing (Mip-Splatting), for views from near and far",
    ),
    (Effect::Background, "A far background, such as the sky"),
    (Effect::LumaDegree, "Luma that changes with the view (SH)"),
];

/// Overrides of the plan's decisions.
#[derive(Args, Clone)]
pub struct EffectArguments {
    /// Model an effect, whatever the plan says; repeatable.
    ///
    /// lens: distortion. masks. exposure: changing exposure, flicker. robust: dust, scratches.
    /// antialias: views from near and far. background: sky. luma-degree: gloss (SH).
    #[arg(long, hide_possible_values = true, value_name = "EFFECT", value_parser = one_of(EFFECTS), help_heading = headings::EFFECTS)]
    with: Vec<Effect>,
    /// Leave an effect out; repeatable.
    #[arg(long, value_name = "EFFECT", value_parser = one_of(EFFECTS), hide_possible_values = true, help_heading = headings::EFFECTS)]
    without: Vec<Effect>,
    /// Maximum SH degree of luma [default: by the plan].
    ///
    /// How far luma may change with the view.
    #[arg(long, value_name = "0..3", value_parser = clap::value_parser!(u32).range(0..=3), help_heading = headings::QUALITY)]
    sh_degree: Option<u32>,
}

impl EffectArguments {
    /// Ends the program with exit code 2 where they contradict each other.
    pub fn overrules(self) -> Overrules {
        if let Some(both) = self
            .with
            .iter()
            .find(|effect| self.without.contains(effect))
        {
            refuse(
                ErrorKind::ArgumentConflict,
                format_args!("the argument '--with {both}' cannot be used with '--without {both}'"),
            );
        }
        Overrules {
            with: self.with,
            without: self.without,
            sh_degree: self.sh_degree,
        }
    }
}
