use std::fs;

use image::{DynamicImage, GrayImage, Luma, Rgba, RgbaImage};
use tempfile::TempDir;

use super::*;
use crate::capture::fixtures::{Model, SIZE, folder, write};
use crate::capture::{LoadOptions, Loader, MaskUse, Photo};

/// The example's three views, `a.png`, `b.png` and `left/a c.png`, all photos gray 200.
fn capture() -> (TempDir, Capture) {
    let model = Model::example();
    let dir = folder(&model);
    write(dir.path(), "sparse/0", model.binary(), "bin");
    let capture = Capture::load(dir.path()).unwrap();
    for view in &capture.views {
        let photo = GrayImage::from_pixel(SIZE.0, SIZE.1, Luma([200]));
        photo.save(&view.image_path).unwrap();
    }
    (dir, capture)
}

/// Writes a mask below the capture's `masks/`.
fn put(capture: &Capture, name: &str, mask: impl Into<DynamicImage>) {
    let path = capture.root.join("masks").join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    mask.into().save(path).unwrap();
}

/// Its left half counts.
fn half(width: u32, height: u32, white: u8) -> GrayImage {
    GrayImage::from_fn(width, height, |x, _| {
        Luma([if 2 * x < width { white } else { 0 }])
    })
}

fn load(capture: &Capture, options: &LoadOptions, view: usize) -> Photo {
    let loader = Loader::open(capture, options).unwrap();
    loader.load(&capture.views[view]).unwrap().0
}

#[track_caller]
fn assert_fails(capture: &Capture, source: MaskSource, words: &[&str]) {
    let options = LoadOptions {
        masks: source,
        ..LoadOptions::default()
    };
    let error = Loader::open(capture, &options)
        .and_then(|loader| {
            capture
                .views
                .iter()
                .try_for_each(|v| loader.load(v).map(|_| ()))
        })
        .unwrap_err()
        .to_string();
    for word in words {
        assert!(error.contains(word), "{error:?} does not say {word:?}");
    }
}

#[test]
fn masks_are_found_by_colmaps_names() {
    let (_dir, capture) = capture();
    put(&capture, "a.png", half(SIZE.0, SIZE.1, 255));
    put(&capture, "a.png.png", half(SIZE.0, SIZE.1, 100));
    put(&capture, "left/a c.png", half(SIZE.0, SIZE.1, 255));
    let options = LoadOptions::default();
    let loader = Loader::open(&capture, &options).unwrap();
    assert_eq!(loader.masked_views(&capture.views), 2);
    assert_eq!(loader.options().masks, MaskSource::ImageMetadata);
    let row = |mask: Option<Vec<u8>>| mask.map(|mask| mask[..8].to_vec());
    let first = load(&capture, &options, 0);
    assert_eq!(row(first.mask), Some(vec![100, 100, 100, 100, 0, 0, 0, 0]));
    assert!(first.gray.iter().all(|&v| v == 200));
    assert_eq!(load(&capture, &options, 1).mask, None);
    let last = load(&capture, &options, 2);
    assert_eq!(row(last.mask), Some(vec![255, 255, 255, 255, 0, 0, 0, 0]));

    let off = LoadOptions {
        masks: MaskSource::Off,
        ..options
    };
    assert_eq!(load(&capture, &off, 0).mask, None);
}

#[test]
fn another_folder_may_be_named() {
    let (dir, capture) = capture();
    put(&capture, "b.png", half(SIZE.0, SIZE.1, 255));
    let elsewhere = dir.path().join("elsewhere");
    fs::rename(dir.path().join("masks"), &elsewhere).unwrap();
    assert_eq!(load(&capture, &LoadOptions::default(), 1).mask, None);
    let options = LoadOptions {
        masks: MaskSource::Folder(elsewhere.clone()),
        ..LoadOptions::default()
    };
    assert!(load(&capture, &options, 1).mask.is_some());
    fs::remove_file(elsewhere.join("b.png")).unwrap();
    assert_fails(
        &capture,
        options.masks,
        &["elsewhere", "a.png.png", "like COLMAP does"],
    );
    let none = MaskSource::Folder(dir.path().join("none"));
    assert_fails(&capture, none, &["none", "no such folder of masks"]);
    let photos = MaskSource::Folder(dir.path().join("images"));
    assert_fails(&capture, photos, &["images", "no mask for any photo"]);
}

