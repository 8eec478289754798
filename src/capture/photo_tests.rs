use std::fs;
use std::path::Path;

use glam::{DMat3, DVec3};
use image::{DynamicImage, GrayImage, Rgb, RgbImage, RgbaImage};
use tempfile::{TempDir, tempdir};

use super::*;
use crate::capture::{Camera, CaptureError, LoadOptions, Loader, View};
use crate::color::gray_from_rgb;

fn view(path: &Path, width: u32, height: u32) -> View {
    View {
        name: "photo".into(),
        photo: "photo".into(),
        undistortion: None,
        stance: Default::default(),
        image_path: path.into(),
        camera: Camera {
            width,
            height,
            fx: 30.0,
            fy: 31.0,
            cx: 0.5 * f64::from(width),
            cy: 0.5 * f64::from(height),
            rotation: DMat3::IDENTITY,
            translation: DVec3::ZERO,
        },
    }
}

/// Loads with every other option at its default.
fn load(view: &View, max_side: Option<u32>) -> Result<(Photo, Camera), CaptureError> {
    let options = LoadOptions {
        max_side,
        ..LoadOptions::default()
    };
    Loader::new(options).load(view)
}

/// Saves a picture under a name that tells its format.
fn saved(picture: impl Into<DynamicImage>, name: &str) -> (TempDir, std::path::PathBuf) {
    let dir = tempdir().unwrap();
    let path = dir.path().join(name);
    picture.into().save(&path).unwrap();
    (dir, path)
}

fn colors(width: u32, height: u32) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        Rgb([(x * 37) as u8, (y * 53) as u8, (x * y) as u8])
    })
}

#[track_caller]
fn assert_fails(path: &Path, size: (u32, u32), words: &[&str]) {
    let error = load(&view(path, size.0, size.1), None)
        .unwrap_err()
        .to_string();
    let name = path.file_name().unwrap().to_str().unwrap();
    for word in [name].iter().chain(words) {
        assert!(error.contains(word), "{error:?} does not say {word:?}");
    }
}

#[test]
fn color_photos_keep_their_colors_and_lightness() {
    let picture = colors(12, 9);
    let (_dir, path) = saved(picture.clone(), "photo.png");
    let (photo, camera) = load(&view(&path, 12, 9), None).unwrap();
    assert_eq!((photo.width, photo.height), (12, 9));
    assert_eq!(camera, view(&path, 12, 9).camera);
    let rgb = photo.rgb.unwrap();
    for (i, pixel) in picture.pixels().enumerate() {
        assert_eq!(rgb[i], pixel.0);
        let exact = gray_from_rgb(pixel.0.map(|c| f64::from(c) / 255.0));
        assert_eq!(photo.gray[i], (255.0 * exact).round() as u8);
    }
}

#[test]
fn gray_photos_pass_through_whatever_their_container() {
    let gray = GrayImage::from_fn(10, 8, |x, y| image::Luma([(x * 25 + y) as u8]));
    let rgb = DynamicImage::from(gray.clone()).to_rgb8();
    let rgba = RgbaImage::from_fn(10, 8, |x, y| {
        let value = gray.get_pixel(x, y).0[0];
        image::Rgba([value, value, value, (x * 9) as u8])
    });
    let with_alpha = DynamicImage::from(gray.clone()).to_luma_alpha8();
    for picture in [
        gray.clone().into(),
        rgb.into(),
        rgba.into(),
        DynamicImage::from(with_alpha),
    ] {
        let (_dir, path) = saved(picture, "photo.png");
        let (photo, _) = load(&view(&path, 10, 8), None).unwrap();
        assert_eq!(photo.gray, gray.as_raw().as_slice());
        assert!(photo.rgb.is_none());
    }
}

#[test]
fn jpeg_is_told_by_its_content() {
    let (_dir, path) = saved(colors(16, 16), "photo.jpg");
    let disguised = path.with_extension("png");
    fs::rename(&path, &disguised).unwrap();
    let (photo, _) = load(&view(&disguised, 16, 16), None).unwrap();
    assert!(photo.rgb.is_some());
}

