//! Photos of more than 8 bits, channels, ranges.

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use ::tiff::encoder::{TiffEncoder, colortype};
use glam::{DMat3, DVec3};
use image::{ImageBuffer, Luma, Rgb, RgbImage};
use tempfile::{TempDir, tempdir};

use super::fixtures::{Model, SIZE, folder, write};
use super::{
    Camera, Capture, CaptureError, Channel, Encoding, Headers, LoadOptions, Loader, Normalize,
    Photo, View,
};
use crate::color::{GrayTable, linear_to_srgb};

/// A capture of the example's views whose photos `save` writes.
fn capture(save: impl Fn(usize, &Path)) -> (TempDir, Capture) {
    let model = Model::example();
    let dir = folder(&model);
    write(dir.path(), "sparse/0", model.binary(), "bin");
    let capture = Capture::load(dir.path()).unwrap();
    for (i, view) in capture.views.iter().enumerate() {
        save(i, &view.image_path);
    }
    (dir, capture)
}

/// A view of another photo of the same size.
fn view(image_path: PathBuf) -> View {
    let [width, height] = [SIZE.0, SIZE.1];
    View {
        name: "photo".into(),
        photo: "photo".into(),
        undistortion: None,
        stance: Default::default(),
        image_path,
        camera: Camera {
            width,
            height,
            fx: 10.0,
            fy: 10.0,
            cx: 4.0,
            cy: 3.0,
            rotation: DMat3::IDENTITY,
            translation: DVec3::ZERO,
        },
    }
}

fn load_with(bytes: &[u8], options: LoadOptions) -> Result<Photo, CaptureError> {
    let dir = tempdir().unwrap();
    let path = dir.path().join("photo.tif");
    fs::write(&path, bytes).unwrap();
    Ok(Loader::new(options).load(&view(path))?.0)
}

const COUNT: usize = (SIZE.0 * SIZE.1) as usize;

fn gray_tiff(values: &[f32; COUNT]) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    TiffEncoder::new(&mut file)
        .unwrap()
        .write_image::<colortype::Gray32Float>(SIZE.0, SIZE.1, values)
        .unwrap();
    file.into_inner()
}

fn ramp() -> [f32; COUNT] {
    std::array::from_fn(|i| i as f32 / (COUNT - 1) as f32)
}

fn level(encoded: f64) -> u8 {
    (255.0 * encoded.clamp(0.0, 1.0)).round() as u8
}

#[test]
fn sixteen_bits_are_rounded_to_the_nearest_gray() {
    let (_dir, capture) = capture(|_, path| {
        ImageBuffer::<Luma<u16>, _>::from_fn(SIZE.0, SIZE.1, |x, y| {
            Luma([(257 * (8 * y + x) + 128) as u16])
        })
        .save(path)
        .unwrap();
    });
    let loader = Loader::new(LoadOptions::default());
    let (photo, _) = loader.load(&capture.views[0]).unwrap();
    assert_eq!(photo.gray, (0..48).collect::<Vec<u8>>());
    assert!(photo.rgb.is_none() && photo.mask.is_none());
}

#[test]
fn sixteen_bits_of_color_keep_it() {
    let (_dir, capture) = capture(|_, path| {
        ImageBuffer::<Rgb<u16>, _>::from_fn(SIZE.0, SIZE.1, |x, y| {
            Rgb([257 * 9 * x as u16, 257 * 5 * y as u16, 257 * 200])
        })
        .save(path)
        .unwrap();
    });
    let loader = Loader::new(LoadOptions::default());
    let (photo, _) = loader.load(&capture.views[0]).unwrap();
    let rgb = photo.rgb.unwrap();
    assert_eq!(rgb[8 * 3 + 5], [45, 15, 200]);
    assert_eq!(photo.gray[8 * 3 + 5], GrayTable::new().gray([45, 15, 200]));
}

