//! The uniform that tells every kernel which camera it works for.

use bytemuck::{Pod, Zeroable};

use super::constants::{FRUSTUM_MARGIN, TILE_SIDE};
use crate::capture::Camera;

/// Twin of `struct View` in `shaders/common/view.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ViewUniform {
    /// World-to-camera rows, translation last.
    pub rows: [[f32; 4]; 3],
    /// Camera center in world space; near distance.
    pub center_near: [f32; 4],
    /// fx, fy, cx, cy in pixels.
    pub intrinsics: [f32; 4],
    /// Lowest x/z, y/z, highest x/z, y/z of the linearized projection.
    pub slope_limits: [f32; 4],
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Tiles across and down.
    pub tiles: [u32; 2],
    /// Number of Gaussians.
    pub splat_count: u32,
    /// Degree of the spherical harmonics in use.
    pub sh_degree: u32,
    /// Entries that the tile lists have room for.
    pub instance_capacity: u32,
    /// Unused; keeps the size a multiple of 16.
    pub padding: u32,
}

impl ViewUniform {
    /// The uniform for `camera`, showing nothing nearer than `near` world units.
    pub fn new(camera: &Camera, near: f64, splat_count: usize, sh_degree: u32) -> Self {
        let rotation = camera.rotation.transpose();
        let row =
            |axis: glam::DVec3, t: f64| [axis.x as f32, axis.y as f32, axis.z as f32, t as f32];
        let center = camera.center();
        let (width, height) = (f64::from(camera.width), f64::from(camera.height));
        let margin = [
            FRUSTUM_MARGIN * 0.5 * width / camera.fx,
            FRUSTUM_MARGIN * 0.5 * height / camera.fy,
        ];
        Self {
            rows: [
                row(rotation.x_axis, camera.translation.x),
                row(rotation.y_axis, camera.translation.y),
                row(rotation.z_axis, camera.translation.z),
            ],
            center_near: [
                center.x as f32,
                center.y as f32,
                center.z as f32,
                near as f32,
            ],
            intrinsics: [camera.fx, camera.fy, camera.cx, camera.cy].map(|v| v as f32),
            slope_limits: [
                -camera.cx / camera.fx - margin[0],
                -camera.cy / camera.fy - margin[1],
                (width - camera.cx) / camera.fx + margin[0],
                (height - camera.cy) / camera.fy + margin[1],
            ]
            .map(|v| v as f32),
            size: [camera.width, camera.height],
            tiles: [
                camera.width.div_ceil(TILE_SIDE),
                camera.height.div_ceil(TILE_SIDE),
            ],
            splat_count: splat_count as u32,
            sh_degree,
            instance_capacity: 0,
            padding: 0,
        }
    }

    /// Tiles in all.
    pub fn tile_count(&self) -> usize {
        (self.tiles[0] * self.tiles[1]) as usize
    }

    /// Pixels in all.
    pub fn pixel_count(&self) -> usize {
        (self.size[0] * self.size[1]) as usize
    }
}
