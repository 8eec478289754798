//! Somebody paints: strokes come in, a thread of its own recolors the scene.

use std::{
    collections::BTreeSet,
    path::Path,
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use serde::{Deserialize, Serialize};

use super::{
    command::Choices,
    free_view::ViewStroke,
    layer::{Paint, Way},
    log::Act,
    pictures::{Colors, Pictures},
    scene::PaintScene,
    strokes::{AllStrokes, Dab, Ink},
};
use crate::{
    chroma::{at_middle_lightness, bake_rgb, shaded_at},
    color::{lab_to_srgb, srgb_to_lab},
    run::RunError,
    splats::{ShField, Splats},
    store::StoreError,
    subject::scene::{Frame, read_scene},
    tell::Observer,
    tradeoff::shell_line,
};

/// A stroke on a photo, in pixels of its upright layer.
#[derive(Clone, Debug, Deserialize)]
pub struct Stroke {
    /// Index of the photo.
    pub photo: usize,
    pub paint: Paint,
    pub points: Way,
}

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
pub(super) struct Base {
    /// Baked, and the a and b that it was baked from.
    pub splats: Splats,
    pub chroma: ShField,
}

/// Where nobody knows the colors.
#[derive(Clone, Debug, Default)]
pub struct Doubt {
    /// a and b that tint the Gaussians.
    pub tint: ShField,
    /// Places to paint next, in shares of the photo's sides, and their photos.
    pub next: Vec<([f32; 2], usize)>,
}

pub(super) struct State {
    /// Counts up with every change.
    pub version: u64,
    /// The version that the colors are of.
    pub colors: u64,
    pub phase: Phase,
    pub strokes: AllStrokes,
    pub choices: Choices,
    pub base: Arc<Base>,
    pub shown: Arc<ShField>,
    /// Photos whose strokes the solver does not know.
    pub dirty: BTreeSet<usize>,
    pub stroked: Option<Instant>,
    pub unsettled: bool,
    pub save: bool,
    pub saved: bool,
    /// Doubt is asked for; what was found, and of which colors.
    pub look: bool,
    pub doubt: Option<(u64, Arc<Doubt>)>,
    /// The photo drawn last in the colors of a version.
    pub drawn: Option<(usize, u64, Arc<Vec<u8>>)>,
}

impl State {
    /// Words of the command that colors the run with what is painted now.
    pub fn command(&self, scene: &PaintScene) -> Vec<String> {
        scene.command(&self.choices, self.strokes.painted().next().is_some())
    }
}

/// A run that is painted on.
pub struct PaintSession {
    pub scene: PaintScene,
    pictures: Pictures,
    state: Mutex<State>,
    pub(super) changed: Condvar,
    /// Ends a solve for somebody who paints.
    pub(super) stop: AtomicBool,
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
        let chroma_report = scene.report.chroma.as_ref();
        let hinted = chroma_report.is_some_and(|chroma| chroma.hints > 0);
        let state = State {
            version: 1,
            colors: 1,
            phase: Phase::Opening {
                doing: String::new(),
            },
            dirty: strokes.painted().collect(),
            shown: Arc::new(chroma.clone()),
            base: Arc::new(Base { splats, chroma }),
            stroked: None,
            unsettled: true,
            save: false,
            // Nobody knows whether these strokes are in the run's colors.
            saved: !hinted && strokes.painted().next().is_none(),
            strokes,
            choices: Choices::of(&scene.report),
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

    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the state and lets everybody know.
    pub(super) fn change<T>(&self, how: impl FnOnce(&mut State) -> T) -> T {
        let mut state = self.state();
        let done = how(&mut state);
        state.version += 1;
        self.changed.notify_all();
        done
    }

    pub(super) fn tell(&self, phase: Phase) {
        self.change(|state| state.phase = phase);
    }

    /// Draws a stroke, which is kept before this returns.
    ///
    /// # Errors
    /// [`RunError`] where it cannot be kept, or no teacher has colors for it.
    pub fn draw(&self, stroke: &Stroke) -> Result<(), RunError> {
        let Stroke {
            photo,
            paint,
            points,
        } = stroke;
        let Some(mask) = points.mask(self.scene.photos[*photo].size) else {
            return Ok(());
        };
        let ink = self.ink(*photo, *paint)?;
        let photo = *photo;
        self.lay(*paint, &[Dab { photo, mask, ink }])
    }

    /// Draws a stroke on the scene as strokes on photos that show it; the number of these.
    ///
    /// # Errors
    /// As [`PaintSession::draw`].
    pub fn draw_in_view(&self, stroke: &ViewStroke) -> Result<usize, RunError> {
        let painted: BTreeSet<usize> = self.state().strokes.painted().collect();
        // What is not painted cannot be erased.
        let erases = stroke.paint == Paint::Nothing;
        let found = stroke.on_photos(&self.scene, &|photo| !erases || painted.contains(&photo))?;
        let mut dabs = Vec::new();
        for (photo, mask, lightness) in found {
            let ink = match stroke.paint {
                Paint::Color(color) => Ink::Color(in_light(color, lightness)),
                paint => self.ink(photo, paint)?,
            };
            dabs.push(Dab { photo, mask, ink });
        }
        if !dabs.is_empty() {
            self.lay(stroke.paint, &dabs)?;
        }
        Ok(dabs.len())
    }

    fn ink(&self, photo: usize, paint: Paint) -> Result<Ink, RunError> {
        Ok(match paint {
            Paint::Color(color) => Ink::Color(color),
            Paint::Nothing => Ink::Nothing,
            Paint::Teacher => {
                let name = &self.scene.photos[photo].name;
                let failed = |reason: &str| StoreError::file(&self.scene.folder.hint(name), reason);
                let png = self.picture(photo, Colors::Taught)?;
                let png = png.ok_or_else(|| failed("no teacher has colors for this photo"))?;
                let picture = image::load_from_memory(&png);
                Ink::Picture(
                    picture
                        .map_err(|error| failed(&error.to_string()))?
                        .into_rgb8(),
                )
            }
        })
    }

    fn lay(&self, paint: Paint, dabs: &[Dab]) -> Result<(), RunError> {
        self.change(|state| {
            state.strokes.draw(&self.scene, paint, dabs)?;
            self.wake(state, dabs.iter().map(|dab| dab.photo));
            Ok(())
        })
    }

    /// Undoes or does again.
    ///
    /// # Errors
    /// As [`PaintSession::draw`].
    pub fn turn(&self, act: Act) -> Result<(), RunError> {
        self.change(|state| {
            let photos = state.strokes.turn(&self.scene, act)?;
            if !photos.is_empty() {
                self.wake(state, photos.into_iter());
            }
            Ok(())
        })
    }

    /// Has the strokes on some photos looked at.
    fn wake(&self, state: &mut State, photos: impl Iterator<Item = usize>) {
        state.dirty.extend(photos);
        state.phase = Phase::Solving;
        state.stroked = Some(Instant::now());
        state.saved = false;
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Takes options of the command that colors the run.
    pub fn choose(&self, choices: Choices) {
        self.change(|state| {
            state.saved &= state.choices == choices;
            state.choices = choices;
        });
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
            "choices": state.choices,
            "command": shell_line(&state.command(&self.scene)),
            "doubt": doubt.map(|(_, doubt)| &doubt.next),
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
        self.drawn(photo, false)
    }

    pub(super) fn drawn(&self, photo: usize, quickly: bool) -> Result<Arc<Vec<u8>>, RunError> {
        let (version, shown) = {
            let state = self.state();
            match &state.drawn {
                Some((known, version, png)) if (*known, *version) == (photo, state.colors) => {
                    return Ok(png.clone());
                }
                _ => (state.colors, state.shown.clone()),
            }
        };
        let colors = match quickly {
            true => Colors::Guess(&shown),
            false => Colors::Scene(&shown),
        };
        let png = self.picture(photo, colors)?.unwrap_or_default();
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
}

/// A color of paint on what is as light as this.
fn in_light(color: [u8; 3], lightness: f32) -> [u8; 3] {
    let [own, a, b] = srgb_to_lab(color.map(|value| f64::from(value) / 255.0));
    let middle = at_middle_lightness([a as f32, b as f32], own as f32);
    let [a, b] = shaded_at(middle, lightness).map(f64::from);
    let rgb = lab_to_srgb([f64::from(lightness), a, b]);
    rgb.map(|value| (255.0 * value).round().clamp(0.0, 255.0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paint_is_darker_where_less_light_falls() {
        let [red, dark] = [[200, 60, 50], in_light([200, 60, 50], 20.0)];
        let [a, b] = [red, dark].map(|rgb| srgb_to_lab(rgb.map(|v| f64::from(v) / 255.0)));
        assert!((b[0] - 20.0).abs() < 1.0, "{b:?}");
        let [hue, darker] = [a, b].map(|[_, a, b]| b.atan2(a));
        assert!((hue - darker).abs() < 0.05, "{a:?} {b:?}");
        assert_eq!(in_light(red, a[0] as f32), red);
    }
}
