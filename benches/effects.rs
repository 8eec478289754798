//! Cost of each effect of image formation, against an iteration without it:
//!
//! ```sh
//! cargo bench --bench effects
//! ```
//!
//! A word after `--` leaves out the rows without it (`cargo bench --bench effects -- lens`).
//! Every effect takes turns with the plain trainer on the same Gaussians and photos; the
//! table has the median over the turns of the ratio of their times, and what is taken on
//! the device beyond the plain one's. What an effect costs now and then, a search for
//! outliers or the reading of photos, stands below.

use std::{error::Error, fs, path::Path, process::ExitCode, sync::Arc, time::Instant};

use glam::{DMat3, DVec3};
use gs_chroma::{
    capture::{Camera, Capture, CaptureError, Choice, Exposure, LoadOptions, Loader},
    gpu::Gpu,
    low_level::oracle::random::Random,
    luma::{LumaError, LumaSettings, LumaTrainer, Schedule, TrainingView},
    raster::{Raster, RasterOptions},
    splats::{ShField, Splats, dome::dome, sh},
};
use image::{GrayImage, Luma};

/// Gaussians, and pixels across a photo.
const SPLATS: usize = 10_000;
const WIDTH: u32 = 640;

/// Photos, iterations of a turn, and turns.
const VIEWS: usize = 4;
const ITERATIONS: usize = 8;
const TURNS: usize = 7;

/// Effects that are switched on.
#[derive(Clone, Copy, Default)]
struct Effects {
    exposed: bool,
    masked: bool,
    antialiased: bool,
    background: bool,
    robust: bool,
    /// Searches for outliers in a turn; they are masked either way.
    searches: usize,
    sh_degree: u32,
}

fn camera(view: usize) -> Camera {
    let height = WIDTH * 3 / 4;
    Camera {
        width: WIDTH,
        height,
        fx: f64::from(WIDTH),
        fy: f64::from(WIDTH),
        cx: f64::from(WIDTH) / 2.0,
        cy: f64::from(height) / 2.0,
        rotation: DMat3::from_rotation_y(0.02 * view as f64),
        translation: DVec3::new(0.1 * view as f64, 0.0, 0.0),
    }
}

fn cloud(sh_degree: u32) -> Splats {
    let mut random = Random::new(1);
    let camera = camera(0);
    let mut place = || {
        let depth = random.range(2.0, 6.0);
        let x = random.range(0.0, f64::from(camera.width)) - camera.cx;
        let y = random.range(0.0, f64::from(camera.height)) - camera.cy;
        [x * depth / camera.fx, y * depth / camera.fy, depth].map(|v| v as f32)
    };
    Splats {
        means: (0..SPLATS).map(|_| place()).collect(),
        quats: vec![[1.0, 0.1, 0.2, 0.3]; SPLATS],
        log_scales: vec![[-4.2, -3.8, -4.0]; SPLATS],
        opacity_logits: vec![0.3; SPLATS],
        sh: ShField::zeros(SPLATS, sh_degree, 1),
    }
}

