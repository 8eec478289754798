// SSIM's window along one axis, and how four neighboring sums are made with it at once.
// Wang et al. 2004 take eleven taps of a Gaussian with σ = 1.5; `window7` and `window5`
// cut it off earlier and weigh the rest so that it sums to one.

@if(window11) const RADIUS: u32 = 5u;
@if(window7) const RADIUS: u32 = 3u;
@if(window5) const RADIUS: u32 = 2u;
// Rows of a block of 16 with its halo.
const HALO: u32 = 16u + 2u * RADIUS;
// The window up to its middle; the rest mirrors it.
@if(window11) const WINDOW: array<f32, 6> = array<f32, 6>(
    0.00102838008447911, 0.007598758135239185, 0.03600077212843083,
    0.10936068950970002, 0.2130055377112537, 0.26601172486179436);
@if(window7) const WINDOW: array<f32, 4> = array<f32, 4>(
    0.036632845369194034, 0.11128075847888486, 0.21674532140370778, 0.27068214949642655);
@if(window5) const WINDOW: array<f32, 3> = array<f32, 3>(
    0.12007838424321347, 0.2338807565853503, 0.29208171834287244);

// Neighbors: sixteen, twelve or eight, of which the last two of sixteen and of twelve
// are not used.
struct Run {
    a: vec4f,
    b: vec4f,
    @if(!window5) c: vec4f,
    @if(window11) d: vec4f,
}

// The window over the neighbors from four places on. Four sums share most
// of their values; each value is loaded once.
@if(window11) fn windowed(v: Run) -> vec4f {
    return WINDOW[0] * (v.a + vec4f(v.c.zw, v.d.xy))
        + WINDOW[1] * (vec4f(v.a.yzw, v.b.x) + vec4f(v.c.yzw, v.d.x))
        + WINDOW[2] * (vec4f(v.a.zw, v.b.xy) + v.c)
        + WINDOW[3] * (vec4f(v.a.w, v.b.xyz) + vec4f(v.b.w, v.c.xyz))
        + WINDOW[4] * (v.b + vec4f(v.b.zw, v.c.xy))
        + WINDOW[5] * vec4f(v.b.yzw, v.c.x);
}
@if(window7) fn windowed(v: Run) -> vec4f {
    return WINDOW[0] * (v.a + vec4f(v.b.zw, v.c.xy))
        + WINDOW[1] * (vec4f(v.a.yzw, v.b.x) + vec4f(v.b.yzw, v.c.x))
        + WINDOW[2] * (vec4f(v.a.zw, v.b.xy) + v.b)
        + WINDOW[3] * vec4f(v.a.w, v.b.xyz);
}
@if(window5) fn windowed(v: Run) -> vec4f {
    return WINDOW[0] * (v.a + v.b)
        + WINDOW[1] * (vec4f(v.a.yzw, v.b.x) + vec4f(v.a.w, v.b.xyz))
        + WINDOW[2] * vec4f(v.a.zw, v.b.xy);
}

@if(window11) fn times(v: Run, w: Run) -> Run { return Run(v.a * w.a, v.b * w.b, v.c * w.c, v.d * w.d); }
@if(window7) fn times(v: Run, w: Run) -> Run { return Run(v.a * w.a, v.b * w.b, v.c * w.c); }
@if(window5) fn times(v: Run, w: Run) -> Run { return Run(v.a * w.a, v.b * w.b); }
