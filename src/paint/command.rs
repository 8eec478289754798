//! The command that colors a run with what is painted on it, and what the page chooses of it.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::{
    chroma::{ChromaSettings, SolverKind, teacher::Upsample},
    effects::{Decider, Effect},
    report::{ChromaReport, EffectReport, Report},
    store::RunFolder,
};

/// Teachers at most.
const TEACHERS: usize = 16;

/// Options of `colorize` that the page shows; the others stay as the run has them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Choices {
    /// Teachers as on the command line, and their weights.
    pub teachers: Vec<(String, f32)>,
    /// Factor on their a and b, 0 to 1.
    pub strength: f32,
    /// Residual at which the loss levels off, in CIELAB units; none for plain L1.
    pub robust: Option<f32>,
    /// Degree of the harmonics of a and b, 0 to 3.
    pub sh_degree: u32,
}

impl Choices {
    /// Those that the run was colored with, or the usual ones.
    pub fn of(report: &Report) -> Self {
        let chroma = report.chroma.as_ref();
        let usual = ChromaSettings::irls();
        let settings = chroma.map_or(&usual, |chroma| &chroma.settings);
        let of_irls = settings.solver == SolverKind::Irls;
        let teachers = chroma.into_iter().flat_map(|chroma| &chroma.teachers);
        let known =
            |teacher: &crate::report::TeacherReport| Some((teacher.path.clone()?, teacher.weight));
        Self {
            teachers: teachers.filter_map(known).collect(),
            strength: chroma.map_or(1.0, |chroma| chroma.strength),
            robust: if of_irls {
                settings.robust
            } else {
                usual.robust
            },
            sh_degree: settings.sh_degree,
        }
    }

    /// Returns true if `colorize` takes them.
    pub fn are_sound(&self) -> bool {
        let above = |value: f32| value.is_finite() && value > 0.0;
        let teacher = |(name, weight): &(String, f32)| {
            !name.trim().is_empty() && !name.starts_with('-') && above(*weight)
        };
        self.teachers.len() <= TEACHERS
            && self.teachers.iter().all(teacher)
            && (0.0..=1.0).contains(&self.strength)
            && self.robust.is_none_or(above)
            && self.sh_degree <= 3
    }
}

/// Words of `colorize` for a run with strokes or without.
pub fn words(
    folder: &RunFolder,
    report: &Report,
    colmap: Option<&Path>,
    choices: &Choices,
    painted: bool,
) -> Vec<String> {
    let text = |path: &Path| path.to_string_lossy().into_owned();
    let mut words = vec!["colorize".to_owned(), text(folder.path())];
    let mut add = |name: &str, value: String| words.extend([format!("--{name}"), value]);
    if let Some(colmap) = colmap {
        add("colmap", text(colmap));
    }
    for (teacher, _) in &choices.teachers {
        add("teacher", teacher.clone());
    }
    let mut weights = choices.teachers.iter().map(|(_, weight)| weight);
    if weights.clone().any(|&weight| weight != 1.0) {
        let first = weights.next().map_or(String::new(), f32::to_string);
        add(
            "weights",
            weights.fold(first, |all, weight| format!("{all},{weight}")),
        );
    }
    if choices.strength != 1.0 {
        add("strength", choices.strength.to_string());
    }
    let usual = ChromaSettings::irls();
    if choices.sh_degree != usual.sh_degree {
        add("sh-degree", choices.sh_degree.to_string());
    }
    if choices.robust != usual.robust {
        let off = || "off".to_owned();
        add(
            "robust",
            choices.robust.map_or_else(off, |units| units.to_string()),
        );
    }
    if let Some(chroma) = &report.chroma {
        of_networks(chroma, !choices.teachers.is_empty(), &mut add);
        of_settings(chroma, &mut add);
    }
    if painted {
        add("hints", text(&folder.hints()));
    }
    words
}

/// Options of networks that the run was colored with.
fn of_networks(chroma: &ChromaReport, any: bool, add: &mut dyn FnMut(&str, String)) {
    if chroma.upsample == Upsample::Bilinear {
        add("upsample", "bilinear".to_owned());
    }
    if !any {
        return;
    }
    if let Some(profile) = &chroma.teacher_profile {
        add("teacher-profile", profile.clone());
    }
    if let Some(side) = chroma.teacher_size {
        add("teacher-size", side.to_string());
    }
    if let Some(class) = chroma.teacher_class {
        add("teacher-class", class.to_string());
    }
}

/// Settings of least squares that are not the usual ones.
fn of_settings(chroma: &ChromaReport, add: &mut dyn FnMut(&str, String)) {
    let (own, usual) = (&chroma.settings, ChromaSettings::irls());
    if own.solver != SolverKind::Irls {
        return;
    }
    if own.rounds != usual.rounds {
        add("rounds", own.rounds.to_string());
    }
    if own.fill != usual.fill {
        add("fill", "off".to_owned());
    }
    if let Some(bytes) = own.memory_limit {
        add("memory-limit", (bytes >> 20).to_string());
    }
    let wished = |effect: &&EffectReport| {
        effect.name == Effect::TeacherCorrection && effect.decided_by == Decider::User
    };
    if let Some(effect) = chroma.effects.iter().find(wished) {
        let switch = if effect.on { "on" } else { "off" };
        add("correct-views", switch.to_owned());
    }
}
