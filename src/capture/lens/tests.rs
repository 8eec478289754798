//! Lenses at their edges: folds, wide fields, resampling.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::{Lens, ModelName, Undistortion};
use crate::capture::{Camera, Photo};

fn lens(model: &str, parameters: &[f64]) -> Lens {
    let model = ModelName::named(model).unwrap();
    model.lens(640, 480, parameters).unwrap()
}

fn barrel() -> Lens {
    let parameters = [500.0, 500.0, 320.0, 240.0, -0.25, 0.06, 0.001, -0.0005];
    lens("OPENCV", &parameters)
}

/// 140° across.
fn fisheye() -> Lens {
    lens(
        "SIMPLE_FISHEYE",
        &[320.0 / 70_f64.to_radians(), 320.0, 240.0],
    )
}

/// Every hundredth pixel's round trip, in pixels; and how many have no ray.
fn round_trip(lens: &Lens) -> (f64, usize) {
    round_trips(lens, 97)
}

fn round_trips(lens: &Lens, every: usize) -> (f64, usize) {
    let (mut worst, mut lost) = (0.0_f64, 0);
    for k in (0..640 * 480).step_by(every) {
        let pixel = DVec2::new(f64::from(k % 640) + 0.5, f64::from(k / 640) + 0.5);
        match lens.ray(pixel) {
            None => lost += 1,
            Some(ray) => {
                assert!((ray.length() - 1.0).abs() < 1e-12 && ray.z > 0.0, "{ray}");
                let back = lens.pixel(ray).unwrap_or(DVec2::NAN);
                worst = worst.max(back.distance(pixel));
                assert!(back.is_finite());
            }
        }
    }
    (worst, lost)
}

#[test]
fn round_trips_hold_over_the_whole_image() {
    for (model, coefficients) in [
        ("SIMPLE_RADIAL", &[-0.2][..]),
        ("SIMPLE_RADIAL", &[2.0]),
        ("RADIAL", &[-0.35, 0.15]),
        ("SIMPLE_RADIAL_FISHEYE", &[-0.15]),
        ("SIMPLE_DIVISION", &[-0.9]),
        ("SIMPLE_DIVISION", &[0.3]),
    ] {
        let parameters = [&[500.0, 320.0, 240.0], coefficients].concat();
        let (worst, lost) = round_trip(&lens(model, &parameters));
        assert!(
            worst < 1e-7 && lost == 0,
            "{model} {coefficients:?}: {worst} {lost}"
        );
    }
    for (model, coefficients) in [
        ("FOV", &[1.8][..]),
        ("FOV", &[0.0]),
        ("EUCM", &[1.0, 0.5]),
        ("OPENCV", &[-0.25, 0.06, 0.01, -0.01]),
        (
            "THIN_PRISM_FISHEYE",
            &[0.1, -0.05, 0.01, -0.01, 0.01, 0.0, 0.02, -0.02],
        ),
    ] {
        let parameters = [&[500.0, 480.0, 310.0, 250.0], coefficients].concat();
        let (worst, lost) = round_trip(&lens(model, &parameters));
        assert!(
            worst < 1e-7 && lost == 0,
            "{model} {coefficients:?}: {worst} {lost}"
        );
    }
}

#[test]
fn folds_end_the_image() {
    // r − r³ turns at 1/√3, where it is 0.385: 192 of 400 pixels to the corner.
    let folded = lens("SIMPLE_RADIAL", &[500.0, 320.0, 240.0, -1.0]);
    assert!(
        (folded.limit - 1.0 / 3_f64.sqrt()).abs() < 0.005,
        "{}",
        folded.limit
    );
    let (worst, lost) = round_trip(&folded);
    assert!(worst < 1e-6 && lost > 1000, "{worst} {lost}");
    assert!(folded.ray(DVec2::new(320.0 + 191.0, 240.0)).is_some());
    assert!(folded.ray(DVec2::new(320.0 + 193.0, 240.0)).is_none());
    assert!(folded.pixel(DVec3::new(0.6, 0.0, 1.0)).is_none());
    // A tangential fold, on one side only.
    let lopsided = lens("OPENCV", &[500.0, 500.0, 320.0, 240.0, 0.0, 0.0, 0.0, 0.25]);
    let (worst, lost) = round_trip(&lopsided);
    assert!(worst < 1e-6 && lost > 0 && lost < 1500, "{worst} {lost}");
}

