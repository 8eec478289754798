//! SIGINT and SIGTERM.

use std::{
    fmt,
    process::exit,
    sync::{
        Arc, LazyLock, OnceLock,
        atomic::{AtomicBool, Ordering},
    },
};

use super::CliError;
use crate::{disk, programs, run::RunError, store::Interrupt};

/// The statuses with which a shell expects a program to end that was interrupted, and one that was
/// told to end.
const INTERRUPTED: i32 = 130;
const TERMINATED: i32 = 143;

/// True if the signal was SIGTERM.
static TOLD_TO_END: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// Interrupt flag that a signal raises, where it does not end the program.
static HEEDED: OnceLock<Arc<Interrupt>> = OnceLock::new();

/// True if a signal is the normal end of the command.
static ENDS_WELL: AtomicBool = AtomicBool::new(false);

/// Lets signals end the program without leaving files behind that were only begun.
pub(super) fn heed_signals() -> Result<(), CliError> {
    let handled = ctrlc::set_handler(|| {
        if HEEDED.get().is_some_and(|interrupt| interrupt.raise()) {
            eprintln!("writing a checkpoint; once more ends at once");
            return;
        }
        // Before their files are removed.
        let _no_program = programs::end_all();
        let _nothing_new = disk::give_up();
        exit(match ENDS_WELL.load(Ordering::SeqCst) {
            true => 0,
            false if TOLD_TO_END.load(Ordering::SeqCst) => TERMINATED,
            false => INTERRUPTED,
        });
    });
    let failed = |error: &dyn fmt::Display| RunError::Signals(error.to_string());
    handled.map_err(|error| failed(&error))?;
    #[cfg(unix)]
    {
        use signal_hook::{consts, flag::register};
        // The handler above is called as before.
        register(consts::SIGTERM, TOLD_TO_END.clone()).map_err(|error| failed(&error))?;
        // Whoever writes too large a file is told so, and does not die of it.
        register(consts::SIGXFSZ, Arc::default()).map_err(|error| failed(&error))?;
    }
    Ok(())
}

/// Interrupt flag that the first signal raises from now on, where the work can be saved.
pub(super) fn interrupt() -> Arc<Interrupt> {
    HEEDED.get_or_init(Arc::default).clone()
}

/// From now on a signal is the normal end of the command.
pub(super) fn ends_well() {
    ENDS_WELL.store(true, Ordering::SeqCst);
}
