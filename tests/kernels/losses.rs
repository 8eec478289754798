//! `chroma_loss` at its kink and far from it.

use gs_chroma::{chroma::ChromaLossWeights, doctor::kernels::chroma_loss_on};

use crate::{harness::gpu, oracle::chroma_loss::chroma_loss};

/// Where the teacher is met there is no slope, far from it the slope of L1.
#[test]
fn chroma_slopes_at_rest_and_far_away() {
    let size = [9, 5];
    let weights = ChromaLossWeights {
        coarser_size: [5, 3],
        teacher: 1.0,
        agreement: 0.0,
    };
    let coarser = vec![[0.0; 2]; 15];
    for (away, slope) in [(0.0, 0.0), (300.0, 1.0), (-1e6, -1.0)] {
        let wanted = vec![[12.5, -30.0]; 45];
        let image = vec![[12.5 + away, -30.0]; 45];
        let (loss, gradient) =
            chroma_loss_on(gpu(), size, [&image, &wanted, &coarser], &weights).unwrap();
        assert!(
            (loss - chroma_loss(&image, &wanted)).abs() <= 1e-6 * loss,
            "{loss}"
        );
        for pair in gradient.chunks_exact(2) {
            // The mean over pixels and both channels.
            assert!((f64::from(pair[0]) * 90.0 - slope).abs() < 1e-5, "{pair:?}");
            assert_eq!(pair[1], 0.0);
        }
    }
}
