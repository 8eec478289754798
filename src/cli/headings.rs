//! Groups of options in the help, in the order in which most commands show them.

/// Input of the command.
pub(super) const INPUT: &str = "Input";
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
/// Files and text that the command writes.
pub(super) const OUTPUT: &str = "Output";
/// Rarely used options; hidden from `-h`.
pub(super) const EXPERT: &str = "Expert";
