//! One field of color drawn over a view's tile lists: `shade` and `blend`.

use super::{
    ColorKind, Raster,
    lists::Lists,
    portions::TileBindings,
    splats::{Field, Geometry},
};
use crate::gpu::{Bindings, Buffer, Gpu, GpuError, Recorder, groups_for};

/// Buffers that a layer draws to. Layers that are drawn one after the other may share them.
#[derive(Clone)]
pub struct Canvas {
    colors: Buffer<f32>,
    image: Buffer<f32>,
    lasts: Buffer<u32>,
}

impl Canvas {
    /// Bytes of a canvas for so many Gaussians and pixels.
    pub fn bytes(kind: ColorKind, splats: usize, max_pixels: usize) -> u64 {
        let stride = kind.stride() as u64;
        4 * (stride * splats as u64 + (stride + 1) * max_pixels as u64)
    }

    /// A canvas for so many Gaussians and a picture, `[pixels]` of the kind's stride.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn of(
        gpu: &Gpu,
        kind: ColorKind,
        splats: usize,
        image: &Buffer<f32>,
    ) -> Result<Self, GpuError> {
        let stride = kind.stride();
        Ok(Self {
            colors: Buffer::zeros(gpu, "colors", splats * stride)?,
            image: image.clone(),
            lasts: Buffer::zeros(gpu, "lasts", image.len() / stride)?,
        })
    }
}

/// Buffers and bindings that draw one field.
pub struct Layer {
    /// Kind of color.
    pub kind: ColorKind,
    /// Color of each visible Gaussian, `[N]` of the kind's stride.
    pub colors: Buffer<f32>,
    /// The picture, `[pixels]` of the kind's stride.
    pub image: Buffer<f32>,
    /// Entries of its tile that each pixel used.
    pub lasts: Buffer<u32>,
    count: usize,
    pub(super) max_tiles: usize,
    shade: Bindings,
    blend: TileBindings,
}

impl Layer {
    /// A layer for views of at most `max_pixels` pixels and `max_tiles` tiles.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        raster: &Raster,
        geometry: &Geometry,
        lists: &Lists,
        field: &Field,
        max_pixels: usize,
        max_tiles: usize,
    ) -> Result<Self, GpuError> {
        let (gpu, kind) = (&raster.gpu, field.kind);
        let image = Buffer::zeros(gpu, "image", max_pixels * kind.stride())?;
        let canvas = Canvas::of(gpu, kind, geometry.count, &image)?;
        Ok(Self::on(raster, geometry, lists, field, canvas, max_tiles))
    }

    /// A layer on a canvas that is there, for views of at most `max_tiles` tiles.
    pub fn on(
        raster: &Raster,
        geometry: &Geometry,
        lists: &Lists,
        field: &Field,
        canvas: Canvas,
        max_tiles: usize,
    ) -> Self {
        let gpu = &raster.gpu;
        let Canvas {
            colors,
            image,
            lasts,
        } = canvas;
        let kernels = raster.layer(field.kind);
        let shade = kernels.shade.bind(
            gpu,
            &[
                lists.view.raw(),
                geometry.planes.raw(),
                field.planes.raw(),
                lists.ranks.raw(),
                lists.projected.raw(),
                colors.raw(),
                lists.status.raw(),
            ],
        );
        let of_blend = [
            (0, lists.view.raw()),
            (1, lists.starts.raw()),
            (2, lists.slots().raw()),
            (3, lists.instance_splats.raw()),
            (4, lists.projected.raw()),
            (5, colors.raw()),
            (6, image.raw()),
            (7, lasts.raw()),
        ];
        let blend = (lists.portions).bind(gpu, &kernels.blend, &of_blend, 8, max_tiles);
        Self {
            kind: field.kind,
            colors,
            image,
            lasts,
            count: geometry.count,
            max_tiles,
            shade,
            blend,
        }
    }

    /// Records shading and blending; the lists must have been recorded before.
    pub fn record(&self, raster: &Raster, recorder: &mut Recorder) {
        let kernels = raster.layer(self.kind);
        recorder.dispatch(&kernels.shade, &self.shade, groups_for(self.count));
        self.blend.record(&kernels.blend, recorder);
    }

    /// Reads the picture as `[pixels, channels]`.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn read_image(&self, gpu: &Gpu, pixels: usize) -> Result<Vec<f32>, GpuError> {
        let (stride, channels) = (self.kind.stride(), self.kind.channels());
        let image = self.image.read(gpu)?;
        Ok(image
            .chunks_exact(stride)
            .take(pixels)
            .flat_map(|pixel| &pixel[..channels])
            .copied()
            .collect())
    }
}
