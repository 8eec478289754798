//! The program, run by itself.

use std::{
    env, io,
    path::Path,
    process::{Command, ExitStatus, Stdio},
    thread,
    time::{Duration, Instant},
};

use crate::{disk, input, invocation::Invocation};

/// Set for a program that is to end when its standard input does.
const TETHER: &str = "GS_CHROMA_ENDS_WITH_STDIN";

/// Interval of polling a child process.
const PATIENCE: Duration = Duration::from_millis(50);

/// Interval of calls to the observer.
const TELL: Duration = Duration::from_millis(500);

/// Ends this program when the one that started it is gone, where that one asked for
/// it: the other end of standard input then closes, whatever ended it, on every system.
/// Files are written beside and renamed, so no moment is a bad one.
pub fn end_with_parent() {
    if env::var_os(TETHER).is_some() {
        thread::spawn(|| {
            let _ = io::copy(&mut io::stdin(), &mut io::sink());
            std::process::exit(1);
        });
    }
}

/// Runs this program with `arguments`; what it says on standard error is in `log`
/// afterwards. `tell` is called now and then.
///
/// # Errors
/// The last line that it said and, unless it ended by itself, how it did.
pub(super) fn run(arguments: &[String], log: &Path, tell: &mut dyn FnMut()) -> Result<(), String> {
    let status = ended(arguments, log, tell).map_err(|error| error.to_string())?;
    if status.success() {
        return Ok(());
    }
    let said = input::read_to_string(log).unwrap_or_default();
    let last = said.lines().rfind(|line| !line.trim().is_empty());
    let last = last.unwrap_or_default();
    let reason = last.strip_prefix("error: ").unwrap_or(last);
    Err(match status.code() {
        Some(1 | 2) if !reason.is_empty() => reason.to_owned(),
        _ => format!("{status}: {reason}"),
    })
}

fn ended(arguments: &[String], log: &Path, tell: &mut dyn FnMut()) -> io::Result<ExitStatus> {
    let stderr = disk::open_in_place(log)?;
    stderr.set_len(0)?;
    let [program, words @ ..] = &*Invocation::present().command else {
        return Err(io::ErrorKind::NotFound.into());
    };
    let mut child = Command::new(program)
        .args(words)
        .args(arguments)
        .env(TETHER, "1")
        // A fault of a test is this program's own.
        .env_remove(disk::FAULT)
        // Kept open until the child is done, which `Child::wait` would not do.
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(stderr)
        .spawn()?;
    let mut told = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status);
        }
        if told.elapsed() >= TELL {
            tell();
            told = Instant::now();
        }
        thread::sleep(PATIENCE);
    }
}
