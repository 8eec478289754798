//! The table of cases: each has a name of its own, stands in docs/experiments/hard-cases.csv, and shows what it
//! is about. That all hold is what `doctor` finds, which tests/cli runs.

use std::collections::BTreeSet;

use gs_chroma::low_level::{
    doctor::cases::{CASES, ODD},
    oracle::{render::visible, shade::Shading},
};

const DOCS: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/docs/experiments/hard-cases.csv"
);

#[test]
fn cases_have_names_of_their_own_and_stand_in_the_documentation() {
    let names: BTreeSet<_> = CASES.iter().map(|case| case.name).collect();
    assert_eq!(names.len(), CASES.len());
    let docs = std::fs::read_to_string(DOCS).unwrap();
    for name in names {
        assert!(
            docs.contains(&format!("\n\"{name}\",")),
            "{name} is missing: see {DOCS}"
        );
    }
}

/// A troublesome Gaussian that nobody sees would prove nothing.
#[test]
fn the_odd_one_is_in_view_unless_it_must_vanish() {
    let unseen = CASES.iter().filter(|case| {
        let hard = (case.make)();
        let list = visible(&hard.scene, &hard.view, Shading::Offset);
        let matters = hard.scene.len() > ODD && hard.broken.is_empty();
        matters && list.iter().all(|seen| seen.index != ODD)
    });
    let names: Vec<_> = unseen.map(|case| case.name).collect();
    assert!(names.is_empty(), "{names:?}");
}
