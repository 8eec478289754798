//! Kernels in `shaders/compiled/` come from the present sources. `make test-all` compiles them.

use std::{fs, path::Path};

#[path = "../../../tools/compile_shaders/src/stamp.rs"]
mod stamp;

#[test]
fn the_compiled_kernels_are_not_stale() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let kept = fs::read_to_string(root.join("shaders/compiled").join(stamp::FILE)).unwrap();
    assert_eq!(
        kept,
        stamp::of(root),
        "cargo run --release -p compile_shaders"
    );
}
