//! Kernels broken on purpose: the cases notice each.

use std::sync::Arc;

use gs_chroma::{
    low_level::doctor::{cases::CASES, examine, kernels::TOPICS},
    raster::Raster,
};

use crate::gpu;

/// Those of the cases that fail when `kernel` is compiled with `from` replaced by `to`.
fn failing(
    cases: &[&'static str],
    kernel: &'static str,
    from: &'static str,
    to: &'static str,
) -> Vec<&'static str> {
    let raster = Arc::new(Raster::new(&gpu().with_broken(kernel, from, to)));
    let fails = |name: &&str| {
        let case = CASES.iter().find(|case| case.name == *name).expect(name);
        examine(&raster, case).unwrap().failure.is_some()
    };
    cases.iter().copied().filter(fails).collect()
}

const ORDINARY: &str = "ordinary scene";

#[test]
fn a_wrong_sign_is_noticed() {
    let failing = failing(
        &[ORDINARY],
        "project_backward",
        "let v_r2 = -(",
        "let v_r2 = (",
    );
    assert_eq!(failing, [ORDINARY]);
}

#[test]
fn a_missing_factor_is_noticed() {
    let failing = failing(&[ORDINARY], "sum_instances", "0.5 * m[3]", "m[3]");
    assert_eq!(failing, [ORDINARY]);
}

/// Records that are loaded together: of a Gaussian that has many.
#[test]
fn a_record_that_counts_twice_is_noticed() {
    let many = "over 42 tiles";
    let failing = failing(&[many], "sum_instances", "third + fourth", "third + third");
    assert_eq!(failing, [many]);
}

/// Nothing but the poisoned case can tell: a clamp makes a number of NaN.
#[test]
fn a_clamp_that_swallows_nan_is_noticed() {
    let poisoned = "opacity is not a number";
    let failing = failing(
        &[poisoned, ORDINARY],
        "project",
        "let logit = plane(PLANE_OPACITY, i);",
        "let logit = clamp(plane(PLANE_OPACITY, i), -30.0, 30.0);",
    );
    assert_eq!(failing, [poisoned]);
}

#[test]
fn a_higher_cap_on_alpha_is_noticed() {
    let saturated = "opacity saturates";
    let failing = failing(
        &[saturated],
        "blend",
        "const ALPHA_MAX: f32 = 0.99;",
        "const ALPHA_MAX: f32 = 0.999;",
    );
    assert_eq!(failing, [saturated]);
}

#[test]
fn a_jacobian_without_its_clamp_is_noticed() {
    let beside = "far beside the image";
    let failing = failing(
        &[beside],
        "project",
        "clamp(f.camera.xy / f.camera.z, view.slope_limits.xy, view.slope_limits.zw)",
        "f.camera.xy / f.camera.z",
    );
    assert_eq!(failing, [beside]);
}

#[test]
fn an_opacity_that_stays_is_noticed() {
    let failing = failing(
        &["antialiased", ORDINARY],
        "project",
        "sigmoid(logit) * compensation(f, determinant)",
        "sigmoid(logit)",
    );
    assert_eq!(failing, ["antialiased"]);
}

#[test]
fn a_compensation_without_its_gradient_is_noticed() {
    let failing = failing(
        &["antialiased", ORDINARY],
        "project_backward",
        "v_row_x += share * cross(f.row_y, normal);",
        "",
    );
    assert_eq!(failing, ["antialiased"]);
}

#[test]
fn a_depth_of_the_next_gaussian_is_noticed() {
    assert_noticed(&[[
        "blend",
        "blend",
        "(next <= -color)",
        "(transmittance <= -color)",
    ]]);
}

#[test]
fn an_untouched_kernel_is_not() {
    let cases = [
        "antialiased",
        "over 42 tiles",
        "far beside the image",
        ORDINARY,
    ];
    assert_eq!(failing(&cases, "project", "no such line", ""), [""; 0]);
}

