//! Groups of options in the help, and their order.

use clap::{Arg, Command};

/// Input of the command.
pub(super) const INPUT: &str = "Input";
/// Cameras and their poses.
pub(super) const CAMERA: &str = "Cameras and poses";
/// Camera paths.
pub(super) const PATH: &str = "Along a path";
/// Amount of work.
pub(super) const BUDGET: &str = "Budget";
/// Quality settings that the work is spent on.
pub(super) const QUALITY: &str = "Quality";
/// Effects of image formation.
pub(super) const EFFECTS: &str = "Effects";
/// Pixel masks, and conversion of values to gray.
pub(super) const MASKS: &str = "Masks and tone";
/// Source of the colors.
pub(super) const TEACHER: &str = "Teacher";
/// Other ways to color the scene.
pub(super) const COMPARE: &str = "Comparisons";
/// What is measured.
pub(super) const MEASURES: &str = "Measures";
/// Files and text that the command writes.
pub(super) const OUTPUT: &str = "Output";
/// Rarely used options; hidden from `-h`.
pub(super) const EXPERT: &str = "Expert";

/// All, in the order in which every command shows them.
const ORDER: [&str; 12] = [
    INPUT, CAMERA, PATH, BUDGET, QUALITY, EFFECTS, MASKS, TEACHER, COMPARE, MEASURES, OUTPUT,
    EXPERT,
];

/// A command with its options in this order, wherever its structs declare them.
pub(super) fn in_order(command: &Command) -> Command {
    let mut arguments: Vec<Arg> = command.get_arguments().cloned().collect();
    arguments.sort_by_key(place);
    let hidden = arguments.into_iter().map(|argument| {
        let is_expert = argument.get_help_heading() == Some(EXPERT);
        let hides = is_expert || argument.is_hide_short_help_set();
        argument.hide_short_help(hides)
    });
    let about = command.get_about().cloned().unwrap_or_default();
    let long_about = command.get_long_about().cloned();
    Command::new(command.get_name().to_owned())
        .aliases(command.get_all_aliases().map(str::to_owned))
        .long_about(long_about.unwrap_or_else(|| about.clone()))
        .about(about)
        .after_long_help(command.get_after_long_help().cloned().unwrap_or_default())
        .groups(command.get_groups().cloned())
        .args(hidden)
}

/// Place of an option's group; those of no group come first.
fn place(argument: &Arg) -> Option<usize> {
    let heading = argument.get_help_heading()?;
    ORDER.iter().position(|&other| other == heading)
}

#[cfg(test)]
mod tests {
    use crate::cli::program;

    use super::*;

    #[test]
    fn every_command_shows_its_groups_in_one_order() {
        for command in program().get_subcommands() {
            let with_heading = command
                .get_arguments()
                .filter(|a| a.get_help_heading().is_some());
            let places: Vec<Option<usize>> = with_heading.map(place).collect();
            let name = command.get_name();
            assert!(places.is_sorted() && !places.contains(&None), "{name}");
        }
    }
}
