//! Optical flow between two photos that nothing else relates.
//!
//! Coarse to fine with warping, an L1-like penalty on data and smoothness (T. Brox et al., *High
//! accuracy optical flow estimation based on a theory for warping*, ECCV 2004), and a median
//! after every warp (D. Sun, S. Roth and M. Black, *Secrets of optical flow estimation and their
//! principles*, CVPR 2010). Pictures are compared with their local mean and contrast taken out, so
//! that flicker and fading move nothing.

mod relax;

use relax::{Data, Equations};

use super::Flow;

/// Reach in pixels of the local mean and contrast.
const LOCAL: usize = 8;

/// Contrast in 8-bit levels below which a place is even: grain and rounding.
const EVEN: f32 = 4.0;

/// Levels end where a side would be shorter than this.
const SHORTEST: usize = 12;

/// Warps on each level at most, and by how many pixels one moves the flow, root mean square, that
/// is the last.
const WARPS: usize = 4;
const STAYS: f32 = 0.02;

/// Sweeps over all pixels for each warp at most, in how many the penalties' weights are held, and
/// the change in pixels, root mean square, from which on they are taken anew at once.
const SWEEPS: usize = 24;
const HELD: usize = 8;
const SETTLED: f32 = 1e-3;

/// The flow from one picture to another of the same size, known everywhere. Gray is in 8-bit
/// levels, `[height, width]`.
///
/// # Panics
/// When a picture has not this size.
pub fn optical_flow(from: &[f32], to: &[f32], [width, height]: [usize; 2]) -> Flow {
    assert_eq!(
        [from.len(), to.len()],
        [width * height; 2],
        "pictures of one size"
    );
    let size = [width, height];
    let mut levels = vec![[from, to].map(|gray| Gray {
        size,
        pixels: gray.to_vec(),
    })];
    while let Some([last, other]) = levels.last()
        && last.size.iter().all(|side| side / 2 >= SHORTEST)
    {
        let next = [last.halved(), other.halved()];
        levels.push(next);
    }
    let mut vectors = Vec::new();
    let mut coarser = [0; 2];
    for pair in levels.iter().rev() {
        // On each level by itself: what is even over eight pixels here is not on a coarser one.
        let [from, to] = pair.each_ref().map(Gray::normalized);
        vectors = match vectors.is_empty() {
            true => vec![[0.0; 2]; from.pixels.len()],
            false => enlarged(&vectors, coarser, from.size),
        };
        for _ in 0..WARPS {
            let moved = refine(&from, &to, &mut vectors);
            vectors = median(&vectors, from.size);
            if moved < STAYS {
                break;
            }
        }
        coarser = from.size;
    }
    Flow {
        width,
        height,
        vectors,
    }
}

struct Gray {
    size: [usize; 2],
    pixels: Vec<f32>,
}

impl Gray {
    /// Without its local mean, over its local contrast.
    fn normalized(&self) -> Self {
        let (gray, size) = (&self.pixels, self.size);
        let mean = boxed(gray, size);
        let about: Vec<f32> = gray.iter().zip(&mean).map(|(g, m)| g - m).collect();
        let squares: Vec<f32> = about.iter().map(|v| v * v).collect();
        let variance = boxed(&squares, size);
        let pixels = about.iter().zip(&variance);
        Self {
            size,
            pixels: pixels
                .map(|(v, s)| v / (s.max(0.0).sqrt() + EVEN))
                .collect(),
        }
    }

