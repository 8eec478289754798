//! COLMAP's sparse models, as binary files and as text.
//!
//! Format: <https://colmap.github.io/format.html>. Where there are rigs and frames, poses are
//! composed of them.

mod binary;
mod records;
mod rigs;
mod text;
mod tracks;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::error::CaptureError;
use super::lens::{Lens, ModelName};
use super::{Chosen, Point};
use crate::input::excerpt;
use records::RecordSource;

/// Contents of a model's three files.
pub(super) struct Model {
    /// Cameras in the order of the file.
    pub cameras: Vec<Camera>,
    /// Images in the order of the file.
    pub images: Vec<Image>,
    /// Points in the order of the file; their positions may be anything. The views
    /// of their tracks are indices into `images`.
    pub points: Vec<Point>,
    /// Warnings about the model's files, a line each.
    pub doubts: Vec<String>,
    /// The cameras file, for errors.
    pub cameras_path: PathBuf,
    /// The images file, for errors.
    pub images_path: PathBuf,
    /// The points file, for errors.
    pub points_path: PathBuf,
}

/// A registered image; its pose may be anything.
pub(super) struct Image {
    /// COLMAP's id.
    pub id: u32,
    /// Path below `images/`, `/` between folders, never leaving it.
    pub name: String,
    /// World-to-camera rotation, w x y z.
    pub quaternion: [f64; 4],
    /// World-to-camera translation.
    pub translation: DVec3,
    /// Index into [`Model::cameras`].
    pub camera: usize,
}

/// A camera that images share.
pub(super) struct Camera {
    /// COLMAP's id.
    pub id: u32,
    /// The lens; its error matters only if an image uses it.
    pub lens: Result<Lens, CaptureError>,
}

/// Cameras in the order of the file, and their places by COLMAP's id.
#[derive(Default)]
struct Cameras {
    cameras: Vec<Camera>,
    places: BTreeMap<u32, usize>,
}

/// Images no camera makes; beyond this a size is taken for a damaged field.
const MAX_SIDE: u64 = 1 << 20;

/// The name of a record of the images file.
const IMAGE: &str = "image";

/// Linux's longest path, in bytes.
const LONGEST_NAME: usize = 4096;

/// Finds the model of a COLMAP folder and reads it: `sparse/0`, then `sparse`,
/// then the folder itself; `.bin` before `.txt`. Of images that were not chosen nothing is
/// kept, nor of points that only these show.
pub(super) fn read(root: &Path, chosen: Option<&Chosen>) -> Result<Model, CaptureError> {
    let (paths, extension) = find(root)?;
    read_files(paths, extension, chosen)
}

/// Reads the model in this very folder; none where there is no whole one.
#[cfg(feature = "cli")]
pub(super) fn read_in(dir: &Path) -> Result<Option<Model>, CaptureError> {
    match files_in(dir) {
        Ok((paths, extension)) => read_files(paths, extension, None).map(Some),
        Err(_) => Ok(None),
    }
}

/// The folder of the model that [`read`] reads.
pub(super) fn folder(root: &Path) -> Result<PathBuf, CaptureError> {
    let ([cameras, ..], _) = find(root)?;
    Ok(cameras.parent().unwrap_or(root).into())
}

/// Number of images with a pose in the model of this very folder; `None` if there is no whole model
/// or its file cannot be read.
pub(super) fn images_in(dir: &Path) -> Option<u64> {
    let ([_, images, _], extension) = files_in(dir).ok()?;
    match extension {
        "bin" => binary::count_images(&images),
        _ => text::count_images(&images).ok(),
    }
}

