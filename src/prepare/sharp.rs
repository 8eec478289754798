//! Choice of the frames for COLMAP: the sharpest of each time step.

use std::path::Path;

use crate::{
    capture::{CaptureError, Normalize, downscale, plain_photo},
    measure::{laplacian, variance},
};

/// As many frames as poses are found well from, unless the user asks for others: enough for
/// neighbors to overlap, few enough to match on a processor.
const FEWEST: f64 = 30.0;
const MOST: f64 = 120.0;

/// Frames a second that serve a camera that walks.
const USUAL: f64 = 2.0;

/// Sharpness is judged at this longer side at most: grain is finer.
const SIDE: u32 = 960;

/// Frames a second to take of a shot of so many seconds.
pub(super) fn usual_rate(seconds: f64) -> f64 {
    (USUAL * seconds).clamp(FEWEST, MOST) / seconds
}

/// The sharpest frame of each time step; of `frames_a_second` as many as `per_second`. The
/// frames' places, in order.
pub(super) fn sharpest(sharpness: &[f64], frames_a_second: f64, per_second: f64) -> Vec<usize> {
    if per_second >= frames_a_second {
        return (0..sharpness.len()).collect();
    }
    let step = |frame: usize| (frame as f64 * per_second / frames_a_second).floor() as usize;
    let frames: Vec<usize> = (0..sharpness.len()).collect();
    frames
        .chunk_by(|&a, &b| step(a) == step(b))
        .filter_map(|frames| {
            // Of several as sharp the first.
            let sharper =
                |a: &usize, b: &usize| sharpness[*a].total_cmp(&sharpness[*b]).then(b.cmp(a));
            frames.iter().copied().max_by(sharper)
        })
        .collect()
}

/// Sharpness of a frame, comparable among frames of similar content: variance of the Laplacian.
///
/// # Errors
/// If it cannot be read.
pub(super) fn sharpness(frame: &Path) -> Result<f64, CaptureError> {
    let photo = plain_photo(frame, Normalize::Off)?;
    let size = [photo.width, photo.height];
    let longer = size[0].max(size[1]).max(1);
    let to = size.map(|side| match longer > SIDE {
        true => (side as usize * SIDE as usize / longer as usize).max(1),
        false => side as usize,
    });
    let from = size.map(|side| side as usize);
    let gray = downscale(photo.gray.as_chunks::<1>().0, from, to);
    let gray: Vec<f32> = gray.iter().map(|&[v]| f32::from(v) / 255.0).collect();
    Ok(variance(&laplacian(to[0], to[1], &gray)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sharpest_of_each_step() {
        let sharpness = [1.0, 3.0, 2.0, 5.0, 5.0, 4.0, 0.5];
        assert_eq!(sharpest(&sharpness, 24.0, 8.0), [1, 3, 6]);
        assert_eq!(sharpest(&sharpness, 24.0, 24.0), [0, 1, 2, 3, 4, 5, 6]);
        assert_eq!(sharpest(&sharpness, 24.0, 0.1), [3]);
        // A step need not be a whole number of frames.
        assert_eq!(sharpest(&[0.0; 10], 25.0, 10.0), [0, 3, 5, 8]);
        assert_eq!(sharpest(&[], 24.0, 2.0), [0; 0]);
    }

    #[test]
    fn thirty_to_a_hundred_and_twenty_frames() {
        for (seconds, frames) in [(0.8, 30.0), (10.0, 30.0), (20.0, 40.0), (300.0, 120.0)] {
            assert!((usual_rate(seconds) * seconds - frames).abs() < 1e-9);
        }
    }

    #[test]
    fn a_blurred_picture_is_less_sharp() {
        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, blur: u32| {
            let path = dir.path().join(name);
            let shade = |x, y| {
                image::Luma([(127.0 + 100.0 * (f64::from(x * y) / f64::from(blur)).sin()) as u8])
            };
            image::GrayImage::from_fn(1200, 20, shade)
                .save(&path)
                .unwrap();
            sharpness(&path).unwrap()
        };
        assert!(write("sharp.png", 900) > 2.0 * write("soft.png", 9000));
    }
}
