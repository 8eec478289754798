//! Text for terminals: names of files may hold anything, also what moves a cursor.

use std::{
    fmt::Display,
    io::{self, Write},
    path::Path,
};

use super::error::CliError;
use crate::store::StoreError;

/// The text with what a terminal would act on escaped, such as `\u{1b}`, and lines as they are.
pub(super) fn printable(text: &str) -> String {
    let mut printable = String::with_capacity(text.len());
    for c in text.chars() {
        match acts(c) && c != '\n' {
            true => printable.extend(c.escape_unicode()),
            false => printable.push(c),
        }
    }
    printable
}

/// The same for what is one line.
pub(super) fn line(text: &str) -> String {
    printable(&text.replace('\n', "\\n"))
}

/// Prints a line to standard output, with what a terminal would act on escaped.
pub(super) fn print(line: impl Display) -> Result<(), CliError> {
    print_as_is(&printable(&line.to_string()))
}

/// The same for text of our own. A reader that has seen enough (`| head`) is no error.
pub(super) fn print_as_is(text: &str) -> Result<(), CliError> {
    match writeln!(io::stdout(), "{text}") {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(CliError::Store(
            StoreError::file(Path::new("standard output"), error.to_string()),
        )),
        _ => Ok(()),
    }
}

/// Returns true if a terminal acts on the character instead of showing it: control characters, and
/// those that change the direction of writing (Unicode standard annex 9).
fn acts(c: char) -> bool {
    c.is_control() || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_act_on_is_escaped() {
        let name = "a\u{1b}[2Jé\u{202e}gnp.\u{7}\n日";
        let shown = "a\\u{1b}[2Jé\\u{202e}gnp.\\u{7}\n日";
        assert_eq!(printable(name), shown);
        assert_eq!(line(name), shown.replace('\n', "\\n"));
    }
}
