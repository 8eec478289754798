//! A scene while it is made, for somebody who looks on. Nothing in what is made depends on it:
//! Gaussians are read from the device where a page asks for them, and nobody waits for the page.

use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use super::{SceneKind, SubjectError};
use crate::{
    capture::{Dataset, Photo},
    chroma::{ChromaCheckpoint, ChromaCheckpointing, bake_rgb},
    effects::Plan,
    luma::{Checkpoint, Checkpointing, LumaProgress},
    raster::RasterOptions,
    report::EffectReport,
    splats::{ShField, Splats},
    tell::Event,
};

/// Whoever has not asked for so long does not look any more.
const GONE_AFTER: Duration = Duration::from_secs(6);

/// Gaussians are read no sooner than after so long, and after so many times what reading took:
/// at most a twentieth of the time goes into it.
const EVERY: Duration = Duration::from_secs(2);
const RARELY: u32 = 20;

/// Live state of a running command, for viewers.
#[derive(Debug, Default)]
pub struct Live(Mutex<LiveState>);

/// State that is shown.
#[derive(Clone, Debug, Default)]
pub struct LiveState {
    /// Photos and cameras, once they are there.
    pub dataset: Option<Arc<Dataset>>,
    /// The newest scene of each kind.
    pub scenes: [Option<LiveScene>; 2],
    /// Current activity, in words.
    pub doing: String,
    pub plan: Vec<EffectReport>,
    /// Iterations and losses.
    pub losses: Vec<[f64; 2]>,
    /// Iterations and PSNR of the views that are looked at, in dB.
    pub psnr: Vec<[f64; 2]>,
    drawn: RasterOptions,
    asked: Option<Instant>,
    /// When Gaussians may be read again.
    due: Option<Instant>,
    /// Scenes so far.
    count: u32,
}

/// A scene at some moment.
#[derive(Clone, Debug)]
pub struct LiveScene {
    /// Tells it from those before.
    pub stamp: u32,
    /// The Gaussians.
    pub splats: Arc<Splats>,
    /// Raster options of the scene.
    pub drawn: RasterOptions,
}

impl Live {
    /// Current state; marks a viewer as present.
    pub fn ask(&self) -> LiveState {
        let mut state = self.state();
        state.asked = Some(Instant::now());
        state.clone()
    }

    /// The newest scene of a kind.
    pub fn scene(&self, kind: SceneKind) -> Option<LiveScene> {
        self.state().scenes[kind as usize].clone()
    }

    /// The photo of a view; none as long as there are no photos, or no such view.
    pub fn photo(&self, view: usize) -> Result<Option<Arc<Photo>>, SubjectError> {
        let dataset = self.state().dataset.clone();
        match dataset.filter(|dataset| view < dataset.cameras.len()) {
            Some(dataset) => Ok(Some(dataset.photo(view)?)),
            None => Ok(None),
        }
    }

    /// Takes over what an event says.
    pub fn tell(&self, event: &Event) {
        let Event::Progress {
            stage,
            done,
            total,
            message,
        } = event
        else {
            return;
        };
        let far = match total {
            0 => String::new(),
            total => format!(" {done} of {total}"),
        };
        let more = match message.is_empty() {
            true => String::new(),
            false => format!(", {message}"),
        };
        self.state().doing = format!("{stage}{far}{more}");
    }

    pub(crate) fn begin(&self, dataset: &Arc<Dataset>) {
        self.state().dataset = Some(dataset.clone());
    }

    pub(crate) fn plan(&self, plan: &Plan, drawn: RasterOptions) {
        let mut state = self.state();
        state.plan = EffectReport::of(&plan.decisions);
        state.drawn = drawn;
    }

    pub(crate) fn draw(&self, drawn: RasterOptions) {
        self.state().drawn = drawn;
    }

