// Constants of the rasterizer. `src/raster/constants.rs` holds the same values
// and a test compares the two. Those that training may trade for time
// (`src/raster/numerics.rs`) are overridable: the host gives their value when it makes
// the pipeline, and the device's compiler sees a constant.

// Side of a square tile in pixels.
const TILE_SIDE: u32 = 16u;

// Variance in px² added to every projected covariance: a splat is never thinner
// than about a pixel, and the covariance can be inverted.
const BLUR: f32 = 0.3;

// Alpha is capped so that 1/(1 - alpha) in the adjoint stays below 100.
const ALPHA_MAX: f32 = 0.99;

// The smallest opacity that is blended: one step of an 8-bit image.
override ALPHA_MIN: f32 = 0.00392156862745098;

// A pixel is finished when less than this passes through.
override TRANSMITTANCE_MIN: f32 = 1e-4;

// A larger color is poison: its gradient times squared pixel distances, squared
// again by Adam, would overflow.
const COLOR_MAX: f32 = 1e4;

// A quaternion whose squared length is below has no direction in f32.
const QUAT_NORM_MIN_SQ: f32 = 1e-8;

// The linearized projection is kept inside the image and this share of its half width.
const FRUSTUM_MARGIN: f32 = 0.3;

// Planes of the geometry array `[11, N]`.
const PLANE_MEAN: u32 = 0u;
const PLANE_QUAT: u32 = 3u;
const PLANE_LOG_SCALE: u32 = 7u;
const PLANE_OPACITY: u32 = 10u;
const GEOMETRY_PLANES: u32 = 11u;

// Planes of the statistics for densification `[2, N]`: pulls added up over the
// views that showed a Gaussian, and how many these were.
const STAT_PULL: u32 = 0u;
const STAT_VIEWS: u32 = 1u;

// Rank of a Gaussian that the view does not show.
const INVISIBLE: u32 = 0xffffffffu;

// Words of the status array.
const STATUS_OVERFLOW: u32 = 0u;
const STATUS_VISIBLE: u32 = 1u;
const STATUS_INSTANCES: u32 = 2u;
const STATUS_NEEDED: u32 = 3u;
const STATUS_POISONED: u32 = 4u;
// Training steps taken since the last reset.
const STATUS_STEPS: u32 = 5u;
// Gradients that Adam refused.
const STATUS_REFUSED: u32 = 6u;
