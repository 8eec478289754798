//! Device time of each kernel, beside the least memory traffic.

use std::fmt::Write;

use serde::{Deserialize, Serialize};

use crate::{
    chroma,
    gpu::KernelTime,
    luma,
    raster::{self, Load},
};

/// Bytes of a word on the device.
const WORD: f64 = 4.0;

/// Bytes that a dispatch of `kernel` must read and write at least, each input read once;
/// `None` for a name that is no kernel's.
pub fn minimum_bytes(kernel: &str, load: &Load) -> Option<f64> {
    let words = raster::minimum_words(kernel, load)
        .or_else(|| luma::minimum_words(kernel, load))
        .or_else(|| chroma::minimum_words(kernel, load))?;
    Some(WORD * words)
}

/// One kernel's row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct KernelReport {
    /// Its name, as in `shaders/`.
    pub kernel: String,
    /// Number of dispatches.
    pub dispatches: u64,
    /// Total on the device, in seconds.
    ///
    /// Without timestamp queries on the host, each dispatch alone.
    pub seconds: f64,
    /// Share of all kernels' seconds.
    pub share: f64,
    /// Least that one dispatch reads and writes, in bytes.
    ///
    /// Each input is read once.
    pub minimum_bytes: f64,
}

/// The rows of a stage, those that took longest first.
pub fn kernel_reports(times: &[KernelTime], load: &Load) -> Vec<KernelReport> {
    let all: f64 = times.iter().map(|time| time.seconds).sum();
    let mut rows: Vec<_> = (times.iter())
        .map(|time| KernelReport {
            kernel: time.kernel.to_owned(),
            dispatches: time.dispatches,
            seconds: time.seconds,
            share: if all > 0.0 { time.seconds / all } else { 0.0 },
            minimum_bytes: minimum_bytes(time.kernel, load).unwrap_or_default(),
        })
        .collect();
    rows.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
    rows
}

/// The rows as a table for the terminal and for Markdown.
pub fn timings_table(rows: &[KernelReport]) -> String {
    let mut text = String::from(
        "| kernel             | dispatches |   ms each | share | MB at least |   GB/s |\n\
         |--------------------|-----------:|----------:|------:|------------:|-------:|\n",
    );
    for row in rows {
        let each = row.seconds / row.dispatches.max(1) as f64;
        let rate = if each > 0.0 {
            1e-9 * row.minimum_bytes / each
        } else {
            0.0
        };
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {:<18} | {:>10} | {:>9.4} | {:>4.1}% | {:>11.3} | {:>6.2} |",
            row.kernel,
            row.dispatches,
            1e3 * each,
            100.0 * row.share,
            1e-6 * row.minimum_bytes,
            rate,
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::RasterNumerics;

    const LOAD: Load = Load {
        splats: 1000.0,
        visible: 800.0,
        instances: 5000.0,
        capacity: 8000.0,
        pixels: 60_000.0,
        tiles: 240.0,
        channels: 1.0,
        sh_planes: 1.0,
        numerics: RasterNumerics::DEFAULT,
    };

    fn time(kernel: &'static str, dispatches: u64, seconds: f64) -> KernelTime {
        KernelTime {
            kernel,
            dispatches,
            seconds,
        }
    }

    #[test]
    fn shares_add_up_and_the_slowest_comes_first() {
        let rows = kernel_reports(&[time("shade", 2, 0.1), time("blend", 2, 0.3)], &LOAD);
        assert_eq!(rows[0].kernel, "blend");
        assert_eq!(
            [rows[0].share, rows[1].share].map(|s| (4.0 * s).round()),
            [3.0, 1.0]
        );
        // 9 words an entry, a color and a count a pixel.
        assert_eq!(rows[0].minimum_bytes, 4.0 * (9.0 * 5000.0 + 2.0 * 60_000.0));
        let table = timings_table(&rows);
        assert!(
            table.contains("| blend ") && table.contains(" 75.0% |"),
            "{table}"
        );
        // 0.66 MB in 150 ms.
        assert!(table.contains("0.660 |   0.00 |"), "{table}");
    }

    /// A kernel that is new has to say what it reads and writes.
    #[test]
    fn every_kernel_of_the_shaders_is_known() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/shaders");
        let mut kernels = 0;
        for file in std::fs::read_dir(folder).unwrap() {
            let path = file.unwrap().path();
            if path.is_dir() {
                continue;
            }
            let shader = std::fs::read_to_string(&path).unwrap();
            for entry in shader.split("@compute").skip(1) {
                let (_, name) = entry.split_once("fn ").unwrap();
                let (name, _) = name.split_once('(').unwrap();
                assert!(minimum_bytes(name, &LOAD).is_some(), "{name}");
                kernels += 1;
            }
        }
        assert!(kernels > 30, "{kernels}");
        assert_eq!(minimum_bytes("no_kernel", &LOAD), None);
    }

    #[test]
    fn nothing_timed_is_no_division_by_zero() {
        assert!(kernel_reports(&[], &LOAD).is_empty());
        let rows = kernel_reports(&[time("blend", 0, 0.0)], &LOAD);
        assert_eq!(rows[0].share, 0.0);
        assert!(!timings_table(&rows).contains("NaN"));
    }
}
