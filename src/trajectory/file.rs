//! Camera paths in files.
//!
//! What is written, and read, is nerfstudio's `camera_path.json`: of each frame its pose
//! `camera_to_world`, 4 × 4 by rows, with OpenGL's axes (x right, y up, z back), and its vertical
//! field of view `fov` in degrees. Each frame also has `fl_x`, `fl_y`, `cx`, `cy` in pixels,
//! which nerfstudio leaves aside, and which say exactly what the lens is. Also read are
//! `transforms.json` of nerfstudio and Instant-NGP, `cameras.json` of 3DGS, and SuperSplat's
//! (see [`super::supersplat`]).
//!
//! Coordinates are COLMAP's. nerfstudio turns, moves and scales a scene for itself, and notes it
//! in `dataparser_transforms.json`: where a file of this name lies beside a path, the path is in
//! nerfstudio's coordinates, and is brought back.

use std::{
    io::{self, Write},
    path::{Path, PathBuf},
};

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::Value;

use super::{
    lens,
    supersplat::{self, typed},
    world::{SKEW, WorldTransform},
};
use crate::{capture::Camera, disk, input};

/// File with nerfstudio's transform of a scene.
const MOVED: &str = "dataparser_transforms.json";

/// Largest number of frames of a path.
pub const MOST_FRAMES: usize = 100_000;

/// Error of reading a camera path.
#[derive(Debug, thiserror::Error)]
pub enum TrajectoryError {
    /// The file system.
    #[error("{}: {source}", path.display())]
    Io {
        /// File at fault.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// It would have too many frames.
    #[error("a path of {frames:.0} frames: {MOST_FRAMES} at most")]
    Long {
        /// Number of frames.
        frames: f64,
    },
    /// It is no camera path.
    #[error("{}: {reason}", path.display())]
    Bad {
        /// File at fault.
        path: PathBuf,
        /// Defect, with the name of the field.
        reason: String,
    },
}

/// Coordinate system of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinates {
    /// COLMAP's.
    Colmap,
    /// Those of the splat file that a viewer has shown.
    SplatFile,
}

/// A camera path that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct PathFile {
    /// One camera a frame; at least one.
    pub cameras: Vec<Camera>,
    /// Frames a second, above 0, where the file says.
    pub rate: Option<f64>,
    /// Coordinate system of the cameras.
    pub coordinates: Coordinates,
}

/// `camera_path.json`.
#[derive(Serialize, Deserialize)]
struct Nerfstudio {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    camera_type: Option<String>,
    render_width: f64,
    render_height: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    fps: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    seconds: Option<f64>,
    #[serde(default)]
    is_cycle: bool,
    camera_path: Vec<NerfstudioFrame>,
}

#[derive(Serialize, Deserialize)]
struct NerfstudioFrame {
    camera_to_world: Vec<f64>,
    fov: f64,
    #[serde(default)]
    aspect: f64,
    #[serde(flatten)]
    lens: Lens,
}

/// A lens in pixels, as far as it is given.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
struct Lens {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    fl_x: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    fl_y: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    cx: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    cy: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    w: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    h: Option<f64>,
    /// Horizontal field of view in radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    camera_angle_x: Option<f64>,
}

/// `transforms.json`; what a frame does not say of its lens is said for all.
#[derive(Deserialize)]
struct Transforms {
    #[serde(flatten)]
    lens: Lens,
    /// What brought COLMAP's world to the file's.
    applied_transform: Option<Vec<[f64; 4]>>,
    frames: Vec<TransformsFrame>,
}

#[derive(Deserialize)]
struct TransformsFrame {
    transform_matrix: [[f64; 4]; 4],
    #[serde(flatten)]
    lens: Lens,
}

/// An item of `cameras.json`; `rotation` has the camera's axes as its columns, COLMAP's.
#[derive(Deserialize)]
struct Trained {
    width: f64,
    height: f64,
    position: [f64; 3],
    rotation: [[f64; 3]; 3],
    fx: f64,
    fy: f64,
}

/// Reads a camera path; `size` is that of pictures where the file does not say.
///
/// # Errors
/// [`TrajectoryError`].
pub fn read_path(path: &Path, size: [u32; 2]) -> Result<PathFile, TrajectoryError> {
    let bad = |reason: String| TrajectoryError::Bad {
        path: path.to_owned(),
        reason,
    };
    let value: Value = read_json(path)?;
    let mut read = parse(value, size).map_err(bad)?;
    let count = read.cameras.len();
    if count == 0 || count > MOST_FRAMES {
        return Err(bad(format!(
            "has {count} frames: 1 to {MOST_FRAMES} can be drawn"
        )));
    }
    if read
        .rate
        .is_some_and(|rate| !(rate.is_finite() && rate > 0.0))
    {
        read.rate = None;
    }
    if let Some(moved) = moved_beside(path)? {
        read.cameras = read
            .cameras
            .iter()
            .map(|camera| moved.back(camera))
            .collect();
    }
    Ok(read)
}

