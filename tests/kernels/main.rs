//! Every GPU kernel against the `f64` oracle.
//!
//! `gs_chroma::doctor` measures the kernels on random inputs; `error_table` asserts
//! that all of it is within bounds and writes it to `target/kernel-errors.md`:
//! `cargo test --release --test kernels error_table -- --nocapture`.
//! A Vulkan, Metal or DirectX 12 adapter is needed; a software one will do.

use gs_chroma::{
    compare,
    doctor::{kernels::TOPICS, measured},
    oracle,
};

mod adam;
mod antialiasing;
mod blend;
mod contributions;
mod convergence;
mod depth;
mod device;
mod effects;
mod gather;
mod gradient;
mod harness;
mod layout;
mod least_squares;
mod losses;
mod memory;
mod numerics;
mod poison;
mod portions;
mod renderer;
mod repeat;
mod resume;
mod rgb;
mod scan;
mod solver;
mod sort;
mod streamed;
mod tiles;
mod viewers;
mod wall;

/// Prints, files and judges what is measured.
#[test]
fn error_table() {
    let rows: Vec<measured::Row> = (TOPICS.iter())
        .flat_map(|(_, measure)| measure(&harness::raster()).unwrap())
        .collect();
    let device = harness::gpu().describe();
    let table = format!(
        "Kernels on {device} against the f64 oracle; the worst input of each row.\n\n{}",
        measured::table(&rows)
    );
    println!("{table}");
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/target");
    std::fs::create_dir_all(folder).expect("a target folder");
    std::fs::write(format!("{folder}/kernel-errors.md"), &table).expect("target is writable");
    assert!(rows.len() >= 28);
    assert!(rows.iter().all(|row| row.failures.is_empty()), "{table}");
}
