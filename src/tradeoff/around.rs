//! The base, around which knobs are turned, and what work costs beside it.

use crate::{luma::LumaSettings, report::Report, run::Work};

/// Share of an iteration of stage 1 that goes by pixels and not by Gaussians: about half.
pub(super) const PIXELS_SHARE: f64 = 0.5;

/// The base, around which knobs are turned.
#[derive(Clone, Debug)]
pub(super) struct Around {
    /// Iterations of luma.
    pub iterations: usize,
    /// Longer side at which photos are seen, in pixels.
    pub side: u32,
    /// Longer side of the largest photo, in pixels.
    pub largest_side: u32,
    /// The settings of luma.
    pub luma: LumaSettings,
    /// Gaussians that there were at the end.
    pub splats: usize,
    /// Iterations that Adam takes for chroma.
    pub adam: usize,
    /// The names of the other presets, and the work of each over the base's.
    pub presets: Vec<(&'static str, f64)>,
    /// How the base is colored, once it is.
    pub color: Option<ColorAround>,
}

/// How the base is colored.
#[derive(Clone, Debug)]
pub(super) struct ColorAround {
    /// Rounds of least squares.
    pub rounds: usize,
    /// Whether views are brought into line.
    pub corrects_views: bool,
    /// Shorter side at which the network sees photos; `None` for a folder.
    pub teacher_size: Option<u32>,
}

impl Around {
    /// What the base's report says; `adam` as in [`Around::adam`].
    pub fn new(base: &Report, largest_side: u32, adam: usize) -> Self {
        let cap = base.capture.load.max_side.unwrap_or(largest_side);
        Self {
            iterations: base.luma.iterations,
            side: cap.min(largest_side),
            largest_side,
            luma: base.luma.settings.clone(),
            splats: base.luma.splats,
            adam,
            presets: Vec::new(),
            color: None,
        }
    }

    /// What an amount of work is over the base's, which was asked for `base`. Rather too much:
    /// Gaussians may stay below their cap.
    pub fn work(&self, work: &Work, base: &Work) -> f64 {
        let (settings, base) = (&work.settings, &base.settings);
        let ratio = |amount: f64, base: usize| amount / base.max(1) as f64;
        let iterations = match settings.stop_when_flat.and(base.stop_when_flat) {
            // Both end where the curve is flat, which may be long before.
            Some(_) => base.iterations,
            None => self.iterations,
        };
        let side = work.max_side.unwrap_or(self.largest_side);
        let side = ratio(side.min(self.largest_side).into(), self.side as usize);
        // Where its own cap left room to the base, so will another.
        let splats = match self.reaches_cap() {
            true => settings.max_splats,
            false => settings.max_splats.min(self.splats),
        };
        let splats = ratio(splats as f64, self.splats);
        let each = PIXELS_SHARE * side.powi(2) + (1.0 - PIXELS_SHARE) * splats;
        ratio(settings.iterations as f64, iterations) * each
    }

    /// Whether its cap kept the base from having more Gaussians.
    pub fn reaches_cap(&self) -> bool {
        self.splats as f64 > 0.9 * self.luma.max_splats as f64
    }

    /// With what the colored base's report says.
    pub fn colored(mut self, base: &Report) -> Self {
        self.color = base.chroma.as_ref().map(|chroma| ColorAround {
            // The base is colored by the default solver.
            rounds: chroma.iterations,
            corrects_views: chroma.settings.correct_views,
            teacher_size: (chroma.teachers.first())
                .and_then(|teacher| teacher.info.input_size)
                .map(|[width, height]| width.min(height)),
        });
        self
    }

    /// The same of the colors; of nothing to try where there are none.
    pub fn of_color(&self, values: impl Fn(&ColorAround) -> Vec<String>) -> Vec<String> {
        self.color.as_ref().map_or(Vec::new(), values)
    }
}
