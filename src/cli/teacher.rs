//! `gs-chroma teacher`.

use std::{
    io::{self, IsTerminal, Write},
    ops::ControlFlow,
    path::{Path, PathBuf},
    time::Duration,
};

use clap::{Args, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};

use super::{CliError, network::NetworkArguments, next, print, progress::Progress};
use crate::{
    capture::decode_image,
    chroma::teacher::{
        Catalog, Checkup, GrayImage, KnownTeacher, ProfileSource, TeacherError, check,
    },
    download::{DownloadError, DownloadSource, download},
    input,
    run::RunError,
    store::{StoreError, files, originals::OriginalFiles},
};

/// List, download and check colorization networks.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma teacher list
  gs-chroma teacher fetch ddcolor-tiny
  gs-chroma teacher check mine.onnx --manifest mine.toml")]
pub struct TeacherCommand {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    List(List),
    Fetch(Fetch),
    Check(Check),
}

/// Show the networks known by name, and which are on this machine.
#[derive(Args)]
struct List {
    /// Print as JSON.
    #[arg(long)]
    json: bool,
}

/// Download a network from its publisher and check its SHA-256.
///
/// Resumes interrupted downloads. Uses the proxy that HTTPS_PROXY names.
#[derive(Args)]
struct Fetch {
    /// Name, as gs-chroma teacher list shows it.
    name: String,
    /// Do not ask before downloading.
    #[arg(long, short)]
    yes: bool,
    /// Seconds to wait for a silent host.
    #[arg(long, value_name = "SECONDS", default_value_t = 30, hide = true, value_parser = clap::value_parser!(u16).range(1..))]
    patience: u16,
}

/// Test a network on a ramp and a photo, and show how it is understood.
///
/// If it is not known what its numbers mean, the usual conventions are tried and the most plausible
/// is taken. colorize follows it only if a manifest states it.
#[derive(Args)]
struct Check {
    /// Name or .onnx file of the network.
    #[arg(value_name = "NAME|FILE.onnx")]
    teacher: PathBuf,
    #[command(flatten)]
    network: NetworkArguments,
    /// Photo to try [default: one of the bundled scene].
    #[arg(long, value_name = "FILE")]
    photo: Option<PathBuf>,
    /// Write the conventions as a manifest.
    #[arg(long, value_name = "FILE.toml")]
    manifest: Option<PathBuf>,
    /// Print as JSON.
    #[arg(long)]
    json: bool,
}

/// A photo for those who name none.
const PHOTO: &[u8] = include_bytes!("../../assets/demo/images/garden_05.jpg");

impl Check {
    fn run(self) -> Result<(), CliError> {
        let mut progress = Progress::default();
        let (name, bytes) = match &self.photo {
            Some(path) => {
                let bytes = input::read(path);
                let bytes = bytes.map_err(|error| unreadable(path, &error))?;
                (path.display().to_string(), bytes)
            }
            None => ("garden".to_owned(), PHOTO.to_vec()),
        };
        let photo = decode_image(bytes)
            .map_err(|error| unreadable(Path::new(&name), &error))?
            .upright()
            .into_luma8();
        let gray = GrayImage {
            width: photo.width(),
            height: photo.height(),
            pixels: photo.as_raw(),
        };
        let checkup = check(&self.teacher, &self.network.settings(), (&name, gray));
        let checkup = checkup.map_err(teacher_error)?;
        if let Some(path) = &self.manifest {
            let read = [&self.teacher].into_iter().chain(&self.photo);
            let _kept = OriginalFiles::default().with_all(read, "an input").keep();
            files::write(path, checkup.manifest.as_bytes())?;
        }
        if self.json {
            return print(format_args!("{:#}", serde_json::json!(checkup)));
        }
        for line in lines(&checkup) {
            print(line)?;
        }
        let wrote: Vec<&Path> = self.manifest.iter().map(PathBuf::as_path).collect();
        progress.close(&wrote, &next::auto(&self.teacher.to_string_lossy()))
    }
}

fn unreadable(path: &Path, reason: &impl ToString) -> CliError {
    CliError::Store(StoreError::file(path, reason.to_string()))
}

/// Candidates that are further off, in CIELAB units, are not worth a line.
const FAR: f64 = 60.0;

/// A checkup in words.
fn lines(checkup: &Checkup) -> Vec<String> {
    let info = &checkup.info;
    let by = match checkup.told_by {
        ProfileSource::User => "as --teacher-profile says",
        ProfileSource::Manifest => "as the manifest beside it says",
        ProfileSource::Catalog => "by its SHA-256",
        ProfileSource::Shapes => "by its inputs and outputs",
        ProfileSource::Trial => "a guess, from answers to what was tried",
    };
    let known = checkup.known_as.as_ref();
    let known = known.map_or(String::new(), |name| format!(", {name} of `teacher list`"));
    let mut lines = vec![
        format!("{}{known}", info.name),
        format!("SHA-256 {}", info.sha256.as_deref().unwrap_or("none")),
        checkup.ports.clone(),
        format!("{}: {by}", info.kind),
    ];
    let (told, far): (Vec<_>, Vec<_>) = (checkup.trials.iter()).partition(|trial| trial.off < FAR);
    let tried = told.into_iter();
    lines.extend(tried.map(|t| format!("  tried {}: {:.1} units off", t.candidate, t.off)));
    if !far.is_empty() {
        lines.push(format!("  and {} more, which are far off", far.len()));
    }
    if let (Some([width, height]), Some(device)) = (info.input_size, info.device) {
        lines.push(format!("sees {width} x {height} on {}", device.name()));
    }
    lines.extend(checkup.answers.iter().map(|answer| {
        let [least, most] = answer.range;
        format!(
            "{}: answers {least:.3} to {most:.3}, colorfulness {:.1}, {:.2} s",
            answer.picture, answer.colorfulness, answer.seconds
        )
    }));
    lines
}

