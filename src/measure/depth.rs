//! Depth of a splat scene, drawn as if it were colour.

use glam::DVec3;

use crate::{
    capture::Camera,
    raster::{Picture, constants::COLOR_MAX},
    splats::{ShField, Splats, sh},
};

/// Coordinates go no farther than this on the device; what is beyond is as far as can
/// be told. Below [`COLOR_MAX`] by rounding's due.
const FARTHEST: f64 = 0.99 * COLOR_MAX as f64;

/// Where Gaussians are, as fields of two channels, which the rasterizer neither shifts
/// nor clamps: x and y, z and 1.
pub struct PositionFields {
    /// Subtracted from the centres, in world units.
    origin: DVec3,
    /// World units to one on the device.
    scale: f64,
    /// (x, y) and (z, 1), of degree 0.
    pub fields: [ShField; 2],
}

impl PositionFields {
    /// The fields of some Gaussians; `scale` is the size of the scene in world units
    /// and `origin` a place in it.
    pub fn new(splats: &Splats, origin: DVec3, scale: f64) -> Self {
        let field = |of: &dyn Fn(DVec3) -> [f64; 2]| ShField {
            degree: 0,
            channels: 2,
            coefficients: splats
                .means
                .iter()
                .flat_map(|&mean| {
                    let place = (DVec3::from(mean.map(f64::from)) - origin) / scale;
                    of(place).map(|v| (v.clamp(-FARTHEST, FARTHEST) / sh::C0) as f32)
                })
                .collect(),
        };
        Self {
            origin,
            scale,
            fields: [field(&|p| [p.x, p.y]), field(&|p| [p.z, 1.0])],
        }
    }

    /// Expected depth along the camera's z axis in world units (NaN where nothing is
    /// drawn) and opacity in [0, 1], each `[height, width]`.
    ///
    /// # Panics
    /// When the pictures are not the two fields'.
    pub fn depth(&self, camera: &Camera, xy: &Picture, z1: &Picture) -> (Vec<f32>, Vec<f32>) {
        assert!(
            xy.channels == 2 && z1.channels == 2,
            "pictures of the fields"
        );
        let axis = camera.rotation.row(2);
        let from_origin = axis.dot(self.origin) + camera.translation.z;
        xy.pixels
            .chunks_exact(2)
            .zip(z1.pixels.chunks_exact(2))
            .map(|(xy, z1)| {
                // The blend is linear, and so is depth in position.
                let place = DVec3::new(xy[0].into(), xy[1].into(), z1[0].into());
                let mean = self.scale * place / f64::from(z1[1]);
                ((axis.dot(mean) + from_origin) as f32, z1[1])
            })
            .unzip()
    }
}

#[cfg(test)]
mod tests {
    use super::super::flow::tests::camera;
    use super::*;

    fn picture(pixels: &[[f64; 2]]) -> Picture {
        Picture {
            width: pixels.len() as u32,
            height: 1,
            channels: 2,
            pixels: pixels.iter().flatten().map(|&v| v as f32).collect(),
        }
    }

    #[test]
    fn depth_of_blended_places() {
        let splats = Splats {
            means: vec![[101.0, 2.0, 9.0], [103.0, -4.0, 5.0], [1e9, 0.0, 0.0]],
            ..Splats::default()
        };
        let origin = DVec3::new(100.0, 0.0, 5.0);
        let fields = PositionFields::new(&splats, origin, 2.0);
        let value = |field: usize, i: usize| {
            let pair = fields.fields[field].of(i);
            [pair[0], pair[1]].map(|c| f64::from(c) * sh::C0)
        };
        // The pixel sees a quarter of the first, half of the second, and nothing.
        let mix = |field: usize| {
            let (p, q) = (value(field, 0), value(field, 1));
            [0.25 * p[0] + 0.5 * q[0], 0.25 * p[1] + 0.5 * q[1]]
        };
        let camera = camera(DVec3::new(100.0, 0.0, -1.0), 0.3);
        let (depth, opacity) = fields.depth(
            &camera,
            &picture(&[mix(0), value(0, 0), [0.0; 2]]),
            &picture(&[mix(1), value(1, 0), [0.0; 2]]),
        );
        let z = |p: DVec3| (camera.rotation * p + camera.translation).z;
        let first = DVec3::new(101.0, 2.0, 9.0);
        let second = DVec3::new(103.0, -4.0, 5.0);
        let want = z((first + 2.0 * second) / 3.0);
        assert!(
            (f64::from(depth[0]) - want).abs() < 1e-4,
            "{} {want}",
            depth[0]
        );
        assert!((f64::from(depth[1]) - z(first)).abs() < 1e-4);
        assert!(depth[2].is_nan());
        assert!((opacity[0] - 0.75).abs() < 1e-6 && opacity[2] == 0.0);
        // A stray Gaussian stays drawable.
        assert!(
            value(0, 2)[0] < f64::from(COLOR_MAX) && value(0, 2)[0] > 0.9 * f64::from(COLOR_MAX)
        );
    }
}
