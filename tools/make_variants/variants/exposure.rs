//! Photos each exposed in its own way.

use super::resample::byte;
use super::scene::Scene;

/// Gains on encoded values lie between this and its inverse: half a stop either way, in
/// linear light about 1.8.
const LARGEST_GAIN: f64 = 1.3;

/// Offsets of encoded values in [0, 1] lie between this and its negative.
const LARGEST_OFFSET: f64 = 0.04;

/// Gives every training photo a gain and an offset, `share` of the largest ones. They
/// are spread evenly and dealt by chance, so that they cancel over the scene and the
/// clean held-out photos are its mean exposure.
pub fn vary(scene: &mut Scene, share: f64, seed: u64) -> String {
    let mut random = super::random(seed, 0);
    let count = scene.training().count();
    let [gains, offsets] = [(); 2].map(|()| {
        let mut even: Vec<f64> = (0..count)
            .map(|k| share * (2.0 * k as f64 / (count.max(2) - 1) as f64 - 1.0))
            .collect();
        random.shuffle(&mut even);
        even
    });
    for ((_, view), (gain, offset)) in scene.training().zip(gains.into_iter().zip(offsets)) {
        let (gain, offset) = (LARGEST_GAIN.powf(gain), 255.0 * LARGEST_OFFSET * offset);
        for value in view.picture.iter_mut() {
            *value = byte(gain * f64::from(*value) + offset);
        }
    }
    let (gain, offset) = (LARGEST_GAIN.powf(share), LARGEST_OFFSET * share);
    format!(
        "gains {:.4} to {gain:.4}, offsets up to {offset:.4}, held-out photos as they were",
        gain.recip()
    )
}