/// Kernels that no case runs are measured on random inputs: each of these, as a topic of the
/// doctor, a kernel for processors or for GPUs, and what is replaced in it.
fn assert_noticed(broken: &[[&'static str; 4]]) {
    for &[topic, kernel, from, to] in broken {
        let (_, measure) = (TOPICS.iter().find(|(name, _)| *name == topic)).expect(topic);
        let noticed = [true, false].into_iter().any(|simd| {
            let gpu = gpu().with_broken(kernel, from, to).with_simd(simd);
            let rows = measure(&Arc::new(Raster::new(&gpu))).unwrap();
            rows.iter().any(|row| !row.failures.is_empty())
        });
        assert!(noticed, "{kernel}: {from}");
    }
}

#[test]
fn broken_losses_of_luma_are_noticed() {
    assert_noticed(&[
        [
            "losses",
            "luma_loss",
            "by_square[p] = square",
            "by_square[p] = 0.5 * square",
        ],
        [
            "losses",
            "luma_loss_backward",
            "2.0 * x * square[k]",
            "x * square[k]",
        ],
        // The exposed and the masked variant.
        [
            "losses",
            "luma_loss_backward",
            "select(parameters.gain, 0.0,",
            "select(1.0, 0.0,",
        ],
        [
            "losses",
            "luma_loss",
            "let w = weight(p)",
            "let w = sqrt(weight(p))",
        ],
        ["losses", "luma_loss", "0.27068214949642655", "0.28"],
    ]);
}

#[test]
fn broken_losses_of_color_are_noticed() {
    assert_noticed(&[
        [
            "chroma loss",
            "chroma_loss",
            "weight *= weights.teacher",
            "weight *= 1.0",
        ],
        [
            "chroma loss",
            "chroma_loss",
            "exp(-decline * (length - SMOOTHING))",
            "exp(decline * (length - SMOOTHING))",
        ],
        [
            "chroma loss",
            "chroma_loss",
            "weights.joint != 0u",
            "weights.joint == 2u",
        ],
        [
            "chroma loss",
            "chroma_loss",
            "scale * vec4f(gradient, curvature)",
            "scale * vec4f(gradient, -curvature)",
        ],
        [
            "chroma loss",
            "chroma_loss",
            "let painted = weight > 1.0",
            "let painted = weight > 100.0",
        ],
        [
            "rgb loss",
            "rgb_loss",
            "min(difference, vec3f(0.0))",
            "difference",
        ],
        [
            "rgb loss",
            "rgb_loss",
            "vec4f(residual, UNITS)",
            "vec4f(residual, 1.0)",
        ],
        ["lab loss", "lab_loss", "at.x > 0u", "at.x > 1u"],
        ["lab loss", "lab_loss", "((1u << scale) - side) / 2u", "0u"],
        [
            "lab loss",
            "lab_loss",
            "min(weight, weight_of(q))",
            "weight",
        ],
        ["lab loss", "lab_loss", "2.0 * residual.x", "residual.x"],
        ["chroma loss", "sum_loss", "k += 256u", "k += 512u"],
    ]);
}

#[test]
fn a_broken_solver_is_noticed() {
    assert_noticed(&[
        [
            "lbfgs",
            "lbfgs_ridge",
            "gradient[k] += ridge * x",
            "gradient[k] -= ridge * x",
        ],
        [
            "lbfgs",
            "lbfgs_begin",
            "select(parameters.rest, 1.0",
            "select(1.0, 1.0",
        ],
        ["lbfgs held", "lbfgs_ridge", "pull * off;", "-pull * off;"],
        [
            "lbfgs held",
            "lbfgs_begin",
            " + pulls[own]",
            " + 3.0 * pulls[own]",
        ],
        [
            "lbfgs held",
            "lbfgs_anchor",
            "anchors[k] = accepted_unknowns[k]",
            "anchors[k] = 0.5 * accepted_unknowns[k]",
        ],
        [
            "lbfgs judged",
            "lbfgs_judge",
            "loss <= scalars[LOSS] * (1.0 + TOLERANCE)",
            "true",
        ],
        [
            "lbfgs judged",
            "lbfgs_judge",
            "-0.5 * slope / bend",
            "-0.4 * slope / bend",
        ],
        [
            "lbfgs judged",
            "lbfgs_slope",
            "scalars[SLOPE] = -sum",
            "scalars[SLOPE] = sum",
        ],
        [
            "lbfgs judged",
            "lbfgs_moved",
            "k < parameters.constants",
            "true",
        ],
        ["lbfgs judged", "lbfgs_mean", "moved / weight", "moved"],
        ["lbfgs judged", "lbfgs_judge", "i += 256u", "i += 512u"],
        [
            "lbfgs held",
            "lbfgs_begin",
            "unknowns[k] <= floors[k] && gradient[k] >= 0.0",
            "unknowns[k] <= floors[k]",
        ],
        ["lbfgs", "lbfgs_scale", "curvature / sum", "sum / curvature"],
        [
            "lbfgs",
            "lbfgs_beta",
            "scalars[ALPHA + pair] - scalars[RHO + pair] * sum",
            "scalars[ALPHA + pair] + scalars[RHO + pair] * sum",
        ],
        ["lbfgs", "lbfgs_alpha", "block += 256u", "block += 512u"],
        [
            "lbfgs",
            "lbfgs_step",
            "max(unknowns[k] - scalars[LENGTH] * direction[k], floors[k])",
            "min(unknowns[k] - scalars[LENGTH] * direction[k], floors[k])",
        ],
    ]);
}

#[test]
fn broken_view_corrections_are_noticed() {
    assert_noticed(&[
        [
            "view correction",
            "view_correction",
            "corrections[v].offset - center.offset",
            "corrections[v].offset",
        ],
        [
            "view correction",
            "view_correction",
            "v += 256u",
            "v += 1024u",
        ],
        [
            "view correction",
            "view_correction",
            "max(distance_of(own, center), NEAR)",
            "NEAR",
        ],
        [
            "view correction",
            "view_correction_sums",
            "pixel_weights[p] > 1.0 ||",
            "pixel_weights[p] > 100.0 ||",
        ],
        [
            "view correction",
            "view_correction_sums",
            "all(x == vec2f())",
            "all(x == vec2f(1.0))",
        ],
    ]);
}

#[test]
fn broken_gradients_and_steps_are_noticed() {
    assert_noticed(&[
        [
            "adjoint",
            "shade_backward",
            "SH_C0 * gradients",
            "gradients",
        ],
        ["adam", "adam", "sqrt(v * correction.y)", "sqrt(v)"],
        [
            "adjoint",
            "shade_backward",
            "sh_gradient[at] += value.x",
            "sh_gradient[at] = value.x",
        ],
        [
            "step",
            "shade_backward",
            "sqrt(v * correction.y)",
            "sqrt(v)",
        ],
        [
            "step",
            "project_backward",
            "if ranks[i] == INVISIBLE {\n            return;",
            "if ranks[i] != INVISIBLE {\n            return;",
        ],
        [
            "numerics",
            "blend_backward",
            "bits + 32767u + ((bits >> 16u) & 1u)",
            "bits",
        ],
        [
            "numerics",
            "sum_instances",
            "sum[2u * c + 1u] += one.y",
            "sum[2u * c + 1u] += one.x",
        ],
        ["densify", "densify_geometry", "exp(log_scale)", "log_scale"],
    ]);
}

#[test]
fn broken_scans_and_sorts_are_noticed() {
    assert_noticed(&[
        [
            "scan",
            "scan_apply",
            "before += block_sums[block]",
            "before += 2u * block_sums[block]",
        ],
        [
            "scan",
            "scan_sums",
            "conclude(carry);",
            "conclude(carry / 2u);",
        ],
        ["scan", "scan_whole", "lane < local;", "lane + 1u < local;"],
        [
            "sort",
            "sort_scatter",
            "lane_digits[at] = target_index + 1u",
            "lane_digits[at] = target_index",
        ],
        [
            "sort",
            "sort_scatter",
            "bases[local] += total",
            "bases[local] += 0u",
        ],
    ]);
}
