//! Depth of a splat scene, drawn as if it were color.

use glam::DVec3;

use super::MIN_OPACITY;
use crate::{
    capture::Camera,
    raster::Picture,
    splats::{ShField, Splats, sh},
};

/// Depths at which is asked how opaque everything nearer is. With 32 the median depth
/// is within a pixel or so of COLMAP's points (docs/lab/01-photos.md); each two cost a picture.
const STEPS: usize = 32;

/// Fields that tell where the median depth of each pixel is.
///
/// The channels of step k are 1 for the Gaussians no farther than its depth and 0 for
/// the others. Drawn, they are the opacity up to that depth, of which the median depth
/// reaches half. Fields of the chroma kind are neither shifted nor clamped.
pub struct DepthSteps {
    /// Ascending, in world units along the camera's z axis; none without a Gaussian
    /// in the picture.
    depths: Vec<f64>,
    /// Two steps each, of degree 0.
    pub fields: Vec<ShField>,
}

impl DepthSteps {
    /// The steps for one camera: even shares of the Gaussians in the picture.
    pub fn new(splats: &Splats, camera: &Camera) -> Self {
        let seen: Vec<DVec3> = splats
            .means
            .iter()
            .map(|mean| camera.rotation * DVec3::from(mean.map(f64::from)) + camera.translation)
            .collect();
        let in_picture = |p: &&DVec3| {
            let (x, y) = (
                camera.fx * p.x / p.z + camera.cx,
                camera.fy * p.y / p.z + camera.cy,
            );
            p.z > 0.0
                && (0.0..=f64::from(camera.width)).contains(&x)
                && (0.0..=f64::from(camera.height)).contains(&y)
        };
        let mut sorted: Vec<f64> = seen.iter().filter(in_picture).map(|p| p.z).collect();
        sorted.sort_by(f64::total_cmp);
        let depths: Vec<f64> = match sorted.len().checked_sub(1) {
            // The last step sees everything, whatever reaches into the picture.
            Some(last) => (0..STEPS - 1)
                .map(|k| sorted[k * last / (STEPS - 2)])
                .chain([f64::INFINITY])
                .collect(),
            None => Vec::new(),
        };
        let one = (1.0 / sh::C0) as f32;
        let fields = depths
            .as_chunks::<2>()
            .0
            .iter()
            .map(|pair| ShField {
                degree: 0,
                channels: 2,
                coefficients: seen
                    .iter()
                    .flat_map(|p| pair.map(|depth| if p.z <= depth { one } else { 0.0 }))
                    .collect(),
            })
            .collect();
        Self { depths, fields }
    }

    /// Median depth along the camera's z axis in world units, `[height, width]`, by
    /// linear interpolation between two steps; NaN where opacity is below
    /// [`MIN_OPACITY`]. `pictures` are those of the fields, of `pixels` pixels each.
    ///
    /// # Panics
    /// When the pictures are not the fields'.
    pub fn median(&self, pictures: &[Picture], pixels: usize) -> Vec<f32> {
        assert_eq!(pictures.len(), self.fields.len(), "a picture of each field");
        let at = |step: usize, pixel: usize| pictures[step / 2].pixels[2 * pixel + step % 2];
        let Some(last) = self.depths.len().checked_sub(1) else {
            return vec![f32::NAN; pixels];
        };
        (0..pixels)
            .map(|pixel| {
                let opacity = at(last, pixel);
                if opacity.is_nan() || opacity < MIN_OPACITY {
                    return f32::NAN;
                }
                let half = 0.5 * opacity;
                let step = (0..last).find(|&k| at(k, pixel) >= half);
                let depth = match step {
                    Some(0) => self.depths[0],
                    Some(k) => {
                        let (below, above) = (at(k - 1, pixel), at(k, pixel));
                        let share = f64::from((half - below) / (above - below));
                        self.depths[k - 1] + share * (self.depths[k] - self.depths[k - 1])
                    }
                    // Half of what is seen lies beyond all centers in the picture.
                    None => f64::NAN,
                };
                depth as f32
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::flow::tests::camera;
    use super::*;

    /// A picture of one pixel by Gaussians with these weights.
    fn drawn(steps: &DepthSteps, weights: &[f64]) -> Vec<Picture> {
        let draw = |field: &ShField| Picture {
            width: 1,
            height: 1,
            channels: 2,
            pixels: (0..2)
                .map(|c| {
                    let value = |(i, w): (usize, &f64)| w * f64::from(field.of(i)[c]) * sh::C0;
                    weights.iter().enumerate().map(value).sum::<f64>() as f32
                })
                .collect(),
        };
        steps.fields.iter().map(draw).collect()
    }

    /// Gaussians on the camera's axis, a step of 0.1 apart, from 2 to 8.
    fn on_axis() -> (Splats, DepthSteps) {
        let means = (0..=60).map(|i| [0.0, 0.0, 2.0 + 0.1 * i as f32]);
        let splats = Splats {
            means: means.collect(),
            ..Splats::default()
        };
        let steps = DepthSteps::new(&splats, &camera(DVec3::ZERO, 0.0));
        (splats, steps)
    }

    #[test]
    fn a_veil_does_not_move_the_median() {
        let (splats, steps) = on_axis();
        let weights = |parts: &[(usize, f64)]| {
            let mut weights = vec![0.0; splats.len()];
            parts.iter().for_each(|&(i, w)| weights[i] += w);
            weights
        };
        let median = |parts: &[(usize, f64)]| steps.median(&drawn(&steps, &weights(parts)), 1)[0];
        // Steps are 0.2 apart: the answer lies between the two about the wall.
        for wall in [10, 37, 60] {
            let want = 2.0 + 0.1 * wall as f32;
            let clear = median(&[(wall, 0.99)]);
            assert!((clear - want).abs() <= 0.21, "{clear} {want}");
            // The expected depth would move by more than 1.
            let veiled = median(&[(3, 0.3), (wall, 0.65), (60, 0.04)]);
            assert!((veiled - want).abs() <= 0.21, "{veiled} {want}");
        }
        assert!(median(&[(30, 0.49)]).is_nan());
        assert!(median(&[(30, f64::NAN)]).is_nan());
        // Two halves: the median turns from one to the other.
        assert!(median(&[(5, 0.5), (50, 0.4)]) < 2.8);
        assert!(median(&[(5, 0.4), (50, 0.5)]) > 6.6);
    }

    #[test]
    fn what_is_out_of_the_picture_makes_no_step() {
        let (splats, steps) = on_axis();
        let mut more = splats.clone();
        // Behind the camera, beside the picture, and not a number.
        more.means
            .extend([[0.0, 0.0, -5.0], [900.0, 0.0, 40.0], [f32::NAN; 3]]);
        let same = DepthSteps::new(&more, &camera(DVec3::ZERO, 0.0));
        assert_eq!(same.depths, steps.depths);
        assert_eq!(same.depths.len(), STEPS);
        // Nothing in the picture: no fields and no depth.
        let away = DepthSteps::new(&splats, &camera(DVec3::new(0.0, 0.0, 50.0), 0.0));
        assert!(away.fields.is_empty());
        assert!(away.median(&[], 3).iter().all(|z| z.is_nan()));
    }
}
