//! Any radiance field that can say by which weights a pixel shows its primitives, drawn on the
//! host: no kernels of its own, and the solvers' buffers on the device all the same.

use std::{mem, sync::Arc};

use glam::{DVec3, Vec3};

use super::{
    ChromaError, ChromaKernels, MemoryBudget,
    field::{DrawBuffers, Drawing, FrozenField, Primitives},
    memory::Demand,
};
use crate::{
    capture::Camera,
    gpu::{Buffer, Gpu, Recorder},
    raster::{COLOR_FIGURES, ColorKind},
    splats::sh,
};

/// A field of primitives before cameras, by the weights of pixels: `weights(view, [x, y], list)`
/// adds to `list` each primitive that a pixel of the full size shows, and how much, 0 to 1, all
/// together 1 at most. It is called for every pixel in every pass: what takes long should be kept.
pub struct HostField<F> {
    gpu: Gpu,
    kernels: ChromaKernels,
    primitives: Arc<Primitives>,
    cameras: Vec<Camera>,
    weights: F,
    pinned: usize,
    demand: u64,
}

impl<F: Fn(usize, [u32; 2], &mut Vec<(u32, f32)>)> HostField<F> {
    /// The field of `primitives` before `cameras`. `room` is for what solvers keep on the device.
    ///
    /// # Errors
    /// [`ChromaError::NoViews`] without cameras, [`ChromaError::OverLimit`] where one view at a
    /// time exceeds the limit.
    pub fn new(
        gpu: &Gpu,
        primitives: Primitives,
        cameras: &[Camera],
        room: MemoryBudget,
        weights: F,
    ) -> Result<Self, ChromaError> {
        if cameras.is_empty() {
            return Err(ChromaError::NoViews);
        }
        let pixels = |camera: &Camera| camera.width as usize * camera.height as usize;
        let pixels: Vec<usize> = cameras.iter().map(pixels).collect();
        let demand = Demand::on_host(primitives.count(), &pixels, room);
        let pinned = demand.pinned(room.limit)?;
        Ok(Self {
            gpu: gpu.clone(),
            kernels: ChromaKernels::new(gpu),
            primitives: Arc::new(primitives),
            cameras: cameras.to_vec(),
            weights,
            demand: demand.bytes(pinned),
            pinned,
        })
    }

    /// What a pixel of a view at a scale shows: the mean of the pixels of the full size in it.
    fn shown(&self, view: usize, scale: usize, pixel: usize, list: &mut Vec<(u32, f32)>) {
        list.clear();
        let (full, [width, _]) = (self.size(view, 0), self.size(view, scale));
        let (side, pixel) = (1 << scale, pixel as u32);
        let first = [side * (pixel % width), side * (pixel / width)];
        for k in 0..side * side {
            let [x, y] = [first[0] + k % side, first[1] + k / side];
            let inside = [x.min(full[0] - 1), y.min(full[1] - 1)];
            (self.weights)(view, inside, list);
        }
        let share = 1.0 / (side * side) as f32;
        list.iter_mut().for_each(|(_, weight)| *weight *= share);
    }

    /// Harmonics of the direction from which a view sees a primitive.
    fn basis(&self, view: usize, sh_degree: u32, primitive: usize) -> [f64; 16] {
        let place = Vec3::from(self.primitives.centers[primitive]).as_dvec3();
        let direction = place - self.cameras[view].center();
        sh::basis(sh_degree, direction.normalize_or_zero().into())
    }
}

impl<F: Fn(usize, [u32; 2], &mut Vec<(u32, f32)>)> FrozenField for HostField<F> {
    fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    fn kernels(&self) -> &ChromaKernels {
        &self.kernels
    }

    fn primitives(&self) -> &Arc<Primitives> {
        &self.primitives
    }

    fn views(&self) -> usize {
        self.cameras.len()
    }

    fn size(&self, view: usize, scale: usize) -> [u32; 2] {
        let camera = &self.cameras[view];
        [camera.width, camera.height].map(|side| (side >> scale).max(1))
    }

