//! Photos that lie on their side, and say so in their EXIF.

use std::{io::Cursor, path::Path};

use image::{
    DynamicImage, ImageDecoder, ImageEncoder,
    codecs::png::{PngDecoder, PngEncoder},
    metadata::Orientation,
};

use super::program::Place;
use super::scene;
use super::shared::{QUICK_FIT, onnx};

/// Orientations of the photos in turn: turned both ways, upside down and mirrored.
const TAGS: [u8; 4] = [6, 8, 3, 5];

fn orientation(view: usize) -> Orientation {
    Orientation::from_exif(TAGS[view % TAGS.len()]).expect("1 to 8")
}

/// EXIF with a maker and an orientation.
fn exif(tag: u8) -> Vec<u8> {
    let mut exif = b"II*\0\x08\0\0\0\x02\0".to_vec();
    exif.extend(b"\x0f\x01\x02\0\x04\0\0\0Zei\0");
    exif.extend([0x12, 1, 3, 0, 1, 0, 0, 0, tag, 0, 0, 0]);
    exif.extend([0; 4]);
    exif
}

fn save(path: &Path, image: &DynamicImage, tag: Option<u8>) {
    let mut bytes = Vec::new();
    let mut encoder = PngEncoder::new(&mut bytes);
    if let Some(tag) = tag {
        encoder.set_exif_metadata(exif(tag)).expect("kept");
    }
    image.write_with_encoder(encoder).expect("an image");
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
    std::fs::write(path, bytes).expect("writable");
}

fn open(path: &Path) -> (DynamicImage, Vec<u8>) {
    let bytes = std::fs::read(path).expect("a file");
    let mut decoder = PngDecoder::new(Cursor::new(bytes)).expect("PNG");
    let exif = decoder.exif_metadata().expect("readable");
    let image = DynamicImage::from_decoder(decoder).expect("pixels");
    (image, exif.unwrap_or_default())
}

fn turned(image: &DynamicImage, by: Orientation) -> DynamicImage {
    let mut image = image.clone();
    image.apply_orientation(by);
    image
}

fn back(by: Orientation) -> Orientation {
    match by {
        Orientation::Rotate90 => Orientation::Rotate270,
        Orientation::Rotate270 => Orientation::Rotate90,
        other => other,
    }
}

/// Trains on a scene, colors it by a folder of pictures, and its photos.
fn color(place: &Place, scene: &str, pictures: &str) {
    let mut fit = QUICK_FIT;
    fit[1] = scene;
    place.succeed(&fit);
    let run = format!("runs/{scene}");
    let colorize = ["colorize", &run, "--teacher", pictures, "--rounds", "1"];
    place.succeed(&colorize);
    place.succeed(&["frames", &run, "-o", &format!("{scene}-colored")]);
}

#[test]
fn photos_are_trained_on_as_colmap_saw_them_and_shown_upright() {
    let place = Place::new();
    for folder in ["plain", "lying", "stood"] {
        scene::write(&place.path(folder));
    }
    for view in 0..scene::VIEWS {
        let seen = DynamicImage::from(scene::photo(view));
        let (by, name) = (orientation(view), scene::name(view));
        let tag = TAGS[view % TAGS.len()];
        // COLMAP saw the pixels of both; of the second it saw them turned, which its camera's
        // sides tell where these are not swapped.
        save(
            &place.path(&format!("lying/images/{name}")),
            &seen,
            Some(tag),
        );
        let swaps = tag >= 5;
        let file = if swaps {
            turned(&seen, back(by))
        } else {
            seen.clone()
        };
        save(
            &place.path(&format!("stood/images/{name}")),
            &file,
            swaps.then_some(tag),
        );
        // What viewers show, painted over by a program that writes no EXIF.
        save(
            &place.path(&format!("upright/{name}")),
            &turned(&seen, by),
            None,
        );
        save(&place.path(&format!("plain/images/{name}")), &seen, None);
    }
    color(&place, "plain", "photos");
    color(&place, "lying", "upright");
    color(&place, "stood", "photos");
    for scene in ["lying", "stood"] {
        for file in ["luma.ply", "color.ply"] {
            let [ours, plain] =
                [scene, "plain"].map(|run| place.read(&format!("runs/{run}/{file}")));
            assert!(ours == plain, "{scene}/{file}");
        }
    }
    for view in 0..scene::VIEWS {
        let name = scene::name(view);
        let colored = |scene: &str| open(&place.path(&format!("{scene}-colored/{name}")));
        let ((plain, none), (lying, told), (stood, _)) =
            (colored("plain"), colored("lying"), colored("stood"));
        assert_eq!(lying, turned(&plain, orientation(view)), "{name}");
        assert_eq!(stood, plain, "{name}");
        assert_eq!((told, none), (exif(1), Vec::new()));
    }
    // A network is asked about upright photos, which are others.
    let teacher = onnx("ddcolor_tiny.onnx");
    let [plain, lying] = ["plain", "lying"].map(|scene| {
        let run = format!("runs/{scene}");
        place.succeed(&["colorize", &run, "--rounds", "1", "--teacher", &teacher]);
        place.files(&format!("{run}/teacher"))
    });
    assert_eq!(plain.len(), scene::VIEWS);
    assert!(lying.iter().all(|answer| !plain.contains(answer)));
}
