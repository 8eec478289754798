//! Cost of numerical accuracy in time: each knob of `fit --numerics` at several values, its error
//! beside the time of an iteration.
//!
//! ```sh
//! cargo bench --bench accuracy                                 # random Gaussians, bundled scene
//! cargo bench --bench accuracy -- --run runs/garden            # a run's Gaussians and photos
//! cargo bench --bench accuracy -- --csv a.csv --json a.json    # for tools/plot_accuracy.py
//! cargo bench --bench accuracy -- --quick                      # no training, small sizes
//! ```
//!
//! Errors are those of one view's picture and gradient against the f64 oracle without any
//! cut-off, in exact order of depth; small, for the oracle takes its time. Times are ratios
//! to the default's right before and after, in rounds over all values of all knobs; the
//! median of the rounds' ratios counts. A different loss or step is no
//! error of one picture: for these, how far training goes elsewhere, and held-out PSNR.

mod error;
mod knobs;
mod scene;
mod table;
mod time;
mod training;

#[path = "../cloud/mod.rs"]
mod cloud;

use std::{fs, path::PathBuf, process::ExitCode, time::Instant};

use gs_chroma::{gpu::Gpu, low_level::RunFolder};
use knobs::KNOBS;
use scene::Subject;
use table::Row;

type Fallible<T> = Result<T, Box<dyn std::error::Error>>;

/// Options of the command line.
#[derive(Default)]
struct Options {
    run: Option<PathBuf>,
    csv: Option<PathBuf>,
    json: Option<PathBuf>,
    quick: bool,
}

impl Options {
    fn read() -> Result<Self, String> {
        let mut options = Self::default();
        let mut arguments = std::env::args().skip(1);
        while let Some(argument) = arguments.next() {
            let file = match argument.as_str() {
                // Cargo passes it.
                "--bench" => continue,
                "--quick" => {
                    options.quick = true;
                    continue;
                }
                "--run" => &mut options.run,
                "--csv" => &mut options.csv,
                "--json" => &mut options.json,
                other => return Err(format!("unknown argument {other}")),
            };
            *file = Some(
                arguments
                    .next()
                    .ok_or(format!("{argument} of what?"))?
                    .into(),
            );
        }
        Ok(options)
    }
}

/// Errors and times of one subject, a row a knob's value.
fn measure(gpu: &Gpu, subject: &Subject) -> Fallible<Vec<Row>> {
    let begun = Instant::now();
    let told = |what: &str| {
        let seconds = begun.elapsed().as_secs_f64();
        eprintln!("{} after {seconds:.0} s: {what}", subject.name);
    };
    told("the oracle");
    let errors = error::measure(gpu, subject)?;
    told("times");
    let times = time::measure(gpu, subject)?;
    told("done");
    Ok((KNOBS.iter().zip(errors).zip(times))
        .map(|((knob, error), time)| Row::new(&subject.name, *knob, error, time))
        .collect())
}

fn run(options: &Options) -> Fallible<()> {
    let gpu = Gpu::open()?;
    let random = Subject::random(options.quick);
    let mut rows = measure(&gpu, &random)?;
    save(&gpu, options, &rows)?;
    if !options.quick {
        eprintln!("training random Gaussians");
        for (row, drift) in rows.iter_mut().zip(training::drifts(&gpu, &random)?) {
            row.drift = Some(drift);
        }
        save(&gpu, options, &rows)?;
        let first = rows.len();
        let (capture, own_run) = training::fitted()?;
        let folder = RunFolder::at(options.run.as_deref().unwrap_or(&own_run));
        rows.extend(measure(&gpu, &Subject::trained(&folder)?)?);
        save(&gpu, options, &rows)?;
        if options.run.is_none() {
            for (row, fit) in rows[first..].iter_mut().zip(training::fits(&capture)?) {
                row.fit = Some(fit);
            }
        }
        save(&gpu, options, &rows)?;
    }
    println!("{}\n{}", gpu.describe(), table::markdown(&rows));
    Ok(())
}

/// Writes what there is: whoever stops the program half-way keeps the half.
fn save(gpu: &Gpu, options: &Options, rows: &[Row]) -> Fallible<()> {
    if let Some(file) = &options.csv {
        fs::write(file, table::csv(rows))?;
    }
    if let Some(file) = &options.json {
        let described = serde_json::json!({ "device": gpu.describe(), "rows": rows });
        fs::write(file, serde_json::to_string_pretty(&described)?)?;
    }
    Ok(())
}

fn main() -> ExitCode {
    let options = match Options::read() {
        Ok(options) => options,
        Err(message) => {
            eprintln!("error: {message}: give --run RUN, --csv FILE, --json FILE or --quick");
            return ExitCode::from(2);
        }
    };
    match run(&options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
