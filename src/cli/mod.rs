//! The commands: arguments in, text out. What they do is in [`crate::run`].

mod answer;
mod auto;
mod bar;
mod checkpoint;
mod colorize;
mod doctor;
mod effects;
mod error;
mod eval;
mod export;
mod fit;
mod frames;
mod groups;
mod headings;
mod info;
mod info_page;
mod interrupt;
#[cfg(test)]
mod keys_tests;
mod luma;
mod merge;
mod network;
mod next;
mod partition;
mod photos;
mod plan;
mod prepare;
mod printable;
mod progress;
mod remedy;
mod render;
mod shell;
mod studio;
mod teacher;
mod tradeoff;
mod usage;
mod values;
mod view;

use std::iter;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

pub use answer::{AnswerError, answer};
pub use error::CliError;
use printable::{print, print_as_is};

use crate::invocation::Invocation;

/// Turns grayscale photos or films into a colored 3D Gaussian splat scene.
#[derive(Parser)]
#[command(
    version,
    about,
    after_long_help = "Example:
  gs-chroma teacher fetch ddcolor-tiny
  gs-chroma auto photos/ --teacher ddcolor-tiny -o out

Every command has an example at the end of its --help."
)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Auto(auto::Auto),
    Prepare(prepare::Prepare),
    Plan(plan::Plan),
    Partition(partition::Partition),
    Fit(fit::Fit),
    Merge(merge::Merge),
    #[command(aliases = ["colorise", "colourize", "colourise"])]
    Colorize(colorize::Colorize),
    Teacher(teacher::TeacherCommand),
    Studio(studio::StudioCommand),
    View(view::View),
    Render(render::Render),
    Frames(frames::FramesCommand),
    Eval(eval::Eval),
    Export(export::Export),
    Tradeoff(tradeoff::Tradeoff),
    Info(info::Info),
    Doctor(doctor::Doctor),
    Completions(shell::Completions),
    Man(shell::ManPages),
}

/// The program with all its options.
fn program() -> clap::Command {
    let program = Cli::command().max_term_width(bar::WIDTH);
    let program = program.mut_subcommands(|command| match command.get_name() {
        "auto" => headings::in_order(&auto::Auto::for_experts(command)),
        // Its options are those of its own commands.
        "teacher" => command,
        _ => headings::in_order(&command),
    });
    let template = groups::template(&program);
    program.help_template(template)
}

impl Cli {
    /// The command in the program's arguments; ends the process where they are wrong.
    pub fn of_arguments() -> Self {
        let arguments = Invocation::present().arguments.iter().cloned();
        let words = iter::once("gs-chroma".into()).chain(arguments);
        let matches = program().try_get_matches_from(words);
        let parsed = matches.and_then(|matches| Self::from_arg_matches(&matches));
        parsed.unwrap_or_else(|error| usage::with_tip(error).exit())
    }

    /// Runs the command and gives the exit status; what stops it is told in one line on standard
    /// error.
    pub fn main(self) -> u8 {
        crate::tradeoff::end_with_parent();
        match interrupt::heed_signals().and_then(|()| self.run()) {
            Ok(()) => 0,
            Err(error) => {
                eprintln!("error: {}", printable::line(&error.to_string()));
                1
            }
        }
    }

    fn run(self) -> Result<(), CliError> {
        match self.command {
            Command::Auto(command) => command.run(),
            Command::Prepare(command) => command.run(),
            Command::Plan(command) => command.run(),
            Command::Partition(command) => command.run(),
            Command::Fit(command) => command.run(),
            Command::Merge(command) => command.run(),
            Command::Colorize(command) => command.run(),
            Command::Teacher(command) => command.run(),
            Command::Studio(command) => command.run(),
            Command::View(command) => command.run(),
            Command::Render(command) => command.run(),
            Command::Frames(command) => command.run(),
            Command::Eval(command) => command.run(),
            Command::Export(command) => command.run(),
            Command::Tradeoff(command) => command.run(program()),
            Command::Info(command) => command.run(),
            Command::Doctor(command) => command.run(),
            Command::Completions(command) => command.run(program()),
            Command::Man(command) => command.run(program()),
        }
    }
}
