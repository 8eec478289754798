// The gradient record of one Gaussian on the image plane: six figures for mean,
// conic and opacity and the pull where the geometry is trained, then the colour.
import package::common::color::CHANNELS;

// What densification asks: the sum over pixels of the length of each pixel's
// gradient with respect to the centre, in normalised device coordinates. Lengths
// do not cancel where pixels pull apart, as they do within one large Gaussian.
@if(geometry) const PARTIAL_PULL: u32 = 6u;
@if(geometry) const PARTIAL_COLOR: u32 = 7u;
@if(!geometry) const PARTIAL_COLOR: u32 = 0u;
const PARTIAL_STRIDE: u32 = PARTIAL_COLOR + CHANNELS;