    pub(crate) fn note(&self, progress: &LumaProgress) {
        let mut state = self.state();
        let iteration = progress.iteration as f64;
        // A training may go back to its best.
        state.losses.retain(|[known, _]| *known < iteration);
        state.losses.push([iteration, progress.loss]);
        if let Some(look) = progress.looked {
            let psnr = look.psnr;
            state.psnr.retain(|[known, _]| *known < iteration);
            if state.psnr.last().is_none_or(|[_, last]| *last != psnr) {
                state.psnr.push([iteration, psnr]);
            }
        }
    }

    /// Returns true if a viewer is waiting for Gaussians.
    pub(crate) fn wants(&self) -> bool {
        let mut state = self.state();
        let now = Instant::now();
        let looked_at = state.asked.is_some_and(|asked| now - asked < GONE_AFTER);
        let wanted = looked_at && state.due.is_none_or(|due| due <= now);
        if wanted {
            // Until what is read now has taken its time.
            state.due = Some(now + EVERY);
        }
        wanted
    }

    /// Shows a scene, that took so long to read.
    pub(crate) fn show(&self, kind: SceneKind, splats: Splats, took: Duration) {
        let mut state = self.state();
        state.count += 1;
        state.due = Some(Instant::now() + EVERY.max(took.saturating_mul(RARELY)));
        state.scenes[kind as usize] = Some(LiveScene {
            stamp: state.count,
            splats: Arc::new(splats),
            drawn: state.drawn,
        });
    }

    fn state(&self) -> MutexGuard<'_, LiveState> {
        // What is in it is whole even where a thread has panicked.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Keeps checkpoints as another does, and shows what is trained.
pub(crate) struct LiveCheckpoints<'a, K: ?Sized> {
    pub checkpointing: &'a mut K,
    pub live: Option<&'a Live>,
    /// The gray scene that is colored; of no use to a training.
    pub luma: Option<&'a Splats>,
}

impl<K: Checkpointing + ?Sized> Checkpointing for LiveCheckpoints<'_, K> {
    fn wants(&mut self, iteration: usize) -> bool {
        self.checkpointing.wants(iteration)
    }

    fn keep(&mut self, checkpoint: Checkpoint) -> bool {
        self.checkpointing.keep(checkpoint)
    }

    fn looks_on(&mut self) -> bool {
        self.live.is_some_and(Live::wants)
    }

    fn show(&mut self, splats: Splats, took: Duration) {
        if let Some(live) = self.live {
            live.show(SceneKind::Luma, splats, took);
        }
    }
}

impl<K: ChromaCheckpointing + ?Sized> ChromaCheckpointing for LiveCheckpoints<'_, K> {
    fn wants(&mut self) -> bool {
        self.checkpointing.wants()
    }

    fn keep(&mut self, checkpoint: ChromaCheckpoint) -> bool {
        self.checkpointing.keep(checkpoint)
    }

    fn end(&mut self) {
        self.checkpointing.end();
    }

    fn looks_on(&mut self) -> bool {
        self.live.is_some_and(Live::wants)
    }

    fn show(&mut self, chroma: &ShField, took: Duration) {
        if let (Some(live), Some(luma)) = (self.live, self.luma) {
            let colored = bake_rgb(luma, chroma);
            live.show(SceneKind::Color, colored, took);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tell::Stage;

    #[test]
    fn nothing_is_read_for_nobody() {
        let live = Live::default();
        assert!(!live.wants());
        live.ask();
        assert!(live.wants());
        // Once, until it has been shown and some time is over.
        assert!(!live.wants());
        live.show(SceneKind::Luma, Splats::default(), Duration::ZERO);
        assert!(!live.wants());
        let shown = live.ask();
        assert_eq!(
            shown.scenes[SceneKind::Luma as usize]
                .as_ref()
                .map(|s| s.stamp),
            Some(1)
        );
        assert!(live.scene(SceneKind::Color).is_none());
    }

    #[test]
    fn what_goes_on_is_told() {
        let live = Live::default();
        live.tell(&Event::begins(Stage::Model));
        assert_eq!(live.ask().doing, "model");
        live.tell(&Event::progress(Stage::Training, 50, 700, "loss 0.1"));
        assert_eq!(live.ask().doing, "training 50 of 700, loss 0.1");
    }
}
