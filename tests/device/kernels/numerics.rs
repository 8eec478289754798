//! Kernels that compute less accurately, on the hard cases.

use gs_chroma::{
    low_level::doctor::{cases::CASES, examine_with, kernels::numerics::CUTS, stage::cutting},
    luma::Numerics,
    raster::{RasterNumerics, Storage},
};

use crate::kernels::{harness::raster, oracle::numerics};

/// A case that takes seconds.
const SLOW: &str = "65,600 tiles";

/// The picture and the gradient are as close to the oracle that leaves out the same as
/// they are without it, or nearly: what more is shown has more to err in. Each cut-off has its
/// share of the cases.
#[test]
fn hard_cases_hold_with_other_cut_offs() {
    const SLACK: f64 = 4.0;
    for (number, cut) in CUTS.into_iter().enumerate() {
        let raster = cutting(&raster(), &cut);
        let share = CASES.iter().skip(number).step_by(CUTS.len());
        for case in share.filter(|case| case.name != SLOW) {
            let verdict = examine_with(&raster, case, cut).unwrap();
            let name = format!("{} with {cut:?}", case.name);
            println!("{name}: {:?}", verdict.failure);
            assert!(
                verdict.picture_error <= SLACK * verdict.picture_bound,
                "{name}: {verdict:?}"
            );
            assert!(
                verdict.gradient_error <= SLACK * verdict.gradient_bound,
                "{name}: {verdict:?}"
            );
        }
    }
}

/// Seven bits of fraction, whatever the range of the gradient.
#[test]
fn hard_cases_hold_with_records_at_half_the_size() {
    let half = raster().computing(RasterNumerics {
        storage: Storage::Half,
        ..RasterNumerics::DEFAULT
    });
    for case in CASES.iter().filter(|case| case.name != SLOW) {
        let verdict = examine_with(&half, case, numerics::Numerics::DEFAULT).unwrap();
        println!("{}: {:.1e}", case.name, verdict.gradient_error);
        assert!(
            verdict.picture_error <= verdict.picture_bound,
            "{verdict:?}"
        );
        // A record's error is at most 2⁻⁸ of it, but records may cancel: by far the most
        // in "needle across the pixels", where 0.18 was seen.
        assert!(verdict.gradient_error <= 0.2, "{verdict:?}");
    }
}

/// Default cut-offs are the oracle's.
#[test]
fn defaults_are_those_of_the_oracle() {
    let (own, oracle) = (Numerics::default().raster, numerics::Numerics::DEFAULT);
    assert_eq!(own.alpha_min, oracle.alpha_min);
    assert_eq!(own.transmittance_min, oracle.transmittance_min);
    assert_eq!(own.depth_bits, oracle.depth_bits);
    assert_eq!(raster().numerics(), RasterNumerics::DEFAULT);
}
