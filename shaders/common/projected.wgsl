import package::common::constants::ALPHA_MIN;

// A Gaussian on the image plane.
struct Projected {
    // Center in pixels.
    mean: vec2f,
    // Half width and height of the box outside which alpha is below ALPHA_MIN.
    extent: vec2f,
    // The inverse covariance (xx, xy, yy) in px⁻², opacity in w.
    conic_opacity: vec4f,
}

// ½ dᵀ Σ⁻¹ d.
fn power_at(conic: vec3f, d: vec2f) -> f32 {
    return 0.5 * (conic.x * d.x * d.x + conic.z * d.y * d.y) + conic.y * d.x * d.y;
}

// The power at which alpha falls to ALPHA_MIN.
fn power_cutoff(opacity: f32) -> f32 {
    return log(opacity / ALPHA_MIN);
}

// The least power over the rectangle of pixel centers [low, high]: 0 when the
// center lies inside, else on one of the two edges that face it, where a
// quadratic in one variable is clamped to the edge.
fn least_power(splat: Projected, low: vec2f, high: vec2f) -> f32 {
    let conic = splat.conic_opacity.xyz;
    let nearest = clamp(splat.mean, low, high) - splat.mean;
    if nearest.x == 0.0 && nearest.y == 0.0 {
        return 0.0;
    }
    let lower = low - splat.mean;
    let upper = high - splat.mean;
    let on_vertical = vec2f(nearest.x, clamp(-conic.y * nearest.x / conic.z, lower.y, upper.y));
    let on_horizontal = vec2f(clamp(-conic.y * nearest.y / conic.x, lower.x, upper.x), nearest.y);
    return min(power_at(conic, on_vertical), power_at(conic, on_horizontal));
}

// Whether the Gaussian can be seen in the rectangle of pixel centers
// [low, high]. Lists, blending and adjoint all ask here.
fn touches(splat: Projected, cutoff: f32, low: vec2f, high: vec2f) -> bool {
    return least_power(splat, low, high) <= cutoff;
}
