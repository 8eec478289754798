//! `transforms.json` of nerfstudio and Instant-NGP, and `transforms_train.json` of Blender's
//! synthetic scenes, as a COLMAP model without observations.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use glam::{DAffine3, DMat3, DQuat, DVec3};
use serde::Deserialize;
use serde_json::{Map, Value};

use super::{
    Chosen, Rejected,
    colmap::{Camera, Image, Model, checked_lens, relative_name},
    decode,
    error::CaptureError,
    lens::ModelName,
    point_cloud,
};
use crate::input::{self, excerpt};

/// Files of all photos, or of those to train on, and of held-out ones.
const FILES: [&str; 2] = ["transforms.json", "transforms_train.json"];
const HELD_OUT: [&str; 2] = ["transforms_test.json", "transforms_val.json"];

/// Extensions to try where a photo's path has none.
const EXTENSIONS: [&str; 6] = ["png", "jpg", "jpeg", "tif", "PNG", "JPG"];

/// Largest deviation of a pose's axes from right angles and length 1: files have few digits.
const SKEW: f64 = 1e-2;

/// A model with its photos.
pub(super) struct Source {
    pub model: Model,
    /// Folder that the images' names are relative to.
    pub photos: PathBuf,
    /// Photos that the model lists and that are not there.
    pub missing: Vec<Rejected>,
    /// Photos to train on and held-out ones, where the model says.
    pub split: Option<Chosen>,
}

#[derive(Deserialize)]
struct Transforms {
    frames: Vec<Listing>,
    ply_file_path: Option<String>,
    applied_transform: Option<Vec<[f64; 4]>>,
    /// Others, among them the lens of all frames.
    #[serde(flatten)]
    fields: Map<String, Value>,
}

#[derive(Deserialize)]
struct Listing {
    file_path: String,
    transform_matrix: Vec<[f64; 4]>,
    /// Others, among them the frame's own lens.
    #[serde(flatten)]
    fields: Map<String, Value>,
}

/// A photo with its pose and lens.
pub(super) struct Frame {
    /// File of the photo, and its path below the photos' folder.
    pub path: PathBuf,
    name: String,
    held_out: bool,
    /// Camera-to-world, with OpenGL's axes: x right, y up, z back.
    pose: DAffine3,
    /// Fields of the frame, else of all.
    fields: Map<String, Value>,
    /// File and number of the frame, for errors.
    file: PathBuf,
    index: usize,
}

/// All photos of a folder's files.
pub(super) struct Scene {
    /// At least one.
    pub frames: Vec<Frame>,
    /// Folder that the photos' names are relative to: the one that all lie in, else the files'.
    pub photos: PathBuf,
    /// The point cloud's file, and from its world to COLMAP's.
    pub points: Option<(PathBuf, DAffine3)>,
}

/// The files of a folder, the first with the photos to train on; empty where there are none.
pub(super) fn files(root: &Path) -> Vec<PathBuf> {
    let there = |name: &&str| root.join(name).is_file();
    let first = FILES.into_iter().find(there);
    let held_out = HELD_OUT.into_iter().find(there);
    let held_out = held_out.filter(|_| first == Some(FILES[1]));
    let names = first.into_iter().chain(held_out);
    names.map(|name| root.join(name)).collect()
}

/// Reads the [`files`] of a folder that has some; of photos that were not chosen nothing is kept.
///
/// # Errors
/// [`CaptureError`] of a file, a field, or where no photo is there.
pub(super) fn read(root: &Path, chosen: Option<&Chosen>) -> Result<Source, CaptureError> {
    let Scene {
        frames,
        photos,
        points,
    } = Scene::read(root)?;
    let (file, total) = (frames[0].file.clone(), frames.len());
    let (mut cameras, mut lenses) = (Vec::new(), Vec::new());
    let (mut images, mut missing) = (Vec::new(), Vec::new());
    let (mut split, mut has_masks) = (Chosen::default(), false);
    for frame in frames {
        if chosen.is_some_and(|chosen| !chosen.has(&frame.name)) {
            continue;
        }
        if !frame.path.is_file() {
            let reason = "there is no such photo".to_owned();
            let name = frame.name;
            missing.push(Rejected { name, reason });
            continue;
        }
        has_masks |= frame.fields.contains_key("mask_path");
        let group = match frame.held_out {
            true => &mut split.test,
            false => &mut split.train,
        };
        group.insert(frame.name.clone());
        let lens = frame.lens()?;
        let known = lenses.iter().position(|known| *known == lens);
        let camera = known.unwrap_or(cameras.len());
        if known.is_none() {
            let (model, [width, height], parameters) = &lens;
            let made = checked_lens(*model, (*width).into(), (*height).into(), parameters);
            let made = made.map_err(|reason| frame.wrong(format!("lens: {reason}")))?;
            let id = camera as u32 + 1;
            cameras.push(Camera { id, lens: Ok(made) });
            lenses.push(lens);
        }
        // From OpenGL's axes to COLMAP's.
        let axes = frame.pose.matrix3 * DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
        let rotation = DQuat::from_mat3(&axes).normalize().inverse();
        let [x, y, z, w] = rotation.to_array();
        images.push(Image {
            id: images.len() as u32,
            name: frame.name,
            quaternion: [w, x, y, z],
            translation: -(rotation * frame.pose.translation),
            camera,
        });
    }
    if let (true, Some(first)) = (images.is_empty(), missing.first()) {
        return Err(CaptureError::MissingPhotos {
            first: photos.join(&first.name),
            missing: missing.len(),
            total,
        });
    }
    let mut doubts = Vec::new();
    if has_masks && !root.join("masks").is_dir() {
        let file = file.display();
        doubts.push(format!(
            "{file}: mask_path is ignored: put masks into masks/, named like the photos"
        ));
    }
    let mut cloud = Vec::new();
    if let Some((path, back)) = &points {
        cloud = point_cloud::read(path)?;
        for point in &mut cloud {
            point.position = back.transform_point3(point.position);
        }
    }
    Ok(Source {
        model: Model {
            cameras,
            images,
            points: cloud,
            doubts,
            cameras_path: file.clone(),
            points_path: points.map_or(file.clone(), |(path, _)| path),
            images_path: file,
        },
        photos,
        missing,
        split: (!split.test.is_empty()).then_some(split),
    })
}

