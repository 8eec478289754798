//! Files that hold a smaller picture than the one that was taken.

use std::io::Cursor;
use std::path::Path;

use ::tiff::encoder::{TiffEncoder, colortype};
use ::tiff::tags::Tag;

use super::fixtures::{Model, folder, write};
use super::{Capture, Headers, LoadOptions, Loader, Shrunk};

/// Sides, gray level, tags with values.
type Picture<'a> = ([u32; 2], u8, &'a [(u16, u32)]);

/// A TIFF of these pictures.
fn tiff(pictures: &[Picture<'_>]) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut file).unwrap();
    for &([width, height], gray, tags) in pictures {
        let mut picture = encoder
            .new_image::<colortype::Gray8>(width, height)
            .unwrap();
        for &(tag, value) in tags {
            let tag = Tag::from_u16_exhaustive(tag);
            picture.encoder().write_tag(tag, value).unwrap();
        }
        let pixels = vec![gray; (width * height) as usize];
        picture.write_data(&pixels).unwrap();
    }
    file.into_inner()
}

/// The gray of the first photo, or what is wrong with it, where all photos are this file.
fn load(file: &[u8]) -> Result<(u32, u8), String> {
    let model = Model::example();
    let dir = folder(&model);
    write(dir.path(), "sparse/0", model.binary(), "bin");
    let capture = Capture::load(dir.path()).unwrap();
    std::fs::write(&capture.views[0].image_path, file).unwrap();
    let loader = Loader::new(LoadOptions::default());
    let photo = loader.load(&capture.views[0]).map_err(|e| e.to_string());
    photo.map(|(photo, _)| (photo.width, photo.gray[0]))
}

const REDUCED: &[(u16, u32)] = &[(254, 1)];
const DNG: &[(u16, u32)] = &[(254, 1), (50_706, 0x0401)];

#[test]
fn thumbnails_are_passed_over() {
    let (small, full) = ([4, 3], [8, 6]);
    assert_eq!(load(&tiff(&[(full, 7, &[])])), Ok((8, 7)));
    let first = [(small, 200, REDUCED), (full, 7, &[])];
    assert_eq!(load(&tiff(&first)), Ok((8, 7)));
    // Other kinds of pictures, such as a page of several, are none.
    assert_eq!(load(&tiff(&[(full, 9, &[(254, 2)])])), Ok((8, 9)));
    let error = load(&tiff(&[(small, 200, REDUCED)])).unwrap_err();
    assert!(
        error.contains("a.png") && error.contains("thumbnails"),
        "{error}"
    );
}

#[test]
fn raw_files_name_the_remedy() {
    let file = tiff(&[([4, 3], 200, DNG), ([8, 6], 7, &[])]);
    let error = load(&file).unwrap_err();
    assert!(
        error.contains("a.png") && error.contains("develop it to TIFF or PNG"),
        "{error}"
    );
}

#[test]
fn photos_much_smaller_than_their_cameras_are_told() {
    let model = Model::example();
    let dir = folder(&model);
    write(dir.path(), "sparse/0", model.binary(), "bin");
    let capture = Capture::load(dir.path()).unwrap();
    let shrunk = || Headers::read(&capture.views).unwrap().shrunk;
    let save = |path: &Path, [width, height]: [u32; 2]| {
        let photo = image::GrayImage::new(width, height);
        photo.save(path).unwrap();
    };
    assert_eq!(shrunk(), None);
    save(&capture.views[1].image_path, [4, 3]);
    assert_eq!(shrunk(), None);
    save(&capture.views[1].image_path, [3, 2]);
    let expected = Shrunk {
        count: 1,
        name: "b.png".into(),
        photo: [3, 2],
        camera: [8, 6],
    };
    assert_eq!(shrunk(), Some(expected));
}

#[test]
fn files_that_may_be_larger_than_four_gibibytes_are_read() {
    let mut file = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new_big(&mut file).unwrap();
    let pixels = [77; 48];
    encoder
        .write_image::<colortype::Gray8>(8, 6, &pixels)
        .unwrap();
    assert_eq!(load(&file.into_inner()), Ok((8, 77)));
}
