//! docs/experiments/hard-cases.csv and kernels.csv, which `doctor`'s test writes when it is asked to.

use std::fs;

use gs_chroma::{
    gpu::Gpu,
    low_level::doctor::{Diagnosis, Verdict, measured::Row},
};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/experiments");
const COMMAND: &str = "WRITE_DOCS=1 cargo test --test cli doctor_says";

/// The cases. Errors of a picture are in units of its brightest pixel, at least 1; those of
/// gradients are the largest relative L2 of a group of parameters.
fn cases(cases: &[Verdict]) -> String {
    let head = "case,what goes wrong elsewhere,poisoned Gaussians,picture error,picture bound,gradient error,gradient bound";
    let rows = cases.iter().map(|case| {
        format!(
            "{},{},{},{:.1e},{:.1e},{:.1e},{:.1e}",
            quoted(case.name),
            quoted(case.trouble),
            case.poisoned,
            case.picture_error,
            case.picture_bound,
            case.gradient_error,
            case.gradient_bound,
        )
    });
    table(head, rows)
}

/// The kernels on random inputs; x is the oracle's value.
fn kernels(rows: &[Row]) -> String {
    let head = "kernel,what,inputs,largest error,relative L2,bound";
    let rows = rows.iter().map(|row| {
        format!(
            "{},{},{},{:.2e},{:.2e},{}",
            quoted(row.kernel),
            quoted(&row.what),
            row.inputs,
            row.largest_error,
            row.relative_l2,
            quoted(&row.bound),
        )
    });
    table(head, rows)
}

fn table(head: &str, rows: impl Iterator<Item = String>) -> String {
    let lines: Vec<String> = [head.to_owned()].into_iter().chain(rows).collect();
    lines.join("\n") + "\n"
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

/// Measures all cases and kernels and writes the files.
pub fn write() {
    let gpu = Gpu::open().expect("a device");
    let diagnosis = Diagnosis::of(&gpu, &mut |_, _| {}).expect("a diagnosis");
    assert_eq!(diagnosis.failures(), 0);
    let device = format!("{} ({})", diagnosis.adapter, diagnosis.driver);
    for (name, table) in [
        ("hard-cases", cases(&diagnosis.cases)),
        ("kernels", kernels(&diagnosis.kernels)),
    ] {
        let text = format!("# {COMMAND}; {device}\n{table}");
        fs::write(format!("{FOLDER}/{name}.csv"), text).expect("writable");
    }
}
