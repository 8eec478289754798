//! Arguments that overrule the plan of effects.

use clap::{
    Args, CommandFactory,
    error::{ContextKind, ContextValue, ErrorKind},
};

use super::{Cli, values::one_of};
use crate::effects::{Effect, Overrules};

/// Those of stage 1.
const EFFECTS: &[(Effect, &str)] = &[
    (Effect::Lens, "The lens bends straight lines"),
    (Effect::Masks, "Some pixels of the photos do not count"),
    (Effect::Exposure, "Photos differ in exposure, or flicker"),
    (Effect::Robust, "Photos show dust, scratches or passers-by"),
    (
        Effect::Antialias,
        "Views show the same places from near and from far",
    ),
    (
        Effect::Background,
        "Photos show what no point explains, such as the sky",
    ),
    (Effect::LumaDegree, "Luma depends on the direction of view"),
];

/// What the user wants regardless of evidence.
#[derive(Args)]
pub struct EffectArguments {
    /// Simulate an effect whatever the evidence; may be given several times.
    #[arg(long, value_name = "EFFECT", value_parser = one_of(EFFECTS))]
    with: Vec<Effect>,
    /// Leave an effect out whatever the evidence; may be given several times.
    #[arg(long, value_name = "EFFECT", value_parser = one_of(EFFECTS))]
    without: Vec<Effect>,
    /// Degree of the luminance's dependence on the direction of view, at most [default: as
    /// the evidence says, within the preset].
    #[arg(long, value_name = "0..3", value_parser = clap::value_parser!(u32).range(0..=3))]
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
            let mut error = clap::Error::new(ErrorKind::ArgumentConflict).with_cmd(&Cli::command());
            let argument = |name: &str| ContextValue::String(format!("--{name} {}", both.name()));
            error.insert(ContextKind::InvalidArg, argument("with"));
            error.insert(ContextKind::PriorArg, argument("without"));
            error.exit();
        }
        Overrules {
            with: self.with,
            without: self.without,
            sh_degree: self.sh_degree,
        }
    }
}
