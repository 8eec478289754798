//! Distortion on the plane, forward.

use glam::DVec2;

/// Distortion model: maps a point on the plane to its distorted position.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Distortion {
    None,
    Polynomial(Polynomial),
    /// Devernay and Faugeras 2001; the lens's full angle in radians.
    FieldOfView {
        omega: f64,
    },
    /// Fitzgibbon 2001.
    Division {
        k: f64,
    },
    /// Khomutenko, Garcia and Martinet 2016.
    EnhancedUnified {
        alpha: f64,
        beta: f64,
    },
}

/// Radial, tangential and thin-prism terms (Weng et al. 1992) in the form that
/// OpenCV gave them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Polynomial {
    /// Coefficients of r², r⁴, … above the radial term's fraction line.
    pub above: [f64; 6],
    /// Below it.
    pub below: [f64; 3],
    /// OpenCV's p1, p2.
    pub tangential: [f64; 2],
    /// Coefficients of r², r⁴ along x, then along y.
    pub prism: [f64; 4],
    /// True if the tangential and prism terms apply to the radially distorted point instead of the
    /// undistorted one.
    pub after_radial: bool,
}

impl Distortion {
    /// Distorted position of `plane`. Formulas: COLMAP, `sensor/models.h`.
    pub fn apply(&self, plane: DVec2) -> DVec2 {
        let radial = plane * self.radial(plane.length_squared());
        match self {
            Self::Polynomial(polynomial) => {
                let of = if polynomial.after_radial {
                    radial
                } else {
                    plane
                };
                radial + polynomial.decentering(of)
            }
            _ => radial,
        }
    }

    /// By what a place at the squared radius is scaled.
    pub fn radial(&self, squared: f64) -> f64 {
        match self {
            Self::None => 1.0,
            Self::Polynomial(polynomial) => polynomial.radial(squared),
            // COLMAP expands this in a series for small angles, one sign of which
            // is the inverse's; at most 1e-4 of the radius comes of it.
            Self::FieldOfView { omega } => {
                let slope = 2.0 * (0.5 * omega).tan();
                let scale = if *omega == 0.0 { 1.0 } else { slope / omega };
                atan_over(slope * squared.sqrt()) * scale
            }
            Self::Division { k } => 2.0 / (1.0 + (1.0 - 4.0 * k * squared).sqrt()),
            Self::EnhancedUnified { alpha, beta } => {
                1.0 / (alpha * (beta * squared + 1.0).sqrt() + 1.0 - alpha)
            }
        }
    }

    /// The scale where the axis meets the plane.
    pub fn scale_at_center(&self) -> f64 {
        self.radial(0.0)
    }

    /// Returns true if it moves points along radii only.
    pub fn is_radial(&self) -> bool {
        match self {
            Self::Polynomial(polynomial) => {
                polynomial.tangential == [0.0; 2] && polynomial.prism == [0.0; 4]
            }
            _ => true,
        }
    }

    /// Returns true if it moves no point.
    pub fn is_none(&self) -> bool {
        match self {
            Self::None => true,
            Self::Polynomial(polynomial) => {
                let Polynomial { above, below, .. } = polynomial;
                self.is_radial() && *above == [0.0; 6] && *below == [0.0; 3]
            }
            _ => false,
        }
    }

    /// The derivative at `plane` by central differences, columns by x and by y.
    pub fn derivative(&self, plane: DVec2) -> [DVec2; 2] {
        // Half the digits of what is differenced.
        let step = 1e-7 * (1.0 + plane.length());
        [DVec2::X, DVec2::Y].map(|axis| {
            (self.apply(plane + step * axis) - self.apply(plane - step * axis)) / (2.0 * step)
        })
    }
}

impl Polynomial {
    fn radial(&self, squared: f64) -> f64 {
        let series = |coefficients: &[f64]| {
            let sum = |sum, coefficient| (sum + coefficient) * squared;
            1.0 + coefficients.iter().rev().fold(0.0, sum)
        };
        series(&self.above) / series(&self.below)
    }

    fn decentering(&self, p: DVec2) -> DVec2 {
        let [p1, p2] = self.tangential;
        let [x2, x4, y2, y4] = self.prism;
        let squared = p.length_squared();
        let (xy, square) = (2.0 * p.x * p.y, p * p);
        DVec2::new(
            p1 * xy + p2 * (squared + 2.0 * square.x) + squared * (x2 + x4 * squared),
            p2 * xy + p1 * (squared + 2.0 * square.y) + squared * (y2 + y4 * squared),
        )
    }
}

/// atan(x) / x.
fn atan_over(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x.atan() / x }
}

/// The determinant of a matrix given by its columns.
pub(super) fn determinant([x, y]: [DVec2; 2]) -> f64 {
    x.perp_dot(y)
}