impl TeacherCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        match self.action {
            Action::List(command) => command.run(),
            Action::Fetch(command) => command.run(),
            Action::Check(command) => command.run(),
        }
    }
}

/// The table of networks.
fn catalog() -> Result<Catalog, CliError> {
    Catalog::open().map_err(teacher_error)
}

fn teacher_error(error: TeacherError) -> CliError {
    CliError::Run(RunError::Teacher(error))
}

impl List {
    fn run(self) -> Result<(), CliError> {
        let catalog = catalog()?;
        if self.json {
            let teachers = catalog.teachers.iter().map(|teacher| {
                let path = catalog.path(teacher).ok();
                let here = path.as_ref().is_some_and(|path| path.is_file());
                serde_json::json!({ "teacher": teacher, "path": path, "here": here })
            });
            let teachers: Vec<_> = teachers.collect();
            return print(format_args!("{:#}", serde_json::json!(teachers)));
        }
        let mut progress = Progress::default();
        let names = catalog.teachers.iter().map(|teacher| teacher.name.len());
        let width = names.max().unwrap_or(0);
        let is_here = |teacher: &&KnownTeacher| {
            let path = catalog.path(teacher);
            path.is_ok_and(|path| path.is_file())
        };
        for teacher in &catalog.teachers {
            let here = match is_here(&teacher) {
                true => "here",
                false => "",
            };
            print(format_args!(
                "{:width$}  {here:4}  {:12}  {}",
                teacher.name, teacher.license, teacher.about
            ))?;
        }
        let next = match catalog.teachers.iter().find(is_here) {
            Some(teacher) => next::auto(&teacher.name),
            None => {
                let first = catalog.teachers.first();
                next::fetch(first.map_or("NAME", |teacher| &teacher.name))
            }
        };
        progress.close(&[], &next)
    }
}

impl Fetch {
    fn run(self) -> Result<(), CliError> {
        let mut progress = Progress::default();
        let next = next::auto(&self.name);
        let catalog = catalog()?;
        let teacher = catalog.find(&self.name).map_err(teacher_error)?;
        let path = catalog.path(teacher).map_err(teacher_error)?;
        if catalog.is_fetched(teacher).map_err(teacher_error)? {
            print(format_args!("{} is there", path.display()))?;
            return progress.close(&[], &next);
        }
        if !self.yes && !io::stdin().is_terminal() {
            return Err(CliError::NobodyToAsk {
                name: self.name,
                license: teacher.license.clone(),
            });
        }
        let source = DownloadSource {
            url: &teacher.url,
            sha256: &teacher.sha256,
            bytes: teacher.bytes,
            hosts: &catalog.hosts,
            patience: Duration::from_secs(self.patience.into()),
        };
        let mut bar: Option<ProgressBar> = None;
        let fetched = download(&source, &path, &mut |done, total| {
            let bar = match &mut bar {
                Some(bar) => bar,
                None if self.may(teacher, total) => bar.insert(bytes_bar(total)),
                None => return ControlFlow::Break(()),
            };
            bar.set_position(done);
            ControlFlow::Continue(())
        });
        if let Some(bar) = bar {
            bar.abandon();
        }
        fetched.map_err(|error| CliError::Fetch {
            by_hand: match error {
                // The user's own wish, and what the file system says, tell enough.
                DownloadError::Canceled | DownloadError::Io { .. } | DownloadError::Busy { .. } => {
                    None
                }
                _ => Some((teacher.url.clone(), path.clone())),
            },
            error,
        })?;
        progress.close(&[&path], &next)
    }

    /// Names size and license, and asks whether to go on.
    fn may(&self, teacher: &KnownTeacher, total: Option<u64>) -> bool {
        let size = total.map_or("of unknown size".to_owned(), |total| {
            format!("{:.1} MB", total as f64 / 1e6)
        });
        let host = teacher.url.split('/').nth(2).unwrap_or_default();
        eprintln!(
            "{}: {}\n{}, {size}, from {host}",
            teacher.name, teacher.about, teacher.license
        );
        if self.yes {
            return true;
        }
        eprint!("Fetch it? [y/N] ");
        // A terminal that takes no question gives no answer either.
        drop(io::stderr().flush());
        let mut answer = String::new();
        let read = io::stdin().read_line(&mut answer);
        read.is_ok() && matches!(answer.trim(), "y" | "Y" | "yes")
    }
}

/// A bar that counts bytes.
fn bytes_bar(total: Option<u64>) -> ProgressBar {
    let template = "{bar:30} {bytes}/{total_bytes} {bytes_per_sec} ETA {eta}";
    let style = ProgressStyle::with_template(template);
    let bar = match total {
        Some(total) => ProgressBar::new(total),
        None => ProgressBar::no_length(),
    };
    bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