impl Scene {
    /// Reads the [`files`] of a folder.
    pub fn read(root: &Path) -> Result<Self, CaptureError> {
        let (mut frames, mut points) = (Vec::new(), None);
        for (place, file) in files(root).into_iter().enumerate() {
            let text = input::read_to_string(&file).map_err(CaptureError::read(&file))?;
            let read: Transforms = serde_json::from_str(&text)
                .map_err(|error| wrong(&file, format!("is no transforms.json: {error}")))?;
            // It brought COLMAP's world to the file's.
            let applied = read.applied_transform.as_deref().map(rigid).transpose();
            let applied = applied.map_err(|e| wrong(&file, format!("applied_transform {e}")))?;
            let back = applied.unwrap_or_default().inverse();
            if let Some(name) = &read.ply_file_path {
                points = Some((root.join(below(root, &file, name)?), back));
            }
            let mut shared = read.fields;
            shared.retain(|_, value| value.is_number() || value.is_string() || value.is_boolean());
            for (index, listing) in read.frames.into_iter().enumerate() {
                let at = |e: String| wrong(&file, format!("frames[{index}].{e}"));
                let pose = rigid(&listing.transform_matrix);
                let pose = pose.map_err(|e| at(format!("transform_matrix {e}")))?;
                let name = existing(root, below(root, &file, &listing.file_path)?);
                let mut fields = shared.clone();
                fields.extend(listing.fields);
                frames.push(Frame {
                    path: root.join(&name),
                    name,
                    held_out: place > 0,
                    pose: back * pose,
                    fields,
                    file: file.clone(),
                    index,
                });
            }
        }
        let Some(first) = frames.first() else {
            let file = files(root).into_iter().next();
            let file = file.unwrap_or_else(|| root.join(FILES[0]));
            return Err(wrong(&file, "lists no frames".to_owned()));
        };
        let folder = first.name.split_once('/').map_or("", |(folder, _)| folder);
        let inside = |frame: &Frame| Path::new(&frame.name).starts_with(folder);
        let folder = Some(folder).filter(|_| frames.iter().all(inside));
        let folder = folder.unwrap_or_default().to_owned();
        let mut names = BTreeSet::new();
        for frame in &mut frames {
            let name = frame.name.split_off(folder.len());
            frame.name = name.trim_start_matches('/').to_owned();
            if !names.insert(frame.name.clone()) {
                return Err(frame.wrong("file_path is that of another frame"));
            }
        }
        let photos = root.join(folder).components().collect();
        Ok(Self {
            frames,
            photos,
            points,
        })
    }
}

impl Frame {
    fn wrong(&self, reason: impl std::fmt::Display) -> CaptureError {
        wrong(&self.file, format!("frames[{}].{reason}", self.index))
    }

    /// Numbers of these names, where they are there.
    fn numbers<const N: usize>(&self, names: [&str; N]) -> Result<[Option<f64>; N], CaptureError> {
        let mut numbers = [None; N];
        for (number, name) in numbers.iter_mut().zip(names) {
            let value = self.fields.get(name).filter(|value| !value.is_null());
            *number = value.map(|value| value.as_f64().unwrap_or(f64::NAN));
            if number.is_some_and(f64::is_nan) {
                return Err(self.wrong(format!("{name} is no number")));
            }
        }
        Ok(numbers)
    }