    /// Means of four.
    fn halved(&self) -> Self {
        let [width, height] = self.size;
        let size = [width / 2, height / 2];
        let at = |x: usize, y: usize| self.pixels[y * width + x];
        let places = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (2 * x, 2 * y)));
        Self {
            size,
            pixels: places
                .map(|(x, y)| 0.25 * (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1)))
                .collect(),
        }
    }

    /// Bilinear value at a place in pixel indices; none outside.
    fn at(&self, x: f32, y: f32) -> Option<f32> {
        let [width, height] = self.size;
        let inside = |c: f32, length: usize| (0.0..=(length - 1) as f32).contains(&c);
        // NaN is nowhere.
        if !(inside(x, width) && inside(y, height)) {
            return None;
        }
        let (column, row) = (x as usize, y as usize);
        let (right, below) = ((column + 1).min(width - 1), (row + 1).min(height - 1));
        let (s, t) = (x - column as f32, y - row as f32);
        let pixel = |x: usize, y: usize| self.pixels[y * width + x];
        let upper = pixel(column, row) + s * (pixel(right, row) - pixel(column, row));
        let lower = pixel(column, below) + s * (pixel(right, below) - pixel(column, below));
        Some(upper + t * (lower - upper))
    }
}

/// Means over a square of `2 LOCAL + 1` pixels, cut off at the border.
fn boxed(values: &[f32], [width, height]: [usize; 2]) -> Vec<f32> {
    let mut rows = vec![0.0; values.len()];
    for (means, row) in rows.chunks_mut(width).zip(values.chunks(width)) {
        along(row.len(), |i| row[i], |i, mean| means[i] = mean);
    }
    let mut all = vec![0.0; values.len()];
    for x in 0..width {
        along(
            height,
            |y| rows[y * width + x],
            |y, mean| all[y * width + x] = mean,
        );
    }
    all
}

/// Running means of a line.
fn along(length: usize, at: impl Fn(usize) -> f32, mut put: impl FnMut(usize, f32)) {
    let mut sums = Vec::with_capacity(length + 1);
    sums.push(0.0_f64);
    for i in 0..length {
        sums.push(sums[i] + f64::from(at(i)));
    }
    for i in 0..length {
        let (first, end) = (i.saturating_sub(LOCAL), (i + LOCAL + 1).min(length));
        put(i, ((sums[end] - sums[first]) / (end - first) as f64) as f32);
    }
}

/// The flow of the next finer level to begin with.
fn enlarged(vectors: &[[f32; 2]], from: [usize; 2], to: [usize; 2]) -> Vec<[f32; 2]> {
    let scale = [0, 1].map(|k: usize| to[k] as f32 / from[k] as f32);
    let axis = |i: usize, k: usize| {
        let c = ((i as f32 + 0.5) / scale[k] - 0.5).clamp(0.0, (from[k] - 1) as f32);
        let first = c as usize;
        (first, (first + 1).min(from[k] - 1), c - first as f32)
    };
    let mut large = Vec::with_capacity(to[0] * to[1]);
    for y in 0..to[1] {
        let (y0, y1, t) = axis(y, 1);
        for x in 0..to[0] {
            let (x0, x1, s) = axis(x, 0);
            let at = |x: usize, y: usize, k: usize| vectors[y * from[0] + x][k];
            large.push([0, 1].map(|k: usize| {
                let upper = at(x0, y0, k) + s * (at(x1, y0, k) - at(x0, y0, k));
                let lower = at(x0, y1, k) + s * (at(x1, y1, k) - at(x0, y1, k));
                scale[k] * (upper + t * (lower - upper))
            }));
        }
    }
    large
}

/// Moves the flow to where the pictures, linearized about it, agree best. Gives the root mean
/// square in pixels of what it moved by.
fn refine(from: &Gray, to: &Gray, vectors: &mut [[f32; 2]]) -> f32 {
    let start = vectors.to_vec();
    let data = linearized(from, to, &start);
    let mut equations = Equations::new(from.size);
    for _ in 0..SWEEPS / HELD {
        equations.hold(&data, vectors);
        let changes = (0..HELD).map(|_| equations.sweep());
        let settled = changes.take_while(|&change| change > SETTLED).count();
        equations.read(vectors);
        if settled == 0 {
            break;
        }
    }
    let moved = vectors.iter().zip(&start);
    let moved = moved.map(|(new, old)| (new[0] - old[0]).powi(2) + (new[1] - old[1]).powi(2));
    (moved.sum::<f32>() / start.len() as f32).sqrt()
}

