//! Views that are not trained on, looked at now and then.

use std::{sync::Arc, time::Instant};

use super::{
    scores::{AlbumPicture, Watch},
    state::LumaTrainer,
};
use crate::{
    gpu::{GpuError, Recorder},
    luma::{LumaError, TrainingView, TrainingViews, curve::CurvePoint, settings::SYNC_EVERY, view},
    measure,
    raster::ViewUniform,
};

/// From look to look iterations grow by this share: what time brings is told by the
/// logarithm of the iteration ([`crate::luma::curve`]).
const STEP: f64 = 0.15;

/// Fewest and most iterations between two looks: fewer cost more than they tell, more
/// would leave whoever waits in the dark.
const OFTEN: usize = 25;
const RARELY: usize = 500;

/// The look after that at `iteration`, always after a report.
fn next_look(iteration: usize) -> usize {
    let step = (STEP * iteration as f64) as usize;
    iteration + (step / SYNC_EVERY * SYNC_EVERY).clamp(OFTEN, RARELY)
}

impl LumaTrainer {
    /// Looks at these views now and then while it trains, but for those of which nothing
    /// counts; their photos are loaded whenever it does. That changes nothing in what is
    /// trained, but takes time.
    ///
    /// # Errors
    /// [`LumaError`] of a photo; [`GpuError::TooLarge`] or [`GpuError::OverLimit`] when a view
    /// is larger than those trained on and the adapter or the memory limit cannot hold it.
    pub fn watch(&mut self, views: impl TrainingViews + 'static) -> Result<(), LumaError> {
        let mut counting = Vec::new();
        for index in 0..views.count() {
            let view = view::load(&views, index)?;
            if (0..view.gray.len()).any(|pixel| view.counts(pixel)) {
                counting.push(index);
            }
        }
        let cameras = || counting.iter().map(|&index| views.camera(index));
        let before = self.demand;
        self.demand = before.watching(cameras());
        if before != self.demand {
            let capacity = self.workspace()?.lists.capacity;
            self.rebuild(capacity, self.base)?;
        }
        self.watch = Watch {
            views: Some(Arc::new(views)),
            counting,
            next: next_look(0),
            ..Watch::default()
        };
        Ok(())
    }

    /// Keeps pictures of the first view that is watched.
    pub fn keep_album(&mut self) {
        self.watch.album = Some(Vec::new());
    }

    /// Pictures kept so far; their views are counted among those that are watched.
    pub fn album(&mut self) -> Vec<AlbumPicture> {
        self.watch.album.take().unwrap_or_default()
    }

    /// Held-out scores so far.
    pub fn curve(&self) -> &[CurvePoint] {
        &self.watch.curve
    }

    /// The iteration at which it gave up what the last looks had shown to be no gain, and
    /// went back to the best before.
    pub fn given_up(&self) -> Option<usize> {
        self.watch.given_up
    }

    /// Seconds that the looks took.
    pub fn watched_seconds(&self) -> f64 {
        self.watch.seconds
    }

    /// Looks, `seconds` of training after its beginning. Nothing may be on its way.
    pub(super) fn look(&mut self, iteration: usize, seconds: f64) -> Result<(), LumaError> {
        let Some(views) = self.watch.views.clone() else {
            return Ok(());
        };
        let begun = Instant::now();
        let mut sum = 0.0;
        for place in 0..self.watch.counting.len() {
            let view = view::load(&*views, self.watch.counting[place])?;
            let pixels = self.drawn(&view, iteration)?;
            let exposed = |luma: f32| view.exposure.shown(f64::from(luma)) as f32;
            if place == 0 && self.watch.album.is_some() {
                let shown: Vec<f32> = pixels.iter().map(|&luma| exposed(luma)).collect();
                let size = [view.camera.width, view.camera.height];
                self.watch.keep(iteration, size, &shown);
            }
            let (shown, truth) = view.compared(&pixels, exposed);
            sum += measure::reported_psnr(&shown, &truth);
        }
        self.watch.curve.push(CurvePoint {
            iteration,
            seconds,
            splats: self.model.len(),
            psnr: sum / self.watch.counting.len() as f64,
        });
        self.watch.next = next_look(iteration);
        self.watch.seconds += begun.elapsed().as_secs_f64();
        Ok(())
    }

    /// Picture of one view, `[height, width]`.
    fn drawn(&mut self, watched: &TrainingView, iteration: usize) -> Result<Vec<f32>, GpuError> {
        loop {
            let degree = self.degree_at(iteration);
            let view = ViewUniform::new(&watched.camera, self.near, self.model.len(), degree);
            let workspace = self.workspace()?;
            let mut recorder = Recorder::new(&self.gpu);
            workspace.lists.set_view(&self.gpu, &view);
            workspace.lists.record(&self.raster, &mut recorder);
            workspace.layer.record(&self.raster, &mut recorder);
            recorder.submit();
            match workspace.lists.status(&self.gpu)?.overflow {
                None => return workspace.layer.read_image(&self.gpu, view.pixel_count()),
                Some(needed) => self.make_room(needed, iteration)?,
            }
        }
    }
}
