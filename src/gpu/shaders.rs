//! The WGSL of every kernel and variant, compiled from `shaders/` by `build.rs`.

include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