#[test]
fn floats_are_linear_light_unless_told() {
    let values = ramp();
    let encoding = |encoding| LoadOptions {
        encoding,
        ..LoadOptions::default()
    };
    let linear: Vec<u8> = values
        .iter()
        .map(|&v| level(linear_to_srgb(v.into())))
        .collect();
    let plain: Vec<u8> = values.iter().map(|&v| level(v.into())).collect();
    let file = gray_tiff(&values);
    assert_eq!(
        load_with(&file, encoding(Encoding::Auto)).unwrap().gray,
        linear
    );
    assert_eq!(
        load_with(&file, encoding(Encoding::Linear)).unwrap().gray,
        linear
    );
    assert_eq!(
        load_with(&file, encoding(Encoding::Srgb)).unwrap().gray,
        plain
    );
    assert_ne!(linear, plain);

    let doubles = values.map(f64::from);
    let mut file = Cursor::new(Vec::new());
    TiffEncoder::new(&mut file)
        .unwrap()
        .write_image::<colortype::Gray64Float>(SIZE.0, SIZE.1, &doubles)
        .unwrap();
    let photo = load_with(&file.into_inner(), encoding(Encoding::Auto)).unwrap();
    assert_eq!(photo.gray, linear);
}

#[test]
fn values_that_are_not_finite_do_not_count() {
    let mut values = ramp();
    (values[3], values[20], values[21]) = (f32::NAN, f32::INFINITY, f32::NEG_INFINITY);
    let dir = tempdir().unwrap();
    let path = dir.path().join("photo.tif");
    fs::write(&path, gray_tiff(&values)).unwrap();
    let view = view(path);
    let loader = Loader::new(LoadOptions::default());
    let (photo, _) = loader.load(&view).unwrap();
    let mask = photo.mask.unwrap();
    let masked: Vec<usize> = (0..COUNT).filter(|&i| mask[i] == 0).collect();
    assert_eq!(masked, [3, 20, 21]);
    assert_eq!(
        mask.iter().filter(|&&count| count == 255).count(),
        COUNT - 3
    );
    assert_eq!(loader.not_finite(), 3);
    assert!(loader.sample(&view).unwrap().iter().all(|v| v.is_finite()));
    // Nor do they spill into what counts: 8 × 6 becomes 4 × 3, pixel 1 covers 2, 3, 10, 11.
    let options = LoadOptions {
        max_side: Some(4),
        encoding: Encoding::Srgb,
        ..LoadOptions::default()
    };
    let small = Loader::new(options).load(&view).unwrap().0;
    let mean = [2, 10, 11]
        .iter()
        .map(|&i| level(ramp()[i].into()) as f64)
        .sum::<f64>()
        / 3.0;
    assert_eq!(small.gray[1], mean.round() as u8);
    assert_eq!(small.mask.unwrap()[1], 191);

    let error = load_with(&gray_tiff(&[f32::NAN; COUNT]), LoadOptions::default());
    assert!(error.unwrap_err().to_string().contains("no finite value"));
}

#[test]
fn a_channel_becomes_gray() {
    let picture = RgbImage::from_fn(SIZE.0, SIZE.1, |x, y| {
        Rgb([10 * x as u8, 20 * y as u8, (x + y) as u8])
    });
    let (_dir, capture) = capture(|_, path| picture.save(path).unwrap());
    for (i, channel) in [Channel::R, Channel::G, Channel::B].into_iter().enumerate() {
        let loader = Loader::new(LoadOptions {
            channel,
            ..LoadOptions::default()
        });
        let (photo, _) = loader.load(&capture.views[0]).unwrap();
        let expected: Vec<u8> = picture.pixels().map(|pixel| pixel.0[i]).collect();
        assert_eq!(photo.gray, expected);
        assert!(photo.rgb.is_none());
    }
}

#[test]
fn a_range_is_in_the_files_unit() {
    let options = |range| LoadOptions {
        normalize: Normalize::Range(range),
        encoding: Encoding::Srgb,
        ..LoadOptions::default()
    };
    let values: [f32; COUNT] = std::array::from_fn(|i| i as f32 - 10.0);
    let photo = load_with(&gray_tiff(&values), options([0.0, 20.0])).unwrap();
    assert_eq!(photo.gray[..11], [0; 11]);
    assert_eq!(photo.gray[15], 64);
    assert_eq!(photo.gray[20], 128);
    assert_eq!(photo.gray[30..], [255; 18]);

    let (_dir, capture) = capture(|i, path| match i {
        0 => image::GrayImage::from_fn(SIZE.0, SIZE.1, |x, _| Luma([50 + 10 * x as u8]))
            .save(path)
            .unwrap(),
        _ => {
            ImageBuffer::<Luma<u16>, _>::from_fn(SIZE.0, SIZE.1, |x, _| Luma([50 + 10 * x as u16]))
                .save(path)
                .unwrap()
        }
    });
    let loader = Loader::new(options([60.0, 110.0]));
    for view in &capture.views {
        let (photo, _) = loader.load(view).unwrap();
        assert_eq!(photo.gray[..8], [0, 0, 51, 102, 153, 204, 255, 255]);
    }
}

