//! The paper's distillation: Adam on per-Gaussian a/b against the teacher,
//! coarse to fine (ChromaDistill, WACV 2025, algorithm 1).

use std::{sync::Arc, time::Instant};

use super::{
    ChromaSettings, ChromaView, irls,
    loss::{self, ChromaLossWeights, Correction},
    pass::{Pass, Shared},
};
use crate::{
    capture::view_at,
    gpu::{Buffer, Gpu, GpuError, Recorder},
    raster::{
        Adam, AdamKernel, Field, Geometry, Load, LossLog, Raster, SumLossKernel, constants::*,
    },
    splats::{ShField, Splats, sh},
};

/// Iterations between two reports.
const REPORT_EVERY: usize = 50;

/// How far a distillation is.
#[derive(Clone, Copy, Debug)]
pub struct ChromaProgress {
    /// Iterations of Adam, or rounds of reweighting, done.
    pub iteration: usize,
    /// Mean loss of the finest scale in use, in CIELAB units: since the last report, or
    /// at the start of the round.
    pub loss: f64,
    /// Drawings of a view with their adjoints, those of coarser scales by their share of
    /// the pixels.
    pub passes: f64,
    /// Seconds since the distillation began.
    pub seconds: f64,
}

/// Distils a teacher into chroma harmonics.
pub struct Distiller {
    raster: Arc<Raster>,
    gpu: Gpu,
    settings: ChromaSettings,
    views: Vec<ChromaView>,
    shared: Shared,
    adam: Adam,
    adam_kernel: AdamKernel,
    sum_loss: SumLossKernel,
    /// Each view's passes, coarse to fine, while memory allows.
    chains: Vec<Option<Vec<Pass>>>,
    /// Iterations done.
    done: usize,
}

impl Distiller {
    /// A distiller for frozen `splats`, starting from gray.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    ///
    /// # Panics
    /// Without views, or when a wanted image has not its camera's size.
    pub fn new(
        raster: Arc<Raster>,
        settings: ChromaSettings,
        extent: f64,
        splats: &Splats,
        views: Vec<ChromaView>,
    ) -> Result<Self, GpuError> {
        assert!(!views.is_empty(), "distillation needs a view");
        let gpu = raster.gpu.clone();
        let geometry = Geometry::upload(&gpu, splats)?;
        let zeros = ShField::zeros(splats.len(), settings.sh_degree, 2);
        let field = Field::upload(&gpu, &zeros)?;
        let gradient = Buffer::zeros(&gpu, "chroma gradient", field.planes.len())?;
        // Frozen lists never overflow: this status stays zero.
        let status = Buffer::zeros(&gpu, "status", STATUS_WORDS)?;
        let sum_loss = SumLossKernel::new(&gpu);
        let max_pixels = views
            .iter()
            .map(|view| {
                let (width, height) = (view.camera.width, view.camera.height);
                assert_eq!([view.wanted.width, view.wanted.height], [width, height]);
                (width * height) as usize
            })
            .max()
            .unwrap_or(0);
        let log = LossLog::new(
            &gpu,
            &sum_loss,
            &status,
            max_pixels.div_ceil(256),
            REPORT_EVERY,
        )?;
        let adam_kernel = AdamKernel::new(&gpu);
        let adam = Adam::new(
            &gpu,
            &adam_kernel,
            &status,
            &gradient,
            &field.planes,
            geometry.count,
        )?;
        let chains = views.iter().map(|_| None).collect();
        Ok(Self {
            shared: Shared {
                geometry,
                field,
                gradient,
                log,
                loss: loss::kernel(&gpu),
                corrections: Buffer::from_slice(&gpu, "corrections", &[Correction::NONE])?,
                near: NEAR_SHARE * extent,
            },
            raster,
            gpu,
            settings,
            views,
            adam,
            adam_kernel,
            sum_loss,
            chains,
            done: 0,
        })
    }

    /// Distils to the last iteration, telling `observe` now and then.
    ///
    /// # Errors
    /// [`GpuError`] when the device runs out of room or is lost.
    pub fn run(&mut self, observe: &mut dyn FnMut(ChromaProgress)) -> Result<(), GpuError> {
        self.run_to(self.settings.iterations, observe)
    }