#[test]
fn masks_and_photos_without_each_other_are_counted() {
    let (_dir, capture) = capture();
    put(&capture, "a.png", half(SIZE.0, SIZE.1, 255));
    let found = || {
        let loader = Loader::open(&capture, &LoadOptions::default()).unwrap();
        loader.masked().unwrap().clone()
    };
    assert_eq!((found().photos, found().masked), (3, 1));
    assert_eq!(found().strays, [""; 0]);
    put(&capture, "left/b_mask.png", half(SIZE.0, SIZE.1, 255));
    fs::write(capture.root.join("masks/b.jpg"), "").unwrap();
    fs::write(capture.root.join("masks/notes.txt"), "").unwrap();
    // That of a photo without a pose.
    fs::write(capture.root.join("images/d.JPG"), "").unwrap();
    put(&capture, "d.png", half(SIZE.0, SIZE.1, 255));
    assert_eq!((found().photos, found().masked), (3, 1));
    assert_eq!(found().strays, ["b.jpg", "left/b_mask.png"]);
}

#[test]
fn a_mask_of_two_photos_is_refused() {
    let mut model = Model::example();
    model.images[1].name = "b.jpg".into();
    let dir = folder(&model);
    write(dir.path(), "sparse/0", model.binary(), "bin");
    let capture = Capture::load(dir.path()).unwrap();
    // Photo b.png has it for itself.
    put(&capture, "b.png", half(SIZE.0, SIZE.1, 255));
    let loader = Loader::open(&capture, &LoadOptions::default()).unwrap();
    assert_eq!(loader.masked_views(&capture.views), 1);
    model.images[0].name = "b.jpeg".into();
    let dir = folder(&model);
    write(dir.path(), "sparse/0", model.binary(), "bin");
    let capture = Capture::load(dir.path()).unwrap();
    put(&capture, "b.png", half(SIZE.0, SIZE.1, 255));
    let words = ["masks/b.png", "b.jpg", "b.jpeg", "b.jpeg.png"];
    assert_fails(&capture, MaskSource::ImageMetadata, &words);
}

/// Gray 200 where it is opaque; what is under the transparency of the right half is 9.
fn transparent(opacity: u8) -> RgbaImage {
    RgbaImage::from_fn(SIZE.0, SIZE.1, |x, _| match 2 * x < SIZE.0 {
        true => Rgba([200, 200, 200, 255]),
        false => Rgba([9, 9, 9, opacity]),
    })
}

#[test]
fn transparency_is_a_mask_where_no_other_is() {
    let (_dir, capture) = capture();
    transparent(0).save(&capture.views[1].image_path).unwrap();
    let metadata = LoadOptions::default();
    let off = LoadOptions {
        masks: MaskSource::Off,
        ..LoadOptions::default()
    };
    assert_eq!(load(&capture, &off, 1).mask, None);
    let mut loader = Loader::open(&capture, &metadata).unwrap();
    assert_eq!(loader.options().masks, MaskSource::Alpha);
    assert_eq!(loader.masked_views(&capture.views), 1);
    assert_eq!(loader.load(&capture.views[0]).unwrap().0.mask, None);
    assert_eq!(loader.transparent(), 0);
    let (photo, _) = loader.load(&capture.views[1]).unwrap();
    let expected = Some(half(SIZE.0, SIZE.1, 255).into_raw());
    assert_eq!(photo.mask, expected);
    assert_eq!(loader.transparent(), 1);
    // What is under it has no part in the range of 16 bits.
    let deep = DynamicImage::from(transparent(0)).into_rgba16();
    for view in &capture.views {
        deep.save(&view.image_path).unwrap();
    }
    loader = Loader::open(&capture, &metadata).unwrap();
    let sample = loader.sample(&capture.views[1]).unwrap();
    assert!(sample.iter().all(|&value| value == 200.0 * 257.0));
    assert_eq!(load(&capture, &metadata, 1).mask, expected);
    // Masks go before it.
    put(&capture, "a.png", half(SIZE.0, SIZE.1, 255));
    assert_eq!(load(&capture, &metadata, 1).mask, None);
}

