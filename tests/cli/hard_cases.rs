//! docs/hard-cases.md, which `doctor`'s test writes when it is asked to.

use std::fmt::Write;

use gs_chroma::{
    gpu::Gpu,
    low_level::doctor::{Diagnosis, Verdict, measured::Row},
};

const DOCS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/hard-cases.md");

const HEADER: &str = "# Hard cases

Scenes at which splat rasterizers break (`src/doctor/cases.rs`), and how far this one is
from the f64 oracle on them. *Picture error* is the largest of a pixel, in units of the
brightest one, at least 1. *Gradient error* is the largest relative L2 error of a group of
parameters against dual numbers. Where a † stands, one Gaussian is *poisoned*: it is culled
and counted, and nothing else may change by it. `gs-chroma doctor` runs all this on your
device. Bounds are the worst seen on the device below × 1.05, on others × 16; those of
cases are at least 2e-6.

f32 shows in 65,600 tiles, whose coordinates go beyond a million pixels in steps of 1/16,
and in a needle across the pixels, where the exponent is a small difference of large terms
([lab](lab/02-rasterizer.md)).

`tests/device/stability` also poisons every parameter of Gaussians and every number of COLMAP
models, breaks kernels on purpose, lints the shaders, and trains some hundred iterations
each of worlds a thousandth and ten thousand times as large, turned, shifted; one photo;
three points; flat, doubled and collapsed clouds; a camera inside a Gaussian; black, white
and gray photos; 100,000 Gaussians in one tile; a strip as wide as 8K. A whole 8K photo
trains one iteration, half a minute without a GPU. `tests/cli` and `src/color` test
georeferenced coordinates, color conversions and files.

`WRITE_DOCS=1 cargo test --test cli doctor_says` writes this page.
";

const KERNELS: &str = "## Kernels on random inputs

The worst input of each row, where x is the oracle's value; bounds are rounded. Gradients are
also bounded as a whole. A first cell without a name continues the kernel above.
`gs-chroma doctor` also prints how many inputs there are, and how much of the bound was used.
";

/// The cases, with less than `doctor` prints of them.
fn case_table(cases: &[Verdict]) -> String {
    let mut text = String::from(
        "| case | what goes wrong elsewhere | picture error (bound) | gradient error (bound) |\n\
         |---|---|--:|--:|\n",
    );
    for case in cases {
        let mark = if case.poisoned > 0 { " †" } else { "" };
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {} | {}{mark} | {:.1e} ({:.1e}) | {:.1e} ({:.1e}) |",
            case.name,
            case.trouble,
            case.picture_error,
            case.picture_bound,
            case.gradient_error,
            case.gradient_bound,
        );
    }
    text
}

/// The kernels, likewise.
fn kernel_table(rows: &[Row]) -> String {
    let mut text = String::from(
        "| kernel | what | largest error | bound | relative L2 (bound) |\n\
         |---|---|--:|---|--:|\n",
    );
    let mut above = "";
    for row in rows {
        let kernel = if row.kernel == above { "" } else { row.kernel };
        above = row.kernel;
        let bound = row.bound.replace("0.0e0 + ", "");
        let whole = bound.strip_prefix("L2 ").and_then(|b| b.split_once("; "));
        let (bound, l2) = match whole {
            Some((l2, bound)) => (bound, format!("{:.2e} ({l2})", row.relative_l2)),
            None => (bound.as_str(), String::new()),
        };
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {kernel} | {} | {:.2e} | {bound} | {l2} |",
            row.what, row.largest_error,
        );
    }
    text
}

/// Measures all cases and kernels and writes the page.
pub fn write() {
    let gpu = Gpu::open().expect("a device");
    let diagnosis = Diagnosis::of(&gpu, &mut |_, _| {}).expect("a diagnosis");
    assert_eq!(diagnosis.failures(), 0);
    let device = format!("{} ({})", diagnosis.adapter, diagnosis.driver);
    let cases = case_table(&diagnosis.cases);
    let kernels = kernel_table(&diagnosis.kernels);
    let page = format!("{HEADER}\nMeasured on {device}.\n\n{cases}\n{KERNELS}\n{kernels}");
    std::fs::write(DOCS, page).expect("writable");
}