    /// Camera model, width, height and parameters, as COLMAP has them.
    fn lens(&self) -> Result<(ModelName, [u32; 2], Vec<f64>), CaptureError> {
        let size = match self.numbers(["w", "h"])? {
            [Some(w), Some(h)] => [w, h].map(|side| side.round() as u32),
            _ => decode::header(&self.path)?.size,
        };
        let [width, height] = size.map(f64::from);
        let [fl_x, fl_y, cx, cy] = self.numbers(["fl_x", "fl_y", "cx", "cy"])?;
        let angles = self.numbers(["camera_angle_x", "camera_angle_y"])?;
        let focal = |side: f64, angle: f64| 0.5 * side / (0.5 * angle).tan();
        let fl_y = fl_y.or(angles[1].map(|angle| focal(height, angle)));
        let fl_x = fl_x.or(angles[0].map(|angle| focal(width, angle)));
        let [k1, k2, k3, p1, p2, k4, k5, k6] = self
            .numbers(["k1", "k2", "k3", "p1", "p2", "k4", "k5", "k6"])?
            .map(Option::unwrap_or_default);
        let fisheye = self.fields.get("is_fisheye") == Some(&Value::Bool(true));
        let usual = if fisheye { "OPENCV_FISHEYE" } else { "OPENCV" };
        let named = self
            .fields
            .get("camera_model")
            .map_or(usual, |v| v.as_str().unwrap_or("?"));
        let (model, coefficients) = match named {
            "EQUIRECTANGULAR" => (named, vec![]),
            "OPENCV_FISHEYE" if [p1, p2] == [0.0; 2] => (named, vec![k1, k2, k3, k4]),
            // What k4 means differs from program to program.
            "OPENCV" | "PINHOLE" | "SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL"
                if [k4, k5, k6] == [0.0; 3] =>
            {
                match (k3 == 0.0, [k1, k2, p1, p2] == [0.0; 4]) {
                    (true, true) => ("PINHOLE", vec![]),
                    (true, false) => ("OPENCV", vec![k1, k2, p1, p2]),
                    _ => ("FULL_OPENCV", vec![k1, k2, p1, p2, k3, 0.0, 0.0, 0.0]),
                }
            }
            _ => ("", vec![]),
        };
        let Some(known) = ModelName::named(model) else {
            let named = excerpt(named);
            return Err(self.wrong(format!("camera_model {named} with its coefficients is not read: undistort the photos, or name OPENCV (k1, k2, k3, p1, p2), OPENCV_FISHEYE (k1 to k4) or EQUIRECTANGULAR")));
        };
        if model == "EQUIRECTANGULAR" {
            return Ok((known, size, vec![width, height]));
        }
        let fx = fl_x.or(fl_y);
        let fx = fx.ok_or_else(|| self.wrong("fl_x and camera_angle_x are missing"))?;
        let center = [cx.unwrap_or(width / 2.0), cy.unwrap_or(height / 2.0)];
        let pinhole = [fx, fl_y.unwrap_or(fx), center[0], center[1]];
        Ok((known, size, [&pinhole[..], &coefficients].concat()))
    }
}

fn wrong(file: &Path, reason: String) -> CaptureError {
    let path = file.into();
    CaptureError::Transforms { path, reason }
}

/// A matrix of three or four rows as a rotation and translation.
fn rigid(rows: &[[f64; 4]]) -> Result<DAffine3, &'static str> {
    let (3 | 4, [x, y, z, ..]) = (rows.len(), rows) else {
        return Err("has neither three nor four rows");
    };
    let axes = [x, y, z].map(|row| DVec3::new(row[0], row[1], row[2]));
    let axes = DMat3::from_cols(axes[0], axes[1], axes[2]).transpose();
    let skew = axes * axes.transpose() - DMat3::IDENTITY;
    // Of numbers too large to multiply it is none.
    let sound = skew.to_cols_array().iter().all(|value| value.abs() <= SKEW);
    match sound && axes.determinant() > 0.0 {
        true => Ok(DAffine3::from_mat3_translation(
            axes,
            DVec3::new(x[3], y[3], z[3]),
        )),
        false => Err("is no rotation and translation"),
    }
}

/// A file's path below `root`, with `/` between folders.
fn below(root: &Path, file: &Path, name: &str) -> Result<String, CaptureError> {
    let whole = root.canonicalize().unwrap_or_default();
    let inside = Path::new(name).strip_prefix(&whole).ok();
    let inside = inside.and_then(Path::to_str).unwrap_or(name);
    let name = excerpt(name);
    let outside = |_| {
        wrong(
            file,
            format!("{name:?} leads out of its folder: name files below it"),
        )
    };
    relative_name(inside).map_err(outside)
}

/// A photo's path with the extension that it has on the disk, where it is written without.
fn existing(root: &Path, name: String) -> String {
    let mut tried = EXTENSIONS
        .into_iter()
        .map(|extension| format!("{name}.{extension}"));
    let found = tried.find(|path| root.join(path).is_file());
    match root.join(&name).is_file() {
        true => name,
        false => found.unwrap_or(name),
    }
}
