//! What stage 2 needs of a radiance field whose geometry is frozen, whatever it is made of.
//!
//! A pixel's color is linear in the harmonics of the primitives, Gaussians or voxels: a matrix A,
//! of which the solvers need products with A (drawing) and with Aᵀ (its adjoint).

use std::sync::Arc;

use super::{ChromaError, ChromaKernels};
use crate::{
    gpu::{Buffer, Gpu, Recorder},
    raster::{COLOR_FIGURES, ChromaSums, ColorKind, Field, Load, RenderedImage},
    splats::{ShField, Splats, sh},
};

/// Primitives of a radiance field, on the host: what colors are handed on by.
#[derive(Clone, Debug, Default)]
pub struct Primitives {
    /// World coordinates.
    pub centers: Vec<[f32; 3]>,
    /// Constant harmonic of luma: gray, 0 to 1, is 0.5 more than [`sh::C0`] times it.
    pub luma: Vec<f32>,
    /// Natural logarithm of the size in world units.
    pub log_sizes: Vec<f32>,
}

impl From<&Splats> for Primitives {
    fn from(luma: &Splats) -> Self {
        let size = |scales: &[f32; 3]| scales.iter().map(|&s| f64::from(s)).sum::<f64>() / 3.0;
        Self {
            centers: luma.means.clone(),
            luma: (0..luma.len()).map(|i| luma.sh.of(i)[0]).collect(),
            log_sizes: (luma.log_scales.iter().map(|scales| size(scales) as f32)).collect(),
        }
    }
}

impl Primitives {
    /// Number of primitives.
    pub fn count(&self) -> usize {
        self.centers.len()
    }
}

/// Buffers that views are drawn from and to.
#[derive(Clone, Copy)]
pub struct DrawBuffers<'a> {
    /// Harmonics of the primitives on the device.
    pub field: &'a Field,
    /// For each scale a picture, `[pixels]` of the kind's stride.
    pub images: &'a [Buffer<f32>],
    /// For the adjoint, where it is needed: four figures a pixel, the gradient of its channels and
    /// the curvatures of the loss, and the sums that these are added to.
    pub adjoint: Option<(&'a Buffer<f32>, ChromaSums<'a>)>,
}

/// Views that are drawn with certain buffers. Errors are those of the device.
pub trait Drawing {
    /// Records the drawing of a view at a scale: harmonics → picture.
    fn draw(&self, view: usize, scale: usize, recorder: &mut Recorder) -> Result<(), ChromaError>;

    /// Records the adjoint of what was drawn last: image gradient → sums.
    fn adjoint(
        &self,
        view: usize,
        scale: usize,
        recorder: &mut Recorder,
    ) -> Result<(), ChromaError>;
}

/// Harmonics to be drawn, on the device or on the host as the primitives are.
pub enum Colors<'a> {
    /// Those of all primitives, on the device.
    Device(Field),
    /// Those of all primitives, on the host.
    Host(&'a ShField),
}

/// A radiance field with frozen geometry before its cameras.
///
/// A pixel shows each primitive by a weight of 0 to 1, all together by 1 at most: curvatures
/// weighed by these bound what the solvers divide by. Errors are those of the device.
pub trait FrozenField {
    /// The device that holds the buffers.
    fn gpu(&self) -> &Gpu;

    /// Kernels of stage 2.
    fn kernels(&self) -> &ChromaKernels;

    /// All primitives.
    fn primitives(&self) -> &Arc<Primitives>;

    /// Number of views.
    fn views(&self) -> usize;

    /// Width and height of a view, in pixels; at each scale half of the one before, 0 being the full
    /// size.
    fn size(&self, view: usize, scale: usize) -> [u32; 2];

