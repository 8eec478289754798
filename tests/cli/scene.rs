//! A small COLMAP folder: colored discs seen from an arc.

use std::fs;
use std::path::Path;

use image::{Rgb, RgbImage};

use super::oracle::{numerics::Numerics, view::View};

/// Width and height of every photo.
pub const SIZE: [u32; 2] = [64, 48];

/// Views; in the order of their names every 8th is held out.
pub const VIEWS: usize = 10;

/// Views that are held out by default: 0 and 8.
pub const HELD_OUT: usize = 2;

/// Points along each axis of their grid.
const GRID: usize = 4;

/// Points in all.
pub const POINTS: usize = GRID * GRID * GRID;

const FOCAL: f64 = 60.0;
const DISTANCE: f64 = 4.0;

/// The name of a view; the last ones lie in a subfolder.
pub fn name(view: usize) -> String {
    if view < 8 {
        format!("{view:02}.png")
    } else {
        format!("left/{view:02}.png")
    }
}

/// World-to-camera rotation about y, by this angle.
fn angle(view: usize) -> f64 {
    0.1 * (view as f64 - 4.5)
}

/// A view as the oracle takes it; the world is moved by `offset`.
pub fn view(view: usize, offset: [f64; 3]) -> View {
    let (sin, cos) = angle(view).sin_cos();
    let rotation = [[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]];
    let center: [f64; 3] = std::array::from_fn(|k| offset[k] - DISTANCE * rotation[2][k]);
    let translation = std::array::from_fn(|row| {
        -(0..3)
            .map(|column| rotation[row][column] * center[column])
            .sum::<f64>()
    });
    View {
        rotation,
        translation,
        fx: FOCAL,
        fy: FOCAL,
        cx: f64::from(SIZE[0]) / 2.0,
        cy: f64::from(SIZE[1]) / 2.0,
        width: SIZE[0] as usize,
        height: SIZE[1] as usize,
        // The program's: a hundredth of the extent, which no disc comes near.
        near: 0.02,
        antialiased: false,
        numerics: Numerics::DEFAULT,
    }
}

/// Position and color of each point, the world moved by `offset`.
fn points(offset: [f64; 3]) -> Vec<([f64; 3], [u8; 3])> {
    (0..POINTS)
        .map(|i| {
            let cell = [i % GRID, i / GRID % GRID, i / GRID / GRID];
            let position = std::array::from_fn(|k| offset[k] + 0.5 * cell[k] as f64 - 0.75);
            let color = cell.map(|c| (40 + 60 * c) as u8);
            (position, color)
        })
        .collect()
}

/// A photo of the discs on gray ground, the nearer over the farther.
pub fn photo(index: usize) -> RgbImage {
    let view = view(index, [0.0; 3]);
    let mut seen: Vec<_> = points([0.0; 3])
        .into_iter()
        .map(|(position, color)| {
            let camera: [f64; 3] = std::array::from_fn(|row| {
                view.translation[row]
                    + (0..3)
                        .map(|k| view.rotation[row][k] * position[k])
                        .sum::<f64>()
            });
            (camera, color)
        })
        .collect();
    seen.sort_by(|a, b| a.0[2].total_cmp(&b.0[2]));
    RgbImage::from_fn(SIZE[0], SIZE[1], |x, y| {
        let hit = seen.iter().find(|([px, py, pz], _)| {
            let dx = px / pz * FOCAL + view.cx - f64::from(x) - 0.5;
            let dy = py / pz * FOCAL + view.cy - f64::from(y) - 0.5;
            dx.hypot(dy) < 0.12 * FOCAL / pz
        });
        Rgb(hit.map_or([60 + (y * 2) as u8; 3], |(_, color)| *color))
    })
}

/// Writes the folder with a binary model in `sparse/0`.
pub fn write(folder: &Path) {
    write_photos(folder);
    let model = folder.join("sparse/0");
    fs::create_dir_all(&model).expect("writable");
    for (name, bytes) in ["cameras", "images", "points3D"].iter().zip(binary()) {
        fs::write(model.join(name).with_extension("bin"), bytes).expect("writable");
    }
}

/// Writes the folder with a text model in `sparse`, the world moved by `offset`.
pub fn write_moved(folder: &Path, offset: [f64; 3]) {
    write_photos(folder);
    write_moved_model(folder, offset);
}

