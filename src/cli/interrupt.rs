//! SIGINT and SIGTERM.

use std::{
    env, io,
    process::exit,
    sync::{
        Arc, OnceLock,
        atomic::{AtomicBool, Ordering},
    },
    thread,
};

use super::CliError;
use crate::{disk, programs, run::RunError, store::Interrupt};

/// A shell reports a program that signal N ended by this and N.
const BASE_STATUS: i32 = 128;

/// The signal of Ctrl-C.
const INTERRUPTED: i32 = 2;

/// Interrupt flag that a signal raises, where it does not end the program.
static HEEDED: OnceLock<Arc<Interrupt>> = OnceLock::new();

/// True if a signal is the normal end of the command.
static ENDS_WELL: AtomicBool = AtomicBool::new(false);

/// Heeds the end of standard input as a signal, where whoever started the program wants that.
fn heed_tether() {
    // What it starts itself it ends itself.
    if env::var_os(programs::TETHER).is_some() {
        thread::spawn(|| {
            let _ = io::copy(&mut io::stdin(), &mut io::sink());
            heed(INTERRUPTED);
        });
    }
}

/// Lets signals end the program without leaving files behind that were only begun.
#[cfg(unix)]
pub(super) fn heed_signals() -> Result<(), CliError> {
    use signal_hook::{consts, flag, iterator::Signals};
    let failed = |error: std::io::Error| RunError::Signals(error.to_string());
    // Whoever writes too large a file is told so, and does not die of it.
    flag::register(consts::SIGXFSZ, Arc::default()).map_err(failed)?;
    let mut signals =
        Signals::new([consts::SIGINT, consts::SIGTERM, consts::SIGHUP]).map_err(failed)?;
    thread::spawn(move || signals.forever().for_each(heed));
    heed_tether();
    Ok(())
}

/// Lets Ctrl-C end the program without leaving files behind that were only begun.
#[cfg(not(unix))]
pub(super) fn heed_signals() -> Result<(), CliError> {
    heed_tether();
    ctrlc::set_handler(|| heed(INTERRUPTED))
        .map_err(|error| RunError::Signals(error.to_string()).into())
}

/// Ends the program, or lets it end at its next checkpoint.
fn heed(signal: i32) {
    if HEEDED.get().is_some_and(|interrupt| interrupt.raise()) {
        eprintln!("writing a checkpoint; once more ends at once");
        return;
    }
    // Before their files are removed.
    let _no_program = programs::end_all();
    let _nothing_new = disk::give_up();
    exit(match ENDS_WELL.load(Ordering::SeqCst) {
        true => 0,
        false => BASE_STATUS + signal,
    });
}

/// Interrupt flag that the first signal raises from now on, where the work can be saved.
pub(super) fn interrupt() -> Arc<Interrupt> {
    HEEDED.get_or_init(Arc::default).clone()
}

/// From now on a signal is the normal end of the command.
pub(super) fn ends_well() {
    ENDS_WELL.store(true, Ordering::SeqCst);
}
