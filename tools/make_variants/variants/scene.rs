//! A scene in memory, between reading and writing.

use std::path::Path;

use glam::{DMat3, DVec3};
use gs_chroma::capture::{self, Capture};
use image::{GrayImage, ImageBuffer, Luma, RgbImage};

use super::error::Error;
use super::lens::{Camera, Lens};

pub struct Scene {
    /// Sorted by name.
    pub views: Vec<View>,
    pub points: Vec<Point>,
}

pub struct View {
    /// Path below `images/` without extension, `/` between folders.
    pub stem: String,
    pub camera: Camera,
    /// World-to-camera.
    pub rotation: DMat3,
    pub translation: DVec3,
    pub picture: RgbImage,
    /// The photo's file where it is not `picture` as 8-bit RGB.
    pub developed: Option<Developed>,
    /// 0 where the photo shall be ignored, else 255.
    pub mask: Option<GrayImage>,
    /// True if the view is held out of `fit` for measuring.
    pub held_out: bool,
}

/// Content of a photo's file that is not 8-bit RGB.
pub enum Developed {
    Gray(GrayImage),
    Gray16(ImageBuffer<Luma<u16>, Vec<u16>>),
    /// Linear values, row by row, of the picture's size.
    Float(Vec<f32>),
}

pub struct Point {
    pub position: DVec3,
    pub color: [u8; 3],
    pub track: Vec<Observation>,
}

/// Pixel of a view that shows a point.
pub struct Observation {
    pub view: usize,
    /// x and y; the center of the top left pixel is at (0.5, 0.5).
    pub pixel: [f64; 2],
}

impl View {
    /// A world point in the camera's axes.
    pub fn seen(&self, point: DVec3) -> DVec3 {
        self.rotation * point + self.translation
    }

    /// The camera's center in the world.
    pub fn center(&self) -> DVec3 {
        -(self.rotation.transpose() * self.translation)
    }
}

impl Scene {
    /// Reads a COLMAP folder with its photos in the size of its model.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let capture = Capture::load(folder)?;
        let held_out = capture::split(&capture.views, true).test;
        let views = capture.views.iter().enumerate().map(|(index, view)| {
            // The capture may have been moved to the origin: move it back.
            let camera = view.camera.recentered(-capture.offset);
            let picture = picture(&view.image_path, [camera.width, camera.height])?;
            Ok(View {
                stem: Path::new(&view.name)
                    .with_extension("")
                    .to_string_lossy()
                    .replace('\\', "/"),
                camera: Camera {
                    size: [camera.width, camera.height],
                    focal: [camera.fx, camera.fy],
                    center: [camera.cx, camera.cy],
                    lens: Lens::Pinhole,
                },
                rotation: camera.rotation,
                translation: camera.translation,
                picture,
                developed: None,
                mask: None,
                held_out: held_out.contains(&index),
            })
        });
        let views = views.collect::<Result<_, Error>>()?;
        let points = capture.points.iter().map(|point| Point {
            position: point.position + capture.offset,
            color: point.color,
            track: point
                .track
                .iter()
                .map(|&capture::Observation { view, pixel }| Observation { view, pixel })
                .collect(),
        });
        Ok(Self {
            views,
            points: points.collect(),
        })
    }

    /// Moves every observation, or drops it; then drops points that fewer than two views
    /// see, as COLMAP would. Points that none saw before are kept.
    pub fn move_observations(&mut self, to: impl Fn(usize, [f64; 2]) -> Option<[f64; 2]>) {
        self.points.retain_mut(|point| {
            let untracked = point.track.is_empty();
            point
                .track
                .retain_mut(|seen| match to(seen.view, seen.pixel) {
                    Some(pixel) => {
                        seen.pixel = pixel;
                        true
                    }
                    None => false,
                });
            untracked || point.track.len() >= 2
        });
    }

    /// The mean of the cameras' centers.
    pub fn center(&self) -> DVec3 {
        let sum: DVec3 = self.views.iter().map(View::center).sum();
        sum / self.views.len() as f64
    }

    /// The point with the least squares of distances from the optical axes.
    pub fn aim(&self) -> DVec3 {
        let mut across = DMat3::ZERO;
        let mut sum = DVec3::ZERO;
        for view in &self.views {
            let axis = view.rotation.row(2);
            let projection =
                DMat3::IDENTITY - DMat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
            across += projection;
            sum += projection * view.center();
        }
        across.inverse() * sum
    }

    /// The views that are trained on, with their indices.
    pub fn training(&mut self) -> impl Iterator<Item = (usize, &mut View)> {
        let views = self.views.iter_mut().enumerate();
        views.filter(|(_, view)| !view.held_out)
    }
}

/// A photo, which must have its camera's size.
fn picture(path: &Path, [width, height]: [u32; 2]) -> Result<RgbImage, Error> {
    let failure = |reason: String| Error::Photo {
        path: path.into(),
        reason,
    };
    let picture = image::open(path).map_err(|error| failure(error.to_string()))?;
    let picture = picture.into_rgb8();
    if picture.dimensions() == (width, height) {
        return Ok(picture);
    }
    let (w, h) = picture.dimensions();
    Err(failure(format!(
        "has {w}×{h} pixels and its camera {width}×{height}; take a folder where they agree"
    )))
}
