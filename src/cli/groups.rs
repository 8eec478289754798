//! The program's own help: its commands in groups, the first-time path first.

use std::fmt::Write;

use clap::{Command, builder::Styles};

/// Each command once.
const GROUPS: [(&str, &[&str]); 3] = [
    (
        "Start here",
        &["auto", "studio", "prepare", "teacher", "view"],
    ),
    (
        "Step by step",
        &[
            "plan", "fit", "colorize", "frames", "render", "export", "eval", "info",
        ],
    ),
    (
        "Large captures and checks",
        &[
            "partition",
            "merge",
            "tradeoff",
            "doctor",
            "completions",
            "man",
        ],
    ),
];

/// Columns of a command's name.
const NAME: usize = 11;

/// The template of the program's help, with what each command says of itself.
pub(super) fn template(program: &Command) -> String {
    let styles = Styles::default();
    let (header, literal) = (styles.get_header(), styles.get_literal());
    let mut text = "{about-with-newline}\n{usage-heading} {usage}\n".to_owned();
    for (group, commands) in GROUPS {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "\n{header}{group}:{header:#}");
        let found = commands
            .iter()
            .filter_map(|name| program.find_subcommand(name));
        for command in found {
            let (name, about) = (command.get_name(), command.get_about());
            let about = about.map(ToString::to_string).unwrap_or_default();
            let _ = writeln!(text, "  {literal}{name:NAME$}{literal:#}  {about}");
        }
    }
    text + &format!("\n{header}Options:{header:#}\n{{options}}{{after-help}}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::program;

    #[test]
    fn every_command_is_in_one_group() {
        let program = program();
        let commands = program.get_subcommands().map(Command::get_name);
        let mut commands: Vec<&str> = commands.collect();
        let grouped = GROUPS.iter().flat_map(|(_, names)| names.iter().copied());
        let mut grouped: Vec<&str> = grouped.collect();
        commands.sort_unstable();
        grouped.sort_unstable();
        assert_eq!(commands, grouped);
    }
}
