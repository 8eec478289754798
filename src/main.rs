//! The command line program: parse, run, one line of error, exit code.

use std::process::ExitCode;

use clap::Parser;
use gs_chroma::cli::Cli;

fn main() -> ExitCode {
    match Cli::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
