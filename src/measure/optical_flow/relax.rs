//! Successive over-relaxation of a flow, in the order of a checkerboard: pixels of one color have
//! neighbors of the other only, so that whole rows are solved at once.

/// Weight of smoothness relative to data, both in units of local contrast.
const SMOOTHNESS: f32 = 0.12;

/// Below this, penalties are quadratic: of data, in local contrasts, and of slopes, in pixels.
const ROUNDED: [f32; 2] = [0.05, 0.05];

/// Successive over-relaxation.
const OVER: f32 = 1.7;

/// The difference of two pictures at one pixel, linear in the flow `v`: `x v_x + y v_y + about`.
#[derive(Clone, Copy, Default)]
pub(super) struct Data {
    pub x: f32,
    pub y: f32,
    pub about: f32,
}

/// Every pixel's 2 × 2 system for its own vector while the penalties' weights are held.
pub(super) struct Equations {
    size: [usize; 2],
    /// Pixels of one color in a row, and one of the border on either side.
    stride: usize,
    /// Pixels of which the sum of column and row is even, and the others.
    colors: [Planes; 2],
    /// Of a row, both components.
    sums: [Vec<f32>; 2],
}

/// Values of the pixels of one color, with zeros around.
struct Planes {
    flow: [Vec<f32>; 2],
    /// xx, xy and yy of the inverse, times the relaxation.
    inverse: [Vec<f32>; 3],
    /// The data's part of the right-hand side.
    wanted: [Vec<f32>; 2],
    /// Weights of smoothness to the left, to the right, above and below; 0 at the border.
    smooth: [Vec<f32>; 4],
}

impl Equations {
    pub fn new(size: [usize; 2]) -> Self {
        let stride = size[0].div_ceil(2) + 2;
        let plane = || vec![0.0; stride * (size[1] + 2)];
        let planes = || Planes {
            flow: std::array::from_fn(|_| plane()),
            inverse: std::array::from_fn(|_| plane()),
            wanted: std::array::from_fn(|_| plane()),
            smooth: std::array::from_fn(|_| plane()),
        };
        Self {
            size,
            stride,
            colors: [planes(), planes()],
            sums: [vec![0.0; stride], vec![0.0; stride]],
        }
    }

    /// Color and index of the pixel in column `x` and row `y`.
    fn place(&self, x: usize, y: usize) -> (usize, usize) {
        ((x + y) % 2, (y + 1) * self.stride + x / 2 + 1)
    }

    /// Takes the flow, and the penalties' weights at it.
    pub fn hold(&mut self, data: &[Data], flow: &[[f32; 2]]) {
        let [width, height] = self.size;
        let edge = |i: usize, j: usize| {
            let [du, dv] = [flow[j][0] - flow[i][0], flow[j][1] - flow[i][1]];
            SMOOTHNESS / (du * du + dv * dv + ROUNDED[1] * ROUNDED[1]).sqrt()
        };
        let mut above = vec![0.0; width];
        for y in 0..height {
            let mut left = 0.0;
            for (x, above) in above.iter_mut().enumerate() {
                let i = y * width + x;
                let right = if x + 1 < width { edge(i, i + 1) } else { 0.0 };
                let below = match y + 1 < height {
                    true => edge(i, i + width),
                    false => 0.0,
                };
                let Data {
                    x: dx,
                    y: dy,
                    about,
                } = data[i];
                let rest = about + dx * flow[i][0] + dy * flow[i][1];
                let weight = 1.0 / (rest * rest + ROUNDED[0] * ROUNDED[0]).sqrt();
                let total = left + right + *above + below;
                let [xx, xy] = [weight * dx * dx + total, weight * dx * dy];
                let yy = weight * dy * dy + total;
                let determinant = xx * yy - xy * xy;
                // A picture of one pixel has none.
                let scale = match determinant > 0.0 {
                    true => OVER / determinant,
                    false => 0.0,
                };
                let (color, place) = self.place(x, y);
                let planes = &mut self.colors[color];
                let put = |planes: &mut [Vec<f32>], values: &[f32]| {
                    for (plane, value) in planes.iter_mut().zip(values) {
                        plane[place] = *value;
                    }
                };
                put(&mut planes.flow, &flow[i]);
                put(&mut planes.inverse, &[scale * yy, -scale * xy, scale * xx]);
                put(
                    &mut planes.wanted,
                    &[-weight * dx * about, -weight * dy * about],
                );
                put(&mut planes.smooth, &[left, right, *above, below]);
                (left, *above) = (right, below);
            }
        }
    }

