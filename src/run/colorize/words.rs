//! Events of a coloring in words.

use super::open::Coloring;
use crate::{
    chroma::{ChosenDegree, ChromaProgress, ColorizeEvent},
    effects::table,
    store::checkpoints::Journal,
    tell::{Event, Stage},
};

/// Progress of a solver, with its loss.
pub(super) fn of(stage: Stage, progress: &ChromaProgress) -> Event {
    let (done, total) = (progress.iteration, progress.total);
    let moved = match (stage, progress.moved) {
        (Stage::Solving, Some(moved)) => format!(", moved {moved:.2}"),
        _ => String::new(),
    };
    Event::progress(
        stage,
        done,
        total,
        format!("loss {:.3}{moved}", progress.loss),
    )
}

impl Coloring<'_> {
    /// Tells an event, and notes the losses; solving begins after so many rounds of all.
    pub(super) fn tell(
        &self,
        event: ColorizeEvent<'_>,
        [rounds, total]: [usize; 2],
        journal: &Journal<'_>,
    ) {
        journal.tell(match event {
            // It has been asked already.
            ColorizeEvent::Asked { .. } => return,
            ColorizeEvent::Listing => Event::begins(Stage::Lists),
            ColorizeEvent::Streaming { at_a_time } => Event::Note(format!(
                "{} Gaussians have no room on the device: at most {at_a_time} that a photo may show come at a time",
                self.luma.len()
            )),
            ColorizeEvent::Chosen(chosen) => Event::Note(describe(chosen)),
            ColorizeEvent::Plan(effects) => {
                journal.tell(Event::Note(table(effects)));
                Event::progress(Stage::Solving, rounds, total, "")
            }
            ColorizeEvent::Uncorrected { without, with } => Event::Note(format!(
                "view correction is off: the teacher's views agree no better with it (they differ by {:.1} % of its colors' mean square, {:.1} % without)",
                100.0 * with,
                100.0 * without
            )),
            ColorizeEvent::Solving(progress) => {
                journal.row(format_args!(
                    "{},{:.6},{},{:.3},",
                    self.trained.iterations + progress.iteration,
                    progress.loss,
                    self.luma.len(),
                    progress.seconds
                ));
                of(Stage::Solving, &progress)
            }
            ColorizeEvent::Trying { degree, progress } => {
                let message = format!("SH degree {degree}, loss {:.3}", progress.loss);
                Event::progress(Stage::Degree, progress.iteration, progress.total, message)
            }
            ColorizeEvent::Matching { view, total } => {
                Event::progress(Stage::Strength, view, total, "")
            }
            ColorizeEvent::Drawing { view, total } => {
                let message = format!("drawing view {} of {total}", view + 1);
                Event::progress(Stage::Bake, 0, 0, message)
            }
            ColorizeEvent::Baking(progress) => of(Stage::Bake, &progress),
        });
    }
}

/// Held-out loss of each SH degree, in words.
fn describe(chosen: &ChosenDegree) -> String {
    let losses: Vec<String> = (0..)
        .zip(&chosen.losses)
        .map(|(degree, loss)| format!("{degree}: {loss:.3}"))
        .collect();
    format!(
        "chose SH degree {} for chroma; held-out loss by degree: {}",
        chosen.degree,
        losses.join(", ")
    )
}
