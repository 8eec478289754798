//! What the commands of a job take against an older program, in CPU seconds and on the clock:
//!
//! ```sh
//! cargo bench --bench job -- OLD [FILM]
//! ```
//!
//! `OLD` is an older `gs-chroma`. Each program takes its turn with each command on the bundled
//! scene, and with `auto` of `FILM` (tools/make_film.py makes one), which is stopped once the colored
//! film is there. Each cost is printed as it is known; the table at the end has medians over the turns,
//! and new by old. What the programs started themselves counts, too.

use std::{
    error::Error,
    ffi::{OsStr, OsString},
    fs,
    path::{Path, PathBuf},
    process::{Command, ExitCode, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

#[cfg(unix)]
use nix::sys::{
    resource::{UsageWho, getrusage},
    time::TimeValLike,
};

/// Turns, of which the first may compile kernels: the median is of another one.
const TURNS: usize = 3;
const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo");
const TEACHER: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/assets/teacher/demo-teacher.onnx"
);

/// A command, its name first, and the file that it is over with; without one, its end.
struct Stage {
    arguments: Vec<OsString>,
    until: Option<&'static str>,
}

/// CPU seconds and seconds.
type Cost = [f64; 2];

impl Stage {
    fn new(line: &str) -> Self {
        Self {
            arguments: line.split(' ').map(OsString::from).collect(),
            until: None,
        }
    }

    /// Runs in `folder`.
    fn cost(&self, program: &Path, folder: &Path) -> Result<Cost, Box<dyn Error>> {
        let (before, begun) = (cpu()?, Instant::now());
        let mut child = Command::new(program)
            .args(&self.arguments)
            .current_dir(folder)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()?;
        let mut enough = false;
        let status = loop {
            if let Some(status) = child.try_wait()? {
                break status;
            }
            if !enough && self.until.is_some_and(|file| folder.join(file).exists()) {
                enough = true;
                child.kill()?;
            }
            sleep(Duration::from_millis(20));
        };
        if !(status.success() || enough) {
            let line = self.arguments.join(OsStr::new(" "));
            return Err(format!("{} {line:?}: {status}", program.display()).into());
        }
        Ok([cpu()? - before, begun.elapsed().as_secs_f64()])
    }
}

/// CPU seconds of all programs so far that were waited for.
#[cfg(unix)]
fn cpu() -> Result<f64, Box<dyn Error>> {
    let usage = getrusage(UsageWho::RUSAGE_CHILDREN)?;
    let spent = usage.user_time() + usage.system_time();
    Ok(spent.num_microseconds() as f64 * 1e-6)
}

#[cfg(not(unix))]
fn cpu() -> Result<f64, Box<dyn Error>> {
    Ok(f64::NAN)
}

fn stages(film: Option<PathBuf>) -> Vec<Stage> {
    let mut stages: Vec<Stage> = [
        &format!("fit {SCENE} --preset draft -o run"),
        &format!("colorize run --teacher {TEACHER}"),
        "frames run -o frames",
        "export run --viewer any -o scene.ply",
        &format!("eval run --teacher {TEACHER}"),
    ]
    .map(Stage::new)
    .into();
    if let Some(film) = film {
        let mut auto = Stage::new(&format!("auto --teacher {TEACHER} -o out"));
        auto.arguments.push(film.into());
        auto.until = Some("out/colored.mp4");
        stages.push(auto);
    }
    stages
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let arguments = std::env::args_os().skip(1).filter(|word| word != "--bench");
    let mut files =
        arguments.map(|path| fs::canonicalize(&path).map_err(|e| format!("{path:?}: {e}")));
    let Some(old) = files.next().transpose()? else {
        eprintln!("usage: cargo bench --bench job -- OLD [FILM]");
        return Ok(ExitCode::from(2));
    };
    let stages = stages(files.next().transpose()?);
    let programs = [old, PathBuf::from(env!("CARGO_BIN_EXE_gs-chroma"))];
    let place = tempfile::tempdir()?;
    let mut costs: Vec<[Vec<Cost>; 2]> = stages.iter().map(|_| Default::default()).collect();
    let folders = [0, 1].map(|which| place.path().join(which.to_string()));
    for _ in 0..TURNS {
        folders.iter().try_for_each(fs::create_dir)?;
        for (stage, costs) in stages.iter().zip(&mut costs) {
            for ((program, folder), costs) in programs.iter().zip(&folders).zip(costs) {
                let cost = stage.cost(program, folder)?;
                let [cpu, wall] = cost;
                let name = stage.arguments[0].display();
                eprintln!("{name}, {}: {cpu:.1} CPU s, {wall:.1} s", program.display());
                costs.push(cost);
            }
        }
        folders.iter().try_for_each(fs::remove_dir_all)?;
    }
    println!("| Command | CPU s, old | new | ratio | s, old | new | ratio |");
    println!("|---|---:|---:|---:|---:|---:|---:|");
    for (stage, costs) in stages.iter().zip(&costs) {
        let of = |which: usize, kind: usize| median(costs[which].iter().map(|c| c[kind]).collect());
        let columns = [0, 1].map(|kind| {
            let [old, new] = [0, 1].map(|which| of(which, kind));
            format!("{old:.1} | {new:.1} | {:.2}", new / old)
        });
        let name = stage.arguments[0].display();
        println!("| `{name}` | {} | {} |", columns[0], columns[1]);
    }
    Ok(ExitCode::SUCCESS)
}
