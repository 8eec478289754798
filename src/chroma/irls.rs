//! The fast solver: with the geometry frozen, a/b at each pixel are linear in the
//! unknowns, so the distillation is a robust linear regression. Iteratively reweighted
//! least squares, whose steps L-BFGS makes longer, over all views and all of it on the
//! device.

use std::{rc::Rc, sync::Arc, time::Instant};

use super::{
    ChromaProgress, ChromaSettings, ChromaView,
    lbfgs::Lbfgs,
    loss::LOSS_BLOCK,
    pass::exact_capacity,
    rows::{Room, Rows, Shared},
};
use crate::{
    gpu::{Buffer, Gpu, GpuError, Readback, Recorder},
    raster::{
        Field, Geometry, Lists, Load, LossLog, Raster, SumLossKernel, ViewUniform, constants::*,
    },
    splats::{ShField, Splats, sh},
};

/// Bytes of the tile lists for each Gaussian and each entry ([`Lists`] and the scratch
/// of its sorts).
const LIST_BYTES: [usize; 2] = [64, 20];

/// Residual, in CIELAB units, of a pixel that counts as one.
const TYPICAL_RESIDUAL: f64 = 3.0;

/// One reweighting.
#[derive(Clone, Debug, PartialEq)]
struct Round {
    /// Scales whose pictures count, coarse to fine.
    scales: Vec<usize>,
    /// Weight of the agreement between scales.
    agreement: f32,
    /// Residual at which the loss of a and b together levels off; without one, each has
    /// its own.
    robust: Option<f32>,
    /// Whether the views' corrections are found anew after it.
    corrects: bool,
}

/// The rounds that the settings ask for: on each coarser scale alone, to bring the
/// views' corrections and the colours close at little cost, then on all scales that
/// count.
fn rounds(settings: &ChromaSettings) -> Vec<Round> {
    let round = |scales: Vec<usize>, agreement, settled: bool| Round {
        scales,
        agreement,
        // It never levels off at first: what is far off now may be right once the rest is
        // in place.
        robust: (settings.robust).map(|residual| if settled { residual } else { f32::INFINITY }),
        corrects: settings.corrects_views,
    };
    let coarsest = settings.warm_scales as usize;
    let warm = (1..=coarsest).rev().flat_map(|scale| {
        let settled = move |index| scale < coarsest || index >= PLAIN_ROUNDS;
        (0..settings.warm_rounds).map(move |index| round(vec![scale], 0.0, settled(index)))
    });
    let scales: Vec<usize> = (0..=settings.coarser_scales as usize).rev().collect();
    let full = (0..settings.rounds).map(|index| {
        let settled = coarsest > 0 || index >= PLAIN_ROUNDS;
        round(scales.clone(), settings.agreement, settled)
    });
    warm.chain(full).collect()
}

/// Rounds before the loss levels off.
const PLAIN_ROUNDS: usize = 4;

/// Solves for chroma harmonics.
pub struct Solver {
    raster: Arc<Raster>,
    gpu: Gpu,
    shared: Shared,
    lbfgs: Lbfgs,
    sum_loss: SumLossKernel,
    rounds: Vec<Round>,
    /// `[views][scales]`, full size first.
    rows: Vec<Vec<Rows>>,
    /// Of the largest view.
    pixels: usize,
    passes: f64,
    /// Rounds done.
    done: usize,
}

