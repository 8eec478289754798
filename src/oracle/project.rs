//! Projection of one Gaussian: mean, screen covariance, conic, opacity.
//!
//! EWA splatting (Zwicker et al. 2001) as 3D Gaussian splatting uses it
//! (Kerbl et al. 2023), with the guards of `docs/limits.md`; antialiased as in
//! Mip-Splatting (Yu et al. 2024).

use super::Number;
use super::constants::{FRUSTUM_MARGIN, QUAT_NORM_MIN_SQ};
use super::linear::{apply, dot, rotation};
use super::view::View;

/// One Gaussian on the screen. Pixels; the center of the first one is (0.5, 0.5).
#[derive(Clone, Copy, Debug)]
pub struct Projected<T> {
    /// Center on the image, in pixels.
    pub mean2d: [T; 2],
    /// Covariance `xx, xy, yy` with the blur, px².
    pub cov2d: [T; 3],
    /// Inverse of the covariance, `xx, xy, yy`.
    pub conic: [T; 3],
    /// Opacity at the center, from the least that is blended to 1; antialiased, the one
    /// stored times what the blur leaves of it.
    pub opacity: T,
    /// z in camera space; what splats are sorted by.
    pub depth: T,
    /// The largest exponent that still reaches the least alpha: `ln(opacity / alpha_min)`.
    pub cutoff: f64,
    /// Half sides of the box around the visible ellipse.
    pub half_extent: [f64; 2],
}

/// Reason for which a Gaussian is not drawn. Checked in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cull {
    /// A parameter is NaN or infinite.
    NonFinite,
    /// Not in front of the near plane.
    Near,
    /// The quaternion is next to zero.
    Quaternion,
    /// The screen covariance has no finite, positive determinant.
    Covariance,
    /// Too transparent to reach the least alpha anywhere.
    Opacity,
    /// The box around the visible ellipse misses the image.
    Outside,
    /// The color exceeds [`COLOR_MAX`](super::constants::COLOR_MAX).
    Color,
}

/// Limits of x/z and y/z beyond which the Jacobian does not follow: `[[low, high]; 2]`.
pub fn jacobian_limits(view: &View) -> [[f64; 2]; 2] {
    let axis = |size: usize, focal: f64, principal: f64| {
        let margin = FRUSTUM_MARGIN * 0.5 * size as f64 / focal;
        [
            -(principal / focal + margin),
            (size as f64 - principal) / focal + margin,
        ]
    };
    [
        axis(view.width, view.fx, view.cx),
        axis(view.height, view.fy, view.cy),
    ]
}

/// `value` clamped to `[low, high]`; beyond a limit its derivative is zero.
fn clamp<T: Number>(value: T, [low, high]: [f64; 2]) -> T {
    if value.re() < low {
        T::from(low)
    } else if value.re() > high {
        T::from(high)
    } else {
        value
    }
}

/// Projects one Gaussian. Guards are positive, so that NaN fails them.
///
/// # Errors
/// The first reason for which the Gaussian is not drawn.
pub fn project<T: Number>(
    mean: &[T; 3],
    quat: &[T; 4],
    log_scale: &[T; 3],
    opacity_logit: T,
    view: &View,
) -> Result<Projected<T>, Cull> {
    let mut parameters = mean.iter().chain(quat).chain(log_scale);
    if !(parameters.all(|p| p.re().is_finite()) && opacity_logit.re().is_finite()) {
        return Err(Cull::NonFinite);
    }

    let rotated = apply(&view.rotation, mean);
    let [x, y, z] = std::array::from_fn(|i| rotated[i] + view.translation[i]);
    let in_front = z.re() > view.near;
    if !in_front {
        return Err(Cull::Near);
    }

    let norm_squared = dot(quat, quat);
    let has_direction = norm_squared.re() > QUAT_NORM_MIN_SQ;
    if !has_direction {
        return Err(Cull::Quaternion);
    }
    let norm = norm_squared.sqrt();
    let axes = rotation(quat.map(|q| q / norm));
    let scale = log_scale.map(|s| s.exp());

    // A = J·R·M is 2×3 and the covariance A·Aᵀ: symmetric by construction.
    let limits = jacobian_limits(view);
    let clamped_x = z * clamp(x / z, limits[0]);
    let clamped_y = z * clamp(y / z, limits[1]);
    let jacobian = [
        [
            z.recip() * view.fx,
            T::zero(),
            -clamped_x * view.fx / (z * z),
        ],
        [
            T::zero(),
            z.recip() * view.fy,
            -clamped_y * view.fy / (z * z),
        ],
    ];
    let mut footprint = [[T::zero(); 3]; 2];
    for axis in 0..3 {
        let column = [0, 1, 2].map(|row| axes[row][axis] * scale[axis]);
        let in_camera = apply(&view.rotation, &column);
        for row in 0..2 {
            for k in 0..3 {
                footprint[row][axis] += jacobian[row][k] * in_camera[k];
            }
        }
    }
    let blur = view.numerics.falloff.blur();
    let xx = dot(&footprint[0], &footprint[0]) + blur;
    let xy = dot(&footprint[0], &footprint[1]);
    let yy = dot(&footprint[1], &footprint[1]) + blur;

    // xx·yy − xy², written so that nothing cancels: of a needle 10⁸ times as long as wide no digit
    // would be left. |ρ₁ × ρ₂|² is the determinant of A·Aᵀ (Lagrange's identity).
    let [[a, b, c], [d, e, f]] = footprint;
    let normal = [b * f - c * e, c * d - a * f, a * e - b * d];
    let gram = dot(&normal, &normal);
    let determinant = gram + (xx + yy - blur) * blur;
    if !(determinant.re() > 0.0 && determinant.re().is_finite()) {
        return Err(Cull::Covariance);
    }
    let conic = [yy / determinant, -xy / determinant, xx / determinant];

    let mut opacity = ((-opacity_logit).exp() + 1.0).recip();
    if view.antialiased {
        // √(det A·Aᵀ / det (A·Aᵀ + blur)): what it shows in all stays what it was.
        opacity *= (gram / determinant).sqrt();
    }
    let reaches_a_pixel = opacity.re() >= view.numerics.alpha_min;
    if !reaches_a_pixel {
        return Err(Cull::Opacity);
    }
    let cutoff = (opacity.re() / view.numerics.alpha_min).ln();
    let half_extent = [xx, yy].map(|variance| (2.0 * cutoff * variance.re()).sqrt());

    let mean2d = [x / z * view.fx + view.cx, y / z * view.fy + view.cy];
    let size = [view.width, view.height];
    let touches = (0..2).all(|i| {
        let (center, half) = (mean2d[i].re(), half_extent[i]);
        center + half >= 0.0 && center - half <= size[i] as f64
    });
    if !touches {
        return Err(Cull::Outside);
    }
    Ok(Projected {
        mean2d,
        cov2d: [xx, xy, yy],
        conic,
        opacity,
        depth: z,
        cutoff,
        half_extent,
    })
}
