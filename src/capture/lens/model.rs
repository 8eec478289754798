//! COLMAP's camera models by name and number, and their parameters.

use glam::DVec2;
use std::f64::consts::{PI, TAU};

use super::distortion::{Distortion, Polynomial};
use super::{Lens, Projection, inverse};

/// A camera model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ModelName {
    /// COLMAP's name.
    pub name: &'static str,
    /// Number of parameters.
    pub parameters: usize,
    /// Number of focal lengths, the first of the parameters.
    focals: usize,
}

/// COLMAP's models in the order of its numbers, as of COLMAP 4.2.
pub const MODELS: [ModelName; 18] = [
    model("SIMPLE_PINHOLE", 1, 3),
    model("PINHOLE", 2, 4),
    model("SIMPLE_RADIAL", 1, 4),
    model("RADIAL", 1, 5),
    model("OPENCV", 2, 8),
    model("OPENCV_FISHEYE", 2, 8),
    model("FULL_OPENCV", 2, 12),
    model("FOV", 2, 5),
    model("SIMPLE_RADIAL_FISHEYE", 1, 4),
    model("RADIAL_FISHEYE", 1, 5),
    model("THIN_PRISM_FISHEYE", 2, 12),
    model("RAD_TAN_THIN_PRISM_FISHEYE", 2, 16),
    model("SIMPLE_DIVISION", 1, 4),
    model("DIVISION", 2, 5),
    model("SIMPLE_FISHEYE", 1, 3),
    model("FISHEYE", 2, 4),
    model("EUCM", 2, 6),
    model("EQUIRECTANGULAR", 0, 2),
];

/// The most parameters a model has.
pub const MOST_PARAMETERS: usize = 16;

const fn model(name: &'static str, focals: usize, parameters: usize) -> ModelName {
    ModelName {
        name,
        parameters,
        focals,
    }
}

impl ModelName {
    /// The model of COLMAP's number, if it is known.
    pub fn numbered(number: i32) -> Option<Self> {
        MODELS.get(usize::try_from(number).ok()?).copied()
    }

    /// The model of COLMAP's name, if it is known.
    pub fn named(name: &str) -> Option<Self> {
        MODELS.into_iter().find(|model| model.name == name)
    }

    /// The lens with these parameters, in COLMAP's order.
    ///
    /// # Errors
    /// In words, if they are not finite, a focal length is not positive, or a
    /// coefficient is out of the range in which its formula means a lens.
    pub fn lens(self, width: u32, height: u32, parameters: &[f64]) -> Result<Lens, String> {
        if parameters.len() != self.parameters {
            return Err(self.wrong_count(parameters));
        }
        if let Some(strange) = parameters.iter().find(|value| !value.is_finite()) {
            return Err(format!("the parameter {strange} is not finite"));
        }
        let (focals, rest) = parameters.split_at(self.focals);
        let (focal, center, coefficients) = match (focals, rest) {
            (&[f], &[x, y, ref rest @ ..]) => (DVec2::splat(f), DVec2::new(x, y), rest),
            (&[fx, fy], &[x, y, ref rest @ ..]) => (DVec2::new(fx, fy), DVec2::new(x, y), rest),
            // The sphere's width is a turn, its height half of one.
            (&[], &[w, h]) => (DVec2::new(w / TAU, h / PI), DVec2::new(w, h) / 2.0, &[][..]),
            _ => return Err(self.wrong_count(parameters)),
        };
        if focal.min_element() <= 0.0 {
            return Err(format!(
                "the focal length {}, {} is not positive",
                focal.x, focal.y
            ));
        }
        let (projection, distortion) = self.shape(coefficients)?;
        Ok(Lens {
            model: self.name,
            width,
            height,
            focal,
            center,
            limit: inverse::limit(projection, &distortion),
            projection,
            distortion,
        })
    }

    fn wrong_count(self, parameters: &[f64]) -> String {
        format!(
            "{} parameters do not make a {}",
            parameters.len(),
            self.name
        )
    }

    /// Projection and distortion of the parameters after the principal point.
    fn shape(self, coefficients: &[f64]) -> Result<(Projection, Distortion), String> {
        let perspective = |polynomial| (Projection::Perspective, polynomial);
        let fisheye = |polynomial| (Projection::Fisheye, polynomial);
        let distortion = match (self.name, coefficients) {
            ("SIMPLE_PINHOLE" | "PINHOLE", _) => (Projection::Perspective, Distortion::None),
            ("SIMPLE_FISHEYE" | "FISHEYE", _) => (Projection::Fisheye, Distortion::None),
            ("EQUIRECTANGULAR", _) => (Projection::Equirectangular, Distortion::None),
            ("SIMPLE_RADIAL" | "RADIAL", k) => perspective(radial(k)),
            ("SIMPLE_RADIAL_FISHEYE" | "RADIAL_FISHEYE" | "OPENCV_FISHEYE", k) => {
                fisheye(radial(k))
            }
            ("OPENCV", &[k1, k2, p1, p2]) => perspective(Distortion::Polynomial(Polynomial {
                above: above(&[k1, k2]),
                tangential: [p1, p2],
                ..Polynomial::default()
            })),
            ("FULL_OPENCV", &[k1, k2, p1, p2, k3, k4, k5, k6]) => {
                perspective(Distortion::Polynomial(Polynomial {
                    above: above(&[k1, k2, k3]),
                    below: [k4, k5, k6],
                    tangential: [p1, p2],
                    ..Polynomial::default()
                }))
            }
            ("THIN_PRISM_FISHEYE", &[k1, k2, p1, p2, k3, k4, sx, sy]) => {
                fisheye(Distortion::Polynomial(Polynomial {
                    above: above(&[k1, k2, k3, k4]),
                    tangential: [p1, p2],
                    prism: [sx, 0.0, sy, 0.0],
                    ..Polynomial::default()
                }))
            }
            // Its p0 and p1 are OpenCV's p2 and p1.
            ("RAD_TAN_THIN_PRISM_FISHEYE", &[ref k @ .., p0, p1, s0, s1, s2, s3]) => {
                fisheye(Distortion::Polynomial(Polynomial {
                    above: above(k),
                    tangential: [p1, p0],
                    prism: [s0, s1, s2, s3],
                    after_radial: true,
                    ..Polynomial::default()
                }))
            }
            ("FOV", &[omega]) if omega.abs() >= PI => {
                return Err(format!("the angle {omega} is not below π"));
            }
            ("FOV", &[omega]) => perspective(Distortion::FieldOfView { omega }),
            ("SIMPLE_DIVISION" | "DIVISION", &[k]) => perspective(Distortion::Division { k }),
            ("EUCM", &[alpha, beta]) if !(0.0..=1.0).contains(&alpha) || beta <= 0.0 => {
                return Err(format!(
                    "alpha {alpha} is not in 0 to 1, or beta {beta} not positive"
                ));
            }
            ("EUCM", &[alpha, beta]) => perspective(Distortion::EnhancedUnified { alpha, beta }),
            _ => return Err(self.wrong_count(coefficients)),
        };
        Ok(distortion)
    }
}

fn radial(coefficients: &[f64]) -> Distortion {
    Distortion::Polynomial(Polynomial {
        above: above(coefficients),
        ..Polynomial::default()
    })
}

fn above(coefficients: &[f64]) -> [f64; 6] {
    let mut above = [0.0; 6];
    above[..coefficients.len()].copy_from_slice(coefficients);
    above
}
