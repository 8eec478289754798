//! Views drawn, judged and brought back: for each the picture, its loss, and the adjoint
//! that adds to gradient and curvature. Drawing is the matrix A of a linear problem, the
//! adjoint Aᵀ.

use super::{
    ChromaError, Targets,
    correction::Corrections,
    field::{DrawBuffers, Drawing, FrozenField},
    host_system::HostSystem,
    loss::{ChromaLossWeights, LOSS_BLOCK, LabLossParameters, RgbLossParameters, Space},
    view_adjoint::{SolveBuffers, ViewAdjoint, ViewLoss, sized},
};
use crate::{
    gpu::{Buffer, Recorder},
    raster::{COLOR_FIGURES, ChromaSums, Field, Load, LossLog, constants::STATUS_WORDS},
    splats::ShField,
};

/// A view and what is wanted there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Task {
    /// Index into the views of a [`FrozenField`].
    pub view: usize,
    /// Index into [`Targets`].
    pub target: usize,
}

/// Settings of a view's loss.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LossSettings {
    /// Weight of the agreement with the next coarser scale, drawn just before.
    pub agreement: f32,
    /// Residual at which the loss of a and b together levels off; without one, each has
    /// its own.
    pub robust: Option<f32>,
    /// Weights in CIELAB, where RGB is judged there.
    pub lab: LabLossParameters,
}

/// Figures that follow on the loss.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LossOutput {
    /// Draws for the loss alone.
    Loss,
    /// Draws and takes the adjoint: loss and gradient.
    Gradient,
    /// The adjoint, and the sums for the view's correction.
    GradientAndSums,
}

/// All passes of one solve.
pub(super) struct Passes<'a> {
    pub frozen: &'a dyn FrozenField,
    targets: &'a Targets,
    pub tasks: Vec<Task>,
    /// Harmonics of all Gaussians, or of those that one view shows.
    pub field: Field,
    /// All of them, where they wait on the host.
    pub on_host: Option<HostSystem>,
    /// Gradient of the field's first planes: those that are solved for.
    pub gradient: Buffer<f32>,
    /// See [`ChromaSums::diagonal`].
    pub diagonal: Buffer<f32>,
    pub log: LossLog,
    pub status: Buffer<u32>,
    pub corrections: Corrections,
    drawing: Box<dyn Drawing + 'a>,
    /// For each scale of each pinned task, then for each scale those that all others take turns
    /// in.
    adjoints: Vec<ViewAdjoint>,
    scales: usize,
    kept: usize,
}