#[test]
fn opaque_alpha_is_no_mask_and_nothing_else_is_left_of_none() {
    let (_dir, capture) = capture();
    transparent(255).save(&capture.views[1].image_path).unwrap();
    let loader = Loader::open(&capture, &LoadOptions::default()).unwrap();
    assert_eq!(loader.load(&capture.views[1]).unwrap().0.mask, None);
    assert_eq!(loader.transparent(), 0);
    RgbaImage::new(SIZE.0, SIZE.1)
        .save(&capture.views[1].image_path)
        .unwrap();
    let words = ["images/b.png", "transparency leaves no pixel"];
    assert_fails(&capture, MaskSource::ImageMetadata, &words);
    assert_fails(&capture, MaskSource::Alpha, &words);
}

#[test]
fn every_kind_of_mask_says_the_same() {
    let expected: Vec<u8> = half(SIZE.0, SIZE.1, 255).into_raw();
    let gray = half(SIZE.0, SIZE.1, 255);
    let transparent = RgbaImage::from_fn(SIZE.0, SIZE.1, |x, y| {
        let [value] = gray.get_pixel(x, y).0;
        Rgba([value, 0, 0, 0])
    });
    let masks: [DynamicImage; 5] = [
        gray.clone().into(),
        DynamicImage::from(gray.clone()).to_rgb8().into(),
        transparent.into(),
        // Numbers of classes, not grays.
        half(SIZE.0, SIZE.1, 1).into(),
        DynamicImage::from(gray).to_luma_alpha8().into(),
    ];
    for mask in masks {
        let (_dir, capture) = capture();
        put(&capture, "a.png", mask);
        assert_eq!(
            load(&capture, &LoadOptions::default(), 0).mask.as_ref(),
            Some(&expected)
        );
    }
    let (_dir, capture) = capture();
    put(&capture, "a.png", GrayImage::new(1, 1));
    fs::write(capture.root.join("masks/a.png"), ONE_BIT).unwrap();
    assert_eq!(
        load(&capture, &LoadOptions::default(), 0).mask.as_ref(),
        Some(&expected)
    );
}

#[test]
fn labels_of_several_things_are_no_mask() {
    let of =
        |values: [u8; 3]| GrayImage::from_fn(SIZE.0, SIZE.1, |x, _| Luma([values[x as usize % 3]]));
    let colors = [[0, 0, 0, 255], [128, 0, 0, 255], [0, 128, 0, 255]];
    let colors = RgbaImage::from_fn(SIZE.0, SIZE.1, |x, _| Rgba(colors[x as usize % 3]));
    let cut = RgbaImage::from_fn(SIZE.0, SIZE.1, |x, _| {
        Rgba([255, 255, 255, (x % 2 * 255) as u8])
    });
    let kinds: [(DynamicImage, &str); 6] = [
        (of([0, 1, 2]).into(), "values 0, 1, 2,"),
        (of([0, 1, 255]).into(), "values 0, 1, 255,"),
        (of([1, 2, 2]).into(), "values 1, 2,"),
        (of([0, 50, 100]).into(), "values 0, 50, 100,"),
        (colors.into(), "2 colors"),
        (cut.into(), "transparency alone"),
    ];
    for (mask, words) in kinds {
        let (_dir, capture) = capture();
        put(&capture, "a.png", mask);
        assert_fails(&capture, MaskSource::ImageMetadata, &["masks/a.png", words]);
    }
    // One label, void, and gray edges.
    for (values, expected) in [
        ([0, 7, 0], [0, 255, 0]),
        ([0, 255, 0], [0, 255, 0]),
        ([0, 128, 255], [0, 128, 255]),
        ([255, 2, 253], [255, 2, 253]),
    ] {
        let (_dir, capture) = capture();
        put(&capture, "a.png", of(values));
        let mask = load(&capture, &LoadOptions::default(), 0).mask.unwrap();
        assert_eq!(mask[..3], expected);
    }
}

