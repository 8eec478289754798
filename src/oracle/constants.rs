//! The oracle's own copy of every constant; a test compares it with the crate's.

/// Added to both variances of the screen covariance, in px², so that no
/// splat is thinner than a pixel's low-pass filter.
pub const BLUR: f64 = 0.3;

/// The same in PlayCanvas' engine.
pub const PLAYCANVAS_BLUR: f64 = 0.075;

/// Density of a Gaussian where PlayCanvas' engine cuts it off, e⁻⁴.
pub const PLAYCANVAS_TAIL: f64 = 0.018_315_638_888_734_18;

/// The largest opacity of a splat at a pixel; keeps `1 / (1 - alpha)` bounded.
pub const ALPHA_MAX: f64 = 0.99;

/// The smallest opacity that is blended: one step of an 8-bit image.
pub const ALPHA_MIN: f64 = 1.0 / 255.0;

/// A pixel stops before its transmittance would fall below this.
pub const TRANSMITTANCE_MIN: f64 = 1e-4;

/// Gaussians with a color of larger magnitude are not drawn.
pub const COLOR_MAX: f64 = 1e4;

/// Quaternions with a squared norm up to this have no direction worth trusting.
pub const QUAT_NORM_MIN_SQ: f64 = 1e-8;

/// Distance beyond the image up to which the projection's Jacobian follows the splat, as a share of
/// half the field of view.
pub const FRUSTUM_MARGIN: f64 = 0.3;

/// Side of a tile in pixels.
pub const TILE: usize = 16;

/// Weight of `1 - SSIM` in the luma loss; the L1 term has the rest.
pub const SSIM_WEIGHT: f64 = 0.2;

/// Side of the SSIM window in pixels.
pub const SSIM_WINDOW: usize = 11;

/// Standard deviation of the SSIM window in pixels.
pub const SSIM_SIGMA: f64 = 1.5;

/// SSIM's guard of the luminance term, for values in [0, 1].
pub const SSIM_C1: f64 = 0.01 * 0.01;

/// SSIM's guard of the contrast term, for values in [0, 1].
pub const SSIM_C2: f64 = 0.03 * 0.03;

/// Half-width of the chroma loss's rounded corner, in Lab units.
pub const CHROMA_EPSILON: f64 = 0.5;

/// Variance in squared Lab units that is added to both sides of a view's regression.
pub const CORRECTION_PRIOR: f64 = 4.0;

/// A gain's difference of one is as far as an offset's of so many Lab units.
pub const CORRECTION_GAIN_UNITS: f64 = 10.0;

/// Views count alike within so many Lab units of where they gather.
pub const CORRECTION_NEAR: f64 = 10.0;

/// A gain whose determinant is no larger cannot be undone.
pub const CORRECTION_DETERMINANT_MIN: f64 = 0.1;

/// Adam's decay of the first moment.
pub const ADAM_BETA1: f64 = 0.9;

/// Adam's decay of the second moment.
pub const ADAM_BETA2: f64 = 0.999;

/// Adam's guard of the division.
pub const ADAM_EPSILON: f64 = 1e-15;

/// Spherical harmonics, degree 0: 1 / (2 √π).
pub const SH_C0: f64 = 0.282_094_791_773_878_14;

/// Spherical harmonics, degree 1: √(3 / 4π).
pub const SH_C1: f64 = 0.488_602_511_902_919_9;

/// Spherical harmonics, degree 2, with the signs of the splat files.
pub const SH_C2: [f64; 5] = [
    1.092_548_430_592_079_2,
    -1.092_548_430_592_079_2,
    0.315_391_565_252_520_05,
    -1.092_548_430_592_079_2,
    0.546_274_215_296_039_6,
];

/// Spherical harmonics, degree 3, with the signs of the splat files.
pub const SH_C3: [f64; 7] = [
    -0.590_043_589_926_643_5,
    2.890_611_442_640_554,
    -0.457_045_799_464_465_8,
    0.373_176_332_590_115_4,
    -0.457_045_799_464_465_8,
    1.445_305_721_320_277,
    -0.590_043_589_926_643_5,
];
