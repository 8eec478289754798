//! Photos of a capture by name, and figures of theirs.

use std::collections::BTreeSet;

use crate::capture::Capture;

/// Observations of which the median is a figure.
pub(super) const ENOUGH: usize = 30;

/// Photos in the order of their views: names, and the photo of each view.
pub(super) fn photos(capture: &Capture) -> (Vec<&str>, Vec<usize>) {
    let mut names: Vec<&str> = Vec::new();
    let mut of_view = Vec::with_capacity(capture.views.len());
    for view in &capture.views {
        if names.last() != Some(&view.photo.as_str()) {
            names.push(&view.photo);
        }
        of_view.push(names.len() - 1);
    }
    (names, of_view)
}

/// The value in the middle, if there is one; not-a-numbers are not allowed.
pub(in crate::effects) fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (middle < values.len()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// So many names in words, the first of them by name.
pub(crate) fn listed<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    /// More would fill the screen.
    const NAMED: usize = 5;
    let names: BTreeSet<&str> = names.into_iter().collect();
    let mut words: Vec<&str> = names.iter().take(NAMED).copied().collect();
    let more = names.len().saturating_sub(NAMED);
    let rest = format!("{more} more");
    if more > 0 {
        words.push(&rest);
    }
    words.join(", ")
}
