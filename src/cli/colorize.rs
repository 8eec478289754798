//! `gs-chroma colorize`.

use std::path::{Path, PathBuf};

use clap::{ArgAction, Args, error::ErrorKind};

use super::{
    CliError,
    checkpoint::CheckpointArguments,
    headings::{BUDGET, EXPERT, INPUT, OUTPUT, QUALITY, TEACHER},
    network::NetworkArguments,
    next, print,
    progress::Progress,
    usage::refuse,
    values::{mebibytes, one_of, positive, share, switch},
    view::ViewArguments,
};
use crate::chroma::{
    ChromaSettings, Degree, SolverKind,
    teacher::{TeacherSettings, Upsample},
};
use crate::report::timings_table;
use crate::run::{ColorizeRequest, TeachOptions, TeacherCommand, colorize};

/// Methods of upsampling a teacher's output to the photo's size.
const UPSAMPLE: &[(Upsample, &str)] = &[
    (Upsample::Guided, "Along the photo's edges"),
    (Upsample::Bilinear, "Bilinearly: colors spill over edges"),
];

/// Solvers of chroma.
const SOLVERS: &[(SolverKind, &str)] = &[
    (
        SolverKind::Irls,
        "Iteratively reweighted least squares over all views, with L-BFGS",
    ),
    (
        SolverKind::Adam,
        "Stochastic descent, coarse to fine, as the ChromaDistill paper",
    ),
];

/// Last iteration of the paper's schedule, counted from the start of stage 1.
const PAPER_UNTIL: u32 = 30_000;

/// Color a gray scene with a network or with colored photos.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma teacher fetch ddcolor-tiny
  gs-chroma colorize runs/house --teacher ddcolor-tiny

With photos colored by hand, and with strokes:
  gs-chroma colorize runs/house --teacher painted/
  gs-chroma colorize runs/house --teacher ddcolor-tiny --hints hints/

Gray splats of another program:
  gs-chroma colorize gray.ply --colmap house --teacher ddcolor-tiny")]
pub struct Colorize {
    /// Run folder, or gray splats with --colmap [default: newest under runs/].
    run: Option<PathBuf>,
    /// COLMAP folder of the splats, or of a moved run.
    #[arg(long, value_name = "COLMAP_DIR", help_heading = INPUT)]
    colmap: Option<PathBuf>,
    /// Network, folder of colored photos, or photos; repeatable.
    ///
    /// A network is a name of `gs-chroma teacher list` or a .onnx file. Images of a folder are
    /// named like the photos. The word photos means the photos' own colors. Several count as their
    /// mean.
    #[arg(
        long,
        value_name = "TEACHER",
        required_unless_present_any = ["hints", "teacher_command"],
        help_heading = TEACHER
    )]
    teacher: Vec<PathBuf>,
    /// Program that colors photos: 'python mine.py {in} {out}'.
    ///
    /// {in} is a gray PNG of 8 bits, {out} where to write the colored picture, of any size. For
    /// {in_dir} and {out_dir}, all photos at once, it starts once, and names its pictures like
    /// those it is given. Words are split as a shell does, but no shell runs: variables and pipes
    /// mean nothing.
    #[arg(long, value_name = "COMMAND", value_parser = command, help_heading = TEACHER, hide_short_help = true)]
    teacher_command: Option<String>,
    /// Weight of each teacher, in order [default: equal].
    #[arg(long, value_name = "N,N,…", value_delimiter = ',', value_parser = positive::<f32>, requires = "teacher", help_heading = TEACHER)]
    weights: Vec<f32>,
    /// Folder of painted strokes, named like the photos.
    ///
    /// They lie on transparency or on the photo.
    #[arg(long, value_name = "DIR", help_heading = TEACHER)]
    hints: Option<PathBuf>,
    /// Whether a stroke colors the whole thing it lies on, in all views.
    ///
    /// off: paint counts only where it is, 50 times as much as a teacher.
    #[arg(long, action = ArgAction::Set, value_parser = switch(), value_name = "on|off", default_value = "on", help_heading = TEACHER, hide_short_help = true)]
    grow_hints: bool,
    /// Strength of the teachers' colors.
    ///
    /// Hints stay as painted.
    #[arg(long, value_name = "0..1", default_value_t = 1.0, value_parser = share::<f32>, help_heading = TEACHER)]
    strength: f32,
    #[command(flatten)]
    network: NetworkArguments,
    /// How a network's small picture is enlarged.
    #[arg(long, value_parser = one_of(UPSAMPLE), default_value = "guided", help_heading = TEACHER, hide_short_help = true)]
    upsample: Upsample,
    /// Color as the ChromaDistill paper does.
    ///
    /// --solver adam until iteration 30,000, at three scales. With --until the same descent in
    /// proportion.
    #[arg(long, conflicts_with = "solver", help_heading = EXPERT)]
    as_paper: bool,
    /// Maximum rounds of least squares [default: 12].
    ///
    /// Ends sooner once colors settle.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000), help_heading = BUDGET)]
    rounds: Option<u32>,
    /// Limit device memory, in MiB.
    ///
    /// Views and Gaussians that do not fit are loaded view by view.
    #[arg(long, value_name = "MIB", value_parser = mebibytes(), help_heading = BUDGET)]
    memory_limit: Option<u64>,
    /// Correct each view's saturation and tint [default: by evidence].
    ///
    /// They then agree with those of the other views.
    #[arg(long, value_parser = switch(), value_name = "on|off", hide_possible_values = true, help_heading = EXPERT)]
    correct_views: Option<bool>,
    /// Outlier threshold of the chroma loss, in CIELAB units [default: 10].
    ///
    /// off: plain L1. With --solver adam the default is off.
    #[arg(long, value_name = "UNITS|off", value_parser = robust, help_heading = EXPERT)]
    robust: Option<f32>,
    /// Color what no view shows [default: on].
    ///
    /// It takes the colors of its neighbors and of what looks like it. With --solver adam the
    /// default is off.
    #[arg(long, value_parser = switch(), value_name = "on|off", hide_possible_values = true, help_heading = QUALITY)]
    fill: Option<bool>,
    /// Match the teacher's saturation [default: on].
    ///
    /// As far as views agree. Off where there are hints, and with --solver adam.
    #[arg(long, value_parser = switch(), value_name = "on|off", hide_possible_values = true, help_heading = QUALITY)]
    match_saturation: Option<bool>,
    /// SH degree of chroma.
    ///
    /// auto tries it on training views that are held back.
    #[arg(long, value_name = "0..3|auto", default_value = "0", value_parser = degree, help_heading = QUALITY)]
    sh_degree: Degree,
    /// Take lightness, too, from the photos of --colmap in another light.
    #[arg(long, requires = "output", help_heading = QUALITY, hide_short_help = true)]
    relight: bool,
    /// Splat file to write [default: the run's color.ply].
    #[arg(short, long, value_name = "FILE.ply", help_heading = OUTPUT)]
    output: Option<PathBuf>,
    #[command(flatten)]
    checkpoints: CheckpointArguments,
    #[command(flatten)]
    view: ViewArguments,
    /// Print the report as JSON.
    #[arg(long, help_heading = OUTPUT)]
    json: bool,
    /// Solver: irls (reweighted least squares with L-BFGS) or adam (as the paper).
    #[arg(long, value_parser = one_of(SOLVERS), default_value = "irls", help_heading = EXPERT)]
    solver: SolverKind,
    /// Last iteration of --solver adam, counted from the start of fit [default: the preset's].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = EXPERT)]
    until: Option<u32>,
    /// Coarser scales of --solver adam beside the full one [default: 2].
    #[arg(long, value_name = "0..4", value_parser = clap::value_parser!(u32).range(0..=4), help_heading = EXPERT)]
    scales: Option<u32>,
    /// Use all photos, even if they contradict their poses or COLMAP's points.
    #[arg(long, help_heading = EXPERT)]
    force: bool,
    /// Time every kernel and print a table.
    #[arg(long, help_heading = EXPERT)]
    timings: bool,
}

