//! Output of a program: its lines, as they come, and the last of them, for an error.

use std::{
    collections::VecDeque,
    io::{BufRead, BufReader, Read},
    sync::mpsc::Sender,
    thread,
};

/// Lines that are kept to be told if a program fails.
pub(super) const KEPT_LINES: usize = 20;

/// Last lines that go into an error.
const TOLD_LINES: usize = 2;

/// A longer line is no message; the rest of it is not kept.
const LONGEST_LINE: usize = 4096;

/// Sends the lines that a program says: programs that show how far they are end lines with a
/// carriage return as well.
pub(super) fn listen(
    said: impl Read + Send + 'static,
    to: Sender<(Stream, String)>,
    stream: Stream,
) {
    thread::spawn(move || {
        let mut said = BufReader::new(said);
        let mut line = Vec::new();
        loop {
            let end = match said.fill_buf() {
                Ok([]) | Err(_) => break,
                Ok(bytes) => {
                    let end = bytes.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
                    let room = LONGEST_LINE.saturating_sub(line.len());
                    let part = &bytes[..end.unwrap_or(bytes.len())];
                    line.extend_from_slice(&part[..part.len().min(room)]);
                    let used = end.map_or(bytes.len(), |end| end + 1);
                    said.consume(used);
                    end
                }
            };
            if end.is_some() && !line.is_empty() {
                // Nobody may be listening any more; the program is heard to its end.
                let _ = to.send((stream, String::from_utf8_lossy(&line).into_owned()));
                line.clear();
            }
        }
        if !line.is_empty() {
            let _ = to.send((stream, String::from_utf8_lossy(&line).into_owned()));
        }
    });
}

/// Output stream of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stream {
    Output,
    Error,
}

/// Last lines of a program's output.
#[derive(Default)]
pub(super) struct Last(VecDeque<(Stream, String)>);

impl Last {
    pub fn keep(&mut self, stream: Stream, line: String) {
        if self.0.len() == KEPT_LINES {
            self.0.pop_front();
        }
        self.0.push_back((stream, line));
    }

    /// The last lines of standard error or, where there are none, of standard output.
    pub fn told(&self) -> Vec<&str> {
        let of = |stream| {
            let said = self.0.iter().filter(|(from, _)| *from == stream);
            let said = said
                .map(|(_, line)| message(line))
                .filter(|line| !line.is_empty());
            said.collect::<Vec<_>>()
        };
        let mut said = of(Stream::Error);
        if said.is_empty() {
            said = of(Stream::Output);
        }
        said.split_off(said.len().saturating_sub(TOLD_LINES))
    }
}

/// A line without what a log puts before it (`E20250101 10:00:00.000000 123 file.cc:7] `).
fn message(line: &str) -> &str {
    let bytes = line.as_bytes();
    let logged = bytes.len() > 1
        && matches!(bytes[0], b'I' | b'W' | b'E' | b'F')
        && bytes[1].is_ascii_digit();
    match line.split_once("] ") {
        Some((_, message)) if logged => message.trim(),
        _ => line.trim(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_s_prefix_is_no_message() {
        let logged = "E20250101 10:00:00.000000 123 option.cc:7] Failed to parse";
        assert_eq!(message(logged), "Failed to parse");
        for line in ["Error [1] no", "I am [a] person", "E", ""] {
            assert_eq!(message(line), line);
        }
    }
}
