//! Quality of a picture: fidelity to a reference, colorfulness, and consistency between views of
//! one scene.
//!
//! Images are row by row from the top left, encoded sRGB in `[0, 1]`.

mod colorfulness;
mod consistency;
mod diversity;
mod flo;
mod flow;
mod image_error;
mod optical_flow;
mod sharpness;
mod ssim;
mod visibility;

pub use colorfulness::colorfulness;
pub use consistency::{Consistency, DENOMINATOR_RULE, SCALE_RULE};
pub use diversity::color_diversity;
pub use flo::decode_flo;
pub use flow::Flow;
pub use image_error::{
    DeltaE, IDENTICAL_PSNR, ab_error, corrected_psnr, delta_e, mean_delta_e, psnr, reported_psnr,
};
pub use optical_flow::optical_flow;
pub use sharpness::{laplacian, lost_detail, variance};
pub use ssim::ssim;
pub use visibility::{MASK_RULE, visible};
