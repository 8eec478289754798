//! The command line program: parse and run.

use std::process::ExitCode;

use clap::Parser;
use gs_chroma::low_level::Cli;

fn main() -> ExitCode {
    set_environment();
    Cli::parse().main()
}

/// Tells libraries what they ask the environment alone.
fn set_environment() {
    let mut set = vec![
        // ONNX Runtime queues its telemetry and looks for its host whatever its API is told.
        "ORT_DISABLE_TELEMETRY",
    ];
    if cfg!(target_os = "linux") && std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // Without a session, Mesa's device-selection layer complains on standard error about the
        // Wayland display that it cannot ask; there is nothing to select by then.
        set.push("NODEVICE_SELECT");
    }
    for name in set {
        // SAFETY: the first statement of the program; no other thread reads the environment.
        unsafe { std::env::set_var(name, "1") };
    }
}
