//! Scenes as COLMAP folders with a text model.

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::Path;

use glam::DQuat;
use tiff::encoder::{TiffEncoder, colortype::Gray32Float};

use super::error::Error;
use super::lens::Camera;
use super::scene::{Developed, Scene, View};

/// Writes the folder beside its place and then moves it there, so that it is whole or
/// not there.
pub fn scene(scene: &Scene, out: &Path) -> Result<(), Error> {
    let parent = match out.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    attempt(parent, fs::create_dir_all(parent))?;
    let beside = attempt(parent, tempfile::tempdir_in(parent))?;
    // A temporary folder is its owner's alone; this one is for whoever may read its place.
    let folder = beside.path().join("scene");
    for view in &scene.views {
        photo(view, &folder)?;
    }
    model(scene, &folder.join("sparse/0"))?;
    attempt(out, fs::rename(&folder, out))
}

/// The photo's name in the model.
fn name(view: &View) -> String {
    let extension = match view.developed {
        Some(Developed::Float(_)) => "tif",
        _ => "png",
    };
    format!("{}.{extension}", view.stem)
}

fn photo(view: &View, folder: &Path) -> Result<(), Error> {
    let name = name(view);
    let path = folder.join("images").join(&name);
    create_parent(&path)?;
    match &view.developed {
        None => attempt(&path, view.picture.save(&path))?,
        Some(Developed::Gray(gray)) => attempt(&path, gray.save(&path))?,
        Some(Developed::Gray16(gray)) => attempt(&path, gray.save(&path))?,
        Some(Developed::Float(values)) => {
            let file = BufWriter::new(attempt(&path, File::create(&path))?);
            let mut tiff = attempt(&path, TiffEncoder::new(file))?;
            let (width, height) = view.picture.dimensions();
            attempt(
                &path,
                tiff.write_image::<Gray32Float>(width, height, values),
            )?;
        }
    }
    if let Some(mask) = &view.mask {
        // As COLMAP names them.
        let path = folder.join("masks").join(format!("{name}.png"));
        create_parent(&path)?;
        attempt(&path, mask.save(&path))?;
    }
    Ok(())
}

/// The three text files; format: <https://colmap.github.io/format.html>.
fn model(scene: &Scene, folder: &Path) -> Result<(), Error> {
    let mut cameras: Vec<&Camera> = Vec::new();
    let mut camera_lines = String::new();
    let mut images = String::new();
    // Of each view, its observations as text; of each point, its track.
    let mut observations = vec![Vec::new(); scene.views.len()];
    let mut points = String::new();
    for (index, point) in scene.points.iter().enumerate() {
        let id = index + 1;
        let mut track = String::new();
        for seen in &point.track {
            let of_view: &mut Vec<String> = &mut observations[seen.view];
            track += &format!(" {} {}", seen.view + 1, of_view.len());
            let [x, y] = seen.pixel;
            of_view.push(format!("{x} {y} {id}"));
        }
        let ([x, y, z], [r, g, b]) = (point.position.to_array(), point.color);
        points += &format!("{id} {x} {y} {z} {r} {g} {b} 0{track}\n");
    }
    for (index, (view, observations)) in scene.views.iter().zip(observations).enumerate() {
        let known = cameras.iter().position(|camera| **camera == view.camera);
        let camera = known.unwrap_or_else(|| {
            cameras.push(&view.camera);
            camera_lines += &camera_line(cameras.len(), &view.camera);
            cameras.len() - 1
        });
        let [x, y, z, w] = DQuat::from_mat3(&view.rotation).to_array();
        let [tx, ty, tz] = view.translation.to_array();
        images += &format!(
            "{} {w} {x} {y} {z} {tx} {ty} {tz} {} {}\n{}\n",
            index + 1,
            camera + 1,
            name(view),
            observations.join(" ")
        );
    }
    for (file, text) in [
        ("cameras.txt", camera_lines),
        ("images.txt", images),
        ("points3D.txt", points),
    ] {
        let path = folder.join(file);
        create_parent(&path)?;
        attempt(&path, fs::write(&path, text))?;
    }
    Ok(())
}

fn camera_line(id: usize, camera: &Camera) -> String {
    let [width, height] = camera.size;
    let numbers = camera.focal.iter().chain(&camera.center);
    let numbers = numbers.chain(camera.lens.coefficients());
    let numbers: Vec<String> = numbers.map(f64::to_string).collect();
    let model = camera.lens.name();
    format!("{id} {model} {width} {height} {}\n", numbers.join(" "))
}

fn create_parent(path: &Path) -> Result<(), Error> {
    let parent = path.parent().unwrap_or(path);
    attempt(parent, fs::create_dir_all(parent))
}

fn attempt<T, E: ToString>(path: &Path, result: Result<T, E>) -> Result<T, Error> {
    result.map_err(|error| Error::Write {
        path: path.into(),
        reason: error.to_string(),
    })
}
