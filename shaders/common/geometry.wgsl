// The forward projection of one Gaussian, shared by `project` and its adjoint:
// the adjoint differentiates what was evaluated.
@if(!playcanvas) import package::common::constants::{BLUR, QUAT_NORM_MIN_SQ};
@if(playcanvas) import package::common::playcanvas::BLUR;
import package::common::rotation::rotation_from_quat;
import package::common::view::View;

struct Footprint {
    // Position in camera space.
    camera: vec3f,
    // x/z and y/z inside the slope limits, as the linearization uses them.
    slope: vec2f,
    // Rotation · diag(scale), columns.
    axes: mat3x3f,
    // World-to-camera rotation.
    world_to_camera: mat3x3f,
    // Rows of J · axes in camera space: the 2D covariance is their Gram matrix.
    row_x: vec3f,
    row_y: vec3f,
    // xx, xy, yy with BLUR.
    covariance: vec3f,
}

fn world_to_camera(view: View) -> mat3x3f {
    return transpose(mat3x3f(view.row0.xyz, view.row1.xyz, view.row2.xyz));
}

fn footprint(view: View, mean: vec3f, unit_quat: vec4f, scale: vec3f) -> Footprint {
    var f: Footprint;
    f.world_to_camera = world_to_camera(view);
    f.camera = f.world_to_camera * mean + vec3f(view.row0.w, view.row1.w, view.row2.w);
    let rotation = rotation_from_quat(unit_quat);
    f.axes = mat3x3f(rotation[0] * scale.x, rotation[1] * scale.y, rotation[2] * scale.z);
    f.slope = clamp(f.camera.xy / f.camera.z, view.slope_limits.xy, view.slope_limits.zw);
    let focal = view.intrinsics.xy / f.camera.z;
    let in_camera = f.world_to_camera * f.axes;
    let row0 = vec3f(in_camera[0].x, in_camera[1].x, in_camera[2].x);
    let row1 = vec3f(in_camera[0].y, in_camera[1].y, in_camera[2].y);
    let row2 = vec3f(in_camera[0].z, in_camera[1].z, in_camera[2].z);
    f.row_x = focal.x * (row0 - f.slope.x * row2);
    f.row_y = focal.y * (row1 - f.slope.y * row2);
    f.covariance = vec3f(
        dot(f.row_x, f.row_x) + BLUR,
        dot(f.row_x, f.row_y),
        dot(f.row_y, f.row_y) + BLUR);
    return f;
}

// det(Gram + BLUR·I) without cancellation: the Gram determinant of two rows is
// the squared length of their cross product.
fn determinant_of(f: Footprint) -> f32 {
    let normal = cross(f.row_x, f.row_y);
    return dot(normal, normal) + BLUR * (f.covariance.x + f.covariance.z - BLUR);
}

// What the blur must take from the opacity for a Gaussian to show as much as without it:
// √(det Gram / det(Gram + BLUR·I)) (Mip-Splatting, Yu et al. 2024, equation 9), below 1.
@if(mip) fn compensation(f: Footprint, determinant: f32) -> f32 {
    return length(cross(f.row_x, f.row_y)) / sqrt(determinant);
}
