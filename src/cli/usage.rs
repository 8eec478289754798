//! Commands that were called wrongly: exit status 2, with the usage of the command in question.

use clap::{
    Command, Error,
    error::{ContextKind, ContextValue, ErrorKind},
};

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

/// The error; that of a missing teacher says where to find one.
pub(super) fn with_tip(mut error: Error) -> Error {
    let named = error.get(ContextKind::InvalidArg).map(ToString::to_string);
    let is_missing = error.kind() == ErrorKind::MissingRequiredArgument;
    if is_missing && named.is_some_and(|named| named.contains("--teacher <")) {
        let tip =
            "`gs-chroma teacher list` shows networks; a folder of colored photos will do, too";
        let tip = ContextValue::StyledStrs(vec![tip.into()]);
        error.insert(ContextKind::Suggested, tip);
    }
    error
}

/// Ends the program because of arguments that do not go together.
pub(super) fn refuse(kind: ErrorKind, reason: impl std::fmt::Display) -> ! {
    called().error(kind, reason).exit()
}
