//! Cameras and images of a model, and checks of their records.

use std::{collections::BTreeMap, path::PathBuf};

use glam::DVec3;

use crate::{
    capture::{
        Point,
        error::CaptureError,
        lens::{Lens, ModelName},
    },
    input::excerpt,
};

/// Contents of a model's three files.
pub(in crate::capture) struct Model {
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
pub(in crate::capture) struct Image {
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
pub(in crate::capture) struct Camera {
    /// COLMAP's id.
    pub id: u32,
    /// The lens; its error matters only if an image uses it.
    pub lens: Result<Lens, CaptureError>,
}

/// Cameras in the order of the file, and their places by COLMAP's id.
#[derive(Default)]
pub(super) struct Cameras {
    pub cameras: Vec<Camera>,
    places: BTreeMap<u32, usize>,
}

/// Images no camera makes; beyond this a size is taken for a damaged field.
const MAX_SIDE: u64 = 1 << 20;

/// The name of a record of the images file.
pub(super) const IMAGE: &str = "image";

/// Linux's longest path, in bytes.
pub(super) const LONGEST_NAME: usize = 4096;

impl Cameras {
    /// The place of the camera with this id.
    pub fn place(&self, id: u32) -> Result<usize, String> {
        self.places.get(&id).copied().ok_or_else(|| {
            format!(
                "camera {id} is not among the {} of the cameras file",
                self.places.len()
            )
        })
    }

    /// Adds a camera; ids are unique.
    pub fn insert(&mut self, id: u32, lens: Result<Lens, CaptureError>) -> Result<(), String> {
        match self.places.insert(id, self.cameras.len()) {
            None => {
                self.cameras.push(Camera { id, lens });
                Ok(())
            }
            Some(_) => Err(format!("camera {id} is there twice")),
        }
    }
}

/// Checks a camera record.
pub(in crate::capture) fn lens(
    model: ModelName,
    width: u64,
    height: u64,
    parameters: &[f64],
) -> Result<Lens, String> {
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
pub(in crate::capture) fn relative_name(name: &str) -> Result<String, String> {
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
