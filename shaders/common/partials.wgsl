// The gradient record of one Gaussian on the image plane: six figures for mean,
// conic and opacity and the pull where the geometry is trained, then the color. On frozen
// geometry four figures: the color's gradient (a, b or R, G, B), then its curvature.
@if(geometry) import package::common::color::CHANNELS;
@if(half) import package::common::numeric::is_finite;

// What densification asks: the sum over pixels of the length of each pixel's
// gradient with respect to the center, in normalized device coordinates. Lengths
// do not cancel where pixels pull apart, as they do within one large Gaussian.
@if(geometry) const PARTIAL_PULL: u32 = 6u;
@if(geometry) const PARTIAL_COLOR: u32 = 7u;
@if(geometry && !playcanvas) const PARTIAL_STRIDE: u32 = PARTIAL_COLOR + CHANNELS;
// Where alpha is no multiple of its slope, the opacity's gradient has a figure of its own.
@if(geometry && playcanvas) const PARTIAL_OPACITY: u32 = PARTIAL_COLOR + CHANNELS;
@if(geometry && playcanvas) const PARTIAL_STRIDE: u32 = PARTIAL_OPACITY + 1u;
@if(!geometry) const PARTIAL_STRIDE: u32 = 4u;

// How a list entry's record waits for its sum: a word a figure, or (`half`) a word for
// two, each the upper half of an f32. The range must stay that of f32: a figure is one
// over the number of pixels times anything from a faint alpha to a squared distance, of
// which an IEEE half would lose most below its least number, 6e-8.
@if(!half) alias PartialWord = f32;
@if(half) alias PartialWord = u32;
@if(!half) const PARTIAL_WORDS: u32 = PARTIAL_STRIDE;
@if(half) const PARTIAL_WORDS: u32 = PARTIAL_STRIDE / 2u;

// The upper half of a number's bits, rounded to the nearest, ties to even. What is not
// finite is cut off, for a carry could make a number of it.
@if(half) fn upper_half(x: f32) -> u32 {
    let bits = bitcast<u32>(x);
    let rounded = bits + 0x7fffu + ((bits >> 16u) & 1u);
    return select(bits, rounded, is_finite(x)) >> 16u;
}

@if(half) fn packed(low: f32, high: f32) -> u32 {
    return upper_half(low) | (upper_half(high) << 16u);
}

@if(half) fn unpacked(word: u32) -> vec2f {
    return vec2f(bitcast<f32>(word << 16u), bitcast<f32>(word & 0xffff0000u));
}
