//! Kernels broken on purpose: the cases notice each.

use std::sync::Arc;

use gs_chroma::{
    doctor::{cases::CASES, examine, kernels::TOPICS},
    raster::Raster,
};

use crate::gpu;

/// Cases that fail when `kernel` is compiled with `from` replaced by `to`.
fn failing(kernel: &'static str, from: &'static str, to: &'static str) -> Vec<&'static str> {
    let raster = Arc::new(Raster::new(&gpu().with_broken(kernel, from, to)));
    (CASES.iter())
        .filter(|case| case.name != "65,600 tiles")
        .filter(|case| examine(&raster, case).unwrap().failure.is_some())
        .map(|case| case.name)
        .collect()
}

#[test]
fn a_wrong_sign_is_noticed() {
    let failing = failing("project_backward", "let v_r2 = -(", "let v_r2 = (");
    assert!(failing.contains(&"ordinary scene"), "{failing:?}");
}

#[test]
fn a_missing_factor_is_noticed() {
    let failing = failing("sum_instances", "0.5 * m[3]", "m[3]");
    assert!(failing.contains(&"ordinary scene"), "{failing:?}");
}

/// Records that are loaded together: of a Gaussian that has many.
#[test]
fn a_record_that_counts_twice_is_noticed() {
    let failing = failing("sum_instances", "third + fourth", "third + third");
    assert!(failing.contains(&"over 42 tiles"), "{failing:?}");
}

/// Nothing but the poisoned case can tell: a clamp makes a number of NaN.
#[test]
fn a_clamp_that_swallows_nan_is_noticed() {
    let failing = failing(
        "project",
        "let logit = plane(PLANE_OPACITY, i);",
        "let logit = clamp(plane(PLANE_OPACITY, i), -30.0, 30.0);",
    );
    assert!(failing.contains(&"opacity is not a number"), "{failing:?}");
    assert!(!failing.contains(&"ordinary scene"), "{failing:?}");
}

#[test]
fn a_higher_cap_on_alpha_is_noticed() {
    let failing = failing(
        "blend",
        "const ALPHA_MAX: f32 = 0.99;",
        "const ALPHA_MAX: f32 = 0.999;",
    );
    assert!(failing.contains(&"opacity saturates"), "{failing:?}");
}

#[test]
fn a_jacobian_without_its_clamp_is_noticed() {
    let failing = failing(
        "project",
        "clamp(f.camera.xy / f.camera.z, view.slope_limits.xy, view.slope_limits.zw)",
        "f.camera.xy / f.camera.z",
    );
    assert!(failing.contains(&"far beside the image"), "{failing:?}");
}

#[test]
fn an_opacity_that_stays_is_noticed() {
    let failing = failing(
        "project",
        "sigmoid(logit) * compensation(f, determinant)",
        "sigmoid(logit)",
    );
    assert!(failing.contains(&"antialiased"), "{failing:?}");
    assert!(!failing.contains(&"ordinary scene"), "{failing:?}");
}

#[test]
fn a_compensation_without_its_gradient_is_noticed() {
    let failing = failing(
        "project_backward",
        "v_row_x += share * cross(f.row_y, normal);",
        "",
    );
    assert!(failing.contains(&"antialiased"), "{failing:?}");
    assert!(!failing.contains(&"ordinary scene"), "{failing:?}");
}

#[test]
fn an_untouched_kernel_is_not() {
    assert_eq!(failing("project", "no such line", ""), [""; 0]);
}

/// Kernels that no case runs are measured on random inputs.
#[test]
fn broken_losses_and_steps_are_noticed() {
    for (topic, kernel, from, to) in [
        (
            "losses",
            "luma_loss",
            "by_square[p] = square",
            "by_square[p] = 0.5 * square",
        ),
        (
            "losses",
            "luma_loss_backward",
            "2.0 * x * square[k]",
            "x * square[k]",
        ),
        // The exposed and the masked variant.
        (
            "losses",
            "luma_loss_backward",
            "select(parameters.gain, 0.0,",
            "select(1.0, 0.0,",
        ),
        (
            "losses",
            "luma_loss",
            "let w = weight(p)",
            "let w = sqrt(weight(p))",
        ),
        (
            "chroma loss",
            "chroma_loss",
            "weight *= weights.teacher",
            "weight *= 1.0",
        ),
        (
            "chroma loss",
            "chroma_loss",
            "exp(-decline * (length - SMOOTHING))",
            "exp(decline * (length - SMOOTHING))",
        ),
        (
            "chroma loss",
            "chroma_loss",
            "weights.joint != 0u",
            "weights.joint == 2u",
        ),
        (
            "chroma loss",
            "chroma_loss",
            "scale * vec4f(gradient, curvature)",
            "scale * vec4f(gradient, -curvature)",
        ),
        (
            "chroma loss",
            "chroma_loss",
            "let painted = weight > 1.0",
            "let painted = weight > 100.0",
        ),
        (
            "rgb loss",
            "rgb_loss",
            "min(difference, vec3f(0.0))",
            "difference",
        ),
        (
            "rgb loss",
            "rgb_loss",
            "vec4f(residual, UNITS)",
            "vec4f(residual, 1.0)",
        ),
        ("lab loss", "lab_loss", "if at.x > 0u", "if at.x > 1u"),
        ("lab loss", "lab_loss", "2.0 * residual.x", "residual.x"),
        (
            "adjoint",
            "shade_backward",
            "SH_C0 * gradients",
            "gradients",
        ),
        (
            "lbfgs",
            "lbfgs_ridge",
            "gradient[k] += ridge * x",
            "gradient[k] -= ridge * x",
        ),
        (
            "lbfgs",
            "lbfgs_begin",
            "select(parameters.rest, 1.0",
            "select(1.0, 1.0",
        ),
        ("lbfgs", "lbfgs_ridge", "pull * off;", "-pull * off;"),
        (
            "lbfgs",
            "lbfgs_begin",
            " + pulls[own]",
            " + 3.0 * pulls[own]",
        ),
        (
            "lbfgs",
            "lbfgs_anchor",
            "anchors[k] = accepted_unknowns[k]",
            "anchors[k] = 0.5 * accepted_unknowns[k]",
        ),
        (
            "lbfgs",
            "lbfgs_judge",
            "loss <= scalars[LOSS] * (1.0 + TOLERANCE)",
            "true",
        ),
        (
            "lbfgs",
            "lbfgs_judge",
            "-0.5 * slope / bend",
            "-0.4 * slope / bend",
        ),
        (
            "lbfgs",
            "lbfgs_slope",
            "scalars[SLOPE] = -sum",
            "scalars[SLOPE] = sum",
        ),
        ("lbfgs", "lbfgs_moved", "k < parameters.constants", "true"),
        ("lbfgs", "lbfgs_mean", "moved / weight", "moved"),
        ("lbfgs", "lbfgs_judge", "i += 256u", "i += 512u"),
        (
            "lbfgs",
            "lbfgs_begin",
            "unknowns[k] <= floors[k] && gradient[k] >= 0.0",
            "unknowns[k] <= floors[k]",
        ),
        ("lbfgs", "lbfgs_scale", "curvature / sum", "sum / curvature"),
        (
            "lbfgs",
            "lbfgs_beta",
            "scalars[ALPHA + pair] - scalars[RHO + pair] * sum",
            "scalars[ALPHA + pair] + scalars[RHO + pair] * sum",
        ),
        ("lbfgs", "lbfgs_alpha", "block += 256u", "block += 512u"),
        (
            "lbfgs",
            "lbfgs_step",
            "max(unknowns[k] - scalars[LENGTH] * direction[k], floors[k])",
            "min(unknowns[k] - scalars[LENGTH] * direction[k], floors[k])",
        ),
        (
            "view correction",
            "view_correction",
            "corrections[v].offset - center.offset",
            "corrections[v].offset",
        ),
        (
            "view correction",
            "view_correction",
            "v += 256u",
            "v += 1024u",
        ),
        (
            "view correction",
            "view_correction",
            "max(distance_of(own, center), NEAR)",
            "NEAR",
        ),
        (
            "view correction",
            "view_correction_sums",
            "pixel_weights[p] > 1.0 ||",
            "pixel_weights[p] > 100.0 ||",
        ),
        (
            "view correction",
            "view_correction_sums",
            "all(x == vec2f())",
            "all(x == vec2f(1.0))",
        ),
        ("chroma loss", "sum_loss", "k += 256u", "k += 512u"),
        ("adam", "adam", "sqrt(v * correction.y)", "sqrt(v)"),
        (
            "adjoint",
            "shade_backward",
            "sh_gradient[at] += value.x",
            "sh_gradient[at] = value.x",
        ),
        (
            "step",
            "shade_backward",
            "sqrt(v * correction.y)",
            "sqrt(v)",
        ),
        (
            "step",
            "project_backward",
            "if ranks[i] == INVISIBLE {\n            return;",
            "if ranks[i] != INVISIBLE {\n            return;",
        ),
        (
            "numerics",
            "blend_backward",
            "bits + 32767u + ((bits >> 16u) & 1u)",
            "bits",
        ),
        (
            "numerics",
            "sum_instances",
            "sum[2u * c + 1u] += one.y",
            "sum[2u * c + 1u] += one.x",
        ),
        ("losses", "luma_loss", "0.27068214949642655", "0.28"),
        ("densify", "densify_geometry", "exp(log_scale)", "log_scale"),
        (
            "scan",
            "scan_apply",
            "before += block_sums[block]",
            "before += 2u * block_sums[block]",
        ),
        (
            "sort",
            "sort_scatter",
            "bases[local] += total",
            "bases[local] += 0u",
        ),
    ] {
        let raster = Arc::new(Raster::new(&gpu().with_broken(kernel, from, to)));
        let (_, measure) = (TOPICS.iter().find(|(name, _)| *name == topic)).expect(topic);
        let rows = measure(&raster).unwrap();
        let noticed = rows.iter().any(|row| !row.failures.is_empty());
        assert!(noticed, "{kernel}: {from}");
    }
}
