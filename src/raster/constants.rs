//! Constants of the rasterizer, the twins of `shaders/common/constants.wgsl`
//! (reasons stand there; a test compares the values).

/// Side of a square tile in pixels.
pub const TILE_SIDE: u32 = 16;
/// Variance in px² added to every projected covariance.
pub const BLUR: f32 = 0.3;
/// The same in PlayCanvas' engine (`shaders/common/playcanvas.wgsl`).
pub const PLAYCANVAS_BLUR: f32 = 0.075;
/// Cap on alpha.
pub const ALPHA_MAX: f32 = 0.99;
/// Alpha below which a contribution is skipped.
pub const ALPHA_MIN: f32 = 1.0 / 255.0;
/// Transmittance below which a pixel is finished.
pub const TRANSMITTANCE_MIN: f32 = 1e-4;
/// Largest magnitude of a color in any kind's units.
pub const COLOR_MAX: f32 = 1e4;
/// Squared length below which a quaternion has no direction.
pub const QUAT_NORM_MIN_SQ: f32 = 1e-8;
/// Share of the half image beyond its border where the linearized projection is clamped.
pub const FRUSTUM_MARGIN: f64 = 0.3;

/// Planes of the geometry array: mean 3, quaternion 4, log-scale 3, opacity logit 1.
pub const GEOMETRY_PLANES: usize = 11;
/// First plane of the means.
pub const PLANE_MEAN: usize = 0;
/// First plane of the quaternions.
pub const PLANE_QUAT: usize = 3;
/// First plane of the log-scales.
pub const PLANE_LOG_SCALE: usize = 7;
/// The plane of the opacity logits.
pub const PLANE_OPACITY: usize = 10;
/// Planes of the densification statistics: sum of pulls, views.
pub const STATISTICS_PLANES: usize = 2;
/// The plane of the pulls: over the views that showed a Gaussian, the sum over
/// pixels of the length of the loss's gradient with respect to the Gaussian's
/// center in normalized device coordinates.
pub const STAT_PULL: usize = 0;
/// The plane of the counts of these views.
pub const STAT_VIEWS: usize = 1;

/// Words of the status array.
pub const STATUS_WORDS: usize = 7;
/// Set when the tile lists overflowed.
pub const STATUS_OVERFLOW: usize = 0;
/// Gaussians in view.
pub const STATUS_VISIBLE: usize = 1;
/// Entries of the tile lists.
pub const STATUS_INSTANCES: usize = 2;
/// Entries that an overflowing view needed.
pub const STATUS_NEEDED: usize = 3;
/// Gaussians culled because a parameter was not finite or had no direction.
pub const STATUS_POISONED: usize = 4;
/// Training steps taken since the last reset; an overflowing view stops the count.
pub const STATUS_STEPS: usize = 5;
/// Gradients that Adam refused since the last reset.
pub const STATUS_REFUSED: usize = 6;

/// The nearest camera depth at which a Gaussian is shown, as a share of the
/// scene's extent: a fixed distance would empty small scenes.
pub const NEAR_SHARE: f64 = 0.01;
