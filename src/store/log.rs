//! `log.csv`: the losses of both stages.

use std::path::Path;

use crate::input;

/// The log with the chroma rows behind the luma rows, in place of those of an earlier coloring.
pub(crate) fn with_rows(path: &Path, luma: usize, rows: &str) -> String {
    // What cannot be read is begun anew.
    let log = input::read_to_string(path).unwrap_or_default();
    let mut kept: String = log
        .lines()
        .filter(|line| {
            let first = line.split(',').next().unwrap_or_default();
            first
                .parse::<usize>()
                .map_or(true, |iteration| iteration <= luma)
        })
        .flat_map(|line| [line, "\n"])
        .collect();
    kept.push_str(rows);
    kept
}