    /// Makes ready to draw these views, at as many scales as there are pictures.
    fn bind<'a>(
        &'a self,
        views: &[usize],
        buffers: &DrawBuffers<'_>,
    ) -> Result<Box<dyn Drawing + 'a>, ChromaError>;

    /// Median depth of a view's pixels along the camera's z axis, in world units; NaN where it
    /// shows less than half of anything.
    fn depth(&self, view: usize) -> Result<Vec<f32>, ChromaError>;

    /// Views whose data stay on the device: the first so many.
    fn pinned(&self) -> usize;

    /// Bytes of the device that stage 2 takes at most, as estimated before they were.
    fn demand(&self) -> u64;

    /// Number of primitives on the device at a time, at most, if they wait on the host.
    fn streamed(&self) -> Option<usize> {
        None
    }

    /// Puts those on the device that a view may show, where they wait on the host, and tells
    /// which they are.
    fn put(&self, _view: usize) -> Option<Vec<usize>> {
        None
    }

    /// Undoes what drawing harmonics of `sh_degree` that were not finite may have done.
    fn restore(&self, _sh_degree: u32) {}

    /// Work of a dispatch, the mean over these views at so many scales.
    fn load(&self, views: &[usize], scales: usize) -> Load {
        let sizes = views
            .iter()
            .flat_map(|&view| (0..scales).map(move |scale| self.pixels(view, scale)));
        Load {
            splats: self.on_device() as f64,
            pixels: sizes.sum::<usize>() as f64 / (views.len() * scales).max(1) as f64,
            ..Load::default()
        }
    }

    /// Pixels of a view at a scale.
    fn pixels(&self, view: usize, scale: usize) -> usize {
        self.size(view, scale)
            .map(|side| side as usize)
            .iter()
            .product()
    }

    /// Number of primitives that the device holds at a time.
    fn on_device(&self) -> usize {
        self.streamed().unwrap_or(self.primitives().count())
    }

    /// Harmonics of all primitives, to be drawn.
    fn colors<'a>(&self, field: &'a ShField) -> Result<Colors<'a>, ChromaError> {
        Ok(match self.streamed() {
            Some(_) => Colors::Host(field),
            None => Colors::Device(Field::upload(self.gpu(), field)?),
        })
    }

    /// Draws harmonics as a view sees them at full size.
    fn draw(&self, view: usize, fields: &[&Colors<'_>]) -> Result<Vec<RenderedImage>, ChromaError> {
        let shown = self.put(view).unwrap_or_default();
        let picture = |colors: &&Colors<'_>| {
            let chosen;
            let field = match colors {
                Colors::Device(field) => field,
                Colors::Host(field) => {
                    let mut some = field.chosen(&shown);
                    let planes = field.channels * sh::coefficient_count(field.degree);
                    some.coefficients.resize(planes * self.on_device(), 0.0);
                    chosen = Field::upload(self.gpu(), &some)?;
                    &chosen
                }
            };
            self.picture(view, field)
        };
        fields.iter().map(picture).collect()
    }

    /// Picture of a view at full size, of harmonics on the device.
    fn picture(&self, view: usize, field: &Field) -> Result<RenderedImage, ChromaError> {
        let (gpu, pixels) = (self.gpu(), self.pixels(view, 0));
        let (stride, channels) = (field.kind.stride(), field.kind.channels());
        let images = [Buffer::zeros(gpu, "image", stride * pixels)?];
        let buffers = DrawBuffers {
            field,
            images: &images,
            adjoint: None,
        };
        let drawing = self.bind(&[view], &buffers)?;
        let mut recorder = Recorder::new(gpu);
        drawing.draw(view, 0, &mut recorder)?;
        recorder.submit();
        let image = images[0].read(gpu)?;
        drop((drawing, images));
        if self.streamed().is_some() {
            // The next one finds the room of this one.
            gpu.wait()?;
        }
        let [width, height] = self.size(view, 0);
        Ok(RenderedImage {
            width,
            height,
            channels,
            pixels: (image.chunks_exact(stride))
                .flat_map(|pixel| &pixel[..channels])
                .copied()
                .collect(),
        })
    }

    /// Sums for each primitive, over the pixels of a view at full size, of four figures a pixel
    /// (`[height, width]`), each times how much of the primitive the pixel shows, 0 to 1.
    ///
    /// # Panics
    /// When there are not as many figures as pixels.
    fn gather(
        &self,
        view: usize,
        figures: &[[f32; COLOR_FIGURES]],
    ) -> Result<Vec<[f32; COLOR_FIGURES]>, ChromaError> {
        let (count, gpu) = (self.on_device(), self.gpu());
        let shown = self.put(view);
        assert_eq!(figures.len(), self.pixels(view, 0), "figures of each pixel");
        let field = Field::upload(gpu, &ShField::zeros(count, 0, 2))?;
        let stride = ColorKind::Chroma.stride();
        let images = [Buffer::zeros(gpu, "image", stride * figures.len())?];
        let figures = Buffer::from_slice(gpu, "figures", figures.as_flattened())?;
        let [first, last] = ["first figures", "last figures"]
            .map(|name| Buffer::<f32>::zeros(gpu, name, 2 * count));
        let (first, last) = (first?, last?);
        let sums = ChromaSums {
            gradient: &first,
            diagonal: &last,
        };
        let buffers = DrawBuffers {
            field: &field,
            images: &images,
            adjoint: Some((&figures, sums)),
        };
        let drawing = self.bind(&[view], &buffers)?;
        let mut recorder = Recorder::new(gpu);
        drawing.draw(view, 0, &mut recorder)?;
        drawing.adjoint(view, 0, &mut recorder)?;
        recorder.submit();
        let (first, last) = (first.read(gpu)?, last.read(gpu)?);
        let over = 1.0 / sh::C0 as f32;
        let of = |i: usize| [first[i], first[count + i], last[i], last[count + i]];
        let sums = (0..count).map(|i| of(i).map(|sum| over * sum));
        Ok(match shown {
            None => sums.collect(),
            Some(shown) => {
                let mut all = vec![[0.0; COLOR_FIGURES]; self.primitives().count()];
                for (i, sums) in shown.into_iter().zip(sums) {
                    all[i] = sums;
                }
                all
            }
        })
    }
}
