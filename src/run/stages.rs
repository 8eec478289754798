//! The stages that each command goes through, in order. What only some scenes need, such as a
//! trial, is not among them.

use super::{
    ColorizeRequest, EvalOptions, ExportOptions, FitRequest, FramesOptions, MergeOptions,
    PartitionOptions, PathOptions, PlanOptions, RenderOptions,
};
use crate::{
    chroma,
    luma::Goal,
    splats::Format,
    tell::Stage::{self, *},
};

/// A stage that is gone through only where something is asked for.
fn only_if(asked: bool, stage: Stage) -> Option<Stage> {
    asked.then_some(stage)
}

/// Those that are gone through.
fn all<const N: usize>(stages: [Option<Stage>; N]) -> Vec<Stage> {
    stages.into_iter().flatten().collect()
}

impl PlanOptions {
    /// The stages of [`plan`](super::plan).
    pub fn stages(&self) -> Vec<Stage> {
        all([
            only_if(self.preset.is_none(), Device),
            Some(Model),
            Some(Photos),
            Some(Plan),
        ])
    }
}

impl MergeOptions {
    /// The stages of [`merge`](super::merge).
    pub fn stages(&self) -> Vec<Stage> {
        vec![Device, Model, Measuring, Saving]
    }
}

impl PartitionOptions {
    /// The stages of [`partition`](super::partition).
    pub fn stages(&self) -> Vec<Stage> {
        vec![Model, Dividing, Saving]
    }
}

impl FitRequest {
    /// The stages of [`fit`](super::fit).
    pub fn stages(&self) -> Vec<Stage> {
        let limited = match self.goal {
            Goal::Within { .. } => true,
            Goal::Reach { within, .. } => within.is_some(),
            Goal::Fixed => false,
        };
        all([
            Some(Device),
            only_if(limited, Pace),
            Some(Model),
            Some(Photos),
            Some(Plan),
            Some(Placing),
            Some(Training),
            Some(Measuring),
            Some(Saving),
        ])
    }
}

impl ColorizeRequest {
    /// The stages of [`colorize`](super::colorize).
    pub fn stages(&self) -> Vec<Stage> {
        all([
            Some(Device),
            Some(Model),
            Some(Teacher),
            only_if(self.relight, Relight),
            Some(Lists),
            only_if(self.sh_degree == chroma::Degree::Auto, Degree),
            Some(Solving),
            only_if(self.settings.match_saturation, Strength),
            Some(Bake),
            Some(Measuring),
            Some(Saving),
        ])
    }
}

impl EvalOptions {
    /// The stages of [`eval`](super::eval).
    pub fn stages(&self) -> Vec<Stage> {
        let taught = self.teacher.is_some();
        all([
            Some(Model),
            only_if(taught, Teacher),
            Some(Device),
            only_if(self.baselines || !self.recipes.is_empty(), Baseline),
            Some(Measuring),
            Some(Path),
            Some(Views),
            Some(Pairs),
            only_if(taught, Strength),
            Some(Page),
        ])
    }
}

impl FramesOptions {
    /// The stages of [`frames`](super::frames).
    pub fn stages(&self) -> Vec<Stage> {
        vec![Model, Device, Coloring, Saving]
    }
}

impl PathOptions {
    /// The stages of [`render_path`](super::render_path).
    pub fn stages(&self) -> Vec<Stage> {
        vec![Model, Device, Rendering]
    }
}

impl RenderOptions {
    /// The stages of [`render`](super::render).
    pub fn stages(&self) -> Vec<Stage> {
        vec![Model, Device, Rendering]
    }
}

impl ExportOptions {
    /// The stages of [`export`](super::export).
    pub fn stages(&self) -> Vec<Stage> {
        let measured = (Format::of(&self.output)).is_some_and(|format| format.is_read());
        let lossy = measured && Format::of(&self.output) != Some(Format::Ply);
        let fits = self.viewer.is_some();
        let opened = fits || self.clean;
        all([
            Some(Model),
            only_if(opened, Device),
            only_if(self.clean, Cleaning),
            only_if(fits, Viewer),
            Some(Saving),
            only_if(lossy && !opened, Device),
            only_if(lossy, Measuring),
        ])
    }
}