/// The pictures linearized about the flow `start`, at every pixel.
fn linearized(from: &Gray, to: &Gray, start: &[[f32; 2]]) -> Vec<Data> {
    let width = from.size[0];
    let slope = |a: Option<f32>, b: Option<f32>| match (a, b) {
        (Some(a), Some(b)) => 0.5 * (b - a),
        _ => 0.0,
    };
    let of = |(i, &[u, v]): (usize, &[f32; 2])| {
        let (x, y) = ((i % width) as f32, (i / width) as f32);
        let (px, py) = (x + u, y + v);
        let Some(there) = to.at(px, py) else {
            return Data::default();
        };
        // Of both pictures, the mean.
        let dx = 0.5
            * (slope(to.at(px - 1.0, py), to.at(px + 1.0, py))
                + slope(from.at(x - 1.0, y), from.at(x + 1.0, y)));
        let dy = 0.5
            * (slope(to.at(px, py - 1.0), to.at(px, py + 1.0))
                + slope(from.at(x, y - 1.0), from.at(x, y + 1.0)));
        Data {
            x: dx,
            y: dy,
            about: there - from.pixels[i] - dx * u - dy * v,
        }
    };
    start.iter().enumerate().map(of).collect()
}

/// Median of each component, over three by three pixels.
fn median(vectors: &[[f32; 2]], [width, height]: [usize; 2]) -> Vec<[f32; 2]> {
    (0..vectors.len())
        .map(|i| {
            let (x, y) = (i % width, i / width);
            if x > 0 && y > 0 && x + 1 < width && y + 1 < height {
                let row = |first: usize| -> [[f32; 2]; 3] {
                    let row = &vectors[first..first + 3];
                    [row[0], row[1], row[2]]
                };
                let [a, b, c] = row(i - width - 1);
                let [d, e, f] = row(i - 1);
                let [g, h, j] = row(i + width - 1);
                let of = |k: usize| {
                    median_of_nine([a[k], b[k], c[k], d[k], e[k], f[k], g[k], h[k], j[k]])
                };
                return [of(0), of(1)];
            }
            let columns = x.saturating_sub(1)..(x + 2).min(width);
            let mut around = [[0.0; 9]; 2];
            let mut count = 0;
            for row in y.saturating_sub(1)..(y + 2).min(height) {
                for column in columns.clone() {
                    for k in 0..2 {
                        around[k][count] = vectors[row * width + column][k];
                    }
                    count += 1;
                }
            }
            around.map(|mut values| {
                let values = &mut values[..count];
                *values.select_nth_unstable_by(count / 2, f32::total_cmp).1
            })
        })
        .collect()
}

