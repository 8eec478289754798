// Spherical harmonics to the color that each visible Gaussian shows this view.
import package::common::color::{CHANNELS, Color, color_from_sh};
import package::common::constants::{COLOR_MAX, INVISIBLE, PLANE_MEAN, STATUS_POISONED};
import package::common::numeric::{is_within, linear_group};
import package::common::projected::Projected;
import package::common::sh::sh_term;
import package::common::view::View;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> geometry: array<f32>;
// Planes `[(degree + 1)², CHANNELS, N]`.
@group(0) @binding(2) var<storage, read> sh: array<f32>;
@group(0) @binding(3) var<storage, read_write> ranks: array<u32>;
@group(0) @binding(4) var<storage, read_write> projected: array<Projected>;
@group(0) @binding(5) var<storage, read_write> colors: array<Color>;
@group(0) @binding(6) var<storage, read_write> status: array<atomic<u32>>;

fn coefficient(k: u32, i: u32) -> Color {
    let first = k * CHANNELS * view.splat_count + i;
    @if(luma) return sh[first];
    @if(chroma) return vec2f(sh[first], sh[first + view.splat_count]);
    @if(rgb) return vec3f(sh[first], sh[first + view.splat_count], sh[first + 2u * view.splat_count]);
}

@if(luma) fn drawable(c: Color) -> bool { return is_within(c, COLOR_MAX); }
@if(chroma) fn drawable(c: Color) -> bool { return is_within(c.x, COLOR_MAX) && is_within(c.y, COLOR_MAX); }
@if(rgb) fn drawable(c: Color) -> bool { return is_within(c.x, COLOR_MAX) && is_within(c.y, COLOR_MAX) && is_within(c.z, COLOR_MAX); }

@compute @workgroup_size(256)
fn shade(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let i = linear_group(group) * 256u + local;
    if i >= view.splat_count || ranks[i] == INVISIBLE {
        return;
    }
    let mean = vec3f(geometry[i], geometry[view.splat_count + i], geometry[2u * view.splat_count + i]);
    // Visible Gaussians lie beyond the near plane: the offset is not zero.
    let direction = normalize(mean - view.center_near.xyz);
    var sum = coefficient(0u, i) * sh_term(0u, direction).value;
    let count = (view.sh_degree + 1u) * (view.sh_degree + 1u);
    for (var k = 1u; k < count; k++) {
        sum += coefficient(k, i) * sh_term(k, direction).value;
    }
    if !drawable(sum) {
        // Opacity 0 takes it out of every tile's blend.
        projected[i].conic_opacity.w = 0.0;
        ranks[i] = INVISIBLE;
        colors[i] = Color();
        atomicAdd(&status[STATUS_POISONED], 1u);
        return;
    }
    colors[i] = color_from_sh(sum);
}
