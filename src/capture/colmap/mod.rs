//! COLMAP's sparse models, as binary files and as text.
//!
//! Format: <https://colmap.github.io/format.html>. Only cameras, images and
//! points3D are read; rigs and frames are of no use here.

mod binary;
mod text;
mod tracks;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};

use super::error::CaptureError;
use super::{Camera, Point};

/// What the three files of a model say.
pub(super) struct Model {
    /// Images in the order of the file.
    pub images: Vec<Image>,
    /// Points in the order of the file; their positions may be anything. The views
    /// of their tracks are indices into `images`.
    pub points: Vec<Point>,
    /// The images file, for errors.
    pub images_path: PathBuf,
    /// The points file, for errors.
    pub points_path: PathBuf,
}

/// A registered image; its pose may be anything.
pub(super) struct Image {
    /// Path below `images/`, `/` between folders, never leaving it.
    pub name: String,
    /// World-to-camera rotation, w x y z.
    pub quaternion: [f64; 4],
    /// World-to-camera translation.
    pub translation: DVec3,
    pub intrinsics: Intrinsics,
}

/// A pinhole camera's size and calibration in pixels: checked to be usable.
#[derive(Clone, Copy)]
pub(super) struct Intrinsics {
    pub width: u32,
    pub height: u32,
    pub fx: f64,
    pub fy: f64,
    pub cx: f64,
    pub cy: f64,
}

impl Intrinsics {
    /// The camera with this calibration and a world-to-camera pose.
    pub fn camera(self, rotation: DMat3, translation: DVec3) -> Camera {
        let Self {
            width,
            height,
            fx,
            fy,
            cx,
            cy,
        } = self;
        Camera {
            width,
            height,
            fx,
            fy,
            cx,
            cy,
            rotation,
            translation,
        }
    }
}

/// Cameras by COLMAP's id.
type Cameras = BTreeMap<u32, Intrinsics>;

/// Images no camera makes; beyond this a size is taken for a damaged field.
const MAX_SIDE: u64 = 1 << 20;

/// Finds the model of a COLMAP folder and reads it: `sparse/0`, then `sparse`,
/// then the folder itself; `.bin` before `.txt`.
pub(super) fn read(root: &Path) -> Result<Model, CaptureError> {
    let mut incomplete = None;
    for dir in [root.join("sparse/0"), root.join("sparse"), root.into()] {
        for extension in ["bin", "txt"] {
            let paths = ["cameras", "images", "points3D"]
                .map(|stem| dir.join(stem).with_extension(extension));
            let (present, missing): (Vec<_>, Vec<_>) =
                paths.iter().partition(|path| path.is_file());
            match (present.first(), missing.first()) {
                (_, None) => return read_files(paths, extension),
                (Some(present), Some(missing)) if incomplete.is_none() => {
                    incomplete = Some(CaptureError::IncompleteModel {
                        dir: dir.clone(),
                        present: file_name(present),
                        missing: file_name(missing),
                    });
                }
                _ => {}
            }
        }
    }
    Err(incomplete.unwrap_or_else(|| CaptureError::NoModel { dir: root.into() }))
}

fn read_files(
    [cameras, images_path, points_path]: [PathBuf; 3],
    extension: &str,
) -> Result<Model, CaptureError> {
    let (images, points) = if extension == "bin" {
        let cameras = binary::cameras(&cameras)?;
        let (images, sightings) = binary::images(&images_path, &cameras)?;
        (images, binary::points(&points_path, &sightings)?)
    } else {
        let cameras = text::cameras(&cameras)?;
        let (images, sightings) = text::images(&images_path, &cameras)?;
        (images, text::points(&points_path, &sightings)?)
    };
    Ok(Model {
        images,
        points,
        images_path,
        points_path,
    })
}

/// The last part of a path.
pub(super) fn file_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

/// COLMAP's name of a camera model number, where it is known.
fn model_name(id: i32) -> Option<&'static str> {
    const NAMES: [&str; 12] = [
        "SIMPLE_PINHOLE",
        "PINHOLE",
        "SIMPLE_RADIAL",
        "RADIAL",
        "OPENCV",
        "OPENCV_FISHEYE",
        "FULL_OPENCV",
        "FOV",
        "SIMPLE_RADIAL_FISHEYE",
        "RADIAL_FISHEYE",
        "THIN_PRISM_FISHEYE",
        "RAD_TAN_THIN_PRISM_FISHEYE",
    ];
    NAMES.get(usize::try_from(id).ok()?).copied()
}

