//! The thread that recolors the scene.

use std::{
    path::Path,
    sync::{
        Arc, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use super::session::{Base, Doubt, PaintSession, Phase};
use crate::{
    chroma::{
        Repainter,
        teacher::{GrayImage, Query},
    },
    invocation::Invocation,
    programs::Program,
    run::RunError,
    splats::ShField,
    store::StoreError,
    subject::scene::{Frame, read_scene},
    tell::Event,
};

/// Pixels of a photo that colors are solved for while somebody paints, at most.
const PIXELS: usize = 80_000;

/// Places that are marked to be painted next.
const NEXT: usize = 3;

/// Work that comes next.
enum Step {
    Preview(Vec<usize>),
    Solve,
    Look,
    Save,
}

impl PaintSession {
    /// The thread: opens what takes time, then waits for work.
    pub(super) fn work(&self) -> Result<(), RunError> {
        let scene = &self.scene;
        let tell = &mut |event: Event| {
            if let Event::Progress {
                stage, done, total, ..
            } = event
            {
                let doing = format!("{stage} {done} of {total}");
                self.tell(Phase::Opening { doing });
            }
        };
        let answers = scene.teachers(|teachers| teachers.ask(&scene.dataset, 1, tell))?;
        let settings = scene.settings();
        let start = scene.unpainted();
        let unknown = start.is_none();
        let supervision = &answers.supervision;
        let (raster, dataset, luma) = (&scene.raster, &scene.dataset, &scene.luma);
        let mut repainter = Repainter::new(
            raster,
            dataset,
            luma,
            supervision,
            (&settings, PIXELS),
            start,
        )?;
        let doing = match unknown {
            true => "colors".to_owned(),
            // A stroke ends the solve.
            false => "colors; you can paint already".to_owned(),
        };
        self.tell(Phase::Opening { doing });
        if unknown {
            repainter.solve(&AtomicBool::new(false), &mut |_| {})?;
        }
        loop {
            match self.next() {
                Step::Preview(photos) => self.preview(&mut repainter, &photos)?,
                Step::Solve => self.solve(&mut repainter)?,
                Step::Look => self.find_doubt(&repainter)?,
                Step::Save => match self.color_run() {
                    Ok(chroma) => repainter.rebase(chroma),
                    Err(error) => self.tell(Phase::Failed {
                        reason: error.to_string(),
                    }),
                },
            }
        }
    }

    /// Waits for work.
    fn next(&self) -> Step {
        let mut state = self.state();
        loop {
            if !state.dirty.is_empty() {
                state.unsettled = true;
                return Step::Preview(std::mem::take(&mut state.dirty).into_iter().collect());
            }
            if state.unsettled {
                self.stop.store(false, Ordering::Relaxed);
                return Step::Solve;
            }
            if std::mem::take(&mut state.save) {
                return Step::Save;
            }
            if std::mem::take(&mut state.look) {
                return Step::Look;
            }
            state = self
                .changed
                .wait(state)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Shows what the strokes on some photos may come to.
    fn preview(&self, repainter: &mut Repainter<'_>, photos: &[usize]) -> Result<(), RunError> {
        let dataset = &self.scene.dataset;
        for &photo in photos {
            for view in self.scene.photos[photo].views.clone() {
                let gray = dataset.photo(view)?;
                let gray = GrayImage {
                    width: gray.width,
                    height: gray.height,
                    pixels: &gray.gray,
                };
                let query = Query::view(&dataset.capture.views[view], &dataset.cameras[view]);
                let paint = self.scene.hint(query, gray)?;
                repainter.paint(view, &paint)?;
            }
        }
        self.show(repainter.shown().clone(), Phase::Previewed);
        // Before the solver takes the device.
        match photos {
            [photo] => self.drawn(*photo, true).map(drop),
            _ => Ok(()),
        }
    }

    fn show(&self, shown: ShField, phase: Phase) {
        self.change(|state| {
            state.colors = state.version + 1;
            let painted = state.strokes.painted().next().is_some();
            state.shown = Arc::new(self.scene.finished(shown, painted));
            state.phase = phase;
        });
    }

    /// Solves for the strokes, until somebody paints.
    fn solve(&self, repainter: &mut Repainter<'_>) -> Result<(), RunError> {
        // Colors stay the run's until there are strokes.
        let stroked = {
            let state = self.state();
            let any = state.strokes.painted().next().is_some();
            any.then_some(state.stroked).or(state.stroked.map(Some))
        };
        if stroked.is_some() {
            self.tell(Phase::Solving);
        }
        let done = repainter.solve(&self.stop, &mut |shown| {
            if stroked.is_some() {
                self.show(shown.clone(), Phase::Solving);
            }
        })?;
        if done.is_none() {
            return Ok(());
        }
        self.change(|state| {
            // A stroke that came meanwhile waits.
            if !state.dirty.is_empty() {
                return;
            }
            state.unsettled = false;
            state.phase = match stroked.flatten() {
                Some(stroked) => Phase::Settled {
                    seconds: stroked.elapsed().as_secs_f64(),
                },
                None => Phase::Ready,
            };
        });
        Ok(())
    }

    fn find_doubt(&self, repainter: &Repainter<'_>) -> Result<(), RunError> {
        let (tint, views) = repainter.doubt(NEXT)?;
        let marks = views.into_iter();
        let next = marks.filter_map(|(view, place)| self.scene.mark(view, place));
        let next = next.collect();
        self.change(|state| {
            state.doubt = Some((state.colors, Arc::new(Doubt { tint, next })));
        });
        Ok(())
    }

    /// Runs the command that the page shows; the colors that it found.
    fn color_run(&self) -> Result<ShField, RunError> {
        // In Python's process the program is started by Python.
        let [program, before @ ..] = &*Invocation::present().command else {
            let reason = "the program's own file is not known";
            return Err(StoreError::file(self.scene.folder.path(), reason).into());
        };
        self.tell(Phase::Saving {
            doing: String::new(),
        });
        let words = self.state().command(&self.scene);
        let command = Program::new(program).args(before).args(words);
        command.run(Path::new("."), &mut |line| {
            let doing = line.to_owned();
            self.tell(Phase::Saving { doing });
        })?;
        let (folder, count) = (&self.scene.folder, self.scene.luma.len());
        let chroma = folder.read_chroma(count)?;
        let chroma = chroma.ok_or_else(|| StoreError::file(&folder.chroma(), "is missing"))?;
        let splats = read_scene(&folder.color(), Frame::Own, &mut |_| {})?.splats;
        let base = Arc::new(Base {
            splats,
            chroma: chroma.clone(),
        });
        self.change(|state| {
            state.colors = state.version + 1;
            state.base = base;
            state.shown = Arc::new(chroma.clone());
            state.saved = state.dirty.is_empty();
            state.phase = Phase::Saved;
        });
        Ok(chroma)
    }
}
