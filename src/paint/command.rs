//! The command that colors a run with what is painted on it.

use std::path::Path;

use crate::{
    chroma::{ChromaSettings, SolverKind},
    effects::{Decider, Effect},
    report::{ChromaReport, Report},
    store::RunFolder,
};

/// Words of `colorize` with the run's teachers and settings.
pub fn words(folder: &RunFolder, report: &Report, colmap: Option<&Path>) -> Vec<String> {
    let text = |path: &Path| path.to_string_lossy().into_owned();
    let mut words = vec!["colorize".to_owned(), text(folder.path())];
    let mut add = |name: &str, value: String| words.extend([format!("--{name}"), value]);
    if let Some(colmap) = colmap {
        add("colmap", text(colmap));
    }
    if let Some(chroma) = &report.chroma {
        of_teachers(chroma, &mut add);
        of_settings(chroma, &mut add);
    }
    words
}

/// The words that add the strokes in a run's folder.
pub fn hints(folder: &RunFolder) -> [String; 2] {
    let hints = folder.hints();
    ["--hints".to_owned(), hints.to_string_lossy().into_owned()]
}

fn of_teachers(chroma: &ChromaReport, add: &mut dyn FnMut(&str, String)) {
    let known: Vec<(&String, f32)> = (chroma.teachers.iter())
        .filter_map(|teacher| Some((teacher.path.as_ref()?, teacher.weight)))
        .collect();
    for (path, _) in &known {
        add("teacher", (*path).clone());
    }
    if known.iter().any(|(_, weight)| *weight != 1.0) {
        let weights: Vec<String> = known.iter().map(|(_, weight)| weight.to_string()).collect();
        add("weights", weights.join(","));
    }
    if chroma.strength != 1.0 {
        add("strength", chroma.strength.to_string());
    }
}

/// Settings of least squares that are not the usual ones.
fn of_settings(chroma: &ChromaReport, add: &mut dyn FnMut(&str, String)) {
    let (own, usual) = (&chroma.settings, ChromaSettings::irls());
    if own.sh_degree != usual.sh_degree {
        add("sh-degree", own.sh_degree.to_string());
    }
    if own.solver != SolverKind::Irls {
        return;
    }
    if own.rounds != usual.rounds {
        add("rounds", own.rounds.to_string());
    }
    if own.robust != usual.robust {
        let robust = own
            .robust
            .map_or("off".to_owned(), |units| units.to_string());
        add("robust", robust);
    }
    if own.fill != usual.fill {
        add("fill", "off".to_owned());
    }
    if let Some(bytes) = own.memory_limit {
        add("memory-limit", (bytes >> 20).to_string());
    }
    let wished = |effect: &&crate::report::EffectReport| {
        effect.name == Effect::TeacherCorrection && effect.decided_by == Decider::User
    };
    if let Some(effect) = chroma.effects.iter().find(wished) {
        let switch = if effect.on { "on" } else { "off" };
        add("correct-views", switch.to_owned());
    }
}
