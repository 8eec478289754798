//! `gs-chroma auto`.

use std::path::{Path, PathBuf};

use clap::{Args, Command, Id};

use super::{
    CliError,
    effects::EffectArguments,
    frames::CODECS,
    headings::{BUDGET, EXPERT, OUTPUT, TEACHER},
    interrupt::interrupt,
    luma::LumaArguments,
    network::NetworkArguments,
    next,
    photos::PhotoArguments,
    prepare::InputArguments,
    print,
    progress::Progress,
    values::{PRESETS, folder, one_of},
    view::ViewArguments,
};
use crate::{
    auto::{
        AutoEvent, AutoOptions, Results, Step, auto,
        outcome::{Fallback, Outcome, Reel, ReelShot},
        reel,
    },
    run::{FitRequest, Preset},
    store::Codec,
};

const FALLBACKS: &[(Fallback, &str)] = &[
    (Fallback::Gray, "Its frames stay gray [default]"),
    (
        Fallback::Teacher,
        "The teacher's, steadied from frame to frame",
    ),
];

/// Do everything: from photos or a film to a colored scene.
///
/// Runs prepare, fit, colorize, frames, export and eval, with most options of prepare and fit;
/// --memory-limit is for colorize, too. Of a film with several shots each becomes a scene of its
/// own, and all become one film; --shot or --start chooses one. Steps whose result is there are
/// skipped, so the same command continues after an interruption.
#[derive(Args)]
#[command(mut_arg("view", |arg| arg.hide_short_help(true)), after_long_help = "Example:
  gs-chroma teacher fetch ddcolor-tiny
  gs-chroma auto photos/ --teacher ddcolor-tiny -o out
  gs-chroma auto film.mp4 --start 1:05 --end 1:25 --teacher ddcolor-tiny -o out")]
pub struct Auto {
    #[command(flatten)]
    input: InputArguments,
    /// Folder for everything.
    #[arg(short, long, value_name = "DIR", value_parser = folder(), help_heading = OUTPUT)]
    output: PathBuf,
    /// Network, folder of colored photos, or photos.
    ///
    /// As for colorize.
    #[arg(long, help_heading = TEACHER, value_name = "TEACHER")]
    teacher: PathBuf,
    #[command(flatten)]
    network: NetworkArguments,
    /// Folder of painted strokes, as for colorize.
    #[arg(long, help_heading = TEACHER, value_name = "DIR")]
    hints: Option<PathBuf>,
    /// Colors of a shot whose scene cannot be found, in a film of several.
    #[arg(long, hide_short_help = true, help_heading = TEACHER, value_parser = one_of(FALLBACKS), default_value = "gray", hide_default_value = true, value_name = "HOW")]
    fallback: Fallback,
    /// How much work to do [default: paper on a GPU, else draft].
    #[arg(long, value_parser = one_of(PRESETS), help_heading = BUDGET)]
    preset: Option<Preset>,
    #[command(flatten)]
    luma: LumaArguments,
    #[command(flatten)]
    effects: EffectArguments,
    #[command(flatten)]
    photos: PhotoArguments,
    /// How the film in color is coded [default: h264].
    #[arg(long, hide_short_help = true, help_heading = OUTPUT, value_name = "CODEC", value_parser = one_of(CODECS))]
    codec: Option<Codec>,
    /// Leave out the measurements and their page.
    #[arg(long, help_heading = OUTPUT)]
    no_eval: bool,
    #[command(flatten)]
    view: ViewArguments,
    /// Print the paths of all results as JSON.
    #[arg(long, help_heading = OUTPUT)]
    json: bool,
}

/// Groups of options that only the steps need.
const OF_STEPS: [&str; 3] = ["LumaArguments", "EffectArguments", "PhotoArguments"];

impl Auto {
    /// The command with the options of its steps among those rarely used.
    pub(super) fn for_experts(command: Command) -> Command {
        let groups = command.get_groups();
        let groups = groups.filter(|group| OF_STEPS.contains(&group.get_id().as_str()));
        let of_steps: Vec<Id> = groups.flat_map(|group| group.get_args().cloned()).collect();
        command.mut_args(|argument| match of_steps.contains(argument.get_id()) {
            true => argument.help_heading(EXPERT),
            false => argument,
        })
    }