    fn bind<'a>(
        &'a self,
        _views: &[usize],
        buffers: &DrawBuffers<'_>,
    ) -> Result<Box<dyn Drawing + 'a>, ChromaError> {
        Ok(Box::new(HostDrawing {
            field: self,
            kind: buffers.field.kind,
            sh_degree: buffers.field.degree,
            harmonics: buffers.field.planes.clone(),
            images: buffers.images.to_vec(),
            sums: (buffers.adjoint).map(|(gradient, sums)| {
                [gradient, sums.gradient, sums.diagonal].map(Buffer::clone)
            }),
        }))
    }

    fn depth(&self, view: usize) -> Result<Vec<f32>, ChromaError> {
        let camera = &self.cameras[view];
        let depth = |&(i, weight): &(u32, f32)| {
            let place: DVec3 = Vec3::from(self.primitives.centers[i as usize]).as_dvec3();
            (camera.depth(place) as f32, weight)
        };
        let mut list = Vec::new();
        let mut median = |pixel| {
            self.shown(view, 0, pixel, &mut list);
            let mut depths: Vec<(f32, f32)> = list.iter().map(depth).collect();
            depths.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            let mut sum = 0.0;
            let half = depths.iter().find(|(_, weight)| {
                sum += weight;
                sum >= 0.5
            });
            half.map_or(f32::NAN, |&(depth, _)| depth)
        };
        Ok((0..self.pixels(view, 0)).map(&mut median).collect())
    }

    fn pinned(&self) -> usize {
        self.pinned
    }

    fn demand(&self) -> u64 {
        self.demand
    }
}

/// Views drawn on the host, with certain buffers.
struct HostDrawing<'a, F> {
    field: &'a HostField<F>,
    kind: ColorKind,
    sh_degree: u32,
    harmonics: Buffer<f32>,
    images: Vec<Buffer<f32>>,
    /// Image gradient, gradient, diagonal.
    sums: Option<[Buffer<f32>; 3]>,
}

impl<F: Fn(usize, [u32; 2], &mut Vec<(u32, f32)>)> Drawing for HostDrawing<'_, F> {
    fn draw(&self, view: usize, scale: usize, recorder: &mut Recorder) -> Result<(), ChromaError> {
        let (field, channels) = (self.field, self.kind.channels());
        let gpu = submitted(field, recorder);
        let (count, planes) = (field.primitives.count(), self.harmonics.read(gpu)?);
        let mut colors = vec![[0.0; 3]; count];
        for (i, color) in colors.iter_mut().enumerate() {
            let basis = field.basis(view, self.sh_degree, i);
            for (plane, values) in planes.chunks_exact(count).enumerate() {
                color[plane % channels] += basis[plane / channels] * f64::from(values[i]);
            }
        }
        // Luma and RGB are stored around mid-gray.
        let middle = if self.kind == ColorKind::Chroma {
            0.0
        } else {
            0.5
        };
        let (stride, mut list) = (self.kind.stride(), Vec::new());
        let mut image = vec![0.0; stride * field.pixels(view, scale)];
        for (pixel, values) in image.chunks_exact_mut(stride).enumerate() {
            field.shown(view, scale, pixel, &mut list);
            for &(i, weight) in &list {
                for (value, color) in values.iter_mut().zip(&colors[i as usize][..channels]) {
                    *value += weight * (color + middle) as f32;
                }
            }
        }
        self.images[scale].write(gpu, &image);
        Ok(())
    }

    fn adjoint(
        &self,
        view: usize,
        scale: usize,
        recorder: &mut Recorder,
    ) -> Result<(), ChromaError> {
        let Some([image_gradient, gradient, diagonal]) = &self.sums else {
            return Ok(());
        };
        let (field, channels) = (self.field, self.kind.channels());
        let gpu = submitted(field, recorder);
        let count = field.primitives.count();
        let (mut sums, mut list) = (vec![[0.0; COLOR_FIGURES]; count], Vec::new());
        let figures = image_gradient.read(gpu)?;
        let figures = figures.as_chunks::<COLOR_FIGURES>().0;
        for (pixel, figures) in figures.iter().enumerate().take(field.pixels(view, scale)) {
            field.shown(view, scale, pixel, &mut list);
            for &(i, weight) in &list {
                for (sum, figure) in sums[i as usize].iter_mut().zip(figures) {
                    *sum += f64::from(weight * figure);
                }
            }
        }
        let (mut slopes, mut curvatures) = (gradient.read(gpu)?, diagonal.read(gpu)?);
        for (i, sums) in sums.iter().enumerate() {
            let basis = field.basis(view, self.sh_degree, i);
            let (slope, curvature) = sums.split_at(channels);
            for (plane, values) in slopes.chunks_exact_mut(count).enumerate() {
                values[i] += (basis[plane / channels] * slope[plane % channels]) as f32;
            }
            for (values, sum) in curvatures.chunks_exact_mut(count).zip(curvature) {
                values[i] += (sh::C0 * sum) as f32;
            }
        }
        gradient.write(gpu, &slopes);
        diagonal.write(gpu, &curvatures);
        Ok(())
    }
}

/// Submits what was recorded, which the host goes on from.
fn submitted<'a, F>(field: &'a HostField<F>, recorder: &mut Recorder) -> &'a Gpu {
    mem::replace(recorder, Recorder::new(&field.gpu)).submit();
    &field.gpu
}
