//! Makes pairs of scenes from one: a variant that calls for an effect, and a control
//! that went through the same hands and does not.
//!
//! ```text
//! cargo run --release --example make_variants -- assets/demo barrel target/variants/barrel
//! ```

mod variants;

use std::{path::PathBuf, process::ExitCode};

use clap::Parser;
use variants::Variant;

/// Makes a COLMAP folder from another, such that it calls for one effect, or just does not.
///
/// The same arguments give the same bytes. Photos become PNG, the model text; poses are
/// kept, observations move along. In exposure, dust, heavy-dust and masked the held-out
/// photos (every 8th by name, the first included) stay clean: their PSNR tells of the scene
/// and not of the defect.
#[derive(Parser)]
struct Arguments {
    /// COLMAP folder whose photos have no lens distortion
    scene: PathBuf,
    /// What to make of it
    #[arg(value_enum)]
    variant: Variant,
    /// Folder to write; must not exist
    out: PathBuf,
    /// Seed of every random choice
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

fn main() -> ExitCode {
    let Arguments {
        scene,
        variant,
        out,
        seed,
    } = Arguments::parse();
    match variants::make(&scene, variant, &out, seed) {
        Ok(summary) => {
            println!("{}: {summary}", out.display());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