/// The number of parameters of a supported camera model: f, cx, cy or fx, fy, cx, cy.
fn parameter_count(model: &str) -> Option<usize> {
    match model {
        "SIMPLE_PINHOLE" => Some(3),
        "PINHOLE" => Some(4),
        _ => None,
    }
}

/// Checks a camera record; `parameters` holds 3 or 4 values.
fn intrinsics(width: u64, height: u64, parameters: &[f64]) -> Result<Intrinsics, String> {
    let side = |name: &str, value: u64| match u32::try_from(value) {
        Ok(side) if (1..=MAX_SIDE).contains(&value) => Ok(side),
        _ => Err(format!("the {name} of {value} pixels is no image's")),
    };
    let (fx, fy, cx, cy) = match *parameters {
        [f, cx, cy] => (f, f, cx, cy),
        [fx, fy, cx, cy] => (fx, fy, cx, cy),
        _ => {
            return Err(format!(
                "{} parameters do not make a pinhole",
                parameters.len()
            ));
        }
    };
    let positive = |f: f64| f.is_finite() && f > 0.0;
    if !(positive(fx) && positive(fy)) {
        return Err(format!("the focal length {fx}, {fy} is not positive"));
    }
    if !(cx.is_finite() && cy.is_finite()) {
        return Err(format!("the principal point {cx}, {cy} is not finite"));
    }
    Ok(Intrinsics {
        width: side("width", width)?,
        height: side("height", height)?,
        fx,
        fy,
        cx,
        cy,
    })
}

/// An image's name as a path below `images/` with `/` between folders.
///
/// Backslashes, which Windows tools write, count as separators. A name that is
/// empty, absolute or contains `..` is refused: it would read other people's files.
fn relative_name(name: &str) -> Result<String, String> {
    let name = name.replace('\\', "/");
    let drive = name.get(1..2) == Some(":");
    let parts: Vec<&str> = name
        .split('/')
        .filter(|part| !matches!(*part, "" | "."))
        .collect();
    if name.starts_with('/') || drive || parts.contains(&"..") {
        return Err(format!("the name {name:?} leads out of the images/ folder"));
    }
    if parts.is_empty() {
        return Err(format!("the name {name:?} names no file"));
    }
    Ok(parts.join("/"))
}

/// The camera with this id.
fn camera(cameras: &Cameras, id: u32) -> Result<Intrinsics, String> {
    cameras.get(&id).copied().ok_or_else(|| {
        format!(
            "camera {id} is not among the {} of the cameras file",
            cameras.len()
        )
    })
}

/// Adds a camera; ids are unique.
fn insert(cameras: &mut Cameras, id: u32, intrinsics: Intrinsics) -> Result<(), String> {
    match cameras.insert(id, intrinsics) {
        None => Ok(()),
        Some(_) => Err(format!("camera {id} is there twice")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_below_the_folder() {
        assert_eq!(relative_name("a.jpg").unwrap(), "a.jpg");
        assert_eq!(relative_name("left/./a b.jpg").unwrap(), "left/a b.jpg");
        assert_eq!(relative_name("left\\a.jpg").unwrap(), "left/a.jpg");
        assert_eq!(relative_name("a..b.jpg").unwrap(), "a..b.jpg");
        for bad in [
            "../a",
            "x/../../a",
            "/etc/passwd",
            "C:/a",
            "\\\\host\\a",
            "..\\a",
            "",
            ".",
            "./",
        ] {
            assert!(relative_name(bad).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn intrinsics_are_checked() {
        assert!(intrinsics(4, 3, &[5.0, 2.0, 1.5]).is_ok());
        assert!(intrinsics(0, 3, &[5.0, 2.0, 1.5]).is_err());
        assert!(intrinsics(4, u64::MAX, &[5.0, 2.0, 1.5]).is_err());
        for focal in [0.0, -5.0, f64::NAN, f64::INFINITY] {
            assert!(intrinsics(4, 3, &[5.0, focal, 2.0, 1.5]).is_err());
        }
        assert!(intrinsics(4, 3, &[5.0, 5.0, f64::NAN, 1.5]).is_err());
        assert!(intrinsics(4, 3, &[5.0, 5.0]).is_err());
    }
}