impl Solver {
    /// A solver for frozen `splats`, starting from gray.
    ///
    /// # Errors
    /// [`GpuError`] when it does not fit or the device is lost.
    ///
    /// # Panics
    /// Without views, or when a wanted image has not its camera's size.
    pub fn new(
        raster: Arc<Raster>,
        settings: &ChromaSettings,
        extent: f64,
        splats: &Splats,
        views: &[ChromaView],
    ) -> Result<Self, GpuError> {
        assert!(!views.is_empty(), "a solver needs a view");
        let gpu = raster.gpu.clone();
        let near = NEAR_SHARE * extent;
        let geometry = Geometry::upload(&gpu, splats)?;
        let zeros = ShField::zeros(splats.len(), settings.sh_degree, 2);
        let field = Field::upload(&gpu, &zeros)?;
        let rounds = rounds(settings);
        let scales = (rounds.iter().flat_map(|round| &round.scales))
            .max()
            .map_or(1, |scale| scale + 1);
        let chains: Vec<Vec<ChromaView>> = (views.iter())
            .map(|view| {
                let (camera, wanted) = (&view.camera, &view.wanted);
                assert_eq!([wanted.width, wanted.height], [camera.width, camera.height]);
                (0..scales)
                    .map(|scale| view.at_scale(scale as u32))
                    .collect()
            })
            .collect();
        let uniform = |view: &ChromaView| ViewUniform::new(&view.camera, near, geometry.count, 0);
        let largest = |of: &dyn Fn(&ViewUniform) -> usize, scale: usize| {
            let sizes = chains.iter().map(|chain| of(&uniform(&chain[scale])));
            sizes.max().unwrap_or(0)
        };
        let pixels: Vec<usize> = (0..scales)
            .map(|scale| largest(&ViewUniform::pixel_count, scale))
            .collect();
        let tiles = largest(&ViewUniform::tile_count, 0);
        let capacities = chains
            .iter()
            .map(|chain| {
                (chain.iter())
                    .map(|view| exact_capacity(&raster, &geometry, &uniform(view)))
                    .collect::<Result<Vec<usize>, GpuError>>()
            })
            .collect::<Result<Vec<_>, _>>()?;
        let capacity = capacities.iter().flatten().copied().max().unwrap_or(0);

        let status = Buffer::zeros(&gpu, "status", STATUS_WORDS)?;
        let sum_loss = SumLossKernel::new(&gpu);
        let blocks = pixels[0].div_ceil(LOSS_BLOCK);
        let log = LossLog::new(&gpu, &sum_loss, &status, blocks, scales * views.len())?;
        let room = Room { pixels, capacity };
        let ridge = settings.ridge * 0.5 / room.pixels[0] as f64 * sh::C0 * sh::C0;
        let shared = Shared::new(&gpu, geometry, field, log, views.len(), &room)?;
        let lbfgs = Lbfgs::new(&gpu, &shared.system, splats.len(), ridge as f32)?;

        // The views beyond `cache_bytes` share one set of lists.
        let mut spare: Option<Rc<Lists>> = None;
        let mut kept = 0;
        let mut rows = Vec::with_capacity(chains.len());
        for (index, (chain, capacities)) in chains.iter().zip(&capacities).enumerate() {
            let mut of_view: Vec<Rows> = Vec::with_capacity(scales);
            for scale in (0..scales).rev() {
                let needed = capacities[scale];
                let bytes = LIST_BYTES[0] * splats.len() + LIST_BYTES[1] * needed;
                let geometry = &shared.geometry;
                let lists = if kept + bytes <= settings.cache_bytes {
                    kept += bytes;
                    let tiles = uniform_tiles(&chain[scale], near, geometry.count);
                    (Rc::new(Lists::new(&raster, geometry, tiles, needed)?), true)
                } else {
                    if spare.is_none() {
                        spare = Some(Rc::new(Lists::new(&raster, geometry, tiles, capacity)?));
                    }
                    (spare.clone().expect("made above"), false)
                };
                let (view, coarser) = (&chain[scale], of_view.last());
                let at = [index, scale];
                of_view.push(Rows::new(&raster, &shared, near, view, at, lists, coarser)?);
            }
            of_view.reverse();
            rows.push(of_view);
        }
        Ok(Self {
            gpu,
            raster,
            shared,
            lbfgs,
            sum_loss,
            rounds,
            rows,
            pixels: room.pixels[0],
            passes: 0.0,
            done: 0,
        })
    }

    /// Lets no constant harmonic fall below these, `[2, N]`.
    ///
    /// # Panics
    /// When there are not two for each Gaussian.
    pub fn set_floors(&mut self, floors: &[f32]) {
        assert_eq!(floors.len(), 2 * self.shared.geometry.count);
        self.shared.system.floors.write_at(&self.gpu, 0, floors);
    }

    /// Rounds that [`Solver::run`] takes.
    pub fn round_count(&self) -> usize {
        self.rounds.len()
    }

    /// Solves, telling `observe` after each round.
    ///
    /// # Errors
    /// [`GpuError`] when the device is lost.
    pub fn run(&mut self, observe: &mut dyn FnMut(ChromaProgress)) -> Result<(), GpuError> {
        self.run_to(self.rounds.len(), observe)
    }

    /// Goes on until so many rounds are done, and leaves the rest for later.
    ///
    /// # Errors
    /// [`GpuError`] when the device is lost.
    pub fn run_to(
        &mut self,
        until: usize,
        observe: &mut dyn FnMut(ChromaProgress),
    ) -> Result<(), GpuError> {
        let begun = Instant::now();
        let mut pending: Option<(usize, f64, Readback<f32>)> = None;
        let until = until.min(self.rounds.len());
        for index in self.done..until {
            let round = self.rounds[index].clone();
            if index > 0 && self.rounds[index - 1] != round {
                self.lbfgs.restart(&self.gpu);
            }
            self.draw(&round, true);
            let log = self.shared.log.read_later(&self.gpu);
            let mut recorder = Recorder::new(&self.gpu);
            // The first picture is gray and says nothing about the teachers.
            if round.corrects && index > 0 {
                self.shared.corrections.solve(&mut recorder);
            }
            self.lbfgs.step(&mut recorder);
            recorder.submit();
            self.done = index + 1;
            if self.done == self.rounds.len() {
                self.draw(&round, false);
                let mut recorder = Recorder::new(&self.gpu);
                self.lbfgs.end(&mut recorder);
                recorder.submit();
            }
            let due = pending.replace((index, self.passes, log));
            let last = if self.done == until {
                pending.take()
            } else {
                None
            };
            for (index, passes, losses) in due.into_iter().chain(last) {
                let losses = losses.wait(&self.gpu)?;
                observe(ChromaProgress {
                    iteration: index + 1,
                    loss: self.mean_loss(&self.rounds[index], &losses),
                    passes,
                    seconds: begun.elapsed().as_secs_f64(),
                });
            }
        }
        Ok(())
    }

