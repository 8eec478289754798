//! Hard cases: the kernels on scenes at which rasterizers break, and whether
//! anyone would notice if they did.

mod architecture;
mod broken_kernels;
mod cases;
mod circles;
mod literals;
mod poison;
mod poison_capture;
mod shader_lint;
mod training;