impl<'a> Passes<'a> {
    /// Passes of `start` over `tasks` at so many scales; its first `planes` planes are
    /// solved for. The log has room for `entries` losses.
    pub fn new(
        frozen: &'a dyn FrozenField,
        targets: &'a Targets,
        mut tasks: Vec<Task>,
        start: &ShField,
        planes: usize,
        space: Space,
        [scales, entries]: [usize; 2],
    ) -> Result<Self, ChromaError> {
        let (gpu, kernels) = (frozen.gpu(), frozen.kernels());
        if tasks.is_empty() {
            return Err(ChromaError::NoViews);
        }
        for task in &tasks {
            let (found, expected) = (targets.size(task.target), frozen.size(task.view, 0));
            if found != expected {
                return Err(ChromaError::WrongSize { found, expected });
            }
        }
        // Those that stay come first.
        tasks.sort_by_key(|task| task.view);
        let kept = tasks
            .iter()
            .filter(|task| task.view < frozen.pinned())
            .count();
        let splats = frozen.on_device();
        let pixels: Vec<usize> = (0..scales)
            .map(|scale| {
                let pixels = tasks.iter().map(|task| frozen.pixels(task.view, scale));
                pixels.max().unwrap_or(0)
            })
            .collect();
        let on_device = ShField::zeros(splats, start.degree, start.channels);
        let streams = frozen.streamed().is_some();
        let field = Field::upload(gpu, if streams { &on_device } else { start })?;
        let gradient = Buffer::zeros(gpu, "gradient", planes * splats)?;
        let diagonals = COLOR_FIGURES - field.kind.channels();
        let diagonal = Buffer::zeros(gpu, "diagonal", diagonals * splats)?;
        let on_host = streams.then(|| HostSystem::new(start, planes, diagonals));
        // Frozen lists never overflow: this status stays zero.
        let status = Buffer::zeros(gpu, "status", STATUS_WORDS)?;
        let blocks = pixels[0].div_ceil(LOSS_BLOCK);
        let log = LossLog::new(gpu, &kernels.sum_loss, &status, blocks, entries)?;
        let corrections = Corrections::new(gpu, &kernels.correction, tasks.len())?;
        let image = |pixels| Buffer::zeros(gpu, "image", field.kind.stride() * pixels);
        let images = (pixels.iter().copied().map(image)).collect::<Result<Vec<_>, _>>()?;
        let image_gradient = Buffer::zeros(gpu, "image gradient", COLOR_FIGURES * pixels[0])?;
        let views: Vec<usize> = tasks.iter().map(|task| task.view).collect();
        let sums = ChromaSums {
            gradient: &gradient,
            diagonal: &diagonal,
        };
        let buffers = DrawBuffers {
            field: &field,
            images: &images,
            adjoint: Some((&image_gradient, sums)),
        };
        let drawing = frozen.bind(&views, &buffers)?;
        let weighted = targets.weighted();
        let shared = SolveBuffers {
            gpu,
            kernels,
            kind: field.kind,
            block_losses: &log.block_losses,
            corrections: &corrections,
            space,
            image_gradient: &image_gradient,
            images: &images,
        };
        let mut adjoints = Vec::new();
        for &Task { view, target } in &tasks[..kept] {
            for scale in 0..scales {
                let target = targets.read(target, scale)?;
                let wanted = Buffer::from_slice(gpu, "wanted", &target.pixels)?;
                let weights = target.weights.as_deref().unwrap_or(&[0.0]);
                let weights = Buffer::from_slice(gpu, "pixel weights", weights)?;
                adjoints.push(ViewAdjoint::new(
                    &shared,
                    frozen.size(view, scale),
                    scale,
                    wanted,
                    weights,
                )?);
            }
            // What is written waits on the host until it is there.
            gpu.queue().submit([]);
            gpu.wait()?;
        }
        if let Some(&Task { view, .. }) = tasks.get(kept) {
            let wanted: Buffer<u32> = Buffer::zeros(gpu, "wanted", pixels[0])?;
            let count = if weighted { pixels[0] } else { 1 };
            let weights: Buffer<f32> = Buffer::zeros(gpu, "pixel weights", count)?;
            for scale in 0..scales {
                let (wanted, weights) = (wanted.clone(), weights.clone());
                adjoints.push(ViewAdjoint::new(
                    &shared,
                    frozen.size(view, scale),
                    scale,
                    wanted,
                    weights,
                )?);
            }
        }
        Ok(Self {
            frozen,
            targets,
            tasks,
            field,
            on_host,
            gradient,
            diagonal,
            log,
            status,
            corrections,
            drawing,
            adjoints,
            scales,
            kept,
        })
    }

    /// Work of a dispatch, the mean over the tasks at so many scales.
    pub fn load(&self, scales: usize) -> Load {
        let views: Vec<usize> = self.tasks.iter().map(|task| task.view).collect();
        let channels = self.field.kind.channels() as f64;
        let of_splat = self.field.planes.len() as f64 / self.frozen.on_device() as f64;
        Load {
            channels,
            sh_planes: of_splat,
            ..self.frozen.load(&views, scales)
        }
    }

    /// Forgets losses and, with `sums`, gradient and curvature, which is asked for after the
    /// last pass ([`IrlsSolver::seen`](super::IrlsSolver::seen)).
    pub fn clear(&mut self, sums: bool) {
        if let Some(on_host) = self.on_host.as_mut().filter(|_| sums) {
            on_host.clear();
        }
        let mut recorder = Recorder::new(self.frozen.gpu());
        recorder.clear(self.log.losses.raw());
        if sums {
            recorder.clear(self.gradient.raw());
            recorder.clear(self.diagonal.raw());
        }
        recorder.submit();
    }

    /// The harmonics so far.
    pub fn harmonics(&self) -> Result<ShField, ChromaError> {
        match &self.on_host {
            Some(on_host) => Ok(on_host.field()),
            None => Ok(self.field.download(self.frozen.gpu())?),
        }
    }

    /// See [`Passes::diagonal`], of all Gaussians.
    pub fn curvature(&self) -> Result<Vec<f32>, ChromaError> {
        match &self.on_host {
            Some(on_host) => Ok(on_host.diagonal.clone()),
            None => Ok(self.diagonal.read(self.frozen.gpu())?),
        }
    }

    /// Takes other harmonics, of the same degree and channels.
    pub fn put(&mut self, field: &ShField) -> Result<(), ChromaError> {
        match &mut self.on_host {
            Some(on_host) => on_host.put(field),
            None => {
                let gpu = self.frozen.gpu();
                let planes = Field::upload(gpu, field)?.planes;
                let mut recorder = Recorder::new(gpu);
                recorder.copy(planes.raw(), self.field.planes.raw());
                recorder.submit();
            }
        }
        Ok(())
    }

