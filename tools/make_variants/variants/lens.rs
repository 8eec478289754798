//! COLMAP's OPENCV and OPENCV_FISHEYE cameras, written apart from the program's, so that
//! a scene made here tests those.
//!
//! Source: COLMAP's `sensor/models.h` and <https://docs.opencv.org/4.x/db/d58/group__calib3d__fisheye.html>.

/// A camera without its pose: a ray `(x, y, 1)` in camera axes is bent by the lens to
/// `(x', y')` and meets the image at `focal · (x', y') + center`.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// In pixels, along x and y.
    pub focal: [f64; 2],
    /// In pixels.
    pub center: [f64; 2],
    pub lens: Lens,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    Pinhole,
    /// k1, k2, p1, p2.
    OpenCv([f64; 4]),
    /// k1 to k4.
    Fisheye([f64; 4]),
}

/// More than enough for the lenses made here: the error shrinks by a third or better each.
const ROUNDS: usize = 60;

/// At unit depth; of a pixel, a billionth.
const EXACT: f64 = 1e-13;

impl Lens {
    /// COLMAP's name of the model.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Pinhole => "PINHOLE",
            Self::OpenCv(_) => "OPENCV",
            Self::Fisheye(_) => "OPENCV_FISHEYE",
        }
    }

    /// Coefficients after focal lengths and center.
    pub fn coefficients(&self) -> &[f64] {
        match self {
            Self::Pinhole => &[],
            Self::OpenCv(k) | Self::Fisheye(k) => k,
        }
    }

    /// Distorted image point of the ray `(x, y, 1)`.
    pub fn bend(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        match *self {
            Self::Pinhole => [x, y],
            Self::OpenCv([k1, k2, p1, p2]) => {
                let rr = x * x + y * y;
                let radial = 1.0 + rr * (k1 + rr * k2);
                [
                    x * radial + 2.0 * p1 * x * y + p2 * (rr + 2.0 * x * x),
                    y * radial + 2.0 * p2 * x * y + p1 * (rr + 2.0 * y * y),
                ]
            }
            Self::Fisheye(k) => {
                let r = x.hypot(y);
                let scale = if r > 0.0 {
                    fisheye(k, r.atan()).0 / r
                } else {
                    1.0
                };
                [x * scale, y * scale]
            }
        }
    }

    /// The ray that goes to `(x', y')`.
    pub fn straighten(&self, bent: [f64; 2]) -> [f64; 2] {
        match *self {
            Self::Pinhole => bent,
            Self::OpenCv(_) => {
                let mut ray = bent;
                for _ in 0..ROUNDS {
                    let now = self.bend(ray);
                    let step = [0, 1].map(|k| bent[k] - now[k]);
                    ray = [0, 1].map(|k| ray[k] + step[k]);
                    if step[0].hypot(step[1]) < EXACT {
                        break;
                    }
                }
                ray
            }
            Self::Fisheye(k) => {
                let r = bent[0].hypot(bent[1]);
                let mut theta = r.min(1.0);
                for _ in 0..ROUNDS {
                    let (value, slope) = fisheye(k, theta);
                    theta -= (value - r) / slope;
                    if (value - r).abs() < EXACT {
                        break;
                    }
                }
                let scale = if r > 0.0 { theta.tan() / r } else { 1.0 };
                bent.map(|v| v * scale)
            }
        }
    }
}

/// The radius of an angle to the axis in radians, and its derivative.
fn fisheye([k1, k2, k3, k4]: [f64; 4], theta: f64) -> (f64, f64) {
    let t = theta * theta;
    (
        theta * (1.0 + t * (k1 + t * (k2 + t * (k3 + t * k4)))),
        1.0 + t * (3.0 * k1 + t * (5.0 * k2 + t * (7.0 * k3 + t * 9.0 * k4))),
    )
}

impl Camera {
    /// The pixel of the ray `(x, y, 1)`.
    pub fn pixel(&self, ray: [f64; 2]) -> [f64; 2] {
        let bent = self.lens.bend(ray);
        [0, 1].map(|k| self.focal[k] * bent[k] + self.center[k])
    }

    /// The ray `(x, y, 1)` of a pixel.
    pub fn ray(&self, pixel: [f64; 2]) -> [f64; 2] {
        let bent = [0, 1].map(|k| (pixel[k] - self.center[k]) / self.focal[k]);
        self.lens.straighten(bent)
    }

    /// Returns true if a pixel lies in the image, `margin` pixels from its border.
    pub fn contains(&self, pixel: [f64; 2], margin: f64) -> bool {
        (0..2).all(|k| (margin..=f64::from(self.size[k]) - margin).contains(&pixel[k]))
    }

    /// Corners of the pixels along the image's border.
    pub fn border(&self) -> impl Iterator<Item = [f64; 2]> + use<> {
        let [width, height] = self.size;
        let [w, h] = self.size.map(f64::from);
        let rows = (0..=height).map(f64::from);
        let columns = (0..=width).map(f64::from);
        let across = columns.flat_map(move |x| [[x, 0.0], [x, h]]);
        across.chain(rows.flat_map(move |y| [[0.0, y], [w, y]]))
    }

    /// By how many pixels at most the lens moves a pixel from where a pinhole of the same
    /// focal length has it.
    pub fn largest_shift(&self) -> f64 {
        let straight = Self {
            lens: Lens::Pinhole,
            ..self.clone()
        };
        // The farther from the axis, the more: the border suffices.
        let shift = |pixel: [f64; 2]| {
            let [x, y] = straight.pixel(self.ray(pixel));
            (x - pixel[0]).hypot(y - pixel[1])
        };
        self.border().map(shift).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENSES: [Lens; 3] = [
        Lens::Pinhole,
        Lens::OpenCv([-0.2, 0.05, 0.003, -0.002]),
        Lens::Fisheye([-0.02, 0.004, -0.001, 0.0005]),
    ];

    #[test]
    fn straightening_undoes_bending() {
        for lens in LENSES {
            for (x, y) in [(0.0, 0.0), (0.3, -0.2), (-0.7, 0.5), (0.0, 0.9)] {
                let [u, v] = lens.straighten(lens.bend([x, y]));
                assert!((u - x).hypot(v - y) < 1e-12, "{lens:?} {x} {y}: {u} {v}");
            }
        }
    }

    /// By hand: r² = 0.25, radial 1 − 0.05 + 0.003125 = 0.953125; 2·p1·x·y = 0.00072,
    /// p2 (r² + 2x²) = −0.00086; 2·p2·x·y = −0.00048, p1 (r² + 2y²) = 0.00171.
    #[test]
    fn opencv_by_hand() {
        let [x, y] = LENSES[1].bend([0.3, 0.4]);
        let radial = 0.953_125;
        assert!(
            (x - (0.3 * radial + 0.000_72 - 0.000_86)).abs() < 1e-12,
            "{x}"
        );
        assert!(
            (y - (0.4 * radial - 0.000_48 + 0.001_71)).abs() < 1e-12,
            "{y}"
        );
    }

    /// Without coefficients a fisheye's radius is the angle: 45° to the side.
    #[test]
    fn fisheye_by_hand() {
        let [x, y] = Lens::Fisheye([0.0; 4]).bend([1.0, 0.0]);
        assert!((x - std::f64::consts::FRAC_PI_4).abs() < 1e-15 && y == 0.0);
        let [x, _] = Lens::Fisheye([0.1, 0.0, 0.0, 0.0]).bend([1.0, 0.0]);
        let quarter = std::f64::consts::FRAC_PI_4;
        assert!((x - (quarter + 0.1 * quarter.powi(3))).abs() < 1e-15);
    }
}