#[test]
fn absurd_coefficients_neither_hang_nor_give_nan() {
    for value in [1e-300, 1e3, -1e3, 1e18, -1e18, 1e300, -1e300] {
        for (model, focals, count) in [
            ("RADIAL", 1, 2),
            ("FULL_OPENCV", 2, 8),
            ("THIN_PRISM_FISHEYE", 2, 8),
            ("RAD_TAN_THIN_PRISM_FISHEYE", 2, 12),
            ("SIMPLE_DIVISION", 1, 1),
        ] {
            for index in 0..count {
                let mut parameters = vec![500.0; focals];
                parameters.extend([320.0, 240.0]);
                parameters.resize(focals + 2 + count, 0.0);
                parameters[focals + 2 + index] = value;
                let lens = lens(model, &parameters);
                let (worst, _) = round_trips(&lens, 1999);
                assert!(worst < 1e-3, "{model} {index} {value}: {worst}");
                assert!((0.0..=800.0).contains(&lens.displacement()), "{model}");
                if let Ok(cuts) = lens.cuts() {
                    for cut in cuts {
                        let Camera {
                            width, height, fx, ..
                        } = cut.camera;
                        assert!(width > 0 && height > 0 && fx > 0.0);
                        assert!(u64::from(width) * u64::from(height) <= 16 * 640 * 480);
                    }
                }
            }
        }
    }
}

#[test]
fn parameters_that_are_no_lenses_are_errors() {
    let pinhole = ModelName::named("PINHOLE").unwrap();
    for (index, value) in [(0, 0.0), (1, -5.0), (2, f64::NAN), (3, f64::INFINITY)] {
        let mut parameters = [5.0, 5.0, 2.0, 1.5];
        parameters[index] = value;
        assert!(pinhole.lens(4, 3, &parameters).is_err());
    }
    assert!(pinhole.lens(4, 3, &[5.0, 2.0, 1.5]).is_err());
    for (model, parameters, word) in [
        ("FOV", &[500.0, 500.0, 320.0, 240.0, 3.2][..], "angle"),
        ("EUCM", &[500.0, 500.0, 320.0, 240.0, 1.1, 1.0], "alpha"),
        ("EUCM", &[500.0, 500.0, 320.0, 240.0, 0.5, 0.0], "beta"),
        ("EQUIRECTANGULAR", &[0.0, 10.0], "focal"),
        ("SIMPLE_RADIAL", &[500.0, 320.0, 240.0, f64::NAN], "finite"),
    ] {
        let model = ModelName::named(model).unwrap();
        let error = model.lens(640, 480, parameters).unwrap_err();
        assert!(error.contains(word), "{error}");
    }
}

#[test]
fn displacement_is_that_of_the_farthest_pixel() {
    assert_eq!(
        lens("PINHOLE", &[500.0, 480.0, 310.0, 250.0]).displacement(),
        0.0
    );
    assert_eq!(
        lens("SIMPLE_RADIAL", &[500.0, 320.0, 240.0, 0.0]).displacement(),
        0.0
    );
    // At the corner: r = 0.8 stays, r(1 + k r²) = 0.8 ⇒ r = 0.79949…, times 500.
    let slight = lens("SIMPLE_RADIAL", &[500.0, 320.0, 240.0, 0.001]);
    assert!(
        (slight.displacement() - 0.2556).abs() < 2e-3,
        "{}",
        slight.displacement()
    );
    // 500 (tan θ − θ) at the corner's θ = 0.8.
    let wide = lens("SIMPLE_FISHEYE", &[500.0, 320.0, 240.0]);
    let expected = 500.0 * (0.8_f64.tan() - 0.8);
    assert!(
        (wide.displacement() - expected).abs() < 1e-6,
        "{}",
        wide.displacement()
    );
}

#[test]
fn a_moderate_lens_becomes_one_picture_of_its_whole_field() {
    let lens = barrel();
    let cuts = lens.cuts().unwrap();
    let [cut] = &cuts[..] else { panic!("{cuts:?}") };
    assert_eq!((cut.face, cut.camera.fx), (None, 500.0));
    assert!(cut.camera.width > 700 && cut.camera.height > 520, "{cut:?}");
    for k in (0..640 * 480).step_by(97) {
        let pixel = DVec2::new(f64::from(k % 640) + 0.5, f64::from(k / 640) + 0.5);
        assert!(cut.pixel(lens.ray(pixel).unwrap()).is_some(), "{pixel}");
    }
    // A pincushion's picture is smaller.
    let pincushion = super::tests::lens("SIMPLE_RADIAL", &[500.0, 320.0, 240.0, 0.2]);
    assert!(pincushion.cuts().unwrap()[0].camera.width < 620);
}