/// The model of [`write_moved`] without its photos.
pub fn write_moved_model(folder: &Path, offset: [f64; 3]) {
    let model = folder.join("sparse");
    fs::create_dir_all(&model).expect("writable");
    let [width, height] = SIZE;
    let (cx, cy) = (width / 2, height / 2);
    let cameras = format!("1 SIMPLE_PINHOLE {width} {height} {FOCAL} {cx} {cy}\n");
    let images: String = (0..VIEWS)
        .map(|index| {
            let (sin, cos) = (angle(index) / 2.0).sin_cos();
            let [x, y, z] = view(index, offset).translation;
            let name = name(index);
            format!("{} {cos} 0 {sin} 0 {x} {y} {z} 1 {name}\n\n", index + 1)
        })
        .collect();
    let points: String = points(offset)
        .into_iter()
        .enumerate()
        .map(|(i, ([x, y, z], [r, g, b]))| format!("{i} {x} {y} {z} {r} {g} {b} 0.5\n"))
        .collect();
    for (name, text) in [
        ("cameras", cameras),
        ("images", images),
        ("points3D", points),
    ] {
        fs::write(model.join(name).with_extension("txt"), text).expect("writable");
    }
}

/// Puts a text model with tracks in the place of what is in `sparse`: of each disc that more
/// than two views show where `at` says, in pixels.
pub fn write_tracks(folder: &Path, at: impl Fn([f64; 2]) -> bool) {
    fs::remove_dir_all(folder.join("sparse")).expect("a model");
    write_moved_model(folder, [0.0; 3]);
    let mut of_images = vec![String::new(); VIEWS];
    let mut counts = [0; VIEWS];
    let mut lines = String::new();
    for (i, (position, [r, g, b])) in points([0.0; 3]).into_iter().enumerate() {
        let seen: Vec<_> = (0..VIEWS)
            .filter_map(|index| Some((index, pixel(index, position).filter(|&p| at(p))?)))
            .collect();
        if seen.len() < 3 {
            continue;
        }
        let [x, y, z] = position;
        lines += &format!("{i} {x} {y} {z} {r} {g} {b} 0.5");
        for (index, [x, y]) in seen {
            of_images[index] += &format!("{x} {y} {i} ");
            lines += &format!(" {} {}", index + 1, counts[index]);
            counts[index] += 1;
        }
        lines.push('\n');
    }
    let images = folder.join("sparse/images.txt");
    let poses = fs::read_to_string(&images).expect("a model");
    let poses = poses.lines().filter(|line| !line.is_empty());
    let text: String = (poses.zip(of_images))
        .map(|(pose, seen)| format!("{pose}\n{seen}\n"))
        .collect();
    fs::write(images, text).expect("writable");
    fs::write(folder.join("sparse/points3D.txt"), lines).expect("writable");
}

/// Pixel of a point in a view, if it is visible there.
fn pixel(index: usize, position: [f64; 3]) -> Option<[f64; 2]> {
    let view = view(index, [0.0; 3]);
    let [x, y, z]: [f64; 3] = std::array::from_fn(|row| {
        let turned = (0..3).map(|k| view.rotation[row][k] * position[k]);
        view.translation[row] + turned.sum::<f64>()
    });
    let at = [x / z * FOCAL + view.cx, y / z * FOCAL + view.cy];
    let inside = (at.iter().zip(SIZE)).all(|(&at, side)| at >= 0.0 && at < f64::from(side));
    (z > 0.0 && inside).then_some(at)
}

fn write_photos(folder: &Path) {
    fs::create_dir_all(folder.join("images/left")).expect("writable");
    for index in 0..VIEWS {
        let path = folder.join("images").join(name(index));
        photo(index).save(path).expect("writable");
    }
}

/// The three `.bin` files: cameras, images, points3D.
fn binary() -> [Vec<u8>; 3] {
    let count = |count: usize| (count as u64).to_le_bytes().to_vec();
    let mut cameras = count(1);
    cameras.extend(1_u32.to_le_bytes());
    // PINHOLE
    cameras.extend(1_i32.to_le_bytes());
    cameras.extend(SIZE.iter().flat_map(|&side| u64::from(side).to_le_bytes()));
    let center = SIZE.map(|side| f64::from(side) / 2.0);
    for value in [FOCAL, FOCAL, center[0], center[1]] {
        cameras.extend(value.to_le_bytes());
    }
    let mut images = count(VIEWS);
    for index in 0..VIEWS {
        images.extend((index as u32 + 1).to_le_bytes());
        let (sin, cos) = (angle(index) / 2.0).sin_cos();
        let translation = view(index, [0.0; 3]).translation;
        for value in [cos, 0.0, sin, 0.0].into_iter().chain(translation) {
            images.extend(value.to_le_bytes());
        }
        images.extend(1_u32.to_le_bytes());
        images.extend(name(index).bytes());
        images.push(0);
        images.extend(0_u64.to_le_bytes());
    }
    let mut points3d = count(POINTS);
    for (i, (position, color)) in points([0.0; 3]).into_iter().enumerate() {
        points3d.extend((i as u64).to_le_bytes());
        points3d.extend(position.iter().flat_map(|p| p.to_le_bytes()));
        points3d.extend(color);
        points3d.extend(0.5_f64.to_le_bytes());
        points3d.extend(0_u64.to_le_bytes());
    }
    [cameras, images, points3d]
}
