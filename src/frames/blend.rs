//! Colors of a photo from several sources that cover parts of it.
//!
//! The photo takes the teacher's colors t, which have its detail, plus a smooth correction v, which
//! brings them in line with the scene. It minimizes, over all pixels x and neighbors x, y,
//!
//! `Σ c |v − (s − t)|² + (1 − c) [ε |v − d|² + τ |v − (p − t)|²] + λ Σ w |v_x − v_y|²`
//!
//! with s the scene's colors and c how far these are believed; d what the scene differs from the
//! teacher around; p the colors of the photo before, where these are known. So there is no seam
//! where the scene ends (as in Pérez, Gangnet and Blake, *Poisson Image Editing*, SIGGRAPH 2003),
//! and what blurred geometry loses comes back (docs/decisions/films.md). With a teacher w is 1, but
//! nearly 0 where it says something else than the scene beyond a cast: there the scene is taken as
//! it is. Without one t = 0, and w = exp(−δ²/2σ²), δ the difference of the neighbors' gray: colors spread along
//! even lightness and stop at edges (as in Levin, Lischinski and Weiss, *Colorization using
//! Optimization*, SIGGRAPH 2004). The system is symmetric and positive definite; conjugate
//! gradients solve it.

use super::{Canvas, window};

/// λ with a teacher: half the square of the distance in pixels over which its detail stays its
/// own. A scene is blurred over as much.
const SMOOTH: f32 = 4.5;

/// By how much, in CIELAB units, scene and teacher differ where the teacher's detail is believed
/// by half.
const UNLIKE: f32 = 6.0;

/// By how much that difference changes from pixel to pixel where blur is believed to be its cause
/// by half.
const BREAK: f32 = 24.0;

/// Reach in pixels of the mean over which they are compared: that of the blur.
const REACH: usize = 3;

/// Rounds of the fit of a cast, and the difference in CIELAB units that counts half in it.
const CAST: (usize, f64) = (6, 6.0);

/// By how much a photo's saturation may differ as a whole.
const SATURATION: f64 = 0.5;

/// λ without one.
const SPREAD: f32 = 1.0;

/// σ, in 8-bit levels of gray.
const GRAY_DEVIATION: f32 = 6.0;

/// Least weight of an edge, so that every pixel stays connected.
const LEAST_EDGE: f32 = 1e-4;

/// ε: weight of the surrounding colors at a pixel without scene.
const FILL: f32 = 0.02;

/// τ: weight of the previous photo's colors there.
const BEFORE: f32 = 0.2;

/// Residual of the solution, root mean square in CIELAB units, at which the solver stops: below
/// what 8 bits can tell.
const LEFT: f64 = 0.01;

/// Steps of conjugate gradients at most.
const STEPS: usize = 200;

/// Colors and the confidence of each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct WeightedColors {
    /// CIELAB a and b, `[height, width]`.
    pub ab: Vec<[f32; 2]>,
    /// Confidence, 0 to 1.
    pub weight: Vec<f32>,
}

impl WeightedColors {
    /// Nothing, for a number of pixels.
    pub fn nothing(pixels: usize) -> Self {
        Self {
            ab: vec![[0.0; 2]; pixels],
            weight: vec![0.0; pixels],
        }
    }

    /// The mean weight: which share of a picture is known.
    pub fn share(&self) -> f64 {
        let sum: f64 = self.weight.iter().map(|&w| f64::from(w)).sum();
        sum / self.weight.len().max(1) as f64
    }
}

/// The colors of a photo: `scene` where it is believed, elsewhere the teacher's in line with it
/// and with the photo `before`. CIELAB a and b, `[height, width]`.
///
/// Without a teacher, what nothing covers takes the colors around.
pub fn blend(
    canvas: &Canvas,
    scene: &WeightedColors,
    teacher: Option<&[[f32; 2]]>,
    before: Option<&WeightedColors>,
) -> Vec<[f32; 2]> {
    let nothing;
    let own = match teacher {
        Some(ab) => ab,
        None => {
            nothing = vec![[0.0; 2]; canvas.len()];
            &nothing
        }
    };
    let from_teacher = |other: &WeightedColors| WeightedColors {
        ab: (other.ab.iter().zip(own))
            .map(|(&ab, &own)| difference(ab, own))
            .collect(),
        weight: other.weight.clone(),
    };
    let scene = from_teacher(scene);
    let before = before.map(from_teacher);
    let weighted: Vec<[f32; 3]> = (scene.ab.iter().zip(&scene.weight))
        .map(|(ab, &c)| [c * ab[0], c * ab[1], c])
        .collect();
    let around = spread(&weighted, canvas.size());
    let system = match teacher {
        Some(teacher) => {
            let alike = likeness(&scene, teacher, canvas.size());
            let edge = |i: usize, j: usize| {
                let [a, b] = difference(scene.ab[i], scene.ab[j]);
                let known = scene.weight[i] * scene.weight[j];
                let unbroken = 1.0 / (1.0 + (known * a.hypot(b) / BREAK).powi(4));
                SMOOTH * (alike[i].min(alike[j]) * unbroken + LEAST_EDGE)
            };
            System::new(canvas.size(), edge, &scene, &around, before.as_ref())
        }
        None => {
            let gray = &canvas.gray;
            let by_difference: [f32; 256] = std::array::from_fn(|d| {
                let d = d as f32 / GRAY_DEVIATION;
                SPREAD * ((-0.5 * d * d).exp() + LEAST_EDGE)
            });
            let edge = |i: usize, j: usize| by_difference[usize::from(gray[i].abs_diff(gray[j]))];
            System::new(canvas.size(), edge, &scene, &around, before.as_ref())
        }
    };
    let correction = system.solve(around);
    let pixels = correction.iter().zip(own);
    pixels
        .map(|(v, own)| [v[0] + own[0], v[1] + own[1]])
        .collect()
}