/// A trainer that has found its room already, and what it takes on the device.
fn trainer(gpu: &Gpu, effects: Effects) -> Result<(LumaTrainer, u64), LumaError> {
    let mut random = Random::new(2);
    let before = gpu.allocated_bytes();
    let views: Vec<TrainingView> = (0..VIEWS)
        .map(|view| {
            let camera = camera(view);
            let pixels = (camera.width * camera.height) as usize;
            let gray = (0..pixels).map(|_| random.bits() as u8).collect();
            let mut view = TrainingView::new(camera, gray);
            if effects.exposed {
                view.exposure = Exposure {
                    gain: 1.1,
                    offset: -0.02,
                };
            }
            if effects.masked {
                view.mask = Some(
                    (0..pixels)
                        .map(|p| if p % 7 == 0 { 0 } else { 255 })
                        .collect(),
                );
            }
            view
        })
        .collect();
    let settings = LumaSettings {
        sh_degree: effects.sh_degree,
        max_splats: 2 * SPLATS,
        antialiased: effects.antialiased,
        background: effects.background,
        robust: effects.robust,
        ..LumaSettings::new(ITERATIONS)
    };
    let never = |search| {
        if search < effects.searches {
            2 + search
        } else {
            usize::MAX
        }
    };
    let raster = Raster::with(
        gpu,
        RasterOptions {
            antialiased: effects.antialiased,
            ..RasterOptions::default()
        },
    );
    let mut splats = cloud(effects.sh_degree);
    if effects.background {
        // As many as `fit` gives it at most: a quarter of all.
        let around = dome(DVec3::ZERO, 100.0, SPLATS / 4, effects.sh_degree, |_| {
            Some(0.5)
        });
        splats.append(around);
    }
    let raster = Arc::new(raster);
    let mut trainer = LumaTrainer::new(raster, settings, 5.0, &splats, views)?;
    trainer.follow(Schedule {
        find_outliers_at: [0, 1].map(never),
        // All harmonics from the start, as in most of a training.
        raise_degree_every: 1,
        ..trainer.schedule().clone()
    });
    trainer.train(&mut |_| {})?;
    let taken = gpu.allocated_bytes().zip(before);
    Ok((
        trainer,
        taken.map_or(0, |(after, before)| after.saturating_sub(before)),
    ))
}

fn seconds(trainer: &mut LumaTrainer) -> Result<f64, LumaError> {
    let begun = Instant::now();
    trainer.train(&mut |_| {})?;
    Ok(begun.elapsed().as_secs_f64())
}

/// Ratios of the times that two pieces of work take, in ascending order.
fn ratios<E>(
    mut plain: impl FnMut() -> Result<f64, E>,
    mut with: impl FnMut() -> Result<f64, E>,
) -> Result<Vec<f64>, E> {
    let mut ratios = Vec::with_capacity(TURNS);
    for turn in 0..TURNS {
        // Who goes first changes, for whoever does may find the caches cold.
        let [of_plain, of_with] = if turn % 2 == 0 {
            let of_plain = plain()?;
            [of_plain, with()?]
        } else {
            let of_with = with()?;
            [plain()?, of_with]
        };
        ratios.push(of_with / of_plain);
    }
    ratios.sort_by(f64::total_cmp);
    Ok(ratios)
}

fn compare(gpu: &Gpu, name: &str, effects: Effects) -> Result<(), LumaError> {
    let (mut plain, plain_bytes) = trainer(gpu, Effects::default())?;
    let (mut with, bytes) = trainer(gpu, effects)?;
    let ratios = ratios(|| seconds(&mut plain), || seconds(&mut with))?;
    println!(
        "| {name} | {:.2} | {:.2} to {:.2} | {:+.2} |",
        ratios[TURNS / 2],
        ratios[1],
        ratios[TURNS - 2],
        (bytes as f64 - plain_bytes as f64) / f64::from(1 << 20),
    );
    Ok(())
}

/// Cost of a search for outliers, in iterations, for each photo.
fn search(gpu: &Gpu) -> Result<f64, LumaError> {
    let robust = |searches| Effects {
        robust: true,
        searches,
        ..Effects::default()
    };
    let [(mut without, _), (mut with, _)] = [trainer(gpu, robust(0))?, trainer(gpu, robust(2))?];
    let ratios = ratios(|| seconds(&mut without), || seconds(&mut with))?;
    Ok((ratios[TURNS / 2] - 1.0) * ITERATIONS as f64 / (2 * VIEWS) as f64)
}

