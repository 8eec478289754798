//! Stage 2 on another radiance field: a voxel grid, trained on gray photos and colored by the same
//! teachers as Gaussians are.
//!
//! `cargo run --release --example plenoxels -- SCENE TEACHER OUT.png [voxels|gaussians] [SIDE]`
//!
//! `SCENE` is a COLMAP folder with `images/`, `TEACHER` a network or a folder of colored photos.
//! `OUT.png` gets, of each held-out view, photo, gray field, teacher and colored field.

#![allow(
    clippy::unnecessary_cast,
    clippy::useless_conversion,
    reason = "a grid's numbers are f64 where its gradient is tested"
)]

#[cfg(test)]
mod gradient_tests;
mod grid;
mod measure;
mod train;

use std::{env, error::Error, fs::File, ops::ControlFlow, path::Path, sync::Arc, time::Instant};

use gs_chroma::{
    capture::{Camera, Dataset, LoadOptions},
    chroma::{
        ChromaSettings, ColorizeEvent, Degree, Distill, FrozenField, FrozenViews, HostField,
        MemoryBudget, NoChromaCheckpoints, Primitives, Supervision, teach,
        teacher::{Teacher, TeacherSettings},
    },
    gpu::Gpu,
    luma::{self, LumaEvent, LumaSettings},
    raster::ColorKind,
    splats::ShField,
};

use grid::{DEGREE, Grid, HARMONICS, VALUES};
use measure::{Row, measure};

/// Weights that a pixel hardly shows.
const FAINT: f32 = 2e-4;

/// Iterations of the Gaussians, as `fit --preset draft` has them.
const ITERATIONS: usize = 2000;

type Failure = Box<dyn Error>;

/// A grid before cameras, as stage 2 takes it: its primitives are the vertices that may show.
fn frozen(
    gpu: &Gpu,
    grid: &Grid,
    cameras: &[Camera],
    room: MemoryBudget,
) -> Result<impl FrozenField + use<>, Failure> {
    let vertices: Vec<usize> = (0..grid.live.len()).filter(|&i| grid.live[i]).collect();
    let mut primitive = vec![0; grid.live.len()];
    (0..)
        .zip(&vertices)
        .for_each(|(k, &vertex)| primitive[vertex] = k);
    let places = vertices.iter().map(|&i| grid.place(i).as_vec3().into());
    let primitives = Primitives {
        centers: places.collect(),
        luma: vertices
            .iter()
            .map(|&i| grid.values[i * VALUES + 1] as f32)
            .collect(),
        log_sizes: vec![grid.cell.ln() as f32; vertices.len()],
    };
    // What each pixel shows is kept: `[views][height, width]`.
    let mut samples = Vec::new();
    let mut shown = |camera: &Camera, pixel: u32| {
        let ray = grid.ray(camera, [pixel % camera.width, pixel / camera.width]);
        let weights = grid.weights(&ray, &mut samples).into_iter();
        let weights = weights.map(|(vertex, weight)| (primitive[vertex], weight as f32));
        weights
            .filter(|&(_, weight)| weight > FAINT)
            .collect::<Vec<(u32, f32)>>()
    };
    let pixels = |camera: &Camera| 0..camera.width * camera.height;
    let rows = cameras
        .iter()
        .map(|camera| pixels(camera).map(|i| shown(camera, i)).collect());
    let rows: Vec<Vec<Vec<(u32, f32)>>> = rows.collect();
    let widths: Vec<u32> = cameras.iter().map(|camera| camera.width).collect();
    let weights = move |view: usize, [x, y]: [u32; 2], list: &mut Vec<(u32, f32)>| {
        list.extend_from_slice(&rows[view][(y * widths[view] + x) as usize]);
    };
    Ok(HostField::new(gpu, primitives, cameras, room, weights)?)
}

/// Luma harmonics of the vertices that may show.
fn luma_of(grid: &Grid) -> ShField {
    let values = grid.values.chunks_exact(VALUES).zip(&grid.live);
    let live = values.filter(|(_, live)| **live);
    ShField {
        degree: DEGREE,
        channels: 1,
        coefficients: live
            .flat_map(|(values, _)| &values[1..=HARMONICS])
            .map(|&value| value as f32)
            .collect(),
    }
}