/// Confidence in the teacher's detail at each pixel, 0 to 1: high where it agrees with the scene,
/// of which `scene` is the difference from it, but for a cast and a saturation of the whole photo.
fn likeness(scene: &WeightedColors, teacher: &[[f32; 2]], size: [usize; 2]) -> Vec<f32> {
    let casts = [0, 1].map(|k: usize| {
        let points = teacher.iter().zip(&scene.ab).zip(&scene.weight);
        cast(points.map(|((own, ab), &c)| [own[k], ab[k], c].map(f64::from)))
    });
    let rest: Vec<[f32; 3]> = (teacher.iter().zip(&scene.ab).zip(&scene.weight))
        .map(|((own, ab), &c)| {
            let rest = |k: usize| ab[k] - (casts[k][0] + casts[k][1] * f64::from(own[k])) as f32;
            [c * rest(0), c * rest(1), c]
        })
        .collect();
    window::sums(&rest, size, REACH)
        .iter()
        .map(|&[a, b, c]| {
            let far = if c > 0.0 {
                a.hypot(b) / c / UNLIKE
            } else {
                0.0
            };
            1.0 / (1.0 + far.powi(4))
        })
        .collect()
}

/// Offset and slope of a line through points x, y of some weight, which most of them lie near.
fn cast(points: impl Iterator<Item = [f64; 3]> + Clone) -> [f64; 2] {
    let [mut offset, mut slope] = [0.0; 2];
    for round in 0..CAST.0 {
        let mut sums = [0.0; 5];
        for [x, y, weight] in points.clone() {
            let far = (y - offset - slope * x) / CAST.1;
            // From a plain mean on, points that lie far count less and less.
            let weight = weight / (1.0 + if round > 0 { far * far } else { 0.0 });
            for (sum, term) in sums.iter_mut().zip([1.0, x, y, x * x, x * y]) {
                *sum += weight * term;
            }
        }
        let [w, x, y, xx, xy] = sums;
        if w <= 0.0 {
            break;
        }
        let (mean_x, mean_y) = (x / w, y / w);
        // A wrong patch would turn the line as long as it is near nothing. A teacher without any
        // color has no saturation.
        if round >= CAST.0 / 2 {
            slope = (xy / w - mean_x * mean_y) / (xx / w - mean_x * mean_x + 1.0);
            slope = slope.clamp(-SATURATION, SATURATION);
        }
        offset = mean_y - slope * mean_x;
    }
    [offset, slope]
}

/// Weighted values, spread over where there are none: each pixel takes what is around on the
/// finest scale on which there is something (pull and push; S. J. Gortler et al., *The
/// Lumigraph*, SIGGRAPH 1996). Zeros where there is nothing at all.
fn spread(weighted: &[[f32; 3]], [width, height]: [usize; 2]) -> Vec<[f32; 2]> {
    if width * height <= 1 {
        return weighted.iter().map(|&[a, b, w]| over(a, b, w)).collect();
    }
    let [half_width, half_height] = [width.div_ceil(2), height.div_ceil(2)];
    let mut coarse = vec![[0.0; 3]; half_width * half_height];
    for (i, value) in weighted.iter().enumerate() {
        let (x, y) = (i % width, i / width);
        let sum: &mut [f32; 3] = &mut coarse[y / 2 * half_width + x / 2];
        for (sum, value) in sum.iter_mut().zip(value) {
            *sum += value;
        }
    }
    // A coarse pixel counts as much as one of the finest at most.
    for sum in &mut coarse {
        let scale = 1.0 / sum[2].max(1.0);
        *sum = sum.map(|value| value * scale);
    }
    let below = spread(&coarse, [half_width, half_height]);
    (weighted.iter().enumerate())
        .map(|(i, &[a, b, w])| {
            let place = [i % width, i / width].map(|c| (c as f32 - 0.5) / 2.0);
            let around = window::bilinear(&below, [half_width, half_height], place);
            let rest = 1.0 - w.min(1.0);
            [a + rest * around[0], b + rest * around[1]]
        })
        .collect()
}

fn over(a: f32, b: f32, w: f32) -> [f32; 2] {
    if w > 0.0 { [a / w, b / w] } else { [0.0; 2] }
}

