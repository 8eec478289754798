//! `chroma_loss` at its kink and far from it.

use gs_chroma::{
    chroma::{ChromaLossWeights, Correction},
    low_level::doctor::kernels::ChromaInput,
};

use crate::kernels::{harness::gpu, oracle::chroma_loss::chroma_loss};

const SIZE: [usize; 2] = [9, 5];
const WANTED: [[f64; 2]; 45] = [[12.5, -30.0]; 45];

fn input<'a>(image: &'a [[f64; 2]], weights: ChromaLossWeights) -> ChromaInput<'a> {
    ChromaInput {
        size: SIZE,
        image,
        wanted: &WANTED,
        coarser: &[[0.0; 2]; 15],
        pixel_weights: &[0.0],
        corrections: &[Correction::NONE],
        weights: ChromaLossWeights {
            coarser_size: [5, 3],
            teacher: 1.0,
            ..weights
        },
    }
}

/// The slope is 0 at the teacher's colors, and that of L1 far from them.
#[test]
fn chroma_slopes_at_rest_and_far_away() {
    for (away, slope) in [(0.0, 0.0), (300.0, 1.0), (-1e6, -1.0)] {
        let image = [[12.5 + away, -30.0]; 45];
        let plain = input(&image, ChromaLossWeights::default());
        let output = plain.run(gpu()).unwrap();
        let loss = output.loss;
        assert!(
            (loss - chroma_loss(&image, &WANTED)).abs() <= 1e-6 * loss,
            "{loss}"
        );
        for pair in output.gradient.chunks_exact(2) {
            // The mean over pixels and both channels.
            assert!((f64::from(pair[0]) * 90.0 - slope).abs() < 1e-5, "{pair:?}");
            assert_eq!(pair[1], 0.0);
        }
    }
}

/// A loss that declines does not count what is plainly wrong, unless it was painted.
#[test]
fn what_is_plainly_wrong_has_no_slope() {
    let image = [[12.5 + 1e5, -30.0]; 45];
    let declining = ChromaLossWeights {
        decline: 0.1,
        ..ChromaLossWeights::default()
    };
    let output = input(&image, declining).run(gpu()).unwrap();
    // One channel of two at the level of 1 / 0.1.
    assert!((output.loss - 5.0).abs() < 1e-5, "{}", output.loss);
    assert!(output.gradient.iter().all(|&slope| slope == 0.0));
    for pair in output.curvatures.chunks_exact(2) {
        assert_eq!(pair[0], 0.0);
        assert!((f64::from(pair[1]) * 90.0 - 2.0).abs() < 1e-5, "{pair:?}");
    }
    // Judged together, the channel that happens to be right is not believed either.
    let joint = ChromaLossWeights {
        joint: 1,
        ..declining
    };
    let output = input(&image, joint).run(gpu()).unwrap();
    assert!((output.loss - 5.0).abs() < 1e-5, "{}", output.loss);
    assert!(output.curvatures.iter().all(|&curvature| curvature == 0.0));
    let painted = ChromaInput {
        pixel_weights: &[50.0; 45],
        ..input(
            &image,
            ChromaLossWeights {
                weighted: 1,
                ..declining
            },
        )
    };
    let output = painted.run(gpu()).unwrap();
    for pair in output.gradient.chunks_exact(2) {
        assert!((f64::from(pair[0]) * 90.0 - 50.0).abs() < 1e-3, "{pair:?}");
    }
}
