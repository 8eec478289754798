//! Reasons why operations that could overflow or divide by zero stay finite.

/// `(function, expression, what keeps it finite)`.
pub const REASONS: &[(&str, &str, &str)] = &[
    (
        "accumulate",
        "behind / (1.0 - alpha)",
        "ALPHA_MAX keeps 1 - alpha at 0.01 or more",
    ),
    (
        "accumulate",
        "sqrt",
        "of a sum of squares; sizes and conics are finite",
    ),
    (
        "adam_step",
        "rate * (m * correction.x) / (sqrt(v * correction.y) + EPSILON)",
        "EPSILON is added to the root",
    ),
    (
        "adam_step",
        "sqrt",
        "of a mean of squares times a positive correction",
    ),
    (
        "chroma_loss",
        "0.5 / f32(pixels)",
        "the kernel runs for images of at least one pixel",
    ),
    (
        "compensation",
        "length(cross(f.row_x, f.row_y)) / sqrt(determinant)",
        "project culls determinants that are not positive and finite before it asks",
    ),
    (
        "compensation",
        "sqrt",
        "project culls determinants that are not positive and finite before it asks",
    ),
    (
        "densify_geometry",
        "inverseSqrt",
        "only visible Gaussians are split; they passed QUAT_NORM_MIN_SQ",
    ),
    (
        "end",
        "color / pixels.transmittance[row]",
        "no Gaussian is used that leaves less than TRANSMITTANCE_MIN",
    ),
    (
        "footprint",
        "f.camera.xy / f.camera.z",
        "project culls what is not beyond the near plane before it uses the result",
    ),
    (
        "footprint",
        "view.intrinsics.xy / f.camera.z",
        "project culls what is not beyond the near plane before it uses the result",
    ),
    (
        "inverse_diagonal",
        "1.0 / (penalty_factor(k) * free + pulls[own])",
        "the ridge is positive, sums of weights and shares of them are not negative",
    ),
    (
        "lbfgs_judge",
        "-0.5 * slope / bend",
        "chosen where the slope falls and the loss rises, so that the bend is positive",
    ),
    (
        "lbfgs_mean",
        "parameters.color * moved / weight",
        "chosen where the weight is positive",
    ),
    (
        "lbfgs_scale",
        "1.0 / curvature",
        "in the branch where it is above a share of a positive sum",
    ),
    (
        "lbfgs_scale",
        "curvature / sum",
        "in the branch where the divisor is positive",
    ),
    (
        "least_power",
        "-conic.y * nearest.x / conic.z",
        "project culls conics whose diagonal is not positive",
    ),
    (
        "least_power",
        "-conic.y * nearest.y / conic.x",
        "project culls conics whose diagonal is not positive",
    ),
    (
        "luma_loss",
        "-ssim / d",
        "SSIM_C2 is added to a variance, rounding stays far below it",
    ),
    (
        "luma_loss",
        "2.0 * a / (c * d)",
        "SSIM_C1 and SSIM_C2 are added to squares and variances",
    ),
    (
        "luma_loss",
        "2.0 * mu_x * ssim / c",
        "SSIM_C1 is added to a sum of squares",
    ),
    (
        "luma_loss",
        "2.0 * mu_y * b / (c * d)",
        "SSIM_C1 and SSIM_C2 are added to squares and variances",
    ),
    (
        "luma_loss",
        "a * b / (c * d)",
        "SSIM_C1 and SSIM_C2 are added to squares and variances",
    ),
    (
        "luma_loss_backward",
        "slope(p) * (L1_WEIGHT * sign(x - y) - SSIM_WEIGHT * ssim_gradient) / pixels",
        "the kernel runs for images of at least one pixel",
    ),
    (
        "penalty",
        "share * (1.0 - kept) / decline",
        "in the branch where decline is positive; kept is at most 1",
    ),
    (
        "luma_loss_backward",
        "slope(p) * w * (L1_WEIGHT * sign(x - y) - SSIM_WEIGHT * ssim_gradient) / pixels",
        "the kernel runs for images of at least one pixel",
    ),
    (
        "weight",
        "f32((mask[p / 4u] >> (8u * (p % 4u))) & 255u) / 255.0",
        "a constant divisor",
    ),
    ("penalty", "1.0 / length", "a length is at least SMOOTHING"),
    ("penalty", "kept / length", "a length is at least SMOOTHING"),
    ("penalty", "sqrt", "SMOOTHING² is added to a square"),
    (
        "photo_at",
        "f32((photo[p / 4u] >> (8u * (p % 4u))) & 255u) / 255.0",
        "a constant divisor",
    ),
    (
        "power_cutoff",
        "log",
        "project culls opacities below ALPHA_MIN before it asks",
    ),
    (
        "power_cutoff",
        "opacity / ALPHA_MIN",
        "a divisor that the host keeps above 0",
    ),
    (
        "project",
        "inverseSqrt",
        "guarded by QUAT_NORM_MIN_SQ in the branch above",
    ),
    (
        "project",
        "sqrt",
        "of a maximum with 0 times a variance of at least BLUR",
    ),
    (
        "project",
        "vec3f(f.covariance.z, -f.covariance.y, f.covariance.x) / determinant",
        "the next branch culls determinants that are not positive and finite",
    ),
    (
        "project",
        "view.intrinsics.xy * f.camera.xy / f.camera.z",
        "culled above unless beyond the near plane",
    ),
    (
        "project_backward",
        "1.0 / f.camera.z",
        "visible Gaussians lie beyond the near plane",
    ),
    (
        "project_backward",
        "v_log_opacity / dot(normal, normal)",
        "visible Gaussians show ALPHA_MIN, so the root of this is ALPHA_MIN √det Σ or more",
    ),
    (
        "project_backward",
        "inverseSqrt",
        "visible Gaussians passed QUAT_NORM_MIN_SQ",
    ),
    (
        "shade",
        "normalize",
        "visible Gaussians lie beyond the near plane, off the camera",
    ),
    (
        "shade_backward",
        "(v_direction - direction * dot(direction, v_direction)) / distance",
        "visible Gaussians lie beyond the near plane, off the camera",
    ),
    (
        "shade_backward",
        "offset / distance",
        "visible Gaussians lie beyond the near plane, off the camera",
    ),
    (
        "sigmoid",
        "1.0 / (1.0 + exp(-x))",
        "1 is added to a positive number; infinity gives 0",
    ),
    (
        "sum_instances",
        "-m[0] / max(q.w, ALPHA_MIN)",
        "the divisor is at least ALPHA_MIN",
    ),
    (
        "sum_instances",
        "m[PARTIAL_OPACITY] / max(q.w, ALPHA_MIN)",
        "the divisor is at least ALPHA_MIN",
    ),
    (
        "rgb_loss",
        "0.5 / f32(pixels)",
        "the kernel runs for images of at least one pixel",
    ),
    ("rgb_loss", "sqrt", "SMOOTHING² is added to a square"),
    (
        "rgb_loss",
        "weight / length",
        "a length is at least SMOOTHING",
    ),
    (
        "distance_of",
        "r / length",
        "a length is at least its smoothing",
    ),
    (
        "distance_of",
        "sqrt",
        "the square of the smoothing is added to a square",
    ),
    (
        "lab_loss",
        "part.value / f32(parameters.pooled + 1u)",
        "there is one scale at least",
    ),
    (
        "lab_loss",
        "part.gradient / f32(parameters.pooled + 1u)",
        "there is one scale at least",
    ),
    (
        "lab_loss",
        "parameters.agreement / f32(pixels)",
        "the kernel runs for images of at least one pixel",
    ),
    ("of_scale", "image[q] / f32(pixels)", "one pixel or four"),
    (
        "of_scale",
        "wanted_rgb(wanted[q]) / f32(pixels)",
        "one pixel or four",
    ),
    (
        "of_scale",
        "weight / f32(pixels * cells.x * cells.y)",
        "a pixel has come here that lies in one of the cells",
    ),
    (
        "total_variation",
        "1.0 / f32(pairs.x)",
        "sides count as two pixels at least",
    ),
    (
        "total_variation",
        "1.0 / f32(pairs.y)",
        "sides count as two pixels at least",
    ),
    (
        "lab_of",
        "(fourth * fifth - base * base) / (5.0 * fourth)",
        "the base is above 0.09, and its fifth root above 0.3",
    ),
    (
        "lab_of",
        "(max(rgb, vec3f(POWER_FROM)) + 0.055) / 1.055",
        "a constant divisor",
    ),
    (
        "lab_of",
        "(root * root * root - bright) / (3.0 * root * root)",
        "what is brighter than CUBE_ROOT_FROM has a root above 0.2",
    ),
    (
        "lab_of",
        "1.0 / (3.0 * root * root)",
        "what is brighter than CUBE_ROOT_FROM has a root above 0.2",
    ),
    (
        "lab_of",
        "pow",
        "bases are kept above POWER_FROM or CUBE_ROOT_FROM, exponents below 1",
    ),
    ("lab_of", "rgb / 12.92", "a constant divisor"),
    (
        "place_in_coarser",
        "f32(at % (2u * size)) / f32(2u * size)",
        "the kernel runs for images of at least one pixel",
    ),
    ("wanted_ab", "vec2f(halves) / 256.0", "a constant divisor"),
    (
        "wanted_rgb",
        "vec3f((vec3u(word) >> vec3u(0u, 10u, 20u)) & vec3u(1023u)) / 1023.0",
        "a constant divisor",
    ),
    (
        "sum_loss",
        "sum / f32(parameters.pixels)",
        "the host sets a count of at least one pixel",
    ),
    (
        "teacher_of",
        "s[k] /= s[0]",
        "what is not positive left in the branch above",
    ),
    (
        "teacher_of",
        "sqrt",
        "of a product of variances of at least PRIOR_VARIANCE",
    ),
    (
        "teacher_of",
        "vec3f(yy, -xy, xx) / (xx * yy - xy * xy)",
        "xy is clamped to 0.999 of the root of xx yy, which is positive",
    ),
    (
        "tile_lists",
        "(splat.mean + splat.extent) / side",
        "a constant divisor",
    ),
    (
        "tile_lists",
        "(splat.mean - splat.extent) / side",
        "a constant divisor",
    ),
    (
        "gathered",
        "vec2f(sums[1024], sums[1280]) / sum",
        "the host sets a count of at least one view, and each has a positive weight",
    ),
    (
        "view_correction",
        "vec4f(gain.w, -gain.y, -gain.z, gain.x) / determinant",
        "in the branch where it is at least DETERMINANT_MIN",
    ),
    (
        "gathered",
        "vec4f(sums[0], sums[256], sums[512], sums[768]) / sum",
        "the host sets a count of at least one view, and each has a positive weight",
    ),
    (
        "gathered",
        "1.0 / max(distance_of(own, center), NEAR)",
        "NEAR is positive",
    ),
];