fn difference(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

/// The normal equations.
struct System {
    size: [usize; 2],
    /// λw of the edge to the right neighbor and to the one below; 0 at the border.
    edges: Vec<[f32; 2]>,
    /// Sum of the weights of each pixel's own terms.
    own: Vec<f32>,
    /// The right-hand side.
    wanted: Vec<[f32; 2]>,
}

impl System {
    /// Assembles the system; `edge` gives the weight of the edge between two pixels.
    fn new(
        size: [usize; 2],
        edge: impl Fn(usize, usize) -> f32,
        scene: &WeightedColors,
        around: &[[f32; 2]],
        before: Option<&WeightedColors>,
    ) -> Self {
        let [width, height] = size;
        let edges: Vec<[f32; 2]> = (0..around.len())
            .map(|i| {
                let right = i % width + 1 < width;
                let below = i / width + 1 < height;
                [
                    if right { edge(i, i + 1) } else { 0.0 },
                    if below { edge(i, i + width) } else { 0.0 },
                ]
            })
            .collect();
        let (mut own, mut wanted) = (Vec::with_capacity(around.len()), Vec::new());
        for (i, around) in around.iter().enumerate() {
            let c = scene.weight[i];
            let open = 1.0 - c;
            let (t, p) = before.map_or((0.0, [0.0; 2]), |before| {
                (open * BEFORE * before.weight[i], before.ab[i])
            });
            let f = open * FILL + f32::MIN_POSITIVE;
            own.push(c + t + f);
            wanted.push([0, 1].map(|k: usize| c * scene.ab[i][k] + t * p[k] + f * around[k]));
        }
        Self {
            size,
            edges,
            own,
            wanted,
        }
    }

    /// The matrix times `u`.
    fn times(&self, u: &[[f32; 2]], product: &mut [[f32; 2]]) {
        let width = self.size[0];
        for i in 0..u.len() {
            let mut sum = u[i].map(|u| self.own[i] * u);
            let mut pull = |edge: f32, other: usize| {
                for k in 0..2 {
                    sum[k] += edge * (u[i][k] - u[other][k]);
                }
            };
            let [right, below] = self.edges[i];
            if right > 0.0 {
                pull(right, i + 1);
            }
            if below > 0.0 {
                pull(below, i + width);
            }
            if i % width > 0 {
                pull(self.edges[i - 1][0], i - 1);
            }
            if i >= width {
                pull(self.edges[i - width][1], i - width);
            }
            product[i] = sum;
        }
    }

    /// The matrix's diagonal.
    fn diagonal(&self) -> Vec<f32> {
        let width = self.size[0];
        (0..self.own.len())
            .map(|i| {
                let left = if i % width > 0 {
                    self.edges[i - 1][0]
                } else {
                    0.0
                };
                let above = if i >= width {
                    self.edges[i - width][1]
                } else {
                    0.0
                };
                self.own[i] + self.edges[i][0] + self.edges[i][1] + left + above
            })
            .collect()
    }

    /// Conjugate gradients from `u` on, preconditioned by the diagonal, both channels at once.
    fn solve(&self, mut u: Vec<[f32; 2]>) -> Vec<[f32; 2]> {
        let diagonal = self.diagonal();
        let count = u.len();
        let mut product = vec![[0.0; 2]; count];
        self.times(&u, &mut product);
        let mut left: Vec<[f32; 2]> = (self.wanted.iter().zip(&product))
            .map(|(&wanted, &product)| difference(wanted, product))
            .collect();
        let scaled = |left: &[[f32; 2]]| -> Vec<[f32; 2]> {
            let pairs = left.iter().zip(&diagonal);
            pairs.map(|(left, d)| left.map(|left| left / d)).collect()
        };
        let mut direction = scaled(&left);
        let mut energy = dot(&left, &direction);
        for _ in 0..STEPS {
            // In units of the colors: what is left over the diagonal.
            let steps = scaled(&left);
            let rms = (dot(&steps, &steps).iter().sum::<f64>() / count as f64).sqrt();
            if rms <= LEFT {
                break;
            }
            self.times(&direction, &mut product);
            let slope = dot(&direction, &product);
            let step = [0, 1].map(|k: usize| ratio(energy[k], slope[k]));
            for i in 0..count {
                for k in 0..2 {
                    u[i][k] += step[k] * direction[i][k];
                    left[i][k] -= step[k] * product[i][k];
                }
            }
            let next = scaled(&left);
            let now = dot(&left, &next);
            let more = [0, 1].map(|k: usize| ratio(now[k], energy[k]));
            for (direction, next) in direction.iter_mut().zip(&next) {
                *direction = [0, 1].map(|k: usize| next[k] + more[k] * direction[k]);
            }
            energy = now;
        }
        u
    }
}

/// Dot product of each channel.
fn dot(a: &[[f32; 2]], b: &[[f32; 2]]) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for (a, b) in a.iter().zip(b) {
        for k in 0..2 {
            sum[k] += f64::from(a[k]) * f64::from(b[k]);
        }
    }
    sum
}

/// `a / b`; 0 where `b` is 0.
fn ratio(a: f64, b: f64) -> f32 {
    if b > 0.0 { (a / b) as f32 } else { 0.0 }
}

#[cfg(test)]
#[path = "blend_tests.rs"]
mod tests;
