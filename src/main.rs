//! The command line program: parse and run.

use std::process::ExitCode;

use gs_chroma::low_level::{Cli, variables};

fn main() -> ExitCode {
    for name in variables() {
        // SAFETY: the first statement of the program; no other thread reads the environment.
        unsafe { std::env::set_var(name, "1") };
    }
    Cli::of_arguments().main().into()
}
