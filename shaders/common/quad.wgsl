// Four pixels of one column at a time: a Gaussian is loaded once for all four,
// and their arithmetic has no branches.
import package::common::color::Color;
import package::common::constants::{ALPHA_MAX, ALPHA_MIN, TILE_SIDE};
import package::common::view::View;

@if(luma) alias Quad = vec4f;
@if(chroma) alias Quad = mat2x4f;
@if(rgb) alias Quad = mat3x4f;

// Weights times one color.
@if(luma) fn weighted(weights: vec4f, color: Color) -> Quad { return weights * color; }
@if(chroma) fn weighted(weights: vec4f, color: Color) -> Quad { return Quad(weights * color.x, weights * color.y); }
@if(rgb) fn weighted(weights: vec4f, color: Color) -> Quad { return Quad(weights * color.x, weights * color.y, weights * color.z); }

// Color of one of the four pixels.
@if(luma) fn pixel_of(quad: Quad, k: u32) -> Color { return quad[k]; }
@if(chroma) fn pixel_of(quad: Quad, k: u32) -> Color { return vec2f(quad[0][k], quad[1][k]); }
@if(rgb) fn pixel_of(quad: Quad, k: u32) -> Color { return vec3f(quad[0][k], quad[1][k], quad[2][k]); }

// Powers of one Gaussian at the pixels d, d + (0, 1), d + (0, 2), d + (0, 3).
fn powers(conic: vec3f, d: vec2f) -> vec4f {
    let dy = d.y + vec4f(0.0, 1.0, 2.0, 3.0);
    return 0.5 * (conic.x * d.x * d.x + conic.z * dy * dy) + conic.y * d.x * dy;
}

fn quad_alpha(raw: vec4f) -> vec4f {
    return min(vec4f(ALPHA_MAX), raw);
}

// Which of the pixels the Gaussian contributes to at all; false for NaN.
fn contributes(power: vec4f, alpha: vec4f) -> vec4<bool> {
    return (power >= vec4f(0.0)) & (alpha >= vec4f(ALPHA_MIN));
}
