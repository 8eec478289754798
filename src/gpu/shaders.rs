//! The WGSL of every kernel and variant, compiled from `shaders/` by `tools/compile_shaders`.

include!("../../shaders/compiled/kernels.rs");
