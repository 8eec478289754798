//! Readiness of the kernels for other devices: on every adapter and in every language that this
//! machine knows. docs/gpu.md has the findings.

mod adapters;
mod browser;
mod languages;
mod limits;
mod places;

use std::io::Write;

/// Says a line that `cargo test` shows although the test passes: it catches what `println!`
/// says, and nothing else.
fn say(words: &str) {
    // Nobody may be listening.
    let _ = writeln!(std::io::stderr(), "portable: {words}");
}
