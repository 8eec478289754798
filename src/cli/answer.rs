//! Commands for programs that have this one as a library: arguments in, JSON out.

use clap::FromArgMatches;

use super::{Cli, CliError, Command, program};
use crate::{
    run::{eval, export, frames},
    tell::Observer,
};

/// Error of a command that a program gave.
#[derive(Debug, thiserror::Error)]
pub enum AnswerError {
    /// Arguments that the command does not take.
    #[error("{0}")]
    Usage(String),
    /// The command failed.
    #[error(transparent)]
    Failed(#[from] CliError),
}

/// The result of `eval`, `export` or `frames`, which the arguments name, as its option for JSON
/// prints it.
///
/// # Errors
/// [`AnswerError`].
pub fn answer(arguments: &[String], observe: &mut Observer<'_>) -> Result<String, AnswerError> {
    let words = ["gs-chroma"].into_iter();
    let words = words.chain(arguments.iter().map(String::as_str));
    let matches = program().try_get_matches_from(words).map_err(usage)?;
    let cli = Cli::from_arg_matches(&matches).map_err(usage)?;
    let failed = |error| AnswerError::Failed(CliError::Run(error));
    let json = |result: serde_json::Result<String>| result.unwrap_or_default();
    match cli.command {
        Command::Eval(command) => {
            let (_, evaluation) = eval(&command.options(), observe).map_err(failed)?;
            Ok(evaluation.to_json())
        }
        Command::Export(command) => {
            let wrote = export(&command.options(), observe).map_err(failed)?;
            Ok(json(serde_json::to_string(&wrote)))
        }
        Command::Frames(command) => {
            let done = frames(&command.options(), observe).map_err(failed)?;
            Ok(json(serde_json::to_string(&done)))
        }
        _ => Err(AnswerError::Usage("no command with an answer".to_owned())),
    }
}

/// The sentence of an error, without the usage of the program.
fn usage(error: clap::Error) -> AnswerError {
    let text = error.to_string();
    let lines = text.lines().map(str::trim);
    let sentence: Vec<&str> = lines.take_while(|line| !line.is_empty()).collect();
    let sentence = sentence.join(" ");
    AnswerError::Usage(sentence.trim_start_matches("error: ").to_owned())
}