#[test]
fn wide_lenses_become_faces_that_show_every_pixel_once() {
    for (lens, faces) in [
        (fisheye(), &["down", "front", "left", "right", "up"][..]),
        (
            lens("EQUIRECTANGULAR", &[640.0, 480.0]),
            &["back", "down", "front", "left", "right", "up"],
        ),
    ] {
        let cuts = lens.cuts().unwrap();
        let names: Vec<_> = cuts.iter().filter_map(|cut| cut.face).collect();
        assert_eq!(names, faces);
        for cut in &cuts {
            let determinant = cut.rotation.determinant();
            assert!((determinant - 1.0).abs() < 1e-12, "{cut:?}");
            let Camera { width, cx, fx, .. } = cut.camera;
            let (left, right) = (-cx / fx, (f64::from(width) - cx) / fx);
            assert!(left > -1.02 && right < 1.02, "{cut:?}");
        }
        for k in (0..640 * 480).step_by(97) {
            let pixel = DVec2::new(f64::from(k % 640) + 0.5, f64::from(k / 640) + 0.5);
            let Some(ray) = lens.ray(pixel) else { continue };
            let shown = cuts.iter().filter(|cut| cut.pixel(ray).is_some());
            // Rays in the rounded seams are shown twice.
            assert!((1..=3).contains(&shown.count()), "{pixel}");
        }
    }
}

#[test]
fn lenses_that_fold_everything_are_errors() {
    let folded = lens("SIMPLE_RADIAL", &[500.0, 320.0, 240.0, -1e6]);
    assert!(folded.cuts().unwrap_err().contains("folds 100 %"));
    let squeezed = lens("SIMPLE_DIVISION", &[1e6, 320.0, 240.0, -1e7]);
    assert!(
        squeezed
            .cuts()
            .unwrap_err()
            .contains("times as many pixels")
    );
}

/// A smooth picture of the world by direction, between 55 and 200.
fn world(ray: DVec3) -> f64 {
    let ray = ray.normalize();
    127.0 + 40.0 * (9.0 * ray.x + 1.0).sin() + 30.0 * (11.0 * ray.y).cos() * (7.0 * ray.z).sin()
}

/// Photo of the world through `lens`, at a part of its size.
fn photographed(lens: &Lens, width: u32, height: u32) -> Photo {
    let mut gray = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let pixel = DVec2::new(
                (f64::from(x) + 0.5) * f64::from(lens.width) / f64::from(width),
                (f64::from(y) + 0.5) * f64::from(lens.height) / f64::from(height),
            );
            gray.push(lens.ray(pixel).map_or(0, |ray| world(ray).round() as u8));
        }
    }
    Photo {
        width,
        height,
        rgb: Some(gray.iter().map(|&g| [g, 255 - g, 7]).collect()),
        gray,
        mask: None,
    }
}

/// The largest difference from the world where the mask counts, and its share.
fn compared(photo: &Photo, camera: &Camera, rotation: glam::DMat3) -> (f64, f64) {
    let (mut worst, mut count) = (0.0_f64, 0);
    for (k, &gray) in photo.gray.iter().enumerate() {
        if photo.mask.as_ref().is_some_and(|mask| mask[k] == 0) {
            continue;
        }
        let (x, y) = (k as u32 % photo.width, k as u32 / photo.width);
        let ray = DVec3::new(
            (f64::from(x) + 0.5 - camera.cx) / camera.fx,
            (f64::from(y) + 0.5 - camera.cy) / camera.fy,
            1.0,
        );
        let expected = world(rotation.transpose() * ray);
        worst = worst.max((f64::from(gray) - expected).abs());
        count += 1;
    }
    (worst, f64::from(count) / photo.gray.len() as f64)
}

