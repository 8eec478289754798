//! Figures of pixels gathered by the Gaussians that they show: the adjoint of drawing.

use super::{ChromaError, FrozenViews};
use crate::{
    gpu::{Buffer, Recorder},
    raster::{AdjointScratch, COLOR_FIGURES, ChromaAdjoint, ChromaSums, Field, Layer},
    splats::{ShField, sh},
};

impl FrozenViews {
    /// Sums for each Gaussian, over the pixels of a view at full size, of four figures a pixel
    /// (`[height, width]`), each times how much of the Gaussian the pixel shows, 0 to 1.
    ///
    /// # Errors
    /// [`ChromaError::Gpu`].
    ///
    /// # Panics
    /// When there are not as many figures as pixels.
    pub fn gather(
        &self,
        view: usize,
        figures: &[[f32; COLOR_FIGURES]],
    ) -> Result<Vec<[f32; COLOR_FIGURES]>, ChromaError> {
        let (raster, count, gpu) = (&self.raster, self.geometry.count, self.gpu());
        let shown = self.put(view);
        let uniform = self.uniform(view, 0);
        let (pixels, tiles) = (uniform.pixel_count(), uniform.tile_count());
        assert_eq!(figures.len(), pixels, "figures of each pixel");
        let lists = self.lists(view, 0).ok_or(ChromaError::NoViews)?;
        let field = Field::upload(gpu, &ShField::zeros(count, 0, 2))?;
        let layer = Layer::new(raster, &self.geometry, lists, &field, pixels, tiles)?;
        let figures = Buffer::from_slice(gpu, "figures", figures.as_flattened())?;
        let [first, last] = ["first figures", "last figures"]
            .map(|name| Buffer::<f32>::zeros(gpu, name, 2 * count));
        let (first, last) = (first?, last?);
        let scratch = AdjointScratch::color(gpu, count, lists.capacity)?;
        let sums = ChromaSums {
            gradient: &first,
            diagonal: &last,
        };
        let adjoint = ChromaAdjoint::new(
            raster,
            &self.geometry,
            lists,
            &layer,
            &figures,
            scratch,
            sums,
        );
        let mut recorder = Recorder::new(gpu);
        self.list(view, 0, 0, &mut recorder);
        layer.record(raster, &mut recorder);
        adjoint.record(raster, &mut recorder);
        recorder.submit();
        let (first, last) = (first.read(gpu)?, last.read(gpu)?);
        let over = 1.0 / sh::C0 as f32;
        let of = |i: usize| [first[i], first[count + i], last[i], last[count + i]];
        let sums = (0..count).map(|i| of(i).map(|sum| over * sum));
        Ok(match shown {
            None => sums.collect(),
            Some(shown) => {
                let mut all = vec![[0.0; COLOR_FIGURES]; self.splat_count()];
                for (i, sums) in shown.into_iter().zip(sums) {
                    all[i] = sums;
                }
                all
            }
        })
    }
}
