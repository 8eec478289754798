//! Corrections that align the views' teachers: each view's affine map from rendered to taught a/b
//! by weighted least squares, relative to the center of all maps (Huber's location), inverted.

use super::constants::{
    CORRECTION_DETERMINANT_MIN, CORRECTION_GAIN_UNITS, CORRECTION_NEAR, CORRECTION_PRIOR,
};

/// `gain · ab + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    /// Rows.
    pub gain: [[f64; 2]; 2],
    /// In Lab units.
    pub offset: [f64; 2],
}

impl Affine {
    /// Changes nothing.
    pub const IDENTITY: Self = Self {
        gain: [[1.0, 0.0], [0.0, 1.0]],
        offset: [0.0; 2],
    };

    /// The map of one a/b.
    pub fn of(&self, ab: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|c| self.gain[c][0] * ab[0] + self.gain[c][1] * ab[1] + self.offset[c])
    }
}

/// A pixel of a view: weight, rendered and taught a/b.
pub type Pixel = (f64, [f64; 2], [f64; 2]);

fn determinant(m: [[f64; 2]; 2]) -> f64 {
    m[0][0] * m[1][1] - m[0][1] * m[1][0]
}

fn inverse(m: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let d = determinant(m);
    [[m[1][1] / d, -m[0][1] / d], [-m[1][0] / d, m[0][0] / d]]
}

/// The teacher as an affine map of what is rendered; the prior pulls the gain to the
/// identity. Pixels of exactly zero show nothing and do not count. Without any weight,
/// the identity.
pub fn teacher_of(pixels: &[Pixel]) -> Affine {
    let shown = |pixel: &&Pixel| pixel.1.iter().any(|x| x.abs() > 0.0);
    let pixels: Vec<&Pixel> = pixels.iter().filter(shown).collect();
    let weight: f64 = pixels.iter().map(|pixel| pixel.0).sum();
    if weight <= 0.0 {
        return Affine::IDENTITY;
    }
    let mean = |of: &dyn Fn(&Pixel) -> f64| {
        (pixels.iter().map(|pixel| pixel.0 * of(pixel))).sum::<f64>() / weight
    };
    let x = [0, 1].map(|c| mean(&|pixel| pixel.1[c]));
    let t = [0, 1].map(|c| mean(&|pixel| pixel.2[c]));
    let prior = |i: usize, j: usize| if i == j { CORRECTION_PRIOR } else { 0.0 };
    // Centered before it is squared: nothing cancels.
    let within =
        [0, 1].map(|i| [0, 1].map(|j| mean(&|p| (p.1[i] - x[i]) * (p.1[j] - x[j])) + prior(i, j)));
    let across =
        [0, 1].map(|i| [0, 1].map(|j| mean(&|p| (p.2[i] - t[i]) * (p.1[j] - x[j])) + prior(i, j)));
    let inverse = inverse(within);
    let gain =
        [0, 1].map(|i| [0, 1].map(|j| across[i][0] * inverse[0][j] + across[i][1] * inverse[1][j]));
    let offset = [0, 1].map(|c| t[c] - gain[c][0] * x[0] - gain[c][1] * x[1]);
    Affine { gain, offset }
}

/// The mean of maps, weighed.
fn mean_of(maps: &[Affine], weight: impl Fn(&Affine) -> f64) -> Affine {
    let weights: f64 = maps.iter().map(&weight).sum();
    let mean = |of: &dyn Fn(&Affine) -> f64| {
        maps.iter().map(|map| weight(map) * of(map)).sum::<f64>() / weights
    };
    Affine {
        gain: [0, 1].map(|i| [0, 1].map(|j| mean(&|map| map.gain[i][j]))),
        offset: [0, 1].map(|i| mean(&|map| map.offset[i])),
    }
}

/// Distance of two maps, in Lab units.
fn distance(a: &Affine, b: &Affine) -> f64 {
    let length = |a: &[f64], b: &[f64]| {
        let squares = a.iter().zip(b).map(|(a, b)| (a - b).powi(2));
        squares.sum::<f64>().sqrt()
    };
    length(&a.offset, &b.offset)
        + CORRECTION_GAIN_UNITS * length(a.gain.as_flattened(), b.gain.as_flattened())
}

/// Center of maps: Huber's location by reweighted means.
pub fn center_of(maps: &[Affine]) -> Affine {
    let mut center = mean_of(maps, |_| 1.0);
    for _ in 0..GATHERINGS {
        center = mean_of(maps, |map| {
            1.0 / distance(map, &center).max(CORRECTION_NEAR)
        });
    }
    center
}

/// Steps of [`center_of`].
const GATHERINGS: usize = 16;