#[test]
fn undistorted_photos_show_the_world_as_the_pinhole_does() {
    for (lens, least) in [(barrel(), 0.85), (fisheye(), 0.5)] {
        let photo = photographed(&lens, 640, 480);
        let lens = Arc::new(lens);
        for cut in lens.cuts().unwrap() {
            let undistortion = Undistortion {
                lens: lens.clone(),
                rotation: cut.rotation,
            };
            let (picture, camera) = undistortion.apply(&photo, &cut.camera, None);
            assert_eq!(camera, cut.camera);
            let (worst, share) = compared(&picture, &camera, cut.rotation);
            assert!(
                worst <= 2.0 && share > least,
                "{:?}: {worst} {share}",
                cut.face
            );
            let rgb = picture.rgb.unwrap();
            for (k, [r, g, b]) in rgb.into_iter().enumerate() {
                let shown = picture.mask.as_ref().is_none_or(|mask| mask[k] == 255);
                assert!(r == picture.gray[k] && (!shown || (r.abs_diff(255 - g) <= 1 && b == 7)));
            }
        }
    }
}

#[test]
fn shrinking_keeps_cameras_and_pictures_together() {
    let lens = Arc::new(barrel());
    let cut = lens.cuts().unwrap().remove(0);
    let undistortion = Undistortion {
        lens: lens.clone(),
        rotation: cut.rotation,
    };
    let side = undistortion.photo_side(&cut.camera, Some(200)).unwrap();
    assert!((300..400).contains(&side), "{side}");
    let photo = photographed(&lens, side, side * 3 / 4);
    let (picture, camera) = undistortion.apply(&photo, &cut.camera, Some(200));
    assert!(picture.width.max(picture.height) <= 200 && picture.width > 190);
    assert_eq!(
        (camera.width, camera.height),
        (picture.width, picture.height)
    );
    let (worst, share) = compared(&picture, &camera, cut.rotation);
    assert!(worst <= 8.0 && share > 0.85, "{worst} {share}");
    // Whatever sizes are asked for.
    for side in [0, 1, 2] {
        let photo = photographed(&lens, 1, 1);
        let (picture, _) = undistortion.apply(&photo, &cut.camera, Some(side));
        assert!(picture.width >= 1 && picture.width <= side.max(1));
    }
}

#[test]
fn masks_come_along() {
    let lens = Arc::new(barrel());
    let cut = lens.cuts().unwrap().remove(0);
    let mut photo = photographed(&lens, 640, 480);
    photo.mask = Some(
        (0..640 * 480)
            .map(|k| if k % 640 < 320 { 255 } else { 0 })
            .collect(),
    );
    let undistortion = Undistortion {
        lens,
        rotation: cut.rotation,
    };
    let (picture, camera) = undistortion.apply(&photo, &cut.camera, None);
    let mask = picture.mask.unwrap();
    let row = &mask[camera.cy as usize * camera.width as usize..][..camera.width as usize];
    let middle = camera.cx as usize;
    assert_eq!((row[middle - 3], row[middle + 3]), (255, 0));
    assert_eq!(row[0], 0);
}

#[test]
fn a_photos_pixels_are_where_the_picture_shows_them() {
    for lens in [barrel(), fisheye()] {
        let lens = std::sync::Arc::new(lens);
        for cut in lens.cuts().unwrap() {
            let undistortion = Undistortion {
                lens: lens.clone(),
                rotation: cut.rotation,
            };
            // The photo at half its size, the picture at a third of its own.
            let size = [lens.width / 2, lens.height / 2];
            let camera = cut
                .camera
                .resized(cut.camera.width / 3, cut.camera.height / 3);
            let places = undistortion.places(size, &camera);
            let sources = undistortion.sources(&camera, size);
            assert_eq!(places.len(), (size[0] * size[1]) as usize);
            let mut compared = 0;
            for (i, source) in sources.iter().enumerate() {
                let inside = (0..2).all(|k| source[k] >= 1.0 && source[k] < size[k] as f32 - 1.0);
                if !inside {
                    continue;
                }
                let at = source[1] as usize * size[0] as usize + source[0] as usize;
                let place = places[at];
                if place[0].is_nan() {
                    continue;
                }
                // Half a pixel of the photo, as large as the picture's stretch makes it.
                let own = [i as u32 % camera.width, i as u32 / camera.width];
                let off = (0..2).map(|k| (place[k] - own[k] as f32 - 0.5).abs());
                assert!(off.fold(0.0, f32::max) < 2.0, "{own:?} {place:?}");
                compared += 1;
            }
            assert!(compared > 20, "{compared}");
        }
    }
}