    /// Solves for every pixel once. Gives the root mean square of the changes, in pixels.
    pub fn sweep(&mut self) -> f32 {
        let [width, height] = self.size;
        let mut squares = 0.0;
        for color in 0..2 {
            for y in 0..height {
                squares += self.sweep_row(color, y);
            }
        }
        (squares / (width * height) as f32).sqrt()
    }

    /// Solves for a row's pixels of one color. Gives the sum of squares of the changes.
    fn sweep_row(&mut self, color: usize, y: usize) -> f32 {
        let first = (color + y) % 2;
        let count = (self.size[0] + 1 - first) / 2;
        let row = (y + 1) * self.stride + 1;
        let [even, odd] = &mut self.colors;
        let (own, others) = match color {
            0 => (even, &odd.flow),
            _ => (odd, &even.flow),
        };
        let smooth = own.smooth.each_ref().map(|plane| &plane[row..row + count]);
        let starts = [
            row + first - 1,
            row + first,
            row - self.stride,
            row + self.stride,
        ];
        for ((sums, wanted), other) in self.sums.iter_mut().zip(&own.wanted).zip(others) {
            let around = starts.map(|at| &other[at..at + count]);
            add_up(
                &mut sums[..count],
                &wanted[row..row + count],
                smooth,
                around,
            );
        }
        let inverse = own.inverse.each_ref().map(|plane| &plane[row..row + count]);
        let [u, v] = own
            .flow
            .each_mut()
            .map(|plane| &mut plane[row..row + count]);
        let [sum_u, sum_v] = self.sums.each_mut().map(|sums| &mut sums[..count]);
        relax(inverse, [sum_u, sum_v], [u, v]);
        self.sums
            .iter()
            .map(|changes| squares(&changes[..count]))
            .sum()
    }

    /// Writes the flow, `[height, width]`.
    pub fn read(&self, flow: &mut [[f32; 2]]) {
        let width = self.size[0];
        for (i, vector) in flow.iter_mut().enumerate() {
            let (color, place) = self.place(i % width, i / width);
            let [u, v] = &self.colors[color].flow;
            *vector = [u[place], v[place]];
        }
    }
}

// One loop each over slices that do not overlap: compilers make vector instructions of these.

/// Sums of the neighbors' flow, weighted, and of the data's part.
fn add_up(sums: &mut [f32], wanted: &[f32], smooth: [&[f32]; 4], around: [&[f32]; 4]) {
    let count = sums.len();
    let wanted = &wanted[..count];
    let [s0, s1, s2, s3] = smooth.map(|plane| &plane[..count]);
    let [a0, a1, a2, a3] = around.map(|plane| &plane[..count]);
    for i in 0..count {
        sums[i] = wanted[i] + s0[i] * a0[i] + s1[i] * a1[i] + s2[i] * a2[i] + s3[i] * a3[i];
    }
}

/// Moves the flow by what the sums ask for, and leaves the changes in their place.
fn relax(inverse: [&[f32]; 3], sums: [&mut [f32]; 2], flow: [&mut [f32]; 2]) {
    let [sum_u, sum_v] = sums;
    let [flow_u, flow_v] = flow;
    let count = flow_u.len();
    let [xx, xy, yy] = inverse.map(|plane| &plane[..count]);
    let (sum_u, sum_v, flow_v) = (
        &mut sum_u[..count],
        &mut sum_v[..count],
        &mut flow_v[..count],
    );
    for i in 0..count {
        let (u, v) = (sum_u[i], sum_v[i]);
        sum_u[i] = xx[i] * u + xy[i] * v - OVER * flow_u[i];
        sum_v[i] = xy[i] * u + yy[i] * v - OVER * flow_v[i];
        flow_u[i] += sum_u[i];
        flow_v[i] += sum_v[i];
    }
}

fn squares(values: &[f32]) -> f32 {
    let (lanes, rest) = values.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for lane in lanes {
        for (sum, value) in sums.iter_mut().zip(lane) {
            *sum += value * value;
        }
    }
    sums.iter().sum::<f32>() + rest.iter().map(|value| value * value).sum::<f32>()
}