    /// Goes on until so many iterations are done, and leaves the rest for later.
    ///
    /// # Errors
    /// [`GpuError`] when the device runs out of room or is lost.
    pub fn run_to(
        &mut self,
        until: usize,
        observe: &mut dyn FnMut(ChromaProgress),
    ) -> Result<(), GpuError> {
        let begun = Instant::now();
        let mut pending = None;
        let until = until.min(self.settings.iterations);
        for iteration in self.done..until {
            self.step(iteration)?;
            let done = iteration + 1;
            self.done = done;
            let ends = done == until;
            if !(ends || done.is_multiple_of(REPORT_EVERY)) {
                continue;
            }
            let due = pending.replace((done, self.shared.log.read_later(&self.gpu)));
            let last = if ends { pending.take() } else { None };
            for (done, losses) in due.into_iter().chain(last) {
                let losses = losses.wait(&self.gpu)?;
                let recent = &losses[..done - (done - 1) / REPORT_EVERY * REPORT_EVERY];
                observe(ChromaProgress {
                    iteration: done,
                    loss: recent.iter().map(|&loss| f64::from(loss)).sum::<f64>()
                        / recent.len() as f64,
                    passes: done as f64
                        * (0..=self.settings.coarser_scales as usize)
                            .map(irls::share)
                            .sum::<f64>(),
                    seconds: begun.elapsed().as_secs_f64(),
                });
            }
        }
        Ok(())
    }

    /// Reads the chroma distilled so far.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn chroma(&self) -> Result<ShField, GpuError> {
        self.shared.field.download(&self.gpu)
    }

    /// What a dispatch worked on, the mean over the passes that are kept.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn load(&self) -> Result<Load, GpuError> {
        let passes: Vec<&Pass> = self.chains.iter().flatten().flatten().collect();
        let mut load = Load::default();
        for pass in &passes {
            let of_pass = pass.load(&self.gpu)?;
            load.visible += of_pass.visible / passes.len() as f64;
            load.instances += of_pass.instances / passes.len() as f64;
            load.pixels += of_pass.pixels / passes.len() as f64;
            load.tiles += of_pass.tiles / passes.len() as f64;
        }
        Ok(Load {
            splats: self.shared.geometry.count as f64,
            capacity: load.instances,
            channels: 2.0,
            sh_planes: 2.0 * sh::coefficient_count(self.settings.sh_degree) as f64,
            ..load
        })
    }

    /// One view through all scales, one step of Adam a scale.
    fn step(&mut self, iteration: usize) -> Result<(), GpuError> {
        let index = view_at(self.settings.seed, self.views.len(), iteration);
        let mut chain = match self.chains[index].take() {
            Some(chain) => chain,
            None => self.chain(&self.views[index])?,
        };
        let rate = self.settings.rate(iteration);
        let mut rates = vec![
            (rate * self.settings.rest_share) as f32;
            2 * sh::coefficient_count(self.settings.sh_degree)
        ];
        rates[..2].fill(rate as f32);
        let scales = chain.len();
        for (s, pass) in chain.iter_mut().enumerate() {
            let mut recorder = Recorder::new(&self.gpu);
            pass.record(&self.raster, &self.shared, &mut recorder);
            if s + 1 == scales {
                self.shared.log.record(
                    &self.gpu,
                    &self.sum_loss,
                    &mut recorder,
                    pass.blocks(),
                    pass.view.pixel_count(),
                    iteration,
                );
            }
            let step = u32::try_from(iteration * scales + s + 1).unwrap_or(u32::MAX);
            self.adam
                .record(&self.gpu, &self.adam_kernel, &mut recorder, step, &rates);
            recorder.submit();
        }
        self.keep(index, chain);
        Ok(())
    }

    /// Puts a chain back into the cache if it fits.
    fn keep(&mut self, index: usize, chain: Vec<Pass>) {
        let bytes = |chain: &[Pass]| chain.iter().map(Pass::bytes).sum::<usize>();
        let others: usize = self.chains.iter().flatten().map(|chain| bytes(chain)).sum();
        if others + bytes(&chain) <= self.settings.cache_bytes {
            self.chains[index] = Some(chain);
        }
    }

    fn chain(&self, view: &ChromaView) -> Result<Vec<Pass>, GpuError> {
        let mut chain: Vec<Pass> = Vec::new();
        for scale in (0..=self.settings.coarser_scales).rev() {
            let pass = Pass::new(
                &self.raster,
                &self.shared,
                &view.at_scale(scale),
                chain.last(),
                ChromaLossWeights {
                    agreement: self.settings.agreement,
                    ..ChromaLossWeights::robust(self.settings.robust)
                },
            )?;
            chain.push(pass);
        }
        Ok(chain)
    }
}
