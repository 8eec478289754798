//! Groups of options in the help, in the order in which most commands show them.

/// What the command reads.
pub(super) const INPUT: &str = "Input";
/// How much work is done.
pub(super) const BUDGET: &str = "Budget";
/// What the work is spent on.
pub(super) const QUALITY: &str = "Quality";
/// Effects of image formation.
pub(super) const EFFECTS: &str = "Effects";
/// Which pixels count, and how values become gray.
pub(super) const MASKS: &str = "Masks and tone";
/// Who says the colors.
pub(super) const TEACHER: &str = "Teacher";
/// What the command writes and prints.
pub(super) const OUTPUT: &str = "Output";
/// What few need; hidden from `-h`.
pub(super) const EXPERT: &str = "Expert";