#[test]
fn masks_of_another_scale_are_resized() {
    let expected: Vec<u8> = half(SIZE.0, SIZE.1, 255).into_raw();
    for (width, height) in [(4, 3), (16, 12), (80, 60), (2, 2)] {
        let (_dir, capture) = capture();
        put(&capture, "a.png", half(width, height, 255));
        if (width, height) == (2, 2) {
            let words = ["a.png", "2×2", "8×6", "aspect"];
            assert_fails(&capture, MaskSource::ImageMetadata, &words);
            continue;
        }
        assert_eq!(
            load(&capture, &LoadOptions::default(), 0).mask.as_ref(),
            Some(&expected)
        );
    }
}

#[test]
fn masks_that_leave_all_or_nothing() {
    let (_dir, capture) = capture();
    put(
        &capture,
        "a.png",
        GrayImage::from_pixel(SIZE.0, SIZE.1, Luma([255])),
    );
    assert_eq!(load(&capture, &LoadOptions::default(), 0).mask, None);
    put(&capture, "b.png", GrayImage::new(SIZE.0, SIZE.1));
    let words = [
        "images/b.png",
        "masks/b.png",
        "leaves no pixel",
        "image_deleter",
    ];
    assert_fails(&capture, MaskSource::ImageMetadata, &words);
}

#[test]
fn masks_that_cannot_be_read() {
    let (_dir, capture) = capture();
    put(&capture, "a.png", half(SIZE.0, SIZE.1, 255));
    let path = capture.root.join("masks/a.png");
    fs::write(&path, &fs::read(&path).unwrap()[..50]).unwrap();
    assert_fails(
        &capture,
        MaskSource::ImageMetadata,
        &["masks/a.png", "cannot be decoded"],
    );
    let deep = image::ImageBuffer::<Luma<u16>, _>::new(SIZE.0, SIZE.1);
    put(&capture, "a.png", DynamicImage::from(deep));
    assert_fails(
        &capture,
        MaskSource::ImageMetadata,
        &["masks/a.png", "16 bits", "8 bits or 1 bit"],
    );
}

#[test]
fn what_is_removed_is_black() {
    let (_dir, capture) = capture();
    put(&capture, "a.png", half(SIZE.0, SIZE.1, 255));
    let options = LoadOptions {
        masked: MaskUse::Remove,
        ..LoadOptions::default()
    };
    let photo = load(&capture, &options, 0);
    assert_eq!(photo.gray[..8], [200, 200, 200, 200, 0, 0, 0, 0]);
    assert_eq!(photo.mask.unwrap()[..8], [255, 255, 255, 255, 0, 0, 0, 0]);
    // At 3 × 2 pixels the middle one is half covered, and half as bright before black.
    let options = LoadOptions {
        max_side: Some(3),
        ..options
    };
    let photo = load(&capture, &options, 0);
    assert_eq!(photo.mask.as_ref().unwrap()[..3], [255, 128, 0]);
    assert_eq!(photo.gray[..3], [200, 100, 0]);
    let options = LoadOptions {
        masked: MaskUse::Ignore,
        ..options
    };
    assert_eq!(load(&capture, &options, 0).gray[..3], [200, 200, 200]);
}

/// A PNG of 8 × 6 pixels and one bit a pixel, the left half white.
const ONE_BIT: &[u8] = &[
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52,
    0x00, 0x00, 0x00, 0x08, 0x00, 0x00, 0x00, 0x06, 0x01, 0x00, 0x00, 0x00, 0x00, 0xd6, 0x7e, 0xe2,
    0x56, 0x00, 0x00, 0x00, 0x0c, 0x49, 0x44, 0x41, 0x54, 0x78, 0x9c, 0x63, 0xf8, 0xc0, 0x00, 0x87,
    0x00, 0x21, 0xcc, 0x05, 0xa1, 0x89, 0x87, 0x0f, 0x74, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e,
    0x44, 0xae, 0x42, 0x60, 0x82,
];
