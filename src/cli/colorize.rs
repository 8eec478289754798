//! `gs-chroma colorize`.

use std::path::{Path, PathBuf};

use clap::{Args, CommandFactory, ValueEnum, error::ErrorKind};

use super::{
    Cli, CliError,
    checkpoint::CheckpointArguments,
    network::NetworkArguments,
    next, print,
    progress::Progress,
    values::{one_of, positive, share},
    view::ViewArguments,
};
use crate::chroma::{
    ChromaSettings, Degree, SolverKind,
    teacher::{TeacherSettings, Upsample},
};
use crate::report::timings_table;
use crate::run::{ColorizeOptions, TeachOptions, colorize};

/// How a teacher's small picture becomes as large as the photo.
const UPSAMPLE: &[(Upsample, &str)] = &[
    (Upsample::Guided, "Along the photo's edges"),
    (Upsample::Bilinear, "Evenly: colors spill over edges"),
];

/// How chroma is solved for.
const SOLVERS: &[(SolverKind, &str)] = &[
    (
        SolverKind::Irls,
        "Reweighted least squares over all views, sped up by L-BFGS",
    ),
    (
        SolverKind::Adam,
        "The paper's: stochastic steps of Adam, coarse to fine",
    ),
];

/// Color a trained run with a colorization network or a folder of colored photos.
#[derive(Args)]
pub struct Colorize {
    /// Run folder, or a gray .ply with --colmap [default: newest under runs/].
    run: Option<PathBuf>,
    /// A colorization network, by its name in `gs-chroma teacher list` or as an .onnx file, a
    /// folder of colored photos named like the originals, or `photos` where these are in color
    /// themselves; given more than once, their mean.
    #[arg(
        long,
        value_name = "NAME|FILE.onnx|DIR|photos",
        required_unless_present = "hints"
    )]
    teacher: Vec<PathBuf>,
    /// What each teacher counts, in their order [default: all the same].
    #[arg(long, value_name = "N,N,…", value_delimiter = ',', value_parser = positive::<f32>, requires = "teacher")]
    weights: Vec<f32>,
    #[command(flatten)]
    network: NetworkArguments,
    /// How a teacher's small picture becomes as large as the photo.
    #[arg(long, value_parser = one_of(UPSAMPLE), default_value = "guided")]
    upsample: Upsample,
    /// How strong the teachers' colors become; hints stay as painted.
    #[arg(long, value_name = "0..1", default_value_t = 1.0, value_parser = share::<f32>)]
    strength: f32,
    /// A folder of hints: PNG or TIFF images named like the photos, strokes of color on
    /// transparency or on the photo.
    #[arg(long, value_name = "DIR")]
    hints: Option<PathBuf>,
    /// Whether a stroke colors what it lies on, in all views, or counts only where it is painted.
    #[arg(long, value_enum, value_name = "on|off", default_value = "on")]
    grow_hints: Switch,
    /// Colored splat file to write [default: color.ply in the run folder].
    #[arg(short, long, value_name = "FILE.ply")]
    output: Option<PathBuf>,
    /// How chroma is solved for.
    #[arg(long, value_parser = one_of(SOLVERS), default_value = "irls")]
    solver: SolverKind,
    /// Adam's last iteration, counted from the start of `fit` [default: the preset's].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    until: Option<u32>,
    /// Rounds of least squares at most; they end when the colors hardly move any more
    /// [default: 12].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: Option<u32>,
    /// Difference in CIELAB units from which on a view is not believed, or `off` [default: 10
    /// with irls, off with adam].
    #[arg(long, value_name = "UNITS|off", value_parser = robust)]
    robust: Option<f32>,
    /// Bring the views' teachers, who disagree in saturation and tint, into line [default: on with irls, where they
    /// disagree about the same points].
    #[arg(long, value_enum, value_name = "on|off")]
    correct_views: Option<Switch>,
    /// Give Gaussians that no view sees well their neighbors' color [default: on with irls].
    #[arg(long, value_enum, value_name = "on|off")]
    fill: Option<Switch>,
    /// Make colors as strong as the teachers', as far as views agree, where there are no hints
    /// [default: on with irls].
    #[arg(long, value_enum, value_name = "on|off")]
    match_saturation: Option<Switch>,
    /// Coarser scales that count for Adam beside the full one [default: 2].
    #[arg(long, value_name = "0..4", value_parser = clap::value_parser!(u32).range(0..=4))]
    scales: Option<u32>,
    /// Degree of the chroma's dependence on the direction of view, or `auto`: what training views
    /// that are held back prove useful.
    #[arg(long, value_name = "0..3|auto", default_value = "0", value_parser = degree)]
    sh_degree: Degree,
    /// COLMAP folder with the photos, when it is not where `fit` found it.
    #[arg(long, value_name = "COLMAP_DIR")]
    colmap: Option<PathBuf>,
    /// Take lightness, too, from the photos, as those of --colmap in another light show it; a run
    /// keeps its own files.
    #[arg(long, requires = "output")]
    relight: bool,
    /// Go on with all photos where they, their poses and COLMAP's points contradict each other.
    #[arg(long)]
    force: bool,
    /// Device memory in MiB for solving and baking: what does not fit is brought from the host
    /// view by view.
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u32).range(1..))]
    memory_limit: Option<u32>,
    /// Time every kernel, and print a table of it.
    #[arg(long)]
    timings: bool,
    #[command(flatten)]
    checkpoints: CheckpointArguments,
    #[command(flatten)]
    view: ViewArguments,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

