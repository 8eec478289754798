//! Visibility of one picture's pixels in another.

use super::flow::{Flow, sample};

/// The rule in words, for reports.
pub const MASK_RULE: &str = "hidden where |w(B)+F|² > 0.01(|w(B)|²+|F|²)+0.5, \
    where |∇u|²+|∇v|² > 0.01|F|²+0.002, outside the other picture, or below opacity 0.5 in either";

/// Share of the squared flows, and squared pixels, by which there and back may differ.
const ROUND_TRIP: [f64; 2] = [0.01, 0.5];

/// Share of the squared flow, and its offset, that the squared gradient may reach.
const BOUNDARY: [f64; 2] = [0.01, 0.002];

/// True for pixels of the first picture that are visible in the second, `[height, width]`.
///
/// `forward` (F, with components u and v) leads from the first picture to the second,
/// `backward` (B) from the second to the first. The rule is that of W.-S. Lai et al.,
/// *Learning Blind Video Temporal Consistency*, ECCV 2018 (after Ruder et al. 2016). With
/// w(B) the backward flow at a pixel's target, the pixel is hidden where the way there and
/// back does not end near where it began,
///
/// `|w(B) + F|² > 0.01 (|w(B)|² + |F|²) + 0.5`,
///
/// where the flow breaks (forward differences, backward ones in the last row and column),
///
/// `|∇u|² + |∇v|² > 0.01 |F|² + 0.002`,
///
/// and where the target lies outside the picture or a flow is unknown.
pub fn visible(forward: &Flow, backward: &Flow) -> Vec<bool> {
    let size = [backward.width, backward.height];
    (0..forward.vectors.len())
        .map(|i| {
            let f = forward.vectors[i].map(f64::from);
            let Some(b) = sample(&backward.vectors, size, forward.target(i)) else {
                return false;
            };
            let trip = square([b[0] + f[0], b[1] + f[1]]);
            // Written so that NaN fails.
            trip <= ROUND_TRIP[0] * (square(b) + square(f)) + ROUND_TRIP[1]
                && squared_gradient(forward, i) <= BOUNDARY[0] * square(f) + BOUNDARY[1]
        })
        .collect()
}

fn square([x, y]: [f64; 2]) -> f64 {
    x * x + y * y
}

/// `|∇u|² + |∇v|²` at a pixel.
fn squared_gradient(flow: &Flow, index: usize) -> f64 {
    let (x, y) = (index % flow.width, index / flow.width);
    let step = |at: usize, length: usize, stride: usize| {
        let (from, to) = match () {
            () if at + 1 < length => (index, index + stride),
            () if at > 0 => (index - stride, index),
            () => (index, index),
        };
        let difference =
            |c: usize| f64::from(flow.vectors[to][c]) - f64::from(flow.vectors[from][c]);
        square([difference(0), difference(1)])
    };
    step(x, flow.width, 1) + step(y, flow.height, flow.width)
}

#[cfg(test)]
mod tests {
    use super::super::flow::tests::camera;
    use super::*;
    use glam::DVec3;

    fn uniform(vector: [f32; 2]) -> Flow {
        Flow {
            width: 8,
            height: 6,
            vectors: vec![vector; 48],
        }
    }

    #[test]
    fn there_and_back_within_the_rule() {
        let forward = uniform([2.0, 0.0]);
        let shown = |back: [f32; 2]| visible(&forward, &uniform(back));
        // Pixels of the last two columns leave the picture.
        let exact: Vec<bool> = (0..48).map(|i| i % 8 < 6).collect();
        assert_eq!(shown([-2.0, 0.0]), exact);
        // |e|² against 0.01 (4 + |b|²) + 0.5: 0.75 passes, 0.8 does not.
        assert_eq!(shown([-2.0, 0.75]), exact);
        assert!(!shown([-2.0, 0.8]).contains(&true));
        assert!(!shown([f32::NAN, 0.0]).contains(&true));
    }

    #[test]
    fn where_the_flow_breaks_nothing_is_compared() {
        let mut forward = uniform([0.0, 0.0]);
        for (i, vector) in forward.vectors.iter_mut().enumerate() {
            // Below √0.002 a pixel in the upper half, beyond it in the lower.
            let slope = if i / 8 < 3 { 0.04 } else { 0.05 };
            vector[1] = 0.0;
            vector[0] = slope * (i % 8) as f32 - 0.2;
        }
        let mut backward = forward.clone();
        for vector in &mut backward.vectors {
            *vector = vector.map(|v| -v);
        }
        let seen = visible(&forward, &backward);
        // Columns whose targets lie inside; the third row borders on the break.
        for row in 0..6 {
            for column in 1..7 {
                let index = 8 * row + column;
                let inside = forward.target(index)[0] >= 0.5 && forward.target(index)[0] <= 7.5;
                let step = f64::from(
                    forward.vectors[index + if row < 5 { 8 } else { 0 }][0]
                        - forward.vectors[index][0],
                )
                .powi(2);
                let want = inside
                    && row < 3
                    && 0.0016 + step
                        <= 0.002 + 0.01 * square(forward.vectors[index].map(f64::from));
                assert_eq!(seen[index], want, "row {row}, column {column}");
            }
        }
        assert!(seen[8 + 3] && !seen[3 * 8 + 3]);
    }

    /// A wall at depth 8 behind a board at depth 2 in the middle of the picture.
    #[test]
    fn what_an_occluder_hides_is_not_compared() {
        let (from, to) = (
            camera(DVec3::ZERO, 0.0),
            camera(DVec3::new(0.4, 0.0, 0.0), 0.0),
        );
        // The board spans x from -0.2 to 0.2 in the world, over the whole height.
        let depth = |center: f64| -> Vec<f32> {
            (0..1200)
                .map(|i| {
                    let u = (i % 40) as f64 + 0.5;
                    let x = 2.0 * (u - 21.0) / 50.0 + center;
                    if x.abs() < 0.2 { 2.0 } else { 8.0 }
                })
                .collect()
        };
        let forward = Flow::geometric(&from, &to, &depth(0.0));
        let backward = Flow::geometric(&to, &from, &depth(0.4));
        let seen = visible(&forward, &backward);
        // In the first view the board fills columns 16 to 25, in the second 6 to 15; the
        // wall moves by 2.5 pixels. Its columns 8.5 to 18.5 are hidden behind the board.
        for column in 0..40 {
            let got = seen[15 * 40 + column];
            match column {
                // Out of the picture, and hidden behind the board in the second view.
                0..=2 | 9..=14 => assert!(!got, "column {column}"),
                4..=7 | 17..=23 | 27..=38 => assert!(got, "column {column}"),
                _ => {}
            }
        }
    }
}
