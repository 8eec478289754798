// The gradient record of one Gaussian on the image plane: six figures for mean,
// conic and opacity where the geometry is trained, then the colour.
import package::common::color::CHANNELS;

@if(geometry) const PARTIAL_COLOR: u32 = 6u;
@if(!geometry) const PARTIAL_COLOR: u32 = 0u;
const PARTIAL_STRIDE: u32 = PARTIAL_COLOR + CHANNELS;
