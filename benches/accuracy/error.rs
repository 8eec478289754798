//! Errors of picture and gradient against the oracle's, which leaves nothing out.

use std::sync::Arc;

use gs_chroma::{
    gpu::Gpu,
    low_level::{
        doctor::stage::Stage,
        oracle::{
            self,
            gradient::gradient_of,
            luma_loss::{LumaEffects, luma_loss_gradient},
            render::render,
            scene::Scene,
            shade::Shading,
        },
    },
    luma::SsimWindow,
    raster::Raster,
};
use serde::Serialize;

use crate::{
    Fallible,
    knobs::{KNOBS, Knob, NOTHING_LEFT_OUT},
    scene::{Subject, oracle_view, widened},
};

/// Gaussians whose gradient is asked for: the oracle takes milliseconds for each.
const ASKED: usize = 500;

/// The errors of one value of one knob.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Error {
    /// Largest error of a pixel, in levels of an 8-bit picture.
    pub picture_max: f64,
    /// Root mean square error of the pixels, in levels.
    pub picture_rms: f64,
    /// Error of the gradient of the loss over the gradient, both as a length; of the five
    /// groups of parameters, whose units differ, the root mean square.
    pub gradient: f64,
}

/// The gradient's groups, each `[asked, …]`.
type Groups = Vec<Vec<f64>>;

/// Values of a group for some of the Gaussians.
fn asked_of(group: &[f64], count: usize, asked: &[usize]) -> Vec<f64> {
    let each = group.len() / count;
    (asked.iter())
        .flat_map(|&i| &group[i * each..(i + 1) * each])
        .copied()
        .collect()
}

fn groups_of(gradient: &Scene<f64, 1>, asked: &[usize]) -> Groups {
    let groups = [
        gradient.means.as_flattened(),
        gradient.quats.as_flattened(),
        gradient.log_scales.as_flattened(),
        &gradient.opacity_logits,
        gradient.sh.as_flattened(),
    ];
    (groups.iter())
        .map(|group| asked_of(group, gradient.len(), asked))
        .collect()
}

/// The root mean square over groups of `‖actual - expected‖ / ‖expected‖`.
pub fn relative(actual: &[Vec<f64>], expected: &[Vec<f64>]) -> f64 {
    let squares = actual.iter().zip(expected).map(|(actual, expected)| {
        let error: f64 = (actual.iter().zip(expected))
            .map(|(a, e)| (a - e).powi(2))
            .sum();
        error / expected.iter().map(|e| e * e).sum::<f64>()
    });
    (squares.sum::<f64>() / actual.len() as f64).sqrt()
}

/// The errors of all knobs.
pub fn measure(gpu: &Gpu, subject: &Subject) -> Fallible<Vec<Error>> {
    let raster = Arc::new(Raster::new(gpu));
    let scene = widened(&subject.small);
    let camera = &subject.view.camera;
    let view = oracle_view(camera, subject.near(), NOTHING_LEFT_OUT);
    let exact: Vec<f64> = (render(&scene, &view, Shading::Offset).iter())
        .map(|pixel| pixel[0])
        .collect();
    let photo: Vec<f64> = (subject.view.gray.iter())
        .map(|&level| f64::from(level) / 255.0)
        .collect();
    // The loss's slope at the exact picture: what follows differs by the adjoint alone,
    // or by the loss where the window is another one.
    let slope = |window: SsimWindow| {
        let effects = LumaEffects {
            ssim_window: u32::from(window) as usize,
            ..LumaEffects::default()
        };
        luma_loss_gradient(&exact, &photo, view.width, view.height, &effects)
    };
    let slopes = [SsimWindow::Eleven, SsimWindow::Seven, SsimWindow::Five]
        .map(|window| (window, slope(window)));
    let shown: Vec<usize> = (oracle::render::visible(&scene, &view, Shading::Offset).iter())
        .map(|visible| visible.index)
        .collect();
    let mut asked: Vec<usize> = (shown.iter())
        .step_by(shown.len().div_ceil(ASKED).max(1))
        .copied()
        .collect();
    asked.sort_unstable();
    let upstream: Vec<[f64; 1]> = slopes[0].1.iter().map(|&slope| [slope]).collect();
    let wanted = |i: usize| asked.binary_search(&i).is_ok();
    let gradient = gradient_of(&scene, &view, Shading::Offset, &upstream, wanted);
    let gradient = groups_of(&gradient, &asked);

    let of_knob = |knob: &Knob| -> Fallible<Error> {
        let numerics = knob.numerics();
        let cut = oracle::numerics::Numerics {
            alpha_min: numerics.raster.alpha_min,
            transmittance_min: numerics.raster.transmittance_min,
            depth_bits: numerics.raster.depth_bits,
            ..oracle::numerics::Numerics::DEFAULT
        };
        let view = oracle_view(camera, subject.near(), cut);
        let stage = Stage::new(&raster.computing(numerics.raster), &subject.small, &view)?;
        let (_, slope) = (slopes.iter())
            .find(|(window, _)| *window == numerics.ssim_window)
            .expect("all windows are there");
        let found = stage.backward(slope)?;
        let found: Groups = (found.groups().iter())
            .map(|(_, group)| asked_of(group, scene.len(), &asked))
            .collect();
        let levels: Vec<f64> = (stage.image()?.iter().zip(&exact))
            .map(|(&actual, exact)| 255.0 * (f64::from(actual) - exact).abs())
            .collect();
        let squares: f64 = levels.iter().map(|level| level * level).sum();
        Ok(Error {
            picture_max: levels.iter().copied().fold(0.0, f64::max),
            picture_rms: (squares / levels.len() as f64).sqrt(),
            gradient: relative(&found, &gradient),
        })
    };
    KNOBS.iter().map(of_knob).collect()
}