#[test]
fn sizes_near_the_camera_or_of_its_aspect_are_taken() {
    let (_dir, path) = saved(GrayImage::new(100, 75), "photo.png");
    for (width, height) in [
        (101, 75),
        (100, 74),
        (99, 76),
        (800, 600),
        (52, 39),
        (400, 298),
    ] {
        let (photo, camera) = load(&view(&path, width, height), None).unwrap();
        assert_eq!((photo.width, photo.height), (100, 75));
        assert_eq!((camera.width, camera.height), (100, 75));
        assert!((camera.fx - 30.0 * 100.0 / f64::from(width)).abs() < 1e-12);
    }
    for size in [(75, 100), (100, 77), (98, 75), (800, 800)] {
        assert_fails(&path, size, &["100×75", "COLMAP saw"]);
    }
}

#[test]
fn long_photos_are_shrunk_with_their_camera() {
    let (_dir, path) = saved(colors(120, 90), "photo.png");
    let (photo, camera) = load(&view(&path, 120, 90), Some(40)).unwrap();
    assert_eq!((photo.width, photo.height), (40, 30));
    assert_eq!(
        (photo.gray.len(), photo.rgb.as_ref().unwrap().len()),
        (1200, 1200)
    );
    assert_eq!(
        (camera.width, camera.height, camera.fx, camera.cx),
        (40, 30, 10.0, 20.0)
    );
    let picture = colors(120, 90);
    for channel in 0..3 {
        let mean: u32 = (0..9)
            .map(|i| u32::from(picture.get_pixel(3 + i % 3, 6 + i / 3).0[channel]))
            .sum();
        let got = photo.rgb.as_ref().unwrap()[2 * 40 + 1][channel];
        assert!((f64::from(got) - f64::from(mean) / 9.0).abs() <= 0.5);
    }
    let same = load(&view(&path, 120, 90), Some(120)).unwrap().0;
    assert_eq!(same, load(&view(&path, 120, 90), None).unwrap().0);
    assert_eq!(
        load(&view(&path, 120, 90), Some(0)).unwrap().0.gray.len(),
        1
    );
}

#[test]
fn other_formats_name_the_remedy() {
    let (_dir, path) = saved(GrayImage::new(8, 6), "photo.png");
    fs::write(&path, b"BM not a bitmap").unwrap();
    assert_fails(&path, (8, 6), &["neither JPEG, PNG nor TIFF"]);
    fs::write(&path, b"").unwrap();
    assert_fails(&path, (8, 6), &["neither JPEG, PNG nor TIFF"]);
    fs::remove_file(&path).unwrap();
    assert_fails(&path, (8, 6), &["cannot be read"]);
}

#[test]
fn cut_off_photos_are_errors() {
    for name in ["photo.png", "photo.jpg"] {
        let (_dir, path) = saved(colors(40, 30), name);
        let whole = fs::read(&path).unwrap();
        for end in [whole.len() / 4, whole.len() / 2, whole.len() - 20] {
            fs::write(&path, &whole[..end]).unwrap();
            assert_fails(&path, (40, 30), &[]);
        }
    }
}

#[test]
fn cmyk_is_refused() {
    let (_dir, path) = saved(colors(16, 16), "photo.jpg");
    let mut file = fs::read(&path).unwrap();
    let frame = file.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
    file[frame + 9] = 4;
    fs::write(&path, file).unwrap();
    assert_fails(&path, (16, 16), &["CMYK"]);
}

#[test]
fn sizes_that_cannot_be_are_refused_before_decoding() {
    let (_dir, path) = saved(colors(16, 16), "photo.jpg");
    let mut file = fs::read(&path).unwrap();
    let frame = file.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
    file[frame + 5..frame + 9].fill(0xff);
    fs::write(&path, file).unwrap();
    assert_fails(&path, (16, 8), &["65535×65535", "16×8"]);
    assert_fails(&path, (65535, 65535), &["65535×65535", "--max_image_size"]);
}

#[test]
fn twelve_bits_are_told_before_anything_is_decoded() {
    let (_dir, path) = saved(GrayImage::new(16, 16), "photo.jpg");
    let mut file = fs::read(&path).unwrap();
    let frame = file.windows(2).position(|marker| marker == b"\xff\xc0");
    file[frame.expect("a frame") + 4] = 12;
    fs::write(&path, file).unwrap();
    let words = ["photo.jpg", "12 bits", "convert it to 8 bits"];
    assert_fails(&path, (16, 16), &words);
    let error = crate::capture::decode::header(&path)
        .unwrap_err()
        .to_string();
    assert!(words.iter().all(|word| error.contains(word)), "{error}");
}
