//! The command line program: parse, run, one line of error, exit code.

use std::process::ExitCode;

use clap::Parser;
use gs_chroma::cli::Cli;

fn main() -> ExitCode {
    quiet_device_selection();
    gs_chroma::tradeoff::end_with_parent();
    match Cli::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Without a session, Mesa's device-selection layer complains on standard error
/// about the Wayland display that it cannot ask; there is nothing to select by then.
fn quiet_device_selection() {
    if cfg!(target_os = "linux") && std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: the first statement of the program; no other thread reads the environment.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}
