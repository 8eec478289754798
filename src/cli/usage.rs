//! Commands that were called wrongly: exit status 2, with the usage of the command in question.

use clap::{Command, error::ErrorKind};

use crate::invocation::Invocation;

/// The command that was called, as the program's first argument names it.
pub(super) fn called() -> Command {
    let mut program = super::program();
    // Subcommands learn the program's name.
    program.build();
    let name = Invocation::present().arguments.first();
    match name.and_then(|name| program.find_subcommand(name)) {
        Some(command) => command.clone(),
        None => program,
    }
}

/// Ends the program because of arguments that do not go together.
pub(super) fn refuse(kind: ErrorKind, reason: impl std::fmt::Display) -> ! {
    called().error(kind, reason).exit()
}