    /// Draws a task's view at a scale, files its loss under `entry`, and adds its gradient
    /// as `ending` says.
    pub fn draw(
        &mut self,
        index: usize,
        scale: usize,
        loss_settings: LossSettings,
        entry: usize,
        ending: LossOutput,
    ) -> Result<(), ChromaError> {
        let shown = self.frozen.put(self.tasks[index].view);
        if let (Some(on_host), Some(shown)) = (&self.on_host, &shown) {
            let gpu = self.frozen.gpu();
            on_host.send(gpu, shown, &self.field.planes);
            let mut recorder = Recorder::new(gpu);
            recorder.clear(self.gradient.raw());
            recorder.clear(self.diagonal.raw());
            recorder.submit();
        }
        self.draw_on_device(index, scale, loss_settings, entry, ending)?;
        if let (Some(on_host), Some(shown)) = (&mut self.on_host, &shown)
            && ending != LossOutput::Loss
        {
            let found = [&self.gradient, &self.diagonal];
            on_host.receive(self.frozen.gpu(), shown, found)?;
        }
        Ok(())
    }

    /// [`Passes::draw`] of what is on the device.
    fn draw_on_device(
        &self,
        index: usize,
        scale: usize,
        loss_settings: LossSettings,
        entry: usize,
        ending: LossOutput,
    ) -> Result<(), ChromaError> {
        let frozen = self.frozen;
        let (gpu, kernels) = (frozen.gpu(), frozen.kernels());
        let Task { view, target } = self.tasks[index];
        let stays = index < self.kept;
        let view_adjoint =
            &self.adjoints[if stays { index } else { self.kept } * self.scales + scale];
        let weighted = if stays {
            view_adjoint.weights.len() > 1
        } else {
            // What the view before this one reads must be read, and what waits on the
            // host must be gone.
            gpu.wait()?;
            let target = self.targets.read(target, scale)?;
            view_adjoint.wanted.write(gpu, &target.pixels);
            if let Some(weights) = &target.weights {
                view_adjoint.weights.write(gpu, weights);
            }
            (view_adjoint.view).write(gpu, &[sized(frozen.size(view, scale))]);
            target.weights.is_some()
        };
        let pixels = frozen.pixels(view, scale);
        let blocks = pixels.div_ceil(LOSS_BLOCK) as u32;
        let mut recorder = Recorder::new(gpu);
        self.drawing.draw(view, scale, &mut recorder)?;
        let agreement = loss_settings.agreement;
        let agreeing = view_adjoint.agreeing.as_ref().filter(|_| agreement > 0.0);
        let coarser = scale + usize::from(agreeing.is_some());
        let coarser_size = frozen.size(view, coarser);
        let told = u32::from(weighted);
        let [plain, with_agreement] = match &view_adjoint.view_loss {
            ViewLoss::Rgb(parameters) => {
                parameters.write(gpu, &[RgbLossParameters { weighted: told }]);
                [&kernels.rgb_loss; 2]
            }
            ViewLoss::Lab(parameters) => {
                let parameters_now = LabLossParameters {
                    coarser_size,
                    agreement,
                    weighted: told,
                    ..loss_settings.lab
                };
                parameters.write(gpu, &[parameters_now]);
                [&kernels.lab_loss, &kernels.agreeing_lab_loss]
            }
            ViewLoss::Chroma { weights, .. } => {
                let weights_now = ChromaLossWeights {
                    coarser_size,
                    agreement,
                    view_index: index as u32,
                    weighted: told,
                    ..ChromaLossWeights::robust(loss_settings.robust)
                };
                weights.write(gpu, &[weights_now]);
                [&kernels.chroma_loss, &kernels.agreeing_loss]
            }
        };
        match agreeing {
            Some(loss) => recorder.dispatch(with_agreement, loss, blocks),
            None => recorder.dispatch(plain, &view_adjoint.loss, blocks),
        }
        if let ViewLoss::Chroma {
            parameters, sums, ..
        } = &view_adjoint.view_loss
            && ending == LossOutput::GradientAndSums
        {
            self.corrections.choose(gpu, parameters, index, weighted);
            (self.corrections).sum(&kernels.correction, sums, &mut recorder);
        }
        self.log
            .record(gpu, &kernels.sum_loss, &mut recorder, blocks, pixels, entry);
        if ending != LossOutput::Loss {
            self.drawing.adjoint(view, scale, &mut recorder)?;
        }
        recorder.submit();
        Ok(())
    }
}