/// The median by the exchanges of J. L. Smith, *Implementing Median Filters in XC4000E FPGAs*,
/// Xcell 23 (1996).
#[inline]
fn median_of_nine(
    [
        mut a,
        mut b,
        mut c,
        mut d,
        mut e,
        mut f,
        mut g,
        mut h,
        mut i,
    ]: [f32; 9],
) -> f32 {
    let order = |low: &mut f32, high: &mut f32| {
        let (one, other) = (*low, *high);
        *low = if one < other { one } else { other };
        *high = if one < other { other } else { one };
    };
    order(&mut b, &mut c);
    order(&mut e, &mut f);
    order(&mut h, &mut i);
    order(&mut a, &mut b);
    order(&mut d, &mut e);
    order(&mut g, &mut h);
    order(&mut b, &mut c);
    order(&mut e, &mut f);
    order(&mut h, &mut i);
    order(&mut a, &mut d);
    order(&mut f, &mut i);
    order(&mut e, &mut h);
    order(&mut d, &mut g);
    order(&mut b, &mut e);
    order(&mut c, &mut f);
    order(&mut e, &mut h);
    order(&mut e, &mut c);
    order(&mut g, &mut e);
    order(&mut e, &mut c);
    e
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Smooth noise of several sizes, which repeats nowhere.
    fn texture(x: f32, y: f32) -> f32 {
        let lattice = |x: i32, y: i32, seed: u32| {
            let mixed = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77);
            let mixed = (mixed ^ seed).wrapping_mul(0xC2B2_AE3D);
            ((mixed ^ (mixed >> 15)).wrapping_mul(0x2C1B_3C6D) >> 16) as f32 / 65535.0 - 0.5
        };
        let noise = |size: f32, seed: u32| {
            let (x, y) = (x / size, y / size);
            let (left, top) = (x.floor(), y.floor());
            let smooth = |t: f32| t * t * (3.0 - 2.0 * t);
            let (s, t) = (smooth(x - left), smooth(y - top));
            let at = |i: i32, j: i32| lattice(left as i32 + i, top as i32 + j, seed);
            let upper = at(0, 0) + s * (at(1, 0) - at(0, 0));
            let lower = at(0, 1) + s * (at(1, 1) - at(0, 1));
            upper + t * (lower - upper)
        };
        128.0 + 60.0 * noise(5.0, 1) + 70.0 * noise(11.0, 2) + 80.0 * noise(23.0, 3)
    }

    fn picture(size: [usize; 2], at: impl Fn(f32, f32) -> f32) -> Vec<f32> {
        (0..size[0] * size[1])
            .map(|i| at((i % size[0]) as f32, (i / size[0]) as f32))
            .collect()
    }

    /// The mean distance to the true flow, eight pixels off the border.
    fn miss(flow: &Flow, truth: impl Fn(f32, f32) -> [f32; 2]) -> f64 {
        let (mut sum, mut count) = (0.0, 0);
        for (i, vector) in flow.vectors.iter().enumerate() {
            let (x, y) = (i % flow.width, i / flow.width);
            if (8..flow.width - 8).contains(&x) && (8..flow.height - 8).contains(&y) {
                let wanted = truth(x as f32, y as f32);
                sum += f64::from((vector[0] - wanted[0]).hypot(vector[1] - wanted[1]));
                count += 1;
            }
        }
        sum / f64::from(count)
    }

    #[test]
    fn shifts_are_found_though_the_light_changes() {
        let size = [96, 72];
        let from = picture(size, texture);
        for [u, v] in [[0.0, 0.0], [2.3, -1.4], [-9.0, 5.0]] {
            let moved = picture(size, |x, y| 0.6 * texture(x - u, y - v) + 31.0);
            let found = miss(&optical_flow(&from, &moved, size), |_, _| [u, v]);
            assert!(found < 0.35, "{u} {v}: {found}");
        }
    }

    #[test]
    fn a_zoom_is_found_and_two_halves_may_move_apart() {
        let size = [96, 72];
        let from = picture(size, texture);
        let zoom = |x: f32, y: f32| [0.05 * (x - 48.0), 0.05 * (y - 36.0)];
        let grown = picture(size, |x, y| texture((x + 2.4) / 1.05, (y + 1.8) / 1.05));
        let found = miss(&optical_flow(&from, &grown, size), zoom);
        assert!(found < 0.2, "{found}");
        let halves = |_: f32, y: f32| [if y < 36.0 { 3.0 } else { -2.0 }, 0.0];
        let parted = picture(size, |x, y| texture(x - halves(x, y)[0], y));
        let found = miss(&optical_flow(&from, &parted, size), halves);
        assert!(found < 0.5, "{found}");
    }

    #[test]
    fn nothing_moves_where_nothing_is_seen_and_small_pictures_are_no_trouble() {
        for size in [[1, 1], [5, 3], [40, 1], [30, 26]] {
            let even = vec![77.0; size[0] * size[1]];
            let flow = optical_flow(&even, &even, size);
            assert!(flow.vectors.iter().flatten().all(|v| v.abs() < 1e-6));
        }
    }
}
