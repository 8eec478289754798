//! `colorize`: a teacher's colors into a trained scene.

mod commit;
mod open;
mod report;
mod request;
mod solve;
mod words;

use std::{cell::RefCell, ops::ControlFlow, time::Instant};

use open::{Coloring, Supervised};
pub use request::{ColorizeRequest, Output};

use super::RunError;
use crate::{
    chroma::{ChromaSettings, Colored, relight, unseen_share},
    eval::{Measured, exposures},
    report::Report,
    subject::{SceneKind, scene::tell_not_finite},
    tell::{Event, Observer, Stage, keeping},
};

/// A share of Gaussians without a colored photo that is worth a warning.
const UNSEEN: f64 = 0.05;

/// Colors a run or a gray splat file.
///
/// # Errors
/// [`RunError`]; nothing is written before the colors are found.
pub fn colorize(
    request: &ColorizeRequest,
    observe: &mut Observer<'_>,
) -> Result<(Output, Report), RunError> {
    let started = Instant::now();
    let warnings = RefCell::default();
    let observe = &mut keeping(&warnings, observe);
    let mut coloring = Coloring::open(request, observe)?;
    let begun = Instant::now();
    let supervised = coloring.teach(observe)?;
    let seconds = begun.elapsed().as_secs_f64();
    coloring.relight(&supervised.settings, observe)?;
    let solved = coloring.solve(&supervised, started, observe)?;
    let begun = Instant::now();
    let measured = coloring.measure(&supervised, &solved.colored, observe)?;
    observe(Event::begins(Stage::Saving));
    let mut report = coloring.report(&supervised, &solved, &measured);
    if let Some(chroma) = &mut report.chroma {
        chroma.warnings = warnings.take();
        chroma.seconds.teacher = seconds;
        chroma.seconds.measure = begun.elapsed().as_secs_f64();
        chroma.seconds.all = solved.begun.elapsed().as_secs_f64();
    }
    coloring.commit(&solved, &measured.rows, &mut report, observe)?;
    Ok((coloring.output, report))
}

impl Coloring<'_> {
    /// Asks the teachers about all photos.
    fn teach(&mut self, observe: &mut Observer<'_>) -> Result<Supervised, RunError> {
        let asked = &self.request.settings;
        observe(Event::begins(Stage::Teacher));
        let taught = self
            .teachers
            .ask(&self.dataset, asked.target_scales(), observe)?;
        let settings = ChromaSettings {
            iterations: self.iterations,
            seed: self.trained.settings.seed,
            // Hints stay as painted.
            match_saturation: asked.match_saturation && taught.hinted == 0,
            ..asked.clone()
        };
        let split = &self.dataset.split;
        let painted = taught.supervision.painted_held_out(split).len();
        if painted > 0 {
            observe(Event::Note(format!(
                "colors are learned from {painted} held-out {} painted by hand, too; measured {}",
                if painted == 1 { "photo" } else { "photos" },
                match taught.supervision.measured(split) {
                    ("test", views) => format!("on the other {}", views.len()),
                    _ =>
                        "on the photos that they are learned from, for no other is left".to_owned(),
                }
            )));
        }
        if self.trusted {
            tell_not_finite(&self.dataset, observe);
        }
        Ok(Supervised { taught, settings })
    }

    /// Solves for the lightness of other photos, where that is asked for, and shows the scene.
    fn relight(
        &mut self,
        settings: &ChromaSettings,
        observe: &mut Observer<'_>,
    ) -> Result<(), RunError> {
        if self.request.relight {
            observe(Event::begins(Stage::Relight));
            let (raster, dataset, limit) = (&self.raster, &self.dataset, settings.memory_limit);
            self.luma = relight(raster, dataset, &self.luma, limit, &mut |progress| {
                observe(words::of(Stage::Relight, &progress));
                ControlFlow::Continue(())
            })?;
            // These are other photos than those whose exposures the run knows.
            self.trained.exposures.clear();
        }
        if let Some(live) = &self.request.live {
            live.begin(&self.dataset);
            live.draw(self.trained.settings.raster_options());
            self.show(SceneKind::Luma, &self.luma);
        }
        Ok(())
    }

    /// Measures the colors on views that they were not learned from.
    fn measure(
        &self,
        supervised: &Supervised,
        colored: &Colored,
        observe: &mut Observer<'_>,
    ) -> Result<Measured, RunError> {
        let supervision = &supervised.taught.supervision;
        let views = [colored.distilled.colored_views, supervision.views.len()];
        if let Some(warning) = few_colors(self.unseen(colored), views) {
            observe(Event::Warning(warning));
        }
        let measured = Measured::of(
            &self.raster,
            &self.dataset,
            &exposures(&self.dataset, &self.trained.exposures),
            [&self.luma, &colored.splats],
            (
                &colored.distilled.chroma,
                colored.splats_at_a_time.is_some(),
            ),
            supervision,
            &mut |progress| observe(progress.into()),
        );
        Ok(measured?)
    }

    /// Share of the Gaussians that no colored photo shows.
    fn unseen(&self, colored: &Colored) -> Option<f64> {
        // Surroundings are what no photo shows.
        let scene = self.luma.len().saturating_sub(self.trained.surroundings);
        (colored.distilled.seen.as_ref()).map(|seen| unseen_share(&seen[..scene]))
    }
}

/// A warning where some of the views have colors and these do not show all; without any that has
/// none, it is what no photo shows at all.
fn few_colors(unseen: Option<f64>, [colored, views]: [usize; 2]) -> Option<String> {
    let unseen = unseen.filter(|&unseen| unseen >= UNSEEN && colored < views)?;
    Some(format!(
        "{colored} of {views} photos have colors, and {:.0} % of the Gaussians are in none of these: they take the color of what is like them; color photos that show the rest",
        100.0 * unseen
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_colored_photo_shows_is_told() {
        let told = few_colors(Some(0.37), [2, 15]).expect("a warning");
        assert!(
            told.starts_with("2 of 15 photos") && told.contains("37 %"),
            "{told}"
        );
        for (unseen, views) in [
            (Some(0.37), [15, 15]),
            (Some(0.01), [2, 15]),
            (None, [2, 15]),
        ] {
            assert_eq!(few_colors(unseen, views), None);
        }
    }
}
