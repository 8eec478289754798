//! How good a picture is: fidelity to a reference and colourfulness.
//!
//! Images are row by row from the top left, encoded sRGB in `[0, 1]`.

mod colorfulness;
mod image_error;
mod ssim;

pub use colorfulness::{colorfulness, colorfulness_absolute};
pub use image_error::{DeltaE, mean_delta_e, psnr};
pub use ssim::ssim;
