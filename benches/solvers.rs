//! Convergence of the two solvers of stage 2: the plain loss against seconds and view passes, on a
//! run that `fit` made.
//!
//! ```sh
//! cargo bench --bench solvers -- RUN TEACHER [--csv F] [--iterations N] [--scales N]
//! ```
//!
//! TEACHER is an `.onnx` file or a folder, as for `colorize --teacher`. Both solvers get
//! the same views and wanted a/b; the loss at full size of each stage on the way is measured
//! by the same code, its time left out. Adam minimizes it together with the losses at N coarser
//! scales, two as in the paper, least squares alone. `tools/plot_solvers.py` draws the CSV.

use std::{
    fmt::Write, fs, ops::ControlFlow, path::Path, path::PathBuf, process::ExitCode, str::FromStr,
    sync::Arc, time::Instant,
};

use gs_chroma::{
    capture::{Capture, LoadOptions, Loader, split},
    chroma::{
        AdamSolver, ChromaSettings, FrozenViews, IrlsSolver, MemoryBudget, Targets, Task,
        teacher::{GrayImage, Teacher, TeacherSettings},
    },
    gpu::Gpu,
    raster::{ColorKind, Raster},
    splats::ply,
};

type Fallible<T> = Result<T, Box<dyn std::error::Error>>;

/// One point of a curve.
struct Point {
    solver: &'static str,
    step: usize,
    passes: f64,
    seconds: f64,
    objective: f64,
}

struct Problem {
    frozen: FrozenViews,
    targets: Targets,
    tasks: Vec<Task>,
}

/// Scales that Adam may be asked for.
const SCALES: usize = 5;

fn load(run: &Path, teacher: &Path) -> Fallible<Problem> {
    let report: serde_json::Value = serde_json::from_slice(&fs::read(run.join("report.json"))?)?;
    let noted = &report["capture"];
    let colmap = PathBuf::from(noted["path"].as_str().ok_or("report.json has no path")?);
    let options: LoadOptions = serde_json::from_value(noted.clone())?;
    let capture = Capture::load_with(&colmap, &options)?;
    let mut teacher = Teacher::open(
        teacher,
        Some(&run.join("teacher")),
        &TeacherSettings::default(),
    )?;
    let split = split(&capture.views, options.holdout);
    let loader = Loader::open(&capture, &options)?;
    let (mut targets, mut tasks) = (Targets::new(SCALES), Vec::new());
    let mut cameras = Vec::new();
    for &i in &split.train {
        let (photo, camera) = loader.load(&capture.views[i])?;
        let gray = GrayImage {
            width: photo.width,
            height: photo.height,
            pixels: &photo.gray,
        };
        if let Some(wanted) = teacher.colorize(capture.views[i].name.as_str(), gray, None)? {
            tasks.push(Task {
                view: cameras.len(),
                target: targets.push_ab(&wanted, None)?,
            });
            cameras.push(camera);
        }
    }
    let raster = Arc::new(Raster::new(&Gpu::open()?));
    let luma = ply::read_ply(&run.join("luma.ply"))?.splats.to_luma();
    let (extent, room) = (capture.extent(), MemoryBudget::of(ColorKind::Chroma, 0));
    Ok(Problem {
        frozen: FrozenViews::new(&raster, &luma, extent, &cameras, SCALES, room)?,
        targets,
        tasks,
    })
}

/// Iterations of Adam at which the loss is looked at: a few in each doubling.
fn stops(last: usize) -> Vec<usize> {
    let mut stops: Vec<usize> = (0..)
        .map(|k| (25.0 * 2_f64.powf(0.5 * f64::from(k))).round() as usize)
        .take_while(|&n| n < last)
        .collect();
    stops.push(last);
    stops
}

/// Rounds of least squares.
const ROUNDS: usize = 115;

/// Next to none: Adam has none.
const RIDGE: f64 = 1e-5;