#[test]
fn the_range_of_all_photos_is_found() {
    let at = |photo: usize, x: u32, y: u32| 20_000 + 10 * (48 * photo as u32 + 8 * y + x) as u16;
    let (_dir, capture) = capture(|i, path| {
        ImageBuffer::<Luma<u16>, _>::from_fn(SIZE.0, SIZE.1, |x, y| Luma([at(i, x, y)]))
            .save(path)
            .unwrap();
    });
    assert_eq!(
        Headers::read(&capture.views).unwrap().kinds,
        [("gray, 16 bits".to_owned(), 3)].into()
    );
    let mut loader = Loader::open(&capture, &LoadOptions::default()).unwrap();
    assert!(loader.undecided());
    let mut samples: Vec<f32> = Vec::new();
    for view in capture.views.iter().rev() {
        samples.extend(loader.sample(view).unwrap());
    }
    assert_eq!(samples.len(), 3 * COUNT);
    loader.decide(samples);
    // Ranks 0.005 · 143 and 0.995 · 143, to the nearest.
    let range = Normalize::Range([20_010.0, 21_420.0]);
    assert_eq!(loader.options().normalize, range);
    let (first, _) = loader.load(&capture.views[0]).unwrap();
    let (last, _) = loader.load(&capture.views[2]).unwrap();
    assert_eq!((first.gray[0], first.gray[1], first.gray[2]), (0, 0, 2));
    assert_eq!((last.gray[46], last.gray[47]), (255, 255));
    assert_eq!(last.gray[0], level(950.0 / 1410.0));

    // What the report keeps loads the same again, without looking at the others.
    let text = serde_json::to_string(loader.options()).unwrap();
    let again = Loader::open(&capture, &serde_json::from_str(&text).unwrap()).unwrap();
    assert!(!again.undecided());
    assert_eq!(again.load(&capture.views[0]).unwrap().0, first);
}

#[test]
fn photos_that_fill_their_range_stay() {
    let (_dir, sixteen) = capture(|i, path| {
        ImageBuffer::<Luma<u16>, _>::from_fn(SIZE.0, SIZE.1, |x, y| {
            Luma([(1000 + 400 * (48 * i as u32 + 8 * y + x)) as u16])
        })
        .save(path)
        .unwrap();
    });
    let mut loader = Loader::open(&sixteen, &LoadOptions::default()).unwrap();
    let samples = sixteen
        .views
        .iter()
        .map(|view| loader.sample(view).unwrap());
    let samples: Vec<f32> = samples.flatten().collect();
    loader.decide(samples);
    assert_eq!(loader.options().normalize, Normalize::Off);
    // Nothing to stretch, nothing at all.
    for values in [vec![], vec![7.0], vec![300.0; 50]] {
        let mut loader = Loader::open(&sixteen, &LoadOptions::default()).unwrap();
        loader.decide(values);
        assert_eq!(loader.options().normalize, Normalize::Off);
    }

    let (_dir, eight) = capture(|_, _| {});
    let loader = Loader::open(&eight, &LoadOptions::default()).unwrap();
    assert!(!loader.undecided());
    assert_eq!(loader.options().normalize, Normalize::Off);
}