/// A choice to be made either way, whatever the default is.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Switch {
    On,
    Off,
}

/// A residual; `off` is one that is never reached.
fn robust(text: &str) -> Result<f32, String> {
    match text {
        "off" => Ok(f32::INFINITY),
        _ => positive(text).map_err(|reason| reason + ", or off"),
    }
}

/// A degree of harmonics.
fn degree(text: &str) -> Result<Degree, String> {
    match text {
        "auto" => Ok(Degree::Auto),
        _ => match text.parse() {
            Ok(degree @ 0..=3) => Ok(Degree::Fixed(degree)),
            _ => Err("must be 0, 1, 2, 3 or auto".to_owned()),
        },
    }
}

impl Colorize {
    /// The teachers with their weights; ends the program where these are not as
    /// many.
    fn teachers(&self) -> Vec<(PathBuf, f32)> {
        let (teachers, weights) = (&self.teacher, &self.weights);
        if !weights.is_empty() && weights.len() != teachers.len() {
            let message = format!(
                "--weights names {} numbers for {} teachers: give one for each --teacher",
                weights.len(),
                teachers.len()
            );
            Cli::command()
                .error(ErrorKind::WrongNumberOfValues, message)
                .exit();
        }
        let weights = weights.iter().copied().chain(std::iter::repeat(1.0));
        teachers.iter().cloned().zip(weights).collect()
    }

    /// The solver's settings with what was said of them.
    fn settings(&self) -> ChromaSettings {
        let mut settings = match self.solver {
            SolverKind::Irls => ChromaSettings::irls(),
            // As many iterations as the run says.
            SolverKind::Adam => ChromaSettings::adam(0),
        };
        settings.scales = self.scales.unwrap_or(settings.scales);
        settings.rounds = self.rounds.map_or(settings.rounds, |n| n as usize);
        if let Some(residual) = self.robust {
            settings.robust = Some(residual).filter(|residual| residual.is_finite());
        }
        if let Some(switch) = self.fill {
            settings.fill = switch == Switch::On;
        }
        if let Some(switch) = self.match_saturation {
            settings.match_saturation = switch == Switch::On;
        }
        settings.memory_limit = self.memory_limit.map(|mib| u64::from(mib) << 20);
        settings
    }

    /// Ends the program where an option belongs to the other solver.
    fn check_solver(&self) {
        let of_irls = [
            ("--rounds", self.rounds.is_some()),
            ("--correct-views", self.correct_views == Some(Switch::On)),
            ("--fill", self.fill == Some(Switch::On)),
        ];
        let of_adam = [
            ("--until", self.until.is_some()),
            ("--scales", self.scales.is_some()),
        ];
        let (options, other) = match self.solver {
            SolverKind::Adam => (&of_irls[..], SolverKind::Irls),
            SolverKind::Irls => (&of_adam[..], SolverKind::Adam),
        };
        if let Some((option, _)) = options.iter().find(|(_, given)| *given) {
            let message = format!("{option} needs --solver {}", other.name());
            Cli::command()
                .error(ErrorKind::ArgumentConflict, message)
                .exit();
        }
    }

    pub(super) fn run(self) -> Result<(), CliError> {
        self.check_solver();
        let settings = self.settings();
        let options = ColorizeOptions {
            teach: TeachOptions {
                teachers: self.teachers(),
                settings: TeacherSettings {
                    upsample: self.upsample,
                    ..self.network.settings()
                },
                strength: self.strength,
                hints: self.hints,
                grow_hints: self.grow_hints == Switch::On,
            },
            run: self.run,
            output: self.output,
            until: self.until.map(|n| n as usize),
            settings,
            sh_degree: self.sh_degree,
            correct_views: self.correct_views.map(|switch| switch == Switch::On),
            colmap: self.colmap,
            relight: self.relight,
            force: self.force,
            timings: self.timings,
            checkpoints: self.checkpoints.options(),
            live: None,
        };
        let run = options.run.as_deref().unwrap_or("colorize".as_ref());
        let live = self.view.begin(run)?;
        let options = ColorizeOptions {
            live: live.clone(),
            ..options
        };
        let mut progress = Progress::through(options.stages());
        let (output, report) = colorize(&options, &mut |event| {
            live.iter().for_each(|live| live.tell(&event));
            progress.show(&event);
        })?;
        progress.finish();
        if self.json {
            print(report.to_json())?;
        } else {
            print(report.chroma_summary())?;
            let chroma = report.chroma.as_ref();
            if let Some(rows) = chroma.and_then(|chroma| chroma.timings.as_ref()) {
                print(timings_table(rows))?;
            }
            let teacher = options.teach.teachers.first().map(|(path, _)| path);
            let next = match output.contact_sheet.as_deref().and_then(Path::parent) {
                Some(run) => next::eval(run, teacher.map(PathBuf::as_path)),
                None => next::view(&output.ply),
            };
            let wrote = [Some(output.ply.as_path()), output.contact_sheet.as_deref()];
            let wrote: Vec<&Path> = wrote.into_iter().flatten().collect();
            let run = output.contact_sheet.as_deref().and_then(Path::parent);
            progress.close_with(run.unwrap_or(&output.ply), &wrote, &next)?;
        }
        Ok(())
    }
}
