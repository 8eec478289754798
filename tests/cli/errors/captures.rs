//! Errors of photos and poses.

use super::{Case, FIT, Place, case, nothing};
use crate::scene::SIZE;

const CAMERAS: &str = "scene/sparse/0/cameras.bin";
const IMAGES: &str = "scene/sparse/0/images.bin";
const POINTS: &str = "scene/sparse/0/points3D.bin";
const PHOTO: &str = "scene/images/03.png";

/// Keeps so many bytes of a file.
fn cut(place: &Place, name: &str, length: usize) {
    place.write(name, &place.read(name)[..length]);
}

/// Overwrites bytes of a file.
fn patch(place: &Place, name: &str, at: usize, bytes: &[u8]) {
    let mut file = place.read(name);
    file[at..at + bytes.len()].copy_from_slice(bytes);
    place.write(name, file);
}

/// Writes a count that the file does not hold.
fn lie(place: &Place, name: &str) {
    patch(place, name, 0, &(u64::MAX / 2).to_le_bytes());
}

fn remove(place: &Place, name: &str) {
    std::fs::remove_file(place.path(name)).expect("a file");
}

/// A baseline JPEG of four components, all of whose coefficients are zero.
fn cmyk_jpeg() -> Vec<u8> {
    fn segment(file: &mut Vec<u8>, marker: u8, payload: &[u8]) {
        let length = (payload.len() as u16 + 2).to_be_bytes();
        file.extend([0xff, marker, length[0], length[1]]);
        file.extend(payload);
    }
    let [width, height] = SIZE.map(|side| (side as u16).to_be_bytes());
    let mut file = vec![0xff, 0xd8];
    segment(&mut file, 0xdb, &[&[0][..], &[1; 64]].concat());
    let frame = [8, height[0], height[1], width[0], width[1], 4];
    let components: Vec<u8> = (1..=4).flat_map(|id| [id, 0x11, 0]).collect();
    segment(&mut file, 0xc0, &[&frame[..], &components].concat());
    // One code of one bit, 0: no difference, end of block.
    for table in [0x00, 0x10] {
        let lengths = [1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        segment(&mut file, 0xc4, &[&[table][..], &lengths, &[0]].concat());
    }
    let scan: Vec<u8> = (1..=4).flat_map(|id| [id, 0x00]).collect();
    segment(&mut file, 0xda, &[&[4][..], &scan, &[0, 63, 0]].concat());
    // Two bits a block, four blocks of 8 × 8 pixels a byte.
    file.extend(vec![0; (SIZE[0] * SIZE[1] / 64) as usize]);
    file.extend([0xff, 0xd9]);
    file
}

fn save_16_bits(place: &Place) {
    let image = image::ImageBuffer::<image::Luma<u16>, Vec<u16>>::new(SIZE[0], SIZE[1]);
    image.save(place.path(PHOTO)).expect("writable");
}

/// A TIFF with the tag of a DNG.
fn save_raw(place: &Place) {
    let mut file = std::io::Cursor::new(Vec::new());
    let mut encoder = tiff::encoder::TiffEncoder::new(&mut file).expect("a file");
    let picture = encoder.new_image::<tiff::encoder::colortype::Gray8>(SIZE[0], SIZE[1]);
    let mut picture = picture.expect("a picture");
    let version = tiff::tags::Tag::Unknown(50_706);
    let tagged = picture.encoder().write_tag(version, &[1_u8, 4, 0, 0][..]);
    tagged.expect("a tag");
    let pixels = vec![0; (SIZE[0] * SIZE[1]) as usize];
    picture.write_data(&pixels).expect("pixels");
    place.write(PHOTO, file.into_inner());
}

fn save_mask(place: &Place, name: &str, [width, height]: [u32; 2], value: u8) {
    let path = place.path(name);
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
    let image = image::GrayImage::from_pixel(width, height, image::Luma([value]));
    image.save(path).expect("writable");
}

fn save_turned(place: &Place) {
    let image = image::GrayImage::new(SIZE[1], SIZE[0]);
    image.save(place.path(PHOTO)).expect("writable");
}

/// A PNG that announces a size of which its data is nothing.
fn announce(place: &Place, side: u32) {
    let mut file = place.read(PHOTO);
    file[16..20].copy_from_slice(&(side * SIZE[0]).to_be_bytes());
    file[20..24].copy_from_slice(&(side * SIZE[1]).to_be_bytes());
    place.write(PHOTO, file);
}

/// Every pose is NaN.
fn no_pose(place: &Place) {
    let record = 8 + 4;
    let bytes = place.read(IMAGES);
    let mut patched = bytes.clone();
    let mut at = record;
    while at < bytes.len() {
        patched[at..at + 8].copy_from_slice(&f64::NAN.to_le_bytes());
        let name = at + 7 * 8 + 4;
        let end = bytes[name..]
            .iter()
            .position(|&byte| byte == 0)
            .expect("a name");
        at = name + end + 1 + 8 + 4;
    }
    place.write(IMAGES, patched);
}

pub(super) const CASES: &[Case] = &[
    case(
        "no such folder",
        nothing,
        "fit nowhere --preset draft -o out",
        &["nowhere", "no such folder", "images/"],
    ),
    case(
        "a file as folder",
        nothing,
        "fit onnx/truncated.onnx --preset draft -o out",
        &["truncated.onnx", "no such folder", "gs-chroma prepare"],
    ),
    case(
        "a film as scene",
        |p| p.write("film.mp4", "a film"),
        "view film.mp4",
        &["film.mp4", "gs-chroma auto"],
    ),
    case(
        "no images/",
        |p| std::fs::rename(p.path("scene/images"), p.path("scene/photos")).expect("a folder"),
        FIT,
        &["scene", "images/", "COLMAP saw there", "gs-chroma prepare"],
    ),
    case(
        "no model",
        |p| std::fs::remove_dir_all(p.path("scene/sparse")).expect("a folder"),
        FIT,
        &["scene", "no COLMAP model", "sparse/0/", "gs-chroma prepare"],
    ),
    case(
        "half a model",
        |p| remove(p, POINTS),
        FIT,
        &["sparse/0", "points3D", "cameras"],
    ),
    case(
        "a missing photo",
        |p| remove(p, PHOTO),
        FIT,
        &["03.png", "no such photo", "1 of 10", "images/"],
    ),
    case(
        "cut cameras",
        |p| cut(p, CAMERAS, 30),
        FIT,
        &["cameras.bin", "cut off", "byte 0", "export"],
    ),
    case(
        "cut images",
        |p| cut(p, IMAGES, 400),
        FIT,
        &["images.bin", "announces 10", "byte 0", "export"],
    ),
    case(
        "cut points",
        |p| cut(p, POINTS, 400),
        FIT,
        &["points3D.bin", "byte", "export"],
    ),
    case(
        "empty cameras",
        |p| cut(p, CAMERAS, 0),
        FIT,
        &["cameras.bin", "byte 0"],
    ),
    case(
        "lying cameras",
        |p| lie(p, CAMERAS),
        FIT,
        &["cameras.bin", "export"],
    ),
    case(
        "lying images",
        |p| lie(p, IMAGES),
        FIT,
        &["images.bin", "export"],
    ),
    case(
        "lying points",
        |p| lie(p, POINTS),
        FIT,
        &["points3D.bin", "export"],
    ),
    case(
        "no images",
        |p| p.write(IMAGES, [0; 8]),
        FIT,
        &["images.bin", "holds no images", "mapper"],
    ),
    case(
        "no points",
        |p| p.write(POINTS, [0; 8]),
        FIT,
        &["points3D.bin", "no usable points", "point_triangulator"],
    ),
    case(
        "no pose",
        no_pose,
        FIT,
        &[
            "images.bin",
            "none of its 10 images",
            "00.png",
            "not finite",
        ],
    ),
    case(
        "an unknown camera model",
        |p| patch(p, CAMERAS, 12, &18_i32.to_le_bytes()),
        FIT,
        &["cameras.bin", "camera 1", "number 18", "image_undistorter"],
    ),
    case(
        "no image",
        |p| p.write(PHOTO, "GIF89a, or rather not"),
        FIT,
        &["03.png", "neither JPEG, PNG nor TIFF", "convert"],
    ),
    case(
        "a cut photo",
        |p| cut(p, PHOTO, 200),
        FIT,
        &["03.png", "cannot be decoded", "save it again"],
    ),
    case("an empty photo", |p| p.write(PHOTO, ""), FIT, &["03.png"]),
    case(
        "CMYK",
        |p| p.write(PHOTO, cmyk_jpeg()),
        FIT,
        &["03.png", "CMYK", "convert it to RGB or gray"],
    ),
    case(
        "16 bits among 8",
        save_16_bits,
        FIT,
        &["03.png", "16 bits", "02.png", "8 bits", "--normalize off"],
    ),
    case(
        "a cut TIFF",
        |p| p.write(PHOTO, b"II*\0\x08\0\0\0\x0c\0\0\x01"),
        FIT,
        &["03.png", "cannot be decoded", "save it again"],
    ),
    case(
        "a camera's raw file",
        save_raw,
        FIT,
        &["03.png", "raw file (DNG)", "develop it to TIFF or PNG"],
    ),
    case(
        "a mask of another shape",
        |p| save_mask(p, "scene/masks/03.png.png", [48, 64], 255),
        FIT,
        &["03.png.png", "48×64", "64×48", "aspect"],
    ),
    case(
        "a mask that leaves nothing",
        |p| save_mask(p, "scene/masks/03.png", SIZE, 0),
        FIT,
        &["images/03.png", "masks/03.png", "leaves no pixel"],
    ),
    case(
        "masks of other names",
        |p| save_mask(p, "scene/masks/mask3.png", SIZE, 255),
        FIT,
        &["scene/masks", "00.png.png", "--masks off"],
    ),
    case(
        "a folder of masks that is not there",
        nothing,
        "fit scene --preset draft --masks nowhere -o out",
        &["nowhere", "no such folder of masks", "--masks"],
    ),
    case(
        "a turned photo",
        save_turned,
        FIT,
        &["03.png", "48×64", "64×48", "COLMAP saw"],
    ),
    case("a lying photo", |p| announce(p, 20_000), FIT, &["03.png"]),
    case(
        "info on a damaged model",
        |p| cut(p, IMAGES, 400),
        "info scene",
        &["images.bin", "byte"],
    ),
    case(
        "colorize on a missing photo",
        |p| remove(p, PHOTO),
        super::COLORIZE,
        &["03.png", "no such photo"],
    ),
    case(
        "render on a missing photo",
        |p| remove(p, PHOTO),
        "render -o out",
        &["03.png", "no such photo"],
    ),
];