    pub(super) fn run(self) -> Result<(), CliError> {
        let output = self.output;
        let live = self.view.begin(&output)?;
        let options = AutoOptions {
            prepare: self.input.options(output.join("house"), false),
            output,
            teacher: self.teacher,
            teacher_settings: self.network.settings(),
            hints: self.hints,
            fit: FitRequest {
                preset: self.preset,
                settings: self.luma.overlay(),
                load: self.photos.options(),
                overrules: self.effects.overrules(),
                ..FitRequest::default()
            },
            codec: self.codec,
            frame_rate: None,
            without_eval: self.no_eval,
            interrupt: interrupt(),
            live: live.clone(),
        };
        let mut whole = Progress::default();
        let mut progress = Progress::default();
        let fallback = self.fallback;
        let steps = Step::ALL.len() - usize::from(options.without_eval);
        // Shots are looked for before a film of one shot is prepared.
        let mut begun = None;
        let mut heading = |step: Step, more: &str| {
            if begun.replace(step) == Some(step) && more.is_empty() {
                return;
            }
            let place = Step::ALL.iter().position(|&other| other == step);
            let place = place.unwrap_or_default() + 1;
            eprintln!("step {place} of {steps}, {}{more}", step.command());
        };
        let mut tell = |told: AutoEvent| match told {
            AutoEvent::Shot(number, of, span) => {
                whole.join(&mut progress);
                eprintln!("shot {number} of {of}, {span}");
            }
            AutoEvent::Begins(step, stages) => {
                whole.join(&mut progress);
                heading(step, "");
                progress = Progress::through(stages);
            }
            AutoEvent::Skips(step) => {
                whole.join(&mut progress);
                heading(step, ": its result is there");
            }
            AutoEvent::Event(event) => {
                live.iter().for_each(|live| live.tell(&event));
                progress.show(&event);
            }
        };
        if let Some(film) = reel::shots_of(&options, &mut tell)? {
            let made = reel::reel(&options, fallback, &film, &mut tell)?;
            whole.join(&mut progress);
            if self.json {
                return print(serde_json::to_string_pretty(&made).unwrap_or_default());
            }
            print(of_reel(&made))?;
            return whole.close(&[], &next::look(&made.page));
        }
        let results = auto(&options, &mut tell)?;
        whole.join(&mut progress);
        if self.json {
            let text = serde_json::to_string_pretty(&results);
            return print(text.unwrap_or_default());
        }
        print(in_words(&results))?;
        let page = results.page.as_ref().unwrap_or(&results.contact_sheet);
        whole.close(&[], &next::look(page))
    }
}

/// Summary of a film of several shots.
fn of_reel(made: &Reel) -> String {
    let colored = |shot: &&ReelShot| matches!(shot.outcome, Outcome::Scene(_));
    let blank = |shot: &&ReelShot| matches!(shot.outcome, Outcome::Blank);
    let blank = made.shots.iter().filter(blank).count();
    format!(
        "{} of {} shots have a scene\n{}  the film in color\n{}  its shots",
        made.shots.iter().filter(colored).count(),
        made.shots.len() - blank,
        made.colored.display(),
        made.page.display()
    )
}

/// Paths of the results, a line each.
fn in_words(results: &Results) -> String {
    let mut lines: Vec<(&Path, &str)> = vec![
        (&results.colored, results.colored_as()),
        (&results.scene, "the scene, for viewers of splats"),
        (
            &results.contact_sheet,
            "photos, gray, teacher and scene side by side",
        ),
        (
            &results.run,
            "the run: `colorize`, `frames`, `eval` continue from it",
        ),
        (&results.house, "frames, masks and poses"),
    ];
    if let Some(page) = &results.page {
        lines.push((page, "what was measured"));
    }
    let paths: Vec<String> = (lines.iter())
        .map(|(path, _)| path.display().to_string())
        .collect();
    let width = paths
        .iter()
        .map(|path| path.chars().count())
        .max()
        .unwrap_or_default();
    let line = |(path, (_, what)): (&String, &(&Path, &str))| format!("{path:width$}  {what}");
    paths
        .iter()
        .zip(&lines)
        .map(line)
        .collect::<Vec<_>>()
        .join("\n")
}
