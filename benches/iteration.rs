//! Time of an iteration, kernel by kernel, against the number of Gaussians and of pixels:
//!
//! ```sh
//! cargo bench                                # 10⁴ and 10⁵ Gaussians, 320 to 1,280 pixels
//! cargo bench -- --full                      # 10⁴ to 10⁶, 320 to 3,840
//! cargo bench -- --full --csv cost.csv       # for tools/plot_cost.py
//! cargo bench --bench iteration -- --behind  # all Gaussians behind the camera
//! ```
//!
//! Gaussians fill the view at random, as wide as lets eight cover each pixel: finer
//! where there are more, as in scenes. Times are medians over up to five rounds of four
//! iterations each; the kernels' come from the device where it has timestamp queries.
//! With `--behind`, nothing is in view: what kernels that work on what is seen take then is
//! the cost of workgroups that find nothing to do.
//! A harness of its own, because one round times all kernels at once.

mod cloud;

use std::{
    collections::BTreeMap, fmt::Write, path::PathBuf, process::ExitCode, sync::Arc, time::Instant,
};

use cloud::{camera, cloud, median};
use gs_chroma::{
    gpu::Gpu,
    low_level::oracle::random::Random,
    luma::{LumaError, LumaSettings, LumaTrainer, TrainingView},
    raster::Raster,
};

/// Iterations of a round, and rounds.
const ITERATIONS: usize = 4;
const ROUNDS: usize = 5;

/// No further round of a size after so many seconds.
const PATIENCE: f64 = 20.0;

/// Gaussians, and pixels across.
type Size = (usize, u32);

/// Times of one size.
struct Cost {
    splats: usize,
    width: u32,
    /// Seconds of an iteration as the host sees it.
    wall: f64,
    /// Seconds of each kernel in an iteration.
    kernels: BTreeMap<&'static str, f64>,
}

/// A trainer that has found its room already.
fn trainer(gpu: &Gpu, (count, width): Size, behind: bool) -> Result<LumaTrainer, LumaError> {
    let camera = camera(width);
    let mut random = Random::new(2);
    let pixels = camera.width * camera.height;
    let gray = (0..pixels).map(|_| random.bits() as u8).collect();
    let settings = LumaSettings {
        sh_degree: 0,
        max_splats: count,
        ..LumaSettings::new(ITERATIONS)
    };
    let mut splats = cloud(count, &camera, 0);
    if behind {
        for [_, _, z] in &mut splats.means {
            *z = -*z;
        }
    }
    let raster = Arc::new(Raster::new(gpu));
    let views = vec![TrainingView::new(camera, gray)];
    let mut trainer = LumaTrainer::new(raster, settings, 5.0, &splats, views)?;
    trainer.train(&mut |_| {})?;
    Ok(trainer)
}

fn measure(gpu: &Gpu, size: Size, behind: bool) -> Result<Cost, LumaError> {
    let mut plain = trainer(gpu, size, behind)?;
    let mut walls = Vec::new();
    let first = Instant::now();
    while walls.len() < ROUNDS && (walls.is_empty() || first.elapsed().as_secs_f64() < PATIENCE) {
        let begun = Instant::now();
        plain.train(&mut |_| {})?;
        walls.push(begun.elapsed().as_secs_f64() / ITERATIONS as f64);
    }
    drop(plain);
    let timed = gpu.timed();
    let mut trainer = trainer(&timed, size, behind)?;
    timed.timings()?;
    let mut rounds: BTreeMap<&'static str, Vec<f64>> = BTreeMap::new();
    for _ in 0..walls.len() {
        trainer.train(&mut |_| {})?;
        for time in timed.timings()? {
            let seconds = time.seconds / ITERATIONS as f64;
            rounds.entry(time.kernel).or_default().push(seconds);
        }
    }
    Ok(Cost {
        splats: size.0,
        width: size.1,
        wall: median(walls.clone()),
        kernels: rounds
            .into_iter()
            .map(|(kernel, times)| (kernel, median(times)))
            .collect(),
    })
}

/// Kernels down, sizes across, milliseconds of an iteration.
fn table(costs: &[Cost]) -> String {
    let mut text = String::from("| ms |");
    // Writing to a string cannot fail.
    for cost in costs {
        let _ = write!(text, " {} at {} px |", cost.splats, cost.width);
    }
    text += "\n|---|";
    text += &"--:|".repeat(costs.len());
    let mut kernels: Vec<&str> = costs
        .iter()
        .flat_map(|cost| cost.kernels.keys().copied())
        .collect();
    kernels.sort_unstable();
    kernels.dedup();
    for kernel in kernels {
        let _ = write!(text, "\n| `{kernel}` |");
        for cost in costs {
            let _ = write!(
                text,
                " {:.3} |",
                1e3 * cost.kernels.get(kernel).unwrap_or(&0.0)
            );
        }
    }
    text += "\n| an iteration, as the host sees it |";
    for cost in costs {
        let _ = write!(text, " {:.2} |", 1e3 * cost.wall);
    }
    text
}

fn csv(costs: &[Cost]) -> String {
    let mut text = String::from("splats,width,kernel,seconds\n");
    for cost in costs {
        let wall = std::iter::once((&"iteration", &cost.wall));
        for (kernel, seconds) in cost.kernels.iter().chain(wall) {
            let _ = writeln!(text, "{},{},{kernel},{seconds:.9}", cost.splats, cost.width);
        }
    }
    text
}

fn main() -> ExitCode {
    let (mut full, mut behind, mut file) = (false, false, None);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            // Cargo passes it.
            "--bench" => {}
            "--full" => full = true,
            "--behind" => behind = true,
            "--csv" => file = arguments.next().map(PathBuf::from),
            other => {
                eprintln!("error: unknown argument {other}: give --full, --behind or --csv FILE");
                return ExitCode::from(2);
            }
        }
    }
    let (counts, widths): (&[usize], &[u32]) = if full {
        (&[10_000, 100_000, 1_000_000], &[320, 1280, 3840])
    } else {
        (&[10_000, 100_000], &[320, 1280])
    };
    let gpu = match Gpu::open() {
        Ok(gpu) => gpu,
        Err(error) => {
            eprintln!("error: {error}");
            return ExitCode::FAILURE;
        }
    };
    let mut costs = Vec::new();
    for &count in counts {
        for &width in widths {
            match measure(&gpu, (count, width), behind) {
                Ok(cost) => {
                    eprintln!("{count} Gaussians at {width} px: {:.1} ms", 1e3 * cost.wall);
                    costs.push(cost);
                }
                Err(error) => eprintln!("{count} Gaussians at {width} px: {error}"),
            }
        }
    }
    println!("{}\n\n{}", gpu.describe(), table(&costs));
    if let Some(file) = file
        && let Err(error) = std::fs::write(&file, csv(&costs))
    {
        eprintln!("error: {}: {error}", file.display());
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
