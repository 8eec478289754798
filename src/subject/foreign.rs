//! Splats that another program trained: whether they show what the photos show, and how they
//! are to be drawn.

use std::{path::Path, sync::Arc};

use super::SubjectError;
use crate::{
    capture::Dataset,
    gpu::Gpu,
    raster::{Raster, RasterOptions, SceneRenderer},
    splats::Splats,
    tell::{Event, Observer},
};

/// Views that are drawn; an even choice.
const VIEWS: usize = 4;

/// Decibels by which pictures drawn otherwise than the file says have to be closer to the
/// photos. Scenes trained with and without antialiasing differ by one and more where sizes on
/// the screen matter, and by a few hundredths where they do not.
const GAIN: f64 = 0.2;

/// Correlation of drawn and photographed gray below which the two have nothing to do with each
/// other: a rough draft of a scene has 0.8 and more, one of 60 iterations 0.50, Gaussians in
/// another frame about 0.
const CORRELATED: f64 = 0.3;

/// Agreement of splats, drawn with some options, with the photos.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Fit {
    /// Mean of the views' correlations.
    correlation: f64,
    /// Peak signal-to-noise ratio in dB over all views.
    psnr: f64,
}

/// Raster options that fit the gray splats of `path` to the photos of `dataset`: those of the file,
/// unless the photos clearly favor others. Warns if the splats show something else.
pub(crate) fn drawn_like_photos(
    gpu: &Gpu,
    dataset: &Dataset,
    (path, luma): (&Path, &Splats),
    said: RasterOptions,
    observe: &mut Observer<'_>,
) -> Result<RasterOptions, SubjectError> {
    let other = RasterOptions {
        antialiased: !said.antialiased,
        ..said
    };
    let [as_said, otherwise] = fits(gpu, dataset, luma, [said, other])?;
    if as_said.correlation.max(otherwise.correlation) < CORRELATED {
        observe(of_unlike(path, as_said));
    } else if otherwise.psnr > as_said.psnr + GAIN {
        let how = |options: RasterOptions| match options.antialiased {
            true => "antialiased",
            false => "without antialiasing",
        };
        observe(Event::Note(format!(
            "drawing {} {}, which matches the photos better than what the file says: {:.2} dB instead of {:.2}",
            path.display(),
            how(other),
            otherwise.psnr,
            as_said.psnr
        )));
        return Ok(other);
    }
    Ok(said)
}

/// Warns where the gray splats of `path`, drawn as the file says, do not show what the photos of
/// `dataset` show.
pub(crate) fn tell_unlike(
    gpu: &Gpu,
    dataset: &Dataset,
    (path, luma): (&Path, &Splats),
    said: RasterOptions,
    observe: &mut Observer<'_>,
) -> Result<(), SubjectError> {
    let [fit] = fits(gpu, dataset, luma, [said])?;
    if fit.correlation < CORRELATED {
        observe(of_unlike(path, fit));
    }
    Ok(())
}

fn of_unlike(path: &Path, fit: Fit) -> Event {
    Event::Warning(format!(
        "{} does not show what the photos show (correlation {:.2}; of the same scene 0.8 and more): its Gaussians lie in another frame than these cameras, or are another scene; export them in COLMAP's frame",
        path.display(),
        fit.correlation
    ))
}

/// Agreement of the splats with some of the photos, for each of the options.
fn fits<const N: usize>(
    gpu: &Gpu,
    dataset: &Dataset,
    luma: &Splats,
    ways: [RasterOptions; N],
) -> Result<[Fit; N], SubjectError> {
    let views = dataset.cameras.len();
    let chosen: Vec<usize> = (0..views).step_by(views.div_ceil(VIEWS).max(1)).collect();
    let mut found = [Fit::default(); N];
    for (fit, way) in found.iter_mut().zip(ways) {
        let raster = Arc::new(Raster::with(gpu, way));
        let mut renderer = SceneRenderer::of(&raster, luma, &[&luma.sh], dataset.extent)?;
        let (mut correlations, mut squares, mut pixels) = (Vec::new(), 0.0, 0.0);
        dataset.visit(&chosen, |view, photo| {
            let picture = renderer.render(&dataset.cameras[view])?.remove(0);
            let photo_gray = photo.gray_values();
            let pairs: Vec<[f64; 2]> = (picture.pixels.iter().zip(&photo_gray).enumerate())
                .filter(|&(pixel, _)| photo.counts(pixel))
                .map(|(_, (&drawn, &gray))| [f64::from(drawn.clamp(0.0, 1.0)), f64::from(gray)])
                .collect();
            if !pairs.is_empty() {
                correlations.push(correlation(&pairs));
                squares += pairs.iter().map(|[a, b]| (a - b).powi(2)).sum::<f64>();
                pixels += pairs.len() as f64;
            }
            Ok::<_, SubjectError>(())
        })?;
        let count = correlations.len().max(1) as f64;
        *fit = Fit {
            correlation: correlations.iter().sum::<f64>() / count,
            psnr: -10.0 * (squares / f64::max(pixels, 1.0)).max(1e-10).log10(),
        };
    }
    Ok(found)
}

/// Pearson's correlation; 0 where one side does not vary.
fn correlation(pairs: &[[f64; 2]]) -> f64 {
    let count = pairs.len() as f64;
    let mean = [0, 1].map(|k| pairs.iter().map(|pair| pair[k]).sum::<f64>() / count);
    let product = |i: usize, j: usize| -> f64 {
        let deviations = pairs.iter().map(|p| (p[i] - mean[i]) * (p[j] - mean[j]));
        deviations.sum()
    };
    let spread = (product(0, 0) * product(1, 1)).sqrt();
    if spread > 0.0 {
        product(0, 1) / spread
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn correlation_of_known_pairs() {
        let line: Vec<[f64; 2]> = (0..9)
            .map(|k| [f64::from(k), 5.0 - 2.0 * f64::from(k)])
            .collect();
        assert!((correlation(&line) + 1.0).abs() < 1e-12);
        assert_eq!(correlation(&[[1.0, 2.0], [1.0, 3.0]]), 0.0);
        let square = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]];
        assert_eq!(correlation(&square), 0.0);
    }
}
