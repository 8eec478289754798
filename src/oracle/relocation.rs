//! What relocation adds to a step (Kheradmand et al. 2024).

use super::linear::{apply, rotation, transpose};

/// PCG hash (Jarzynski and Olano 2020).
fn pcg(value: u32) -> u32 {
    let state = value.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// Three numbers from the normal distribution for Gaussian `i`.
fn normal3(seed: u32, i: u32) -> [f64; 3] {
    let mut bits = i ^ pcg(seed);
    let [a, b, c, d] = std::array::from_fn(|_| {
        bits = pcg(bits);
        (f64::from(bits >> 8) + 1.0) / 16_777_216.0
    });
    let radius = |u: f64| (-2.0 * u.ln()).sqrt();
    let angle = |u: f64| std::f64::consts::TAU * u;
    [
        radius(a) * angle(b).cos(),
        radius(a) * angle(b).sin(),
        radius(c) * angle(d).cos(),
    ]
}

fn sigmoid(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

/// What is added to the gradients of the opacity logit and of the log-scales by
/// `weights` times the opacity and times the sum of the standard deviations.
pub fn relocation_pull(logit: f64, log_scale: [f64; 3], weights: [f64; 2]) -> (f64, [f64; 3]) {
    let opacity = sigmoid(logit);
    (
        weights[0] * opacity * (1.0 - opacity),
        log_scale.map(|s| weights[1] * s.exp()),
    )
}

/// What is added to the mean of Gaussian `i`: `noise` · σ(100 (0.005 - opacity)) · Σ ε.
pub fn relocation_noise(
    quat: [f64; 4],
    log_scale: [f64; 3],
    logit: f64,
    noise: f64,
    seed: u32,
    i: u32,
) -> [f64; 3] {
    let norm = quat.iter().map(|q| q * q).sum::<f64>().sqrt();
    let axes = rotation(quat.map(|q| q / norm));
    let local = apply(&transpose(axes), &normal3(seed, i));
    let scaled = std::array::from_fn(|axis| (2.0 * log_scale[axis]).exp() * local[axis]);
    let stillness = sigmoid(100.0 * (0.005 - sigmoid(logit)));
    apply(&axes, &scaled).map(|v| noise * stillness * v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_normal_and_has_the_gaussians_shape() {
        let spread = [0.5_f64, 0.1, 0.02];
        let count = 20_000;
        let mut squares = [0.0; 3];
        for i in 0..count {
            let moved =
                relocation_noise([1.0, 0.0, 0.0, 0.0], spread.map(f64::ln), -50.0, 1.0, 9, i);
            squares = std::array::from_fn(|axis| squares[axis] + moved[axis] * moved[axis]);
        }
        for axis in 0..3 {
            // Σ ε has standard deviation s², and the faint are moved by σ(0.5) of it.
            let deviation = (squares[axis] / f64::from(count)).sqrt();
            let wanted = spread[axis].powi(2) * sigmoid(0.5);
            assert!(
                (deviation / wanted - 1.0).abs() < 0.03,
                "{axis}: {deviation} {wanted}"
            );
        }
    }

    #[test]
    fn the_opaque_stay() {
        let moved = relocation_noise([1.0, 2.0, 0.0, 0.5], [0.0; 3], 2.0, 1.0, 9, 3);
        assert!(moved.iter().all(|v| v.abs() < 1e-30));
    }
}