/// The three files of a model, and their extension.
type Files = ([PathBuf; 3], &'static str);

fn find(root: &Path) -> Result<Files, CaptureError> {
    let mut incomplete = None;
    for dir in [root.join("sparse/0"), root.join("sparse"), root.into()] {
        match files_in(&dir) {
            Ok(files) => return Ok(files),
            Err(error) => incomplete = incomplete.or(error),
        }
    }
    Err(incomplete.unwrap_or_else(|| CaptureError::NoModel { dir: root.into() }))
}

/// The model's files in this very folder, or what is wrong where only some of them are there.
fn files_in(dir: &Path) -> Result<Files, Option<CaptureError>> {
    let mut incomplete = None;
    for extension in ["bin", "txt"] {
        let paths =
            ["cameras", "images", "points3D"].map(|stem| dir.join(stem).with_extension(extension));
        let (present, missing): (Vec<_>, Vec<_>) = paths.iter().partition(|path| path.is_file());
        match (present.first(), missing.first()) {
            (_, None) => return Ok((paths, extension)),
            (Some(present), Some(missing)) if incomplete.is_none() => {
                incomplete = Some(CaptureError::IncompleteModel {
                    dir: dir.into(),
                    present: file_name(present),
                    missing: file_name(missing),
                });
            }
            _ => {}
        }
    }
    Err(incomplete)
}

fn read_files(
    paths: [PathBuf; 3],
    extension: &str,
    chosen: Option<&Chosen>,
) -> Result<Model, CaptureError> {
    match extension {
        "bin" => read_records(binary::Records::open, paths, chosen),
        _ => read_records(text::Lines::open, paths, chosen),
    }
}

fn read_records<S: RecordSource>(
    open: impl Fn(&Path, &'static str) -> Result<S, CaptureError>,
    [cameras_path, images_path, points_path]: [PathBuf; 3],
    chosen: Option<&Chosen>,
) -> Result<Model, CaptureError> {
    let rigs = rigs_beside(&images_path)?;
    let cameras = records::cameras(open(&cameras_path, "camera")?)?;
    let images = open(&images_path, IMAGE)?;
    let (mut images, sightings) = records::images(images, &cameras, chosen)?;
    let points = records::points(open(&points_path, "point")?, &sightings)?;
    let doubts = match rigs {
        Some([rigs, frames]) => {
            let poses = rigs::read(open(&rigs, "rig")?, open(&frames, "frame")?)?;
            rigs::place(&mut images, &poses)
        }
        None => Vec::new(),
    };
    let folder = images_path.parent().unwrap_or(&images_path).display();
    let doubts = doubts
        .iter()
        .map(|doubt| format!("{folder}: {doubt}"))
        .collect();
    Ok(Model {
        cameras: cameras.cameras,
        images,
        points,
        doubts,
        cameras_path,
        images_path,
        points_path,
    })
}

/// The files of rigs and frames beside the images file; none where there are none.
fn rigs_beside(images: &Path) -> Result<Option<[PathBuf; 2]>, CaptureError> {
    let extension = images.extension().unwrap_or_default();
    let paths =
        ["rigs", "frames"].map(|stem| images.with_file_name(stem).with_extension(extension));
    let incomplete = |there: &Path, not: &Path| {
        Err(CaptureError::IncompleteRigs {
            path: there.into(),
            missing: file_name(not),
        })
    };
    match paths.each_ref().map(|path| path.exists()) {
        [true, true] => Ok(Some(paths)),
        [false, false] => Ok(None),
        [true, false] => incomplete(&paths[0], &paths[1]),
        [false, true] => incomplete(&paths[1], &paths[0]),
    }
}

/// The last part of a path.
pub(super) fn file_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

/// Checks a camera record.
fn lens(model: ModelName, width: u64, height: u64, parameters: &[f64]) -> Result<Lens, String> {
    let side = |name: &str, value: u64| match u32::try_from(value) {
        Ok(side) if (1..=MAX_SIDE).contains(&value) => Ok(side),
        _ => Err(format!("the {name} of {value} pixels is no image's")),
    };
    model.lens(side("width", width)?, side("height", height)?, parameters)
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
        let name = excerpt(&name);
        return Err(format!("the name {name:?} leads out of the images/ folder"));
    }
    if parts.is_empty() || name.len() > LONGEST_NAME {
        return Err(format!("the name {:?} names no file", excerpt(&name)));
    }
    Ok(parts.join("/"))
}

impl Cameras {
    /// The place of the camera with this id.
    fn place(&self, id: u32) -> Result<usize, String> {
        self.places.get(&id).copied().ok_or_else(|| {
            format!(
                "camera {id} is not among the {} of the cameras file",
                self.places.len()
            )
        })
    }

    /// Adds a camera; ids are unique.
    fn insert(&mut self, id: u32, lens: Result<Lens, CaptureError>) -> Result<(), String> {
        match self.places.insert(id, self.cameras.len()) {
            None => {
                self.cameras.push(Camera { id, lens });
                Ok(())
            }
            Some(_) => Err(format!("camera {id} is there twice")),
        }
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
    fn sizes_are_checked() {
        let model = ModelName::named("SIMPLE_PINHOLE").unwrap();
        assert!(lens(model, 4, 3, &[5.0, 2.0, 1.5]).is_ok());
        assert!(lens(model, 0, 3, &[5.0, 2.0, 1.5]).is_err());
        assert!(lens(model, 4, u64::MAX, &[5.0, 2.0, 1.5]).is_err());
    }
}