fn compare(problem: &Problem, paper: ChromaSettings) -> Fallible<Vec<Point>> {
    let iterations = paper.iterations;
    let mut points = Vec::new();
    let settings = ChromaSettings {
        rounds: ROUNDS,
        ridge: RIDGE,
        ..ChromaSettings::exact()
    };
    let Problem {
        frozen,
        targets,
        tasks,
    } = problem;
    // Measures only; it never solves.
    let mut judge = IrlsSolver::new(frozen, &settings, targets, tasks.clone())?;

    let begun = Instant::now();
    let mut solver = IrlsSolver::new(frozen, &settings, targets, tasks.clone())?;
    let mut spent = begun.elapsed().as_secs_f64();
    for round in 0..ROUNDS {
        let begun = Instant::now();
        let mut passes = 0.0;
        solver.run_to(round + 1, &mut |progress| {
            passes = progress.passes;
            ControlFlow::Continue(())
        })?;
        let chroma = solver.chroma()?;
        spent += begun.elapsed().as_secs_f64();
        points.push(Point {
            solver: "irls",
            step: round + 1,
            passes,
            seconds: spent,
            objective: judge.objective(&chroma)?,
        });
        println!("{}", line(points.last().expect("just pushed")));
    }
    drop(solver);

    let begun = Instant::now();
    let mut adam = AdamSolver::new(frozen, paper, targets, tasks.clone())?;
    let mut spent = begun.elapsed().as_secs_f64();
    for stop in stops(iterations) {
        let begun = Instant::now();
        let mut passes = 0.0;
        adam.run_to(stop, &mut |progress| {
            passes = progress.passes;
            ControlFlow::Continue(())
        })?;
        let chroma = adam.harmonics()?;
        spent += begun.elapsed().as_secs_f64();
        points.push(Point {
            solver: "adam",
            step: stop,
            passes,
            seconds: spent,
            objective: judge.objective(&chroma)?,
        });
        println!("{}", line(points.last().expect("just pushed")));
    }
    Ok(points)
}

fn line(point: &Point) -> String {
    format!(
        "{:5} {:6} {:9.1} passes {:8.2} s   loss {:.4}",
        point.solver, point.step, point.passes, point.seconds, point.objective
    )
}

fn summary(points: &[Point]) {
    let of = |name: &'static str| points.iter().filter(move |point| point.solver == name);
    let Some(goal) = of("adam").next_back() else {
        return;
    };
    match of("irls").find(|point| point.objective <= goal.objective) {
        Some(reached) => println!(
            "irls reaches adam's last loss with 1/{:.1} of its passes in 1/{:.1} of its time",
            goal.passes / reached.passes,
            goal.seconds / reached.seconds
        ),
        None => println!("irls does not reach adam's last loss"),
    }
}

fn number<T: FromStr>(argument: Option<String>, default: T) -> T {
    (argument.and_then(|word| word.parse().ok())).unwrap_or(default)
}

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    let (mut places, mut csv) = (Vec::new(), None);
    let mut paper = ChromaSettings::adam(15_000);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--csv" => csv = arguments.next(),
            "--iterations" => paper.iterations = number(arguments.next(), paper.iterations),
            "--scales" => paper.scales = number(arguments.next(), paper.scales),
            _ => places.push(PathBuf::from(argument)),
        }
    }
    let [run, teacher] = &places[..] else {
        // A plain `cargo bench` comes here too.
        println!("solvers: no RUN and TEACHER named: skipped");
        return ExitCode::SUCCESS;
    };
    let result = load(run, teacher).and_then(|problem| compare(&problem, paper));
    match result {
        Ok(points) => {
            summary(&points);
            let mut text = String::from("solver,step,passes,seconds,objective\n");
            for p in &points {
                // Writing to a string cannot fail.
                let _ = writeln!(
                    text,
                    "{},{},{:.2},{:.4},{:.6}",
                    p.solver, p.step, p.passes, p.seconds, p.objective
                );
            }
            match csv.map(|path| fs::write(path, text)) {
                Some(Err(error)) => {
                    eprintln!("{error}");
                    ExitCode::FAILURE
                }
                _ => ExitCode::SUCCESS,
            }
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