    /// The plain loss of `chroma` over all views at full size, in CIELAB units: what the
    /// solvers are compared by. Teachers count as corrected so far, which is not at all
    /// before the second round. Leaves the solver with this field.
    ///
    /// # Errors
    /// [`GpuError`].
    pub fn objective(&mut self, chroma: &ShField) -> Result<f64, GpuError> {
        let planes = Field::upload(&self.gpu, chroma)?.planes;
        let mut recorder = Recorder::new(&self.gpu);
        recorder.copy(planes.raw(), self.shared.field.planes.raw());
        recorder.submit();
        let passes = self.passes;
        let plain = Round {
            scales: vec![0],
            agreement: 0.0,
            robust: None,
            corrects: false,
        };
        self.draw(&plain, false);
        self.passes = passes;
        self.lbfgs.restart(&self.gpu);
        let losses = self.shared.log.read_later(&self.gpu).wait(&self.gpu)?;
        Ok(self.mean_loss(&plain, &losses))
    }

    /// How far the views decide each Gaussian's colour, in pixels that show it fully and
    /// whose wanted colour is about met.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn seen(&self) -> Result<Vec<f32>, GpuError> {
        let count = self.shared.geometry.count;
        let diagonal = self.shared.system.diagonal.read(&self.gpu)?;
        // One pixel of weight one whose residual is the typical one.
        let pixel = 0.5 / self.pixels as f64 / TYPICAL_RESIDUAL * sh::C0;
        Ok((0..count)
            .map(|i| (0.5 * f64::from(diagonal[i] + diagonal[count + i]) / pixel) as f32)
            .collect())
    }

    /// Reads the chroma found so far.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn chroma(&self) -> Result<ShField, GpuError> {
        self.shared.field.download(&self.gpu)
    }

    /// What a dispatch worked on, the mean over the rows.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn load(&self) -> Result<Load, GpuError> {
        let rows: Vec<&Rows> = self.rows.iter().flatten().collect();
        let mut load = Load::default();
        for row in &rows {
            let status = row.status(&self.gpu)?;
            load.visible += status.visible as f64 / rows.len() as f64;
            load.instances += status.instances as f64 / rows.len() as f64;
            load.pixels += row.view.pixel_count() as f64 / rows.len() as f64;
            load.tiles += row.view.tile_count() as f64 / rows.len() as f64;
        }
        Ok(Load {
            splats: self.shared.geometry.count as f64,
            capacity: load.instances,
            channels: 2.0,
            sh_planes: self.shared.field.planes.len() as f64 / self.shared.geometry.count as f64,
            ..load
        })
    }

    /// Draws every view as it is for its loss, and with `adjoint` finds the gradient and
    /// the sums of the corrections.
    fn draw(&mut self, round: &Round, adjoint: bool) {
        let (raster, shared) = (&self.raster, &self.shared);
        let mut recorder = Recorder::new(&self.gpu);
        recorder.clear(shared.log.losses.raw());
        if adjoint {
            recorder.clear(shared.system.gradient.raw());
            recorder.clear(shared.system.diagonal.raw());
        }
        recorder.submit();
        let views = self.rows.len();
        for (view, rows) in self.rows.iter_mut().enumerate() {
            for &scale in &round.scales {
                let row = &mut rows[scale];
                // There is nothing to agree with where the coarser scale is not drawn.
                let agreement = if round.scales.contains(&(scale + 1)) {
                    round.agreement
                } else {
                    0.0
                };
                row.weigh_by(&self.gpu, agreement, round.robust);
                let mut recorder = Recorder::new(&self.gpu);
                row.draw(raster, shared, &mut recorder);
                shared.log.record(
                    &self.gpu,
                    &self.sum_loss,
                    &mut recorder,
                    row.blocks(),
                    row.view.pixel_count(),
                    scale * views + view,
                );
                self.passes += if adjoint { 1.0 } else { DRAWING } * share(scale);
                if adjoint {
                    if round.corrects && Some(&scale) == round.scales.last() {
                        row.sum_correction(shared, &mut recorder);
                    }
                    row.add_gradient(raster, &mut recorder);
                }
                recorder.submit();
            }
        }
    }

    /// The mean over the views at the finest scale of a round.
    fn mean_loss(&self, round: &Round, losses: &[f32]) -> f64 {
        let views = self.rows.len();
        let finest = round.scales.last().copied().unwrap_or(0);
        let of_views = losses[finest * views..][..views].iter();
        of_views.map(|&loss| f64::from(loss)).sum::<f64>() / views as f64
    }
}

/// What drawing a view is of a pass over it, its adjoint included.
const DRAWING: f64 = 0.5;

/// What a pass over one scale is of a pass at full size.
pub(super) fn share(scale: usize) -> f64 {
    0.25_f64.powi(scale as i32)
}

fn uniform_tiles(view: &ChromaView, near: f64, splats: usize) -> usize {
    ViewUniform::new(&view.camera, near, splats, 0).tile_count()
}