/// A command line that names pictures.
fn command(text: &str) -> Result<String, String> {
    TeacherCommand::parse(text).map(|_| text.to_owned())
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
    /// The weights of all teachers, the program's last; ends the program where there are not as
    /// many.
    fn all_weights(&self) -> Vec<f32> {
        let (weights, count) = (
            &self.weights,
            self.teacher.len() + usize::from(self.teacher_command.is_some()),
        );
        if !weights.is_empty() && weights.len() != count {
            let message = format!(
                "--weights names {} numbers for {count} teachers: give one for each --teacher",
                weights.len(),
            );
            refuse(ErrorKind::WrongNumberOfValues, message);
        }
        match weights.is_empty() {
            true => vec![1.0; count],
            false => weights.clone(),
        }
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
        settings.fill = self.fill.unwrap_or(settings.fill);
        settings.match_saturation = self.match_saturation.unwrap_or(settings.match_saturation);
        settings.memory_limit = self.memory_limit;
        settings
    }

    /// Ends the program where an option belongs to the other solver.
    fn check_solver(&self) {
        let of_irls = [
            ("--rounds", self.rounds.is_some()),
            ("--correct-views", self.correct_views == Some(true)),
            ("--fill", self.fill == Some(true)),
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
            refuse(ErrorKind::ArgumentConflict, message);
        }
    }

    pub(super) fn run(mut self) -> Result<(), CliError> {
        if self.as_paper {
            self.solver = SolverKind::Adam;
            self.until = self.until.or(Some(PAPER_UNTIL));
        }
        self.check_solver();
        let settings = self.settings();
        let run = self.run.as_deref().unwrap_or("colorize".as_ref());
        let live = self.view.begin(run)?;
        let mut weights = self.all_weights();
        let command = self.teacher_command.zip(weights.last().copied());
        weights.truncate(self.teacher.len());
        let options = ColorizeRequest {
            teach: TeachOptions {
                teachers: self.teacher.into_iter().zip(weights).collect(),
                command,
                settings: TeacherSettings {
                    upsample: self.upsample,
                    ..self.network.settings()
                },
                strength: self.strength,
                hints: self.hints,
                grow_hints: self.grow_hints,
            },
            run: self.run,
            output: self.output,
            until: self.until.map(|n| n as usize),
            settings,
            sh_degree: self.sh_degree,
            correct_views: self.correct_views,
            colmap: self.colmap,
            relight: self.relight,
            force: self.force,
            timings: self.timings,
            checkpoints: self.checkpoints.options(),
            live: live.clone(),
        };
        let mut progress = Progress::through(options.stages());
        let (output, report) = colorize(&options, &mut |event| {
            live.iter().for_each(|live| live.tell(&event));
            progress.show(&event);
        })?;
        progress.finish();
        if self.json {
            return print(report.to_json());
        }
        print(report.chroma_summary())?;
        let chroma = report.chroma.as_ref();
        if let Some(rows) = chroma.and_then(|chroma| chroma.timings.as_ref()) {
            print(timings_table(rows))?;
        }
        let run = output.contact_sheet.as_deref().and_then(Path::parent);
        let next = match run {
            Some(run) => next::eval(run),
            None => next::view(&output.ply),
        };
        let wrote = [Some(output.ply.as_path()), output.contact_sheet.as_deref()];
        let wrote: Vec<&Path> = wrote.into_iter().flatten().collect();
        progress.close_with(run.unwrap_or(&output.ply), &wrote, &next)
    }
}
