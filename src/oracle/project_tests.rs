//! Tests of the oracle's projection against values worked out by hand and
//! against the numerical Jacobian.

use super::constants::BLUR;
use super::lift;
use super::linear::{apply, dot, rotation, transpose};
use super::numerics::Numerics;
use super::project::{Cull, jacobian_limits, project};
use super::random::oblique_view;
use super::view::View;

fn view() -> View {
    View {
        rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        translation: [0.0; 3],
        fx: 100.0,
        fy: 80.0,
        cx: 24.0,
        cy: 20.0,
        width: 48,
        height: 40,
        near: 0.2,
        antialiased: false,
        numerics: Numerics::DEFAULT,
    }
}

const UNIT: [f64; 4] = [1.0, 0.0, 0.0, 0.0];

#[test]
fn isotropic_gaussian_on_the_axis() {
    let sigma: f64 = 0.05;
    let log_scale = [sigma.ln(); 3];
    let p = project(&[0.0, 0.0, 2.0], &UNIT, &log_scale, 0.0, &view()).unwrap();
    assert_eq!(p.mean2d, [24.0, 20.0]);
    assert!((p.cov2d[0] - (6.25 + BLUR)).abs() < 1e-12);
    assert!((p.cov2d[2] - (4.0 + BLUR)).abs() < 1e-12);
    assert_eq!(p.cov2d[1], 0.0);
    assert!((p.conic[0] * 6.55 - 1.0).abs() < 1e-12);
    assert_eq!(p.opacity, 0.5);
    assert!((p.cutoff - 127.5_f64.ln()).abs() < 1e-12);
}

#[test]
fn quaternion_turns_the_long_axis_from_x_to_y() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let log_scale = [0.2_f64.ln(), 0.01_f64.ln(), 0.01_f64.ln()];
    // A quarter turn about z, at twice the unit length.
    let quat = [2.0 * half, 0.0, 0.0, 2.0 * half];
    let p = project(&[0.0, 0.0, 2.0], &quat, &log_scale, 0.0, &view()).unwrap();
    assert!((p.cov2d[0] - (0.25 + BLUR)).abs() < 1e-12);
    assert!((p.cov2d[2] - (64.0 + BLUR)).abs() < 1e-12);
}

/// J by dual numbers, Σ entry by entry: neither is how `project` does it.
#[test]
fn covariance_is_that_of_the_linearized_projection() {
    let view = oblique_view();
    let (quat, log_scale) = ([0.7, -0.2, 0.5, 0.9], [-2.0, -3.5, -2.6_f64]);
    let center = view.center();
    let offset = apply(&transpose(view.rotation), &[0.4, -0.3, 2.0]);
    let mean = [0, 1, 2].map(|k| center[k] + offset[k]);
    let p = project(&mean, &quat, &log_scale, 0.0, &view).unwrap();

    let axes = rotation(quat.map(|q| q / dot(&quat, &quat).sqrt()));
    let jacobian = [0, 1, 2].map(|k| {
        let mut varied = mean.map(lift);
        varied[k].eps = 1.0;
        let constants = (quat.map(lift), log_scale.map(lift));
        let p = project(&varied, &constants.0, &constants.1, lift(0.0), &view);
        p.unwrap().mean2d.map(|m| m.eps)
    });
    let mut cov2d = [BLUR, 0.0, BLUR];
    for i in 0..3 {
        for j in 0..3 {
            let entry: f64 = (0..3)
                .map(|a| axes[i][a] * axes[j][a] * (2.0 * log_scale[a]).exp())
                .sum();
            for (sum, (u, v)) in cov2d.iter_mut().zip([(0, 0), (0, 1), (1, 1)]) {
                *sum += jacobian[i][u] * entry * jacobian[j][v];
            }
        }
    }
    // The view's rotation is rounded to f32 and nowhere inverted but here.
    for (actual, expected) in p.cov2d.iter().zip(cov2d) {
        assert!((actual - expected).abs() < 1e-9, "{actual} or {expected}");
    }
    assert!(p.cov2d[1].abs() > 0.1, "a case with a cross term");
    let [[xx, xy, yy], [a, b, c]] = [p.cov2d, p.conic];
    assert!((a * xx + b * xy - 1.0).abs() < 1e-12);
    assert!((a * xy + b * yy).abs() < 1e-12);
    assert!((b * xy + c * yy - 1.0).abs() < 1e-12);
}

#[test]
fn every_reason_to_cull() {
    let small = [0.01_f64.ln(); 3];
    let cull = |mean: [f64; 3], quat: [f64; 4], scale: [f64; 3], logit: f64| {
        project(&mean, &quat, &scale, logit, &view()).unwrap_err()
    };
    let front = [0.0, 0.0, 2.0];
    assert_eq!(
        cull([f64::NAN, 0.0, 2.0], UNIT, small, 0.0),
        Cull::NonFinite
    );
    assert_eq!(cull(front, UNIT, small, f64::INFINITY), Cull::NonFinite);
    assert_eq!(cull([0.0, 0.0, 0.2], UNIT, small, 0.0), Cull::Near);
    assert_eq!(cull([0.0, 0.0, -2.0], UNIT, small, 0.0), Cull::Near);
    assert_eq!(cull(front, [0.0; 4], small, 0.0), Cull::Quaternion);
    assert_eq!(
        cull(front, [1e-4, 0.0, 0.0, 0.0], small, 0.0),
        Cull::Quaternion
    );
    assert_eq!(cull(front, UNIT, [800.0; 3], 0.0), Cull::Covariance);
    assert_eq!(cull(front, UNIT, small, -5.6), Cull::Opacity);
    assert_eq!(cull([2.0, 0.0, 2.0], UNIT, small, 0.0), Cull::Outside);
}

#[test]
fn jacobian_is_held_beyond_the_margin() {
    let log_scale = [0.5_f64.ln(); 3];
    let limit = jacobian_limits(&view())[0][1];
    assert!((limit - (24.0 / 100.0 + 0.3 * 0.24)).abs() < 1e-15);
    let p = project(&[2.0, 0.0, 2.0], &UNIT, &log_scale, 3.0, &view()).unwrap();
    // J = (fx/z)·[1, 0, -limit], so the variance is (50·0.5)²·(1 + limit²).
    let expected = 625.0 * (1.0 + limit * limit) + BLUR;
    assert!((p.cov2d[0] - expected).abs() < 1e-9);
    assert_eq!(p.mean2d[0], 124.0, "the mean itself is not clamped");
}

#[test]
fn quarter_turns_are_right_handed() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    for axis in 0..3 {
        let mut quat = [half, 0.0, 0.0, 0.0];
        quat[axis + 1] = half;
        let turn = rotation(quat);
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        assert!((turn[axis][axis] - 1.0).abs() < 1e-15);
        assert!((turn[last][next] - 1.0).abs() < 1e-15, "axis {axis}");
        assert!((turn[next][last] + 1.0).abs() < 1e-15, "axis {axis}");
    }
}

#[test]
fn limits_follow_the_principal_point() {
    let off_center = View {
        cx: 10.0,
        cy: 30.0,
        ..view()
    };
    let [[left, right], [top, bottom]] = jacobian_limits(&off_center);
    for (actual, expected) in [
        (left, -0.10 - 0.3 * 0.24),
        (right, 0.38 + 0.3 * 0.24),
        (top, -0.375 - 0.3 * 0.25),
        (bottom, 0.125 + 0.3 * 0.25),
    ] {
        assert!((actual - expected).abs() < 1e-15, "{actual} or {expected}");
    }
}