/// Correction of each view's wanted a/b.
pub fn view_corrections(views: &[Vec<Pixel>]) -> Vec<Affine> {
    let teachers: Vec<Affine> = views.iter().map(|pixels| teacher_of(pixels)).collect();
    let Affine {
        gain: mean_gain,
        offset: mean_offset,
    } = center_of(&teachers);
    (teachers.iter())
        .map(|teacher| {
            let identity = Affine::IDENTITY.gain;
            let gain = [0, 1]
                .map(|i| [0, 1].map(|j| teacher.gain[i][j] - mean_gain[i][j] + identity[i][j]));
            if determinant(gain) <= CORRECTION_DETERMINANT_MIN {
                return Affine::IDENTITY;
            }
            let gain = inverse(gain);
            let m = [0, 1].map(|c| teacher.offset[c] - mean_offset[c]);
            let offset = [0, 1].map(|c| -gain[c][0] * m[0] - gain[c][1] * m[1]);
            Affine { gain, offset }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;

    /// Rendered a/b far more spread than the prior, and what `teacher` makes of them.
    fn view(random: &mut Random, teacher: Affine) -> Vec<Pixel> {
        (0..200)
            .map(|_| {
                let x = random.array(-3e4, 3e4);
                (random.range(0.1, 2.0), x, teacher.of(x))
            })
            .collect()
    }

    fn close(a: Affine, b: Affine, far: f64) -> bool {
        let gains = a.gain.as_flattened().iter().zip(b.gain.as_flattened());
        let offsets = a.offset.iter().zip(&b.offset);
        gains.chain(offsets).all(|(a, b)| (a - b).abs() < far)
    }

    /// One view in twelve is far off: the others stay as they are.
    #[test]
    fn one_view_does_not_move_the_others() {
        let mut maps = vec![Affine::IDENTITY; 12];
        maps[4].offset = [30.0, 20.0];
        let center = center_of(&maps);
        // It pulls as strongly as if it stood no farther than what is near.
        let pull = CORRECTION_NEAR / 11.0;
        let length = center.offset[0].hypot(center.offset[1]);
        assert!((length - pull).abs() < 1e-3, "{center:?}");
        // Where none is far, it is their mean.
        for (k, map) in maps.iter_mut().enumerate() {
            map.offset = [0.05 * k as f64, 0.3];
        }
        assert!((center_of(&maps).offset[0] - 0.275).abs() < 1e-12);
    }

    const WARM: Affine = Affine {
        gain: [[1.1, 0.1], [-0.2, 0.9]],
        offset: [4.0, 7.0],
    };

    #[test]
    fn an_affine_teacher_is_found() {
        let found = teacher_of(&view(&mut Random::new(1), WARM));
        assert!(close(found, WARM, 1e-4), "{found:?}");
    }

    /// Teachers whose mean is the identity give the same once they are corrected.
    #[test]
    fn corrected_teachers_agree() {
        let cold = Affine {
            gain: [[0.9, -0.1], [0.2, 1.1]],
            offset: [-4.0, -7.0],
        };
        let mut random = Random::new(2);
        let views = [WARM, cold].map(|teacher| view(&mut random, teacher));
        for (correction, pixels) in view_corrections(&views).iter().zip(&views) {
            for &(_, x, t) in pixels {
                let back = correction.of(t);
                assert!((back[0] - x[0]).abs() < 1e-2 && (back[1] - x[1]).abs() < 1e-2);
            }
        }
    }

    /// The bias that all teachers share is the scene's color, which must not drift.
    #[test]
    fn what_all_share_stays() {
        let mut random = Random::new(3);
        let views = [(); 3].map(|()| view(&mut random, WARM));
        for correction in view_corrections(&views) {
            assert!(close(correction, Affine::IDENTITY, 1e-3), "{correction:?}");
        }
    }

    #[test]
    fn little_color_says_little() {
        let flat = vec![(1.0, [5.0, 5.0], [9.0, 2.0]); 10];
        let found = teacher_of(&flat);
        assert_eq!(found.gain, Affine::IDENTITY.gain);
        assert_eq!(found.offset, [4.0, -3.0]);
        assert_eq!(teacher_of(&[(0.0, [1.0; 2], [50.0; 2])]), Affine::IDENTITY);
        assert_eq!(teacher_of(&[]), Affine::IDENTITY);
        // The sky, where no Gaussian is.
        assert_eq!(teacher_of(&[(1.0, [0.0; 2], [50.0; 2])]), Affine::IDENTITY);
        // A teacher that knows no color at all cannot be undone.
        let mut random = Random::new(4);
        let gray = Affine {
            gain: [[0.0; 2]; 2],
            offset: [0.0; 2],
        };
        let views = [gray, WARM, WARM, WARM].map(|teacher| view(&mut random, teacher));
        assert_eq!(view_corrections(&views)[0], Affine::IDENTITY);
    }
}