/// Writes a camera path of so many frames a second.
///
/// # Errors
/// The system's, and [`TrajectoryError`] of a file that says how nerfstudio moved the scene.
pub fn write_path(path: &Path, cameras: &[Camera], rate: f64) -> Result<(), TrajectoryError> {
    let moved = moved_beside(path)?;
    let size = cameras
        .first()
        .map_or([0, 0], |camera| [camera.width, camera.height]);
    let [width, height] = size.map(f64::from);
    let frame = |camera: &Camera| {
        let camera = match &moved {
            Some(moved) => &moved.forth(camera),
            None => camera,
        };
        NerfstudioFrame {
            camera_to_world: to_opengl(camera).to_vec(),
            fov: 2.0 * (0.5 * height / camera.fy).atan().to_degrees(),
            aspect: width / height,
            lens: Lens {
                fl_x: Some(camera.fx),
                fl_y: Some(camera.fy),
                cx: Some(camera.cx),
                cy: Some(camera.cy),
                ..Lens::default()
            },
        }
    };
    let file = Nerfstudio {
        camera_type: Some("perspective".to_owned()),
        render_width: width,
        render_height: height,
        fps: Some(rate),
        seconds: Some(cameras.len() as f64 / rate),
        is_cycle: false,
        camera_path: cameras.iter().map(frame).collect(),
    };
    let written = || {
        let mut text = serde_json::to_vec_pretty(&file)?;
        text.push(b'\n');
        let mut draft = disk::create(path)?;
        draft.write_all(&text)?;
        draft.persist(path)
    };
    written().map_err(|source| TrajectoryError::Io {
        path: path.to_owned(),
        source,
    })
}

fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T, TrajectoryError> {
    let text = input::read_to_string(path).map_err(|source| TrajectoryError::Io {
        path: path.to_owned(),
        source,
    })?;
    serde_json::from_str(&text).map_err(|error| TrajectoryError::Bad {
        path: path.to_owned(),
        reason: format!("is no JSON of a camera path: {error}"),
    })
}

fn parse(value: Value, size: [u32; 2]) -> Result<PathFile, String> {
    let colmap = |cameras, rate| PathFile {
        cameras,
        rate,
        coordinates: Coordinates::Colmap,
    };
    if value.get("camera_path").is_some() {
        let file: Nerfstudio = typed(value)?;
        let rate = file.fps;
        return Ok(colmap(file.cameras()?, rate));
    }
    if value.get("frames").is_some() {
        return Ok(colmap(typed::<Transforms>(value)?.cameras()?, None));
    }
    if value.is_array() {
        let items: Vec<Trained> = typed(value)?;
        let cameras = numbered(&items, "", Trained::camera)?;
        return Ok(colmap(cameras, None));
    }
    if let Some((cameras, rate)) = supersplat::parse(&value, size, MOST_FRAMES)? {
        return Ok(PathFile {
            cameras,
            rate: Some(rate),
            coordinates: Coordinates::SplatFile,
        });
    }
    Err(
        "is no camera path: it has neither camera_path (nerfstudio), frames (transforms.json), poseSets nor animTracks (SuperSplat)"
            .to_owned(),
    )
}

/// Makes a camera of each item; errors name its field and number.
fn numbered<T>(
    items: &[T],
    field: &str,
    camera: impl Fn(&T) -> Result<Camera, String>,
) -> Result<Vec<Camera>, String> {
    let cameras = items.iter().enumerate();
    cameras
        .map(|(i, item)| camera(item).map_err(|reason| format!("{field}[{i}]: {reason}")))
        .collect()
}

impl Nerfstudio {
    fn cameras(&self) -> Result<Vec<Camera>, String> {
        if let Some(kind) = &self.camera_type
            && kind != "perspective"
        {
            return Err(format!(
                "camera_type is {kind}: only perspective can be drawn"
            ));
        }
        let size = side(self.render_width, "render_width")
            .and_then(|width| Ok([width, side(self.render_height, "render_height")?]))?;
        numbered(&self.camera_path, "camera_path", |frame| {
            if !(frame.fov > 0.0 && frame.fov < 180.0) {
                return Err(format!("fov is {}: must lie between 0 and 180", frame.fov));
            }
            let given: Result<[f64; 16], _> = frame.camera_to_world.as_slice().try_into();
            let given = given.map_err(|_| "camera_to_world has no 16 numbers".to_owned())?;
            let by_fov = lens(size, frame.fov);
            posed(&frame.lens.over(by_fov), "camera_to_world", |r, c| {
                given[4 * r + c]
            })
        })
    }
}