/// Milliseconds that a megapixel takes to read, and to read and undistort.
fn lens() -> Result<[f64; 2], Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    write_photos(folder.path())?;
    let milliseconds = |lens| {
        let options = LoadOptions {
            lens,
            ..LoadOptions::default()
        };
        let capture = Capture::load_with(folder.path(), &options)?;
        let loader = Loader::open(&capture, &options)?;
        let begun = Instant::now();
        for view in &capture.views {
            loader.load(view)?;
        }
        let pixels = f64::from(WIDTH * WIDTH * 3 / 4) * capture.views.len() as f64;
        Ok::<_, CaptureError>(begun.elapsed().as_secs_f64() * 1e9 / pixels)
    };
    let mut found = [Choice::Off, Choice::On].map(|_| Vec::new());
    for _ in 0..TURNS {
        found[0].push(milliseconds(Choice::Off)?);
        found[1].push(milliseconds(Choice::On)?);
    }
    Ok(found.map(|mut of_turns| {
        of_turns.sort_by(f64::total_cmp);
        of_turns[TURNS / 2]
    }))
}

/// A COLMAP folder of gray JPEG photos through a lens that bends lines visibly.
fn write_photos(folder: &Path) -> Result<(), Box<dyn Error>> {
    let height = WIDTH * 3 / 4;
    let mut images = String::new();
    fs::create_dir(folder.join("images"))?;
    for view in 0..2 * VIEWS {
        let mut random = Random::new(view as u64);
        // Not so rough that a photo's decoder would never meet the like.
        let soft = |x, y| Luma([(x / 4 + y / 8) as u8 ^ (random.bits() % 8) as u8]);
        let name = format!("{view}.jpg");
        GrayImage::from_fn(WIDTH, height, soft).save(folder.join("images").join(&name))?;
        images += &format!("{} 1 0 0 0 {view} 0 0 1 {name}\n\n", view + 1);
    }
    let (x, y) = (WIDTH / 2, height / 2);
    let camera = format!("1 SIMPLE_RADIAL {WIDTH} {height} {WIDTH} {x} {y} -0.1\n");
    fs::write(folder.join("cameras.txt"), camera)?;
    fs::write(folder.join("images.txt"), images)?;
    fs::write(folder.join("points3D.txt"), "1 0 0 4 128 128 128 0.5\n")?;
    Ok(())
}

fn run() -> Result<(), Box<dyn Error>> {
    let gpu = Gpu::open()?;
    let height = WIDTH * 3 / 4;
    println!(
        "{SPLATS} Gaussians, {VIEWS} photos of {WIDTH} × {height}, {}\n",
        gpu.describe()
    );
    println!("| effect | time, plain = 1 | second lowest to second highest | memory, MiB more |");
    println!("|---|---|---|---|");
    let plain = Effects::default();
    let degree = |sh_degree| Effects { sh_degree, ..plain };
    let rows = [
        ("none", plain),
        (
            "exposure",
            Effects {
                exposed: true,
                ..plain
            },
        ),
        (
            "masks",
            Effects {
                masked: true,
                ..plain
            },
        ),
        (
            "exposure and masks",
            Effects {
                exposed: true,
                masked: true,
                ..plain
            },
        ),
        (
            "antialias",
            Effects {
                antialiased: true,
                ..plain
            },
        ),
        (
            "robust, between searches",
            Effects {
                robust: true,
                ..plain
            },
        ),
        (
            "background, a quarter more Gaussians",
            Effects {
                background: true,
                ..plain
            },
        ),
        ("luma-degree 1", degree(1)),
        ("luma-degree 2", degree(2)),
        ("luma-degree 3", degree(sh::MAX_DEGREE)),
    ];
    let asked = std::env::args().skip(1).find(|word| !word.starts_with('-'));
    let wanted = |name: &str| asked.as_deref().is_none_or(|asked| name.contains(asked));
    for (name, effects) in rows.into_iter().filter(|(name, _)| wanted(name)) {
        compare(&gpu, name, effects)?;
    }
    if wanted("robust") {
        let iterations = search(&gpu)?;
        println!("\nrobust: a search takes as long as {iterations:.1} iterations for each photo");
    }
    if wanted("lens") {
        let [plain, with] = lens()?;
        println!("\nlens: a megapixel takes {plain:.0} ms to read, undistorted {with:.0} ms");
    }
    Ok(())
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