/// Colors a field before the views that colors are learned from, and measures it before all.
/// `freeze` makes it ready to be drawn before cameras.
fn color<F: FrozenField>(
    (dataset, supervision): (&Dataset, &Supervision),
    luma: &ShField,
    mut freeze: impl FnMut(&[Camera], MemoryBudget) -> Result<F, Failure>,
) -> Result<(f64, Vec<Row>), Failure> {
    let quiet = &mut |_: ColorizeEvent<'_>| ControlFlow::Continue(());
    let begun = Instant::now();
    let settings = ChromaSettings::irls();
    let distill = Distill {
        dataset,
        supervision,
        sh_degree: Degree::Fixed(settings.sh_degree),
        correct_views: None,
    };
    let learned = supervision.views.iter();
    let learned: Vec<Camera> = learned.map(|&i| dataset.cameras[i].clone()).collect();
    let field = freeze(&learned, distill.memory(&settings))?;
    println!("{} primitives", field.primitives().count());
    let found = distill.run(&field, None, &mut NoChromaCheckpoints, &settings, quiet)?;
    drop(field);
    let seconds = begun.elapsed().as_secs_f64();
    let room = MemoryBudget::of(ColorKind::Chroma, settings.sh_degree);
    let all = freeze(&dataset.cameras, room)?;
    let measured = measure(&all, [luma, &found.chroma], dataset, supervision)?;
    Ok((seconds, measured))
}

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [scene, teacher, out, rest @ ..] = &arguments[..] else {
        return Err("usage: plenoxels SCENE TEACHER OUT.png [voxels|gaussians] [SIDE]".into());
    };
    let options = LoadOptions {
        max_side: Some(rest.get(1).map_or(Ok(160), |side| side.parse())?),
        ..LoadOptions::default()
    };
    let dataset = Arc::new(Dataset::open(Path::new(scene), &options, &mut |_| {})?);
    let gpu = Gpu::open()?;
    let mut teacher = Teacher::open(Path::new(teacher), None, &TeacherSettings::default())?;
    let quiet = &mut |_| ControlFlow::Continue(());
    let supervision = teach(&dataset, &mut teacher, 1, quiet)?;
    let (begun, taught) = (Instant::now(), (&*dataset, &supervision));
    let (trained, (colored, rows)) = match rest.first().map(String::as_str) {
        Some("gaussians") => {
            let settings = LumaSettings::new(ITERATIONS);
            let quiet = &mut |_: LumaEvent<'_>| ControlFlow::Continue(());
            let scene = luma::fit(&gpu, &dataset, &settings, quiet)?;
            let (raster, splats) = (scene.raster(&gpu), &scene.splats);
            let freeze = |cameras: &[Camera], room| {
                let frozen = FrozenViews::new(&raster, splats, dataset.extent, cameras, 1, room);
                frozen.map_err(Failure::from)
            };
            let trained = begun.elapsed().as_secs_f64();
            (trained, color(taught, &splats.sh, freeze)?)
        }
        _ => {
            let grid = train::train(&dataset, |scale, error, live| {
                let psnr = -10.0 * error.log10();
                println!("scale {scale}: {psnr:.2} dB on training photos, {live} vertices");
            })?;
            let freeze = |cameras: &[Camera], room| frozen(&gpu, &grid, cameras, room);
            let trained = begun.elapsed().as_secs_f64();
            (trained, color(taught, &luma_of(&grid), freeze)?)
        }
    };
    println!("seconds: gray {trained:.0}, color {colored:.0}");
    write_sheet(Path::new(out), &rows)
}

/// A row of pictures for each held-out view.
fn write_sheet(path: &Path, rows: &[Row]) -> Result<(), Failure> {
    let width = rows.iter().map(|(size, _)| 4 * size[0]).max().unwrap_or(0);
    let mut bytes = Vec::new();
    for (size, pictures) in rows {
        for y in 0..size[1] {
            let mut line = Vec::new();
            for picture in pictures {
                let of_line = &picture[(y * size[0]) as usize..][..size[0] as usize];
                let values = of_line.as_flattened().iter();
                line.extend(values.map(|value| (255.0 * value.clamp(0.0, 1.0)).round() as u8));
            }
            line.resize(3 * width as usize, 255);
            bytes.extend(line);
        }
    }
    let height = bytes.len() as u32 / (3 * width).max(1);
    let mut encoder = png::Encoder::new(File::create(path)?, width, height);
    encoder.set_color(png::ColorType::Rgb);
    Ok(encoder.write_header()?.write_image_data(&bytes)?)
}
