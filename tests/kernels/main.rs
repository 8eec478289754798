//! Every GPU kernel against the `f64` oracle.
//!
//! A topic measures once ([`errors::Row`]) and its test asserts; `error_table`
//! writes all measurements to `target/kernel-errors.md`:
//! `cargo test --release --test kernels error_table -- --nocapture`.
//! A Vulkan, Metal or DirectX 12 adapter is needed; a software one will do.

use gs_chroma::{compare, oracle};

mod adam;
mod blend;
mod densify;
mod errors;
mod gradient;
mod harness;
mod layout;
mod losses;
mod poison;
mod project;
mod renderer;
mod repeat;
mod scan;
mod sort;
mod tiles;

/// Prints and files what was measured.
#[test]
fn error_table() {
    let device = harness::gpu().describe();
    let topics = [
        &project::ROWS,
        &blend::ROWS,
        &gradient::ROWS,
        &losses::ROWS,
        &adam::ROWS,
        &densify::ROWS,
    ];
    let rows = topics.into_iter().flat_map(|rows| rows.iter());
    let table = errors::table(&device, rows);
    println!("{table}");
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/target/kernel-errors.md");
    std::fs::create_dir_all(concat!(env!("CARGO_MANIFEST_DIR"), "/target"))
        .expect("a target folder");
    std::fs::write(file, table).expect("target is writable");
}
