// The adjoint of `shade`: gradients of the spherical harmonics and, through the
// direction of view, of the means. In training (`step`) Adam moves the harmonics at
// once, and their gradient is never stored; `lazy` as in `project_backward`. On frozen
// geometry gradients are added to what is there, and so are the curvatures' sums.
import package::common::color::{CHANNELS, Color, color_gradient};
@if(geometry) import package::common::color::color_dot;
import package::common::constants::{INVISIBLE, PLANE_MEAN};
@if(step) import package::common::constants::STATUS_OVERFLOW;
@if(step) import package::common::descend::{descended, status};
import package::common::numeric::linear_group;
import package::common::partials::PARTIAL_STRIDE;
@if(geometry) import package::common::partials::PARTIAL_COLOR;
import package::common::sh::sh_term;
@if(!luma) import package::common::sh::SH_C0;
import package::common::view::View;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> geometry: array<f32>;
@group(0) @binding(2) var<storage, read> ranks: array<u32>;
@group(0) @binding(3) var<storage, read> colors: array<Color>;
@group(0) @binding(4) var<storage, read> gradients: array<f32>;
// Planes `[harmonics, CHANNELS, N]`: all of them written, or on frozen geometry added to.
@if(!step) @group(0) @binding(5) var<storage, read_write> sh_gradient: array<f32>;
@if(geometry && !step) @group(0) @binding(6) var<storage, read> sh: array<f32>;
@if(step) @group(0) @binding(6) var<storage, read_write> sh: array<f32>;
// Planes `[2, N]` of a and b, `[1, N]` of RGB: the constant harmonic times the curvatures
// of the pixels, each weighed as it is drawn.
@if(!geometry) @group(0) @binding(6) var<storage, read_write> diagonal: array<f32>;
// Planes `[3, N]`, what the means' gradient owes to the direction of view.
@if(geometry) @group(0) @binding(7) var<storage, read_write> mean_gradient: array<f32>;

fn plane_index(k: u32, i: u32) -> u32 {
    return k * CHANNELS * view.splat_count + i;
}

@if(step) fn descend(plane: u32, i: u32, gradient: f32) {
    let k = plane * view.splat_count + i;
    sh[k] = descended(plane, i, view.splat_count, sh[k], gradient);
}

@if(luma && step) fn store(k: u32, i: u32, value: Color) { descend(k, i, value); }

// Most viewers keep the constant harmonic in bytes: it stays between black and white.
@if(rgb && step) fn store(k: u32, i: u32, value: Color) {
    for (var c = 0u; c < CHANNELS; c++) {
        descend(k * CHANNELS + c, i, value[c]);
        if k == 0u {
            let at = c * view.splat_count + i;
            sh[at] = clamp(sh[at], -0.5 / SH_C0, 0.5 / SH_C0);
        }
    }
}

@if(luma && !step) fn store(k: u32, i: u32, value: Color) { sh_gradient[plane_index(k, i)] = value; }

@if(chroma) fn store(k: u32, i: u32, value: Color) {
    let at = plane_index(k, i);
    sh_gradient[at] += value.x;
    sh_gradient[at + view.splat_count] += value.y;
}
@if(rgb && !geometry) fn store(k: u32, i: u32, value: Color) {
    let at = plane_index(k, i);
    sh_gradient[at] += value.x;
    sh_gradient[at + view.splat_count] += value.y;
    sh_gradient[at + 2u * view.splat_count] += value.z;
}

@if(rgb && geometry) fn coefficient(k: u32, i: u32) -> Color {
    let first = plane_index(k, i);
    return vec3f(sh[first], sh[first + view.splat_count], sh[first + 2u * view.splat_count]);
}

@if(luma) fn gradient_of(i: u32) -> Color { return gradients[i * PARTIAL_STRIDE + PARTIAL_COLOR]; }
@if(chroma) fn gradient_of(i: u32) -> Color {
    let at = i * PARTIAL_STRIDE;
    return vec2f(gradients[at], gradients[at + 1u]);
}
@if(rgb) fn gradient_of(i: u32) -> Color {
    @if(geometry) let at = i * PARTIAL_STRIDE + PARTIAL_COLOR;
    @if(!geometry) let at = i * PARTIAL_STRIDE;
    return vec3f(gradients[at], gradients[at + 1u], gradients[at + 2u]);
}

@if(!geometry) fn add_curvatures(i: u32) {
    for (var figure = CHANNELS; figure < PARTIAL_STRIDE; figure++) {
        diagonal[(figure - CHANNELS) * view.splat_count + i] += SH_C0 * gradients[i * PARTIAL_STRIDE + figure];
    }
}

@compute @workgroup_size(256)
fn shade_backward(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let i = linear_group(group) * 256u + local;
    let n = view.splat_count;
    if i >= n {
        return;
    }
    // After an overflow nothing moves until the host has grown the buffers and
    // repeats the iteration.
    @if(step) { if atomicLoad(&status[STATUS_OVERFLOW]) != 0u { return; } }
    @if(geometry) let count = (view.sh_degree + 1u) * (view.sh_degree + 1u);
    // As many harmonics as the gradient has planes for; the picture may have more.
    @if(!geometry) let count = arrayLength(&sh_gradient) / (CHANNELS * n);
    @if(lazy) { if ranks[i] == INVISIBLE { return; } }
    @if(!lazy) if ranks[i] == INVISIBLE {
        @if(geometry) for (var k = 0u; k < count; k++) {
            store(k, i, Color());
        }
        @if(geometry) {
            for (var axis = 0u; axis < 3u; axis++) {
                mean_gradient[axis * n + i] = 0.0;
            }
        }
        return;
    }
    let v_color = color_gradient(colors[i], gradient_of(i));
    let offset = vec3f(geometry[i], geometry[n + i], geometry[2u * n + i]) - view.center_near.xyz;
    // Visible Gaussians lie beyond the near plane: the distance is not zero.
    let distance = length(offset);
    let direction = offset / distance;
    @if(geometry) var v_direction = vec3f(0.0);
    for (var k = 0u; k < count; k++) {
        let term = sh_term(k, direction);
        @if(luma) { v_direction += term.slope * color_dot(sh[plane_index(k, i)], v_color); }
        @if(rgb && geometry) { v_direction += term.slope * color_dot(coefficient(k, i), v_color); }
        store(k, i, term.value * v_color);
    }
    @if(!geometry) { add_curvatures(i); }
    @if(geometry) {
        let v_mean = (v_direction - direction * dot(direction, v_direction)) / distance;
        mean_gradient[i] = v_mean.x;
        mean_gradient[n + i] = v_mean.y;
        mean_gradient[2u * n + i] = v_mean.z;
    }
}
