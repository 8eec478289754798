//! Every case of the table holds, and docs/hard-cases.md is that table.

use std::collections::BTreeSet;

use gs_chroma::{
    doctor::{
        Diagnosis,
        cases::{CASES, ODD},
        measured,
    },
    oracle::{render::visible, shade::Shading},
};

use crate::gpu;

const DOCS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/hard-cases.md");

const HEADER: &str = "# Hard cases

Scenes at which splat rasterizers break, and how far this one is from the f64 oracle
on them: the largest error of a pixel (in units of the brightest one, at least 1), and
the largest relative L2 error of the gradient of a group of parameters against dual
numbers. *Poisoned* Gaussians are culled and counted; nothing else may change by them.
The cases are defined in `src/doctor/cases.rs`. `gs-chroma doctor` runs them on your
own device; bounds are the worst seen on the device below × 1.05, and × 16 on others.

Where f32 shows: 65,600 tiles take coordinates beyond a million
pixels, whose step is 1/16; a needle across the pixels makes the exponent a small
difference of large terms (docs/lab/02-rasterizer.md).

`tests/stability` holds more: poison in every parameter of Gaussians and every number of
COLMAP models, kernels broken on purpose, a lint of the shaders, and whole trainings
(worlds a thousandth and ten thousand times as large, turned, shifted; one photo; three
points; flat, doubled and collapsed clouds; a camera inside a Gaussian; black, white
and gray photos; 100,000 Gaussians in one tile; a strip as wide as 8K): some hundred
iterations each. A whole 8K photo trains one iteration there, which takes half a minute
without a GPU. Georeferenced coordinates, color
conversions and files have their own tests in `tests/cli` and `src/color`.

This file is written by `WRITE_DOCS=1 cargo test --release --test stability`.
";

const KERNELS: &str = "## Kernels on random inputs

The worst input of each row; `gs-chroma doctor` measures these as well.
";

#[test]
fn every_case_holds() {
    let diagnosis = Diagnosis::of(gpu(), &mut |_, _| {}).unwrap();
    let table = diagnosis.case_table();
    let kernels = measured::table(&diagnosis.kernels);
    println!("{table}\n{kernels}");
    if std::env::var_os("WRITE_DOCS").is_some() {
        let device = format!("{} ({})", diagnosis.adapter, diagnosis.driver);
        std::fs::write(
            DOCS,
            format!("{HEADER}\nMeasured on {device}.\n\n{table}\n{KERNELS}\n{kernels}"),
        )
        .unwrap();
    }
    assert!(diagnosis.cases.len() >= 50);
    assert_eq!(diagnosis.failures(), 0, "{table}\n{kernels}");
}

#[test]
fn cases_have_names_of_their_own_and_stand_in_the_documentation() {
    let names: BTreeSet<_> = CASES.iter().map(|case| case.name).collect();
    assert_eq!(names.len(), CASES.len());
    let docs = std::fs::read_to_string(DOCS).unwrap();
    for name in names {
        assert!(
            docs.contains(&format!("| {name} |")),
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
