// How PlayCanvas' engine, SuperSplat's, draws a Gaussian: not to the end of its tails, and
// with less blur. Read in its shaders (gsplatCorner, gsplat), version 2.23; docs/viewers.md
// has what it draws beside what these draw.

// Variance in px² added to every projected covariance. The engine adds 0.3 in a plane of
// twice as many pixels a side.
const BLUR: f32 = 0.075;

// What is left of a Gaussian where it is cut off, exp(-4), and what the rest is divided by.
const TAIL: f32 = 0.01831563888873418;
const RESCALE: f32 = 1.0186573603637742;

// What a Gaussian shows of its opacity at these powers; below zero beyond its end.
fn falloff(power: vec4f) -> vec4f {
    return RESCALE * (exp(-power) - TAIL);
}
