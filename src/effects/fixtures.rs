//! Small captures for tests.

use glam::{DMat3, DVec3};

use super::{Evidence, Survey};
use crate::capture::{Camera, Capture, Photo, Point, Split, View};

/// A camera at `center` that looks along z, of square photos, its focal length as many
/// pixels as they are wide.
pub fn looking_along_z(center: DVec3, width: u32) -> Camera {
    let side = f64::from(width);
    Camera {
        width,
        height: width,
        fx: side,
        fy: side,
        cx: side / 2.0,
        cy: side / 2.0,
        rotation: DMat3::IDENTITY,
        translation: -center,
    }
}

/// A camera's photo with this gray at x, y.
pub fn photo(camera: &Camera, gray: impl Fn(u32, u32) -> u8) -> Photo {
    let (width, height) = (camera.width, camera.height);
    let pixels = (0..width * height).map(|i| gray(i % width, i / width));
    Photo {
        width,
        height,
        gray: pixels.collect(),
        rgb: None,
        mask: None,
    }
}

/// Photos and points without tracks.
pub fn capture(photos: &[(Photo, Camera)], points: impl IntoIterator<Item = DVec3>) -> Capture {
    let views = photos.iter().enumerate().map(|(i, (_, camera))| View {
        name: format!("{i}.png"),
        photo: format!("{i}.png"),
        image_path: format!("{i}.png").into(),
        camera: camera.clone(),
        undistortion: None,
        stance: Default::default(),
    });
    Capture {
        root: ".".into(),
        photos: "images".into(),
        split: None,
        views: views.collect(),
        points: (points.into_iter())
            .map(|position| Point {
                position,
                color: [128; 3],
                track: Vec::new(),
            })
            .collect(),
        offset: DVec3::ZERO,
        rejected: Vec::new(),
        doubts: Vec::new(),
        distortion: 0.0,
    }
}

/// Evidence from all the photos, with every view in the training split.
pub fn evidence(capture: &Capture, photos: &[(Photo, Camera)]) -> Evidence {
    let cameras: Vec<Camera> = photos.iter().map(|(_, camera)| camera.clone()).collect();
    let split = Split {
        train: (0..photos.len()).collect(),
        test: Vec::new(),
    };
    let mut survey = Survey::new(capture, &cameras, &split);
    for (view, (photo, _)) in photos.iter().enumerate() {
        survey.look(view, photo);
    }
    survey.finish()
}
