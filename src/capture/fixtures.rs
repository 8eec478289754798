//! Small COLMAP folders for tests.

use std::fs;
use std::path::Path;

use tempfile::TempDir;

use super::{Capture, CaptureError};

/// A COLMAP model in memory, written as it is: also with lies.
#[derive(Clone)]
pub(super) struct Model {
    pub cameras: Vec<CameraRecord>,
    pub images: Vec<Image>,
    pub points: Vec<PointRecord>,
}

/// Position, color, track: image by its place in `images`, index of the 2D point.
pub(super) type PointRecord = ([f64; 3], [u8; 3], Vec<(u32, u32)>);

#[derive(Clone)]
pub(super) struct CameraRecord {
    pub id: u32,
    /// The camera model's name in text and number in binary files.
    pub model: (&'static str, i32),
    pub width: u64,
    pub height: u64,
    pub parameters: Vec<f64>,
}

#[derive(Clone)]
pub(super) struct Image {
    pub quaternion: [f64; 4],
    pub translation: [f64; 3],
    pub camera: u32,
    pub name: String,
    /// x, y and the point by its place in `points`, if it belongs to one.
    pub observations: Vec<(f64, f64, Option<u64>)>,
}

/// Width and height of every photo.
pub(super) const SIZE: (u32, u32) = (8, 6);

impl Model {
    /// Three views along x of two points, under two cameras: the first sees both
    /// points and something else, the third the first point.
    pub fn example() -> Self {
        let camera = |id, model, parameters: &[f64]| CameraRecord {
            id,
            model,
            width: u64::from(SIZE.0),
            height: u64::from(SIZE.1),
            parameters: parameters.into(),
        };
        let view = |name: &str, x: f64, camera: u32, observations: &[_]| Image {
            quaternion: [0.8, 0.0, 0.6, 0.0],
            translation: [x, 0.25, 2.0],
            camera,
            name: name.into(),
            observations: observations.into(),
        };
        Self {
            cameras: vec![
                camera(7, ("PINHOLE", 1), &[10.0, 11.0, 4.0, 3.0]),
                camera(3, ("SIMPLE_PINHOLE", 0), &[12.0, 4.5, 3.5]),
            ],
            images: vec![
                view(
                    "b.png",
                    1.0,
                    7,
                    &[(1.5, 2.5, Some(1)), (3.25, 4.0, None), (5.0, 0.5, Some(0))],
                ),
                view("left/a c.png", -1.0, 3, &[]),
                view("a.png", 0.0, 7, &[(6.5, 1.75, Some(0))]),
            ],
            points: vec![
                ([0.5, -0.125, 6.0], [200, 100, 50], vec![(0, 2), (2, 0)]),
                ([-1.5, 1.0, 8.0], [0, 255, 7], vec![(0, 0)]),
            ],
        }
    }

    /// The example with all images under its first camera.
    pub fn of_one_camera() -> Self {
        let mut model = Self::example();
        for image in &mut model.images {
            image.camera = model.cameras[0].id;
        }
        model
    }

    /// The three `.bin` files: cameras, images, points3D.
    pub fn binary(&self) -> [Vec<u8>; 3] {
        let mut cameras = (self.cameras.len() as u64).to_le_bytes().to_vec();
        for camera in &self.cameras {
            cameras.extend(camera.id.to_le_bytes());
            cameras.extend(camera.model.1.to_le_bytes());
            cameras.extend(camera.width.to_le_bytes());
            cameras.extend(camera.height.to_le_bytes());
            cameras.extend(camera.parameters.iter().flat_map(|p| p.to_le_bytes()));
        }
        let mut images = (self.images.len() as u64).to_le_bytes().to_vec();
        for (id, image) in self.images.iter().enumerate() {
            images.extend((id as u32).to_le_bytes());
            images.extend(image.quaternion.iter().flat_map(|q| q.to_le_bytes()));
            images.extend(image.translation.iter().flat_map(|t| t.to_le_bytes()));
            images.extend(image.camera.to_le_bytes());
            images.extend(image.name.bytes());
            images.push(0);
            images.extend((image.observations.len() as u64).to_le_bytes());
            for (x, y, point) in &image.observations {
                images.extend([x, y].into_iter().flat_map(|c| c.to_le_bytes()));
                images.extend(point.unwrap_or(u64::MAX).to_le_bytes());
            }
        }
        let mut points = (self.points.len() as u64).to_le_bytes().to_vec();
        for (id, (position, color, track)) in self.points.iter().enumerate() {
            points.extend((id as u64).to_le_bytes());
            points.extend(position.iter().flat_map(|p| p.to_le_bytes()));
            points.extend(color);
            points.extend(0.5_f64.to_le_bytes());
            points.extend((track.len() as u64).to_le_bytes());
            for (image, index) in track {
                points.extend([image, index].into_iter().flat_map(|n| n.to_le_bytes()));
            }
        }
        [cameras, images, points]
    }

    /// The three `.txt` files: cameras, images, points3D.
    pub fn text(&self) -> [Vec<u8>; 3] {
        let join = |values: &[f64]| {
            let words: Vec<String> = values.iter().map(f64::to_string).collect();
            words.join(" ")
        };
        let mut cameras = "# Camera list\n".to_string();
        for camera in &self.cameras {
            let CameraRecord {
                id,
                model: (model, _),
                width,
                height,
                parameters,
            } = camera;
            cameras += &format!("{id} {model} {width} {height} {}\n", join(parameters));
        }
        let mut images = "# Image list\n#   with two lines each\n".to_string();
        for (id, image) in self.images.iter().enumerate() {
            let pose = join(&image.quaternion) + " " + &join(&image.translation);
            images += &format!("{id} {pose} {} {}\n", image.camera, image.name);
            for (x, y, point) in &image.observations {
                let point = point.map_or("-1".into(), |point| point.to_string());
                images += &format!("{x} {y} {point} ");
            }
            images += "\n";
        }
        let mut points = String::new();
        for (id, (position, [r, g, b], track)) in self.points.iter().enumerate() {
            let track = track
                .iter()
                .map(|(image, index)| format!(" {image} {index}"));
            let track: String = track.collect();
            points += &format!("{id} {} {r} {g} {b} 0.5{track}\n", join(position));
        }
        [cameras, images, points].map(String::into_bytes)
    }
}

/// A folder with photos for every image whose name stays inside, and no model.
pub(super) fn folder(model: &Model) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    let images = dir.path().join("images");
    fs::create_dir(&images).unwrap();
    for image in &model.images {
        if !image.name.contains("..") && !image.name.starts_with('/') {
            let path = images.join(&image.name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            image::GrayImage::new(SIZE.0, SIZE.1).save(path).unwrap();
        }
    }
    dir
}

/// Writes a model's three files into a folder of the capture.
pub(super) fn write(dir: &Path, below: &str, files: [Vec<u8>; 3], extension: &str) {
    let dir = dir.join(below);
    fs::create_dir_all(&dir).unwrap();
    for (stem, file) in ["cameras", "images", "points3D"].iter().zip(files) {
        fs::write(dir.join(stem).with_extension(extension), file).unwrap();
    }
}

/// Loads the model from `.bin` files, with its photos.
pub(super) fn load(model: &Model) -> Result<Capture, CaptureError> {
    load_files(model, model.binary(), "bin")
}

/// Loads other files with a model's photos.
pub(super) fn load_files(
    model: &Model,
    files: [Vec<u8>; 3],
    extension: &str,
) -> Result<Capture, CaptureError> {
    let dir = folder(model);
    write(dir.path(), "sparse/0", files, extension);
    Capture::load(dir.path())
}
