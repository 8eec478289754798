//! What each effect of image formation costs, against an iteration without it:
//!
//! ```sh
//! cargo bench --bench effects
//! ```
//!
//! Every effect takes turns with the plain trainer on the same Gaussians and photos; the
//! table has the median over the turns of the ratio of their times, and what is taken on
//! the device beyond the plain one's.

use std::{process::ExitCode, sync::Arc, time::Instant};

use glam::{DMat3, DVec3};
use gs_chroma::{
    capture::{Camera, Exposure},
    gpu::{Gpu, GpuError},
    luma::{LumaSettings, LumaTrainer, TrainingView},
    oracle::random::Random,
    raster::{Raster, RasterOptions},
    splats::{ShField, Splats, sh},
};

/// Gaussians, and pixels across a photo.
const SPLATS: usize = 10_000;
const WIDTH: u32 = 640;

/// Photos, iterations of a turn, and turns.
const VIEWS: usize = 4;
const ITERATIONS: usize = 8;
const TURNS: usize = 7;

/// What is switched on.
#[derive(Clone, Copy, Default)]
struct Effects {
    exposed: bool,
    masked: bool,
    antialiased: bool,
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
fn trainer(gpu: &Gpu, effects: Effects) -> Result<(LumaTrainer, u64), GpuError> {
    let mut random = Random::new(2);
    let before = gpu.allocated_bytes();
    let views = (0..VIEWS)
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
    let mut settings = LumaSettings {
        sh_degree: effects.sh_degree,
        max_splats: SPLATS,
        antialiased: effects.antialiased,
        ..LumaSettings::new(ITERATIONS)
    };
    // All harmonics from the start, as in most of a training.
    settings.schedule.raise_degree_every = 1;
    let raster = Raster::with(
        gpu,
        RasterOptions {
            antialiased: effects.antialiased,
        },
    );
    let mut trainer = LumaTrainer::new(
        Arc::new(raster),
        settings,
        5.0,
        &cloud(effects.sh_degree),
        views,
    )?;
    trainer.train(&mut |_| {})?;
    let taken = gpu.allocated_bytes().zip(before);
    Ok((
        trainer,
        taken.map_or(0, |(after, before)| after.saturating_sub(before)),
    ))
}

fn seconds(trainer: &mut LumaTrainer) -> Result<f64, GpuError> {
    let begun = Instant::now();
    trainer.train(&mut |_| {})?;
    Ok(begun.elapsed().as_secs_f64())
}

fn compare(gpu: &Gpu, name: &str, effects: Effects) -> Result<(), GpuError> {
    let (mut plain, plain_bytes) = trainer(gpu, Effects::default())?;
    let (mut with, bytes) = trainer(gpu, effects)?;
    let mut ratios = Vec::with_capacity(TURNS);
    for turn in 0..TURNS {
        // Who goes first changes, for whoever does may find the caches cold.
        let [of_plain, of_with] = if turn % 2 == 0 {
            let of_plain = seconds(&mut plain)?;
            [of_plain, seconds(&mut with)?]
        } else {
            let of_with = seconds(&mut with)?;
            [seconds(&mut plain)?, of_with]
        };
        ratios.push(of_with / of_plain);
    }
    ratios.sort_by(f64::total_cmp);
    println!(
        "| {name} | {:.2} | {:.2} to {:.2} | {:+.2} |",
        ratios[TURNS / 2],
        ratios[1],
        ratios[TURNS - 2],
        (bytes as f64 - plain_bytes as f64) / f64::from(1 << 20),
    );
    Ok(())
}

fn run() -> Result<(), GpuError> {
    let gpu = Gpu::open()?;
    let height = WIDTH * 3 / 4;
    println!(
        "{SPLATS} Gaussians, {VIEWS} photos of {WIDTH} × {height}, {}\n",
        gpu.describe()
    );
    println!("| effect | time, plain = 1 | second to last but one | memory, MiB more |");
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
        ("luma-degree 1", degree(1)),
        ("luma-degree 2", degree(2)),
        ("luma-degree 3", degree(sh::MAX_DEGREE)),
    ];
    for (name, effects) in rows {
        compare(&gpu, name, effects)?;
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
