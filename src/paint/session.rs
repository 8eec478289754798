//! Somebody paints: strokes come in, a thread of its own recolors the scene.

use std::{
    collections::BTreeSet,
    env,
    path::Path,
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use serde::Serialize;

use super::{
    layer::Stroke,
    log::Act,
    pictures::{Colors, Pictures},
    scene::PaintScene,
    strokes::AllStrokes,
};
use crate::{
    chroma::{
        Repainter, bake_rgb,
        teacher::{GrayImage, Query},
    },
    programs::Program,
    run::RunError,
    splats::{ShField, Splats},
    store::StoreError,
    subject::scene::{Frame, read_scene},
    tell::{Event, Observer},
};

/// State of the colors.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "phase")]
pub enum Phase {
    /// Photos and teachers are read.
    Opening {
        doing: String,
    },
    /// Nothing is waiting.
    Ready,
    /// The last stroke is guessed at.
    Previewed,
    /// The strokes are solved for.
    Solving,
    /// So many seconds after the last stroke.
    Settled {
        seconds: f64,
    },
    /// The command that colors the run goes on.
    Saving {
        doing: String,
    },
    Saved,
    /// The last command went wrong, or nothing goes on any more.
    Failed {
        reason: String,
    },
}

/// Colors that are shown, as changes of a splat file's.
struct Base {
    /// Baked, and the a and b that it was baked from.
    splats: Splats,
    chroma: ShField,
}

/// Where nobody knows the colors.
#[derive(Clone, Debug, Default)]
pub struct Doubt {
    /// a and b that tint the Gaussians.
    pub tint: ShField,
    /// Photos and upright pixels to paint next.
    pub places: Vec<(usize, [f32; 2])>,
}

struct State {
    /// Counts up with every change.
    version: u64,
    /// The version that the colors are of.
    colors: u64,
    phase: Phase,
    strokes: AllStrokes,
    base: Arc<Base>,
    shown: Arc<ShField>,
    /// Photos whose strokes the solver does not know.
    dirty: BTreeSet<usize>,
    stroked: Option<Instant>,
    unsettled: bool,
    save: bool,
    saved: bool,
    /// Doubt is asked for; what was found, and of which colors.
    look: bool,
    doubt: Option<(u64, Arc<Doubt>)>,
    /// The photo drawn last in the colors of a version.
    drawn: Option<(usize, u64, Arc<Vec<u8>>)>,
}

/// A run that is painted on.
pub struct PaintSession {
    pub scene: PaintScene,
    pictures: Pictures,
    state: Mutex<State>,
    changed: Condvar,
    /// Ends a solve for somebody who paints.
    stop: AtomicBool,
}

/// Work that comes next.
enum Step {
    Preview(Vec<usize>),
    Solve,
    Look,
    Save,
}

impl PaintSession {
    /// Opens a run and starts its thread.
    ///
    /// # Errors
    /// [`RunError`].
    pub fn open(
        run: Option<&Path>,
        colmap: Option<&Path>,
        observe: &mut Observer<'_>,
    ) -> Result<Arc<Self>, RunError> {
        let scene = PaintScene::open(run, colmap, observe)?;
        let strokes = AllStrokes::open(&scene);
        let degree = scene.settings().sh_degree;
        let gray = || ShField::zeros(scene.luma.len(), degree, 2);
        let chroma = scene.chroma.clone().unwrap_or_else(gray);
        let color = scene.folder.color();
        let splats = match scene.chroma.is_some() && color.exists() {
            true => read_scene(&color, Frame::Own, observe)?.splats,
            false => bake_rgb(&scene.luma, &chroma),
        };
        let state = State {
            version: 1,
            colors: 1,
            phase: Phase::Opening {
                doing: String::new(),
            },
            dirty: strokes.painted().collect(),
            strokes,
            shown: Arc::new(chroma.clone()),
            base: Arc::new(Base { splats, chroma }),
            stroked: None,
            unsettled: true,
            save: false,
            saved: true,
            look: false,
            doubt: None,
            drawn: None,
        };
        let session = Arc::new(Self {
            scene,
            pictures: Pictures::default(),
            state: Mutex::new(state),
            changed: Condvar::new(),
            stop: AtomicBool::new(false),
        });
        let own = session.clone();
        thread::spawn(move || {
            if let Err(error) = own.work() {
                own.tell(Phase::Failed {
                    reason: error.to_string(),
                });
            }
        });
        Ok(session)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the state and lets everybody know.
    fn change<T>(&self, how: impl FnOnce(&mut State) -> T) -> T {
        let mut state = self.state();
        let done = how(&mut state);
        state.version += 1;
        self.changed.notify_all();
        done
    }

    fn tell(&self, phase: Phase) {
        self.change(|state| state.phase = phase);
    }

    /// Draws a stroke, which is kept before this returns.
    ///
    /// # Errors
    /// [`StoreError`] where it cannot be kept.
    pub fn draw(&self, stroke: &Stroke) -> Result<(), StoreError> {
        self.change(|state| {
            if state.strokes.draw(&self.scene, stroke)? {
                self.wake(state, stroke.photo);
            }
            Ok(())
        })
    }

    /// Undoes or does again.
    ///
    /// # Errors
    /// As [`PaintSession::draw`].
    pub fn turn(&self, act: Act) -> Result<(), StoreError> {
        self.change(|state| {
            if let Some(photo) = state.strokes.turn(&self.scene, act)? {
                self.wake(state, photo);
            }
            Ok(())
        })
    }

    /// Has the strokes on a photo looked at.
    fn wake(&self, state: &mut State, photo: usize) {
        state.dirty.insert(photo);
        state.stroked = Some(Instant::now());
        state.saved = false;
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Has the run colored with the strokes.
    pub fn save(&self) {
        self.change(|state| state.save = true);
    }

    /// Has doubt looked for.
    pub fn look(&self) {
        self.change(|state| state.look = true);
    }

    /// What the page shows, as soon as it is not of `version`, or after some time.
    pub fn told(&self, version: u64, within: Duration) -> serde_json::Value {
        let state = self.state();
        let waited = (self.changed)
            .wait_timeout_while(state, within, |state| state.version == version)
            .unwrap_or_else(PoisonError::into_inner);
        let state = waited.0;
        let [undo, redo] = state.strokes.depth();
        let doubt = state.doubt.as_ref().filter(|(of, _)| *of == state.colors);
        serde_json::json!({
            "version": state.version,
            "colors": state.colors,
            "state": state.phase,
            "undo": undo,
            "redo": redo,
            "painted": state.strokes.painted().collect::<Vec<_>>(),
            "palette": state.strokes.log.palette,
            "saved": state.saved,
            "doubt": doubt.map(|(_, doubt)| &doubt.places),
        })
    }

    /// The layer of a photo as PNG, upright; none where nothing is painted.
    pub fn layer(&self, photo: usize) -> Option<Vec<u8>> {
        self.state()
            .strokes
            .layer(photo)?
            .to_png(Default::default())
            .ok()
    }

    /// A photo in the colors of now.
    ///
    /// # Errors
    /// [`RunError`] of the photo or the device.
    pub fn now(&self, photo: usize) -> Result<Arc<Vec<u8>>, RunError> {
        let (version, shown) = {
            let state = self.state();
            match &state.drawn {
                Some((known, version, png)) if (*known, *version) == (photo, state.colors) => {
                    return Ok(png.clone());
                }
                _ => (state.colors, state.shown.clone()),
            }
        };
        let png = self
            .picture(photo, Colors::Scene(&shown))?
            .unwrap_or_default();
        let png = Arc::new(png);
        self.state().drawn = Some((photo, version, png.clone()));
        Ok(png)
    }

    /// A photo in the colors that the run had before, or since it was saved.
    ///
    /// # Errors
    /// [`RunError`] of the photo or the device.
    pub fn before(&self, photo: usize) -> Result<Option<Vec<u8>>, RunError> {
        let base = self.state().base.clone();
        self.picture(photo, Colors::Scene(&base.chroma))
    }

    /// A photo tinted by doubt; none as long as that is not known.
    ///
    /// # Errors
    /// [`RunError`] of the photo or the device.
    pub fn doubted(&self, photo: usize) -> Result<Option<Vec<u8>>, RunError> {
        let doubt = self.state().doubt.clone();
        match doubt {
            Some((_, doubt)) => self.picture(photo, Colors::Plain(&doubt.tint)),
            None => Ok(None),
        }
    }

    /// A photo in some colors.
    ///
    /// # Errors
    /// [`RunError`] of the photo or the device.
    pub fn picture(&self, photo: usize, colors: Colors<'_>) -> Result<Option<Vec<u8>>, RunError> {
        self.pictures.png(&self.scene, photo, colors)
    }

    /// The scene in the colors of now, or tinted by doubt.
    pub fn splats(&self, doubt: bool) -> Splats {
        let (base, shown, tint) = {
            let state = self.state();
            let tint = state.doubt.as_ref().filter(|_| doubt);
            (
                state.base.clone(),
                state.shown.clone(),
                tint.map(|(_, doubt)| doubt.clone()),
            )
        };
        if let Some(doubt) = tint {
            return bake_rgb(&self.scene.luma, &doubt.tint);
        }
        let mut splats = base.splats.clone();
        if *shown == base.chroma {
            return splats;
        }
        // What baking adds to single Gaussians' colors hardly depends on these.
        let [new, old] =
            [&*shown, &base.chroma].map(|chroma| bake_rgb(&self.scene.luma, chroma).sh);
        let pairs = new.coefficients.iter().zip(&old.coefficients);
        if new.coefficients.len() != splats.sh.coefficients.len() {
            return bake_rgb(&self.scene.luma, &shown);
        }
        for (value, (new, old)) in splats.sh.coefficients.iter_mut().zip(pairs) {
            *value += new - old;
        }
        splats
    }

    /// The thread: opens what takes time, then waits for work.
    fn work(&self) -> Result<(), RunError> {
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
        let doing = "colors".to_owned();
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
            [photo] => self.now(*photo).map(drop),
            _ => Ok(()),
        }
    }

    fn show(&self, shown: ShField, phase: Phase) {
        self.change(|state| {
            state.colors = state.version + 1;
            state.shown = Arc::new(shown);
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
            if state.dirty.is_empty() {
                state.unsettled = false;
            }
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
        let (tint, places) = repainter.doubt(PLACES)?;
        let photos = &self.scene.photos;
        let upright = |(view, [x, y]): (usize, [f32; 2])| {
            let photo = photos
                .iter()
                .position(|photo| photo.views.contains(&view))?;
            let camera = &self.scene.dataset.cameras[view];
            let size = [camera.width, camera.height];
            let [width, height] = photos[photo].upright.size(size);
            let mut marked = vec![false; size[0] as usize * size[1] as usize];
            *marked.get_mut((y as u32 * size[0] + x as u32) as usize)? = true;
            let at = photos[photo].upright.turned(marked, 1, size);
            let at = at.iter().position(|marked| *marked)? as u32;
            let [w, h] = photos[photo].size;
            let place = [(at % width, width, w), (at / width, height, h)];
            Some((
                photo,
                place.map(|(at, of, to)| (at as f32 + 0.5) * to as f32 / of as f32),
            ))
        };
        let places = places.into_iter().filter_map(upright).collect();
        self.change(|state| {
            state.doubt = Some((state.colors, Arc::new(Doubt { tint, places })));
        });
        Ok(())
    }

    /// Runs the command that the page shows; the colors that it found.
    fn color_run(&self) -> Result<ShField, RunError> {
        let program = env::current_exe()
            .map_err(|error| StoreError::file(self.scene.folder.path(), error.to_string()))?;
        self.tell(Phase::Saving {
            doing: String::new(),
        });
        let command = Program::new(program).args(&self.scene.command);
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

/// Pixels of a photo that colors are solved for while somebody paints, at most.
const PIXELS: usize = 80_000;

/// Places that are marked to be painted next.
const PLACES: usize = 3;