impl Transforms {
    fn cameras(&self) -> Result<Vec<Camera>, String> {
        let applied = self.applied_transform.clone();
        let applied = applied.map(|transform| WorldTransform {
            transform,
            scale: 1.0,
        });
        if applied.as_ref().is_some_and(|applied| !applied.is_sound()) {
            return Err("applied_transform is no rotation and translation".to_owned());
        }
        numbered(&self.frames, "frames", |frame| {
            let own = frame.lens.or(self.lens);
            let width = side(own.w.unwrap_or(f64::NAN), "w")?;
            let height = side(own.h.unwrap_or(f64::NAN), "h")?;
            let by_angle = own
                .camera_angle_x
                .map(|angle| 0.5 * f64::from(width) / (0.5 * angle).tan());
            let fl_x = own
                .fl_x
                .or(by_angle)
                .ok_or("has neither fl_x nor camera_angle_x")?;
            let lens = Camera {
                fx: fl_x,
                fy: fl_x,
                ..lens([width, height], 60.0)
            };
            let camera = posed(&own.over(lens), "transform_matrix", |r, c| {
                frame.transform_matrix[r][c]
            })?;
            Ok(match &applied {
                Some(applied) => applied.back(&camera),
                None => camera,
            })
        })
    }
}

impl Trained {
    fn camera(&self) -> Result<Camera, String> {
        let size = [side(self.width, "width")?, side(self.height, "height")?];
        let lens = Camera {
            fx: self.fx,
            fy: self.fy,
            ..lens(size, 60.0)
        };
        // From COLMAP's axes to OpenGL's, from which they come back.
        let sign = [1.0, -1.0, -1.0];
        posed(&lens, "rotation", |r, c| match c {
            3 => self.position[r],
            c => sign[c] * self.rotation[r][c],
        })
    }
}

impl Lens {
    /// Values of `self`, else of `other`.
    fn or(self, other: Self) -> Self {
        Self {
            fl_x: self.fl_x.or(other.fl_x),
            fl_y: self.fl_y.or(other.fl_y),
            cx: self.cx.or(other.cx),
            cy: self.cy.or(other.cy),
            w: self.w.or(other.w),
            h: self.h.or(other.h),
            camera_angle_x: self.camera_angle_x.or(other.camera_angle_x),
        }
    }

    /// A camera with what is given here.
    fn over(&self, camera: Camera) -> Camera {
        Camera {
            fx: self.fl_x.unwrap_or(camera.fx),
            fy: self.fl_y.unwrap_or(camera.fy),
            cx: self.cx.unwrap_or(camera.cx),
            cy: self.cy.unwrap_or(camera.cy),
            ..camera
        }
    }
}

/// Pixels of a side.
fn side(value: f64, field: &str) -> Result<u32, String> {
    // Of a device's largest texture; more cannot be drawn.
    let fits = (1.0..=32768.0).contains(&value);
    fits.then_some(value.round() as u32)
        .ok_or_else(|| format!("{field} is {value}: must be a number of pixels"))
}

/// A camera with the pose of a matrix from the camera to the world, of OpenGL's axes; `field` is
/// the matrix's name.
fn posed(lens: &Camera, field: &str, at: impl Fn(usize, usize) -> f64) -> Result<Camera, String> {
    let column = |c: usize| DVec3::new(at(0, c), at(1, c), at(2, c));
    let [x, y, z] = [0, 1, 2].map(|c| column(c).try_normalize().unwrap_or(DVec3::NAN));
    let skew = [x.dot(y), y.dot(z), z.dot(x)];
    let straight = skew.iter().all(|cosine| cosine.abs() < SKEW) && x.cross(y).dot(z) > 0.0;
    let center = column(3);
    if !(straight && center.is_finite()) {
        return Err(format!("{field} is no pose"));
    }
    if ![lens.fx, lens.fy].iter().all(|f| f.is_finite() && *f > 0.0)
        || ![lens.cx, lens.cy].iter().all(|c| c.is_finite())
    {
        return Err("focal lengths have to be positive, and cx and cy numbers".to_owned());
    }
    let down = -(y - x.dot(y) * x).normalize();
    let rotation = DMat3::from_cols(x, down, x.cross(down)).transpose();
    Ok(Camera {
        rotation,
        translation: -(rotation * center),
        ..lens.clone()
    })
}

/// A camera's pose as a matrix to the world by rows, of OpenGL's axes.
fn to_opengl(camera: &Camera) -> [f64; 16] {
    let [x, y, z] = [0, 1, 2].map(|row| camera.rotation.row(row));
    let columns = [x, -y, -z, camera.center()];
    std::array::from_fn(|i| match (i / 4, i % 4) {
        (3, 3) => 1.0,
        (3, _) => 0.0,
        (row, column) => columns[column][row],
    })
}

/// The transform beside a path, if there is one.
fn moved_beside(path: &Path) -> Result<Option<WorldTransform>, TrajectoryError> {
    let path = path.with_file_name(MOVED);
    if !path.exists() {
        return Ok(None);
    }
    let moved: WorldTransform = read_json(&path)?;
    match moved.is_sound() {
        true => Ok(Some(moved)),
        false => Err(TrajectoryError::Bad {
            path,
            reason: "transform has to be a rotation and a way, and scale positive".to_owned(),
        }),
    }
}

#[cfg(test)]
#[path = "file_tests.rs"]
mod tests;