#[test]
fn floats_beyond_their_range_are_normalized() {
    let (_dir, capture) = capture(|i, path| {
        let values: [f32; COUNT] = std::array::from_fn(|k| (48 * i + k) as f32 / 50.0);
        fs::write(path, gray_tiff(&values)).unwrap();
    });
    let mut loader = Loader::open(&capture, &LoadOptions::default()).unwrap();
    let samples = capture
        .views
        .iter()
        .map(|view| loader.sample(view).unwrap());
    let samples: Vec<f32> = samples.flatten().collect();
    loader.decide(samples);
    let [low, high] = [1.0_f32 / 50.0, 142.0 / 50.0].map(f64::from);
    assert_eq!(loader.options().normalize, Normalize::Range([low, high]));
    let (photo, _) = loader.load(&capture.views[1]).unwrap();
    let share = (f64::from(48.0_f32 / 50.0) - low) / (high - low);
    assert_eq!(photo.gray[0], level(linear_to_srgb(share)));
}

#[test]
fn large_photos_are_sampled_on_a_grid() {
    let dir = tempdir().unwrap();
    let path = dir.path().join("large.png");
    ImageBuffer::<Luma<u16>, _>::from_fn(320, 240, |x, y| Luma([(320 * (y % 4) + x) as u16]))
        .save(&path)
        .unwrap();
    let samples = Loader::new(LoadOptions::default())
        .sample(&view(path))
        .unwrap();
    // Every 5th along both axes, from the third on.
    assert_eq!(samples.len(), 64 * 48);
    assert_eq!(samples[..2], [642.0, 647.0]);
    assert_eq!(samples[64], (320 * 3 + 2) as f32);
}

#[test]
fn one_range_cannot_serve_two_kinds() {
    let (_dir, capture) = capture(|i, path| {
        if i == 1 {
            ImageBuffer::<Luma<u16>, _>::new(SIZE.0, SIZE.1)
                .save(path)
                .unwrap();
        }
    });
    let error = Loader::open(&capture, &LoadOptions::default())
        .unwrap_err()
        .to_string();
    for words in ["b.png", "16 bits", "a.png", "8 bits", "convert one"] {
        assert!(error.contains(words), "{error}");
    }
    let options = LoadOptions {
        normalize: Normalize::Off,
        ..LoadOptions::default()
    };
    assert!(Loader::open(&capture, &options).is_ok());
}

#[test]
fn cut_tiffs_are_errors() {
    let file = gray_tiff(&ramp());
    for end in 0..file.len() {
        assert!(
            load_with(&file[..end], LoadOptions::default()).is_err(),
            "cut at {end}"
        );
    }
    // One byte at a time wrong: an error or a picture, never a panic.
    for at in 0..file.len() {
        for wrong in [0x00, 0x7f, 0xff] {
            let mut file = file.clone();
            file[at] = wrong;
            let _ = load_with(&file, LoadOptions::default());
        }
    }
}

#[test]
fn tiffs_of_absurd_sizes_are_refused() {
    let dir = tempdir().unwrap();
    let path = dir.path().join("photo.tif");
    let mut file = gray_tiff(&ramp());
    // Width, height and rows of a strip: type LONG, one value.
    for (tag, side) in [(256_u16, 60_000_u32), (257, 45_000), (278, 45_000)] {
        let [low, high] = tag.to_le_bytes();
        let entry = [low, high, 4, 0, 1, 0, 0, 0];
        let at = file.windows(8).position(|window| window == entry).unwrap();
        file[at + 8..at + 12].copy_from_slice(&side.to_le_bytes());
    }
    fs::write(&path, file).unwrap();
    let error = Loader::new(LoadOptions::default())
        .load(&view(path))
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("photo.tif") && error.contains("announces 60000×45000"),
        "{error}"
    );
}

#[test]
fn other_kinds_of_tiffs_name_the_remedy() {
    let mut file = Cursor::new(Vec::new());
    TiffEncoder::new(&mut file)
        .unwrap()
        .write_image::<colortype::Gray32>(SIZE.0, SIZE.1, &[0; COUNT])
        .unwrap();
    let error = load_with(&file.into_inner(), LoadOptions::default())
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("photo.tif") && error.contains("convert it to 8 or 16 bits"),
        "{error}"
    );
}

#[test]
fn headers_give_the_same_camera() {
    let (_dir, capture) = capture(|_, path| {
        image::GrayImage::new(40, 30).save(path).unwrap();
    });
    let loader = Loader::new(LoadOptions {
        max_side: Some(17),
        ..LoadOptions::default()
    });
    for view in &capture.views {
        assert_eq!(loader.camera(view).unwrap(), loader.load(view).unwrap().1);
    }
}
