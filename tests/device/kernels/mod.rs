//! Every GPU kernel against the `f64` oracle.
//!
//! The errors of each kernel on random inputs are the doctor's, which `tests/cli/doctor.rs` runs.
//! A Vulkan, Metal or DirectX 12 adapter is needed; a software one will do.

use gs_chroma::low_level::{compare, oracle};

mod adam;
mod antialiasing;
mod blend;
mod compiled;
mod contributions;
mod convergence;
mod densify_3dgs;
mod depth;
mod device;
mod effects;
mod gather;
mod gradient;
mod harness;
mod host_field;
mod layout;
mod least_squares;
mod losses;
mod memory;
mod numerics;
mod poison;
mod portions;
mod renderer;
mod repeat;
mod resume;
mod rgb;
mod scan;
mod solver;
mod sort;
mod streamed;
mod tiles;
mod viewers;
mod wall;
