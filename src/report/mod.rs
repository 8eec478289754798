//! Reports of a run: `report.json`, the contact sheet, and the findings of `eval`.
//! docs/schemas describes every key.

mod chroma;
mod contact_sheet;
mod effects;
mod evaluation;
mod evaluation_tables;
pub(crate) mod html;
mod page;
mod table;
mod timings;
mod verdict;

pub use chroma::{ChromaReport, ChromaSeconds, ColorError, ColorQuality, ColorView, TeacherReport};
pub use contact_sheet::{Row, contact_sheet, to_image, write_text};
pub use effects::EffectReport;
pub use evaluation::{
    BetweenScore, ConsistencyScore, DetectionScore, EVALUATION_VERSION, Evaluation, LumaScore,
    Method, PathConsistency, PathScore, PeerReport, PictureScore, Rules, ViewScore,
};
pub use page::{Figure, Flight, PageRow, error_map, evaluation_page};
pub use table::Table;
pub use timings::{KernelReport, kernel_reports, timings_table};

use std::{fmt::Write, path::Path};

use serde::{Deserialize, Serialize};

use crate::{
    capture::{Dataset, Exposure, LoadOptions},
    gpu::Gpu,
    luma::{CurvePoint, Goal, LumaSettings, Preset},
};
use chroma::number_or_nan;
use table::figure;

/// Version of the report's layout; raised when a key changes its meaning.
pub const REPORT_VERSION: u32 = 2;

/// `report.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Report {
    /// Layout of the report; raised when a key changes its meaning.
    ///
    /// [`REPORT_VERSION`].
    pub version: u32,
    /// Version of gs-chroma.
    pub program: String,
    /// The photos and their poses.
    pub capture: CaptureReport,
    /// Graphics device of the run.
    pub device: DeviceReport,
    /// Source of settings that were not given.
    pub preset: Preset,
    /// The plan: each effect of image formation.
    pub effects: Vec<EffectReport>,
    /// Warnings of `fit`.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// The run's scenes, by which commands detect files of another run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<FileReport>,
    /// Stage 1.
    pub luma: LumaReport,
    /// Stage 2; missing before `colorize`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chroma: Option<ChromaReport>,
}

/// Photos and poses of the capture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct CaptureReport {
    /// The COLMAP folder, absolute.
    pub path: String,
    /// Views with a usable pose.
    pub views: usize,
    /// Views trained on.
    pub train: usize,
    /// Views held out.
    pub test: usize,
    /// Usable points of COLMAP's.
    pub points: usize,
    /// Photos and points left out, and why.
    pub rejected: Vec<String>,
    /// Options that the photos were loaded with.
    #[serde(flatten)]
    pub load: LoadOptions,
    /// Views whose photo has a mask.
    pub masked_views: usize,
    /// Pixels whose values are not finite.
    ///
    /// Of all photos at the files' sizes.
    pub not_finite: usize,
    /// 1.1 times the largest distance of a camera from their mean, in world units.
    ///
    /// Radius of the cameras as 3DGS takes it.
    pub extent: f64,
    /// True if all photos were taken from one place, and the scene has no depth.
    #[serde(default)]
    pub panorama: bool,
    /// Subtracted from COLMAP's x, y and z, in world units.
    pub offset: [f64; 3],
    /// The photos, by which commands detect changes.
    ///
    /// Sorted by name.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub photos: Vec<PhotoReport>,
}

impl CaptureReport {
    /// Report of a COLMAP folder, still without fingerprints of the photos.
    pub fn of(colmap_dir: &Path, dataset: &Dataset) -> Self {
        let capture = &dataset.capture;
        let path = std::fs::canonicalize(colmap_dir).unwrap_or_else(|_| colmap_dir.to_owned());
        Self {
            path: path.to_string_lossy().into_owned(),
            views: capture.views.len(),
            train: dataset.split.train.len(),
            test: dataset.split.test.len(),
            points: capture.points.len(),
            rejected: capture
                .rejected
                .iter()
                .map(|rejected| format!("{}: {}", rejected.name, rejected.reason))
                .collect(),
            load: dataset.options.clone(),
            masked_views: dataset.masked_views,
            not_finite: dataset.not_finite(),
            extent: dataset.extent,
            panorama: capture.is_panorama(),
            offset: capture.offset.to_array(),
            photos: Vec::new(),
        }
    }
}

/// A file of a run as it was written.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct FileReport {
    /// Name in the run's folder.
    pub name: String,
    /// First 16 digits of its SHA-256.
    ///
    /// Hexadecimal.
    pub sha256: String,
    /// Size, time of change and number of the file.
    ///
    /// As long as they are the same, it is not hashed again.
    pub stamp: String,
}

/// A photo as `fit` read it.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct PhotoReport {
    /// Path below the folder of photos.
    pub name: String,
    /// First 16 digits of its SHA-256.
    ///
    /// Hexadecimal. They are to stand chance, not forgers.
    pub sha256: String,
    /// Size, time of change and number of the file.
    ///
    /// As long as they are the same, it is not hashed again.
    #[serde(default)]
    pub stamp: String,
    /// First 16 digits of a SHA-256 of its camera and pose.
    ///
    /// Hexadecimal; empty in reports of former versions.
    #[serde(default)]
    pub pose: String,
}

/// Graphics device of the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct DeviceReport {
    /// Adapter and driver.
    pub name: String,
    /// `Vulkan`, `Metal` or `Dx12`.
    pub backend: String,
    /// True if it is a software adapter.
    pub software: bool,
}

impl DeviceReport {
    /// Report of a device.
    pub fn of(gpu: &Gpu) -> Self {
        Self {
            name: gpu.describe(),
            backend: format!("{:?}", gpu.info().backend),
            software: gpu.is_software(),
        }
    }
}

/// Stage 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LumaReport {
    /// Settings of the training.
    pub settings: LumaSettings,
    /// Iterations that led to the splats, earlier runs included.
    pub iterations: usize,
    /// Iterations done before rolling back to the best; `None`: never.
    pub given_up: Option<usize>,
    /// Gaussians at the end.
    pub splats: usize,
    /// Gaussians of these in the shell around the scene, last in `luma.ply`.
    ///
    /// They cover directions that no photo shows.
    #[serde(default)]
    pub surroundings: usize,
    /// SHA-256 of the merged scene among which a block went on.
    #[serde(default)]
    pub around: Option<String>,
    /// SHA-256 of what a job has planned of the block that was trained.
    #[serde(default)]
    pub plan: Option<String>,
    /// Gaussians × views culled as not finite; 0 if sound.
    ///
    /// Those of the last views, since the set last changed.
    pub poisoned: usize,
    /// Gradients not applied as not finite or too large; 0 if sound.
    ///
    /// Since the set last changed.
    pub refused: usize,
    /// 0.8 · L1 + 0.2 · (1 − SSIM), mean of the last iterations.
    ///
    /// Of grays from 0 to 1. JSON has `null` for what is not finite.
    #[serde(deserialize_with = "number_or_nan")]
    #[cfg_attr(test, schemars(with = "Option<f64>"))]
    pub loss: f64,
    /// Condition that ends the run, by `--time-limit` or `--target-psnr`.
    ///
    /// Its seconds count the whole run.
    pub goal: Goal,
    /// Wall time.
    pub seconds: LumaSeconds,
    /// Peak of the process's resident memory, in bytes.
    ///
    /// `None` where the system does not tell.
    pub peak_host_memory: Option<u64>,
    /// Peak of the device's buffers, in bytes.
    ///
    /// `None` where the backend does not tell.
    pub peak_device_memory: Option<u64>,
    /// Upper estimate for the Gaussians at the end, in bytes.
    pub estimated_device_memory: u64,
    /// Each photo's brightness: gain · luma + offset.
    ///
    /// Empty where they do not differ. Means of log gain and offset are 0; faces of one photo share
    /// theirs.
    pub exposures: Vec<ViewExposure>,
    /// Quality during training.
    ///
    /// Of up to three views, or of all held-out ones where these have a PSNR to reach.
    pub curve: Vec<CurvePoint>,
    /// Views of the curve: `test`, or `train` without held-out ones.
    pub curve_on: String,
    /// Longer side when measuring, in pixels; `None`: as trained.
    pub measured_side: Option<u32>,
    /// Mean over the held-out views, if any.
    pub held_out: Option<LumaQuality>,
    /// Each held-out view.
    pub held_out_views: Vec<LumaView>,
    /// Device time of each kernel, with `--timings`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timings: Option<Vec<KernelReport>>,
}

/// Wall seconds of stage 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LumaSeconds {
    /// Reading photos and placing the first Gaussians, in seconds.
    pub load: f64,
    /// Trials of the plan, in seconds; part of `load`.
    ///
    /// 0 in reports of former versions.
    #[serde(default)]
    pub trial: f64,
    /// Training, in seconds.
    pub train: f64,
    /// Looking at views meanwhile, in seconds.
    pub curve: f64,
    /// Measuring on held-out views, in seconds.
    pub measure: f64,
    /// From the start until files are written, in seconds.
    pub all: f64,
}

/// Quality of gray pictures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LumaQuality {
    /// PSNR of the scene as viewers show it, in dB; at most 100.
    pub psnr: f64,
    /// The same after each picture's best gain and offset, in dB.
    ///
    /// `None` in files that do not know it.
    #[serde(default)]
    pub corrected_psnr: Option<f64>,
    /// PSNR of the exported file in a viewer without antialiasing, in dB.
    ///
    /// Only where the scene is antialiased.
    #[serde(default)]
    pub plain_psnr: Option<f64>,
    /// Share of the photo's textured blocks that show less than 15 % of its detail.
    #[serde(default)]
    pub lost_detail: Option<f64>,
    /// Structural similarity, 1 for equal pictures.
    pub ssim: f64,
}

impl LumaQuality {
    /// PSNR in dB whatever the photo's exposure, where that is known.
    pub fn psnr_of_scene(&self) -> f64 {
        self.corrected_psnr.unwrap_or(self.psnr)
    }

    /// Quality on held-out views, in words.
    pub fn in_words(&self) -> String {
        let kinds = [Some(self.psnr), self.corrected_psnr, self.plain_psnr];
        format!(
            "{}, SSIM {:.3}",
            psnr_in_words("held-out", kinds),
            self.ssim
        )
    }
}

/// PSNR of some views in dB, in words: as shown, exposure-corrected, and in viewers without
/// antialiasing.
pub(crate) fn psnr_in_words(views: &str, [shown, corrected, plain]: [Option<f64>; 3]) -> String {
    let corrected = corrected.map(|psnr| format!(" ({psnr:.1} exposure-corrected)"));
    let plain = plain.map(|psnr| format!(", {psnr:.1} dB in viewers without antialiasing"));
    format!(
        "{views} PSNR {} dB{}{}",
        figure(shown, 1),
        corrected.unwrap_or_default(),
        plain.unwrap_or_default()
    )
}

/// Exposure of one photo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ViewExposure {
    /// The photo's name, or a face's.
    pub name: String,
    /// Its gain and offset.
    #[serde(flatten)]
    pub exposure: Exposure,
}

/// One held-out view of stage 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LumaView {
    /// The photo's name, or a face's.
    pub name: String,
    /// Its quality.
    #[serde(flatten)]
    pub quality: LumaQuality,
}

impl Report {
    /// The report as indented JSON.
    pub fn to_json(&self) -> String {
        // Plain structs with string keys: serializing them cannot fail.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// The bytes of `report.json`.
    pub fn to_file(&self) -> Vec<u8> {
        (self.to_json() + "\n").into_bytes()
    }

    /// Stage 1 on one line.
    pub fn luma_summary(&self) -> String {
        let luma = &self.luma;
        let quality = luma
            .held_out
            .map_or(String::new(), |quality| format!(", {}", quality.in_words()));
        let given_up = luma.given_up.map_or(String::new(), |iteration| {
            format!(" (stopped at {iteration}, rolled back to the best)")
        });
        format!(
            "{} Gaussians after {} iterations{given_up}{quality}",
            luma.splats, luma.iterations
        )
    }

    /// Gain of the training over time, as a table of at most `rows` rows; `None` for a single
    /// checkpoint.
    pub fn curve_table(&self, rows: usize) -> Option<String> {
        let curve = &self.luma.curve;
        if curve.len() < 2 {
            return None;
        }
        let every = curve.len().div_ceil(rows.max(1));
        // The last look is shown, so the first ones may not be.
        let skipped = (curve.len() - 1) % every;
        let mut table = String::from("  seconds  iteration  Gaussians     PSNR  dB per minute");
        let mut before: Option<&CurvePoint> = None;
        for point in curve[skipped..].iter().step_by(every) {
            // Writing to a string cannot fail.
            let _ = write!(
                table,
                "\n{:>9.1}{:>11}{:>11}{:>9.2}",
                point.seconds, point.iteration, point.splats, point.psnr
            );
            if let Some(before) = before {
                let minutes = (point.seconds - before.seconds) / 60.0;
                let _ = write!(table, "{:>+15.2}", (point.psnr - before.psnr) / minutes);
            }
            before = Some(point);
        }
        Some(table)
    }

    /// Stage 2 on one line.
    pub fn chroma_summary(&self) -> String {
        let Some(chroma) = &self.chroma else {
            return "not colored yet".to_owned();
        };
        let truth = chroma.pictures.delta_e.map_or(String::new(), |error| {
            format!(", ΔE00 to the photos {:.2}", error.mean)
        });
        let moved = chroma.moved.map_or(String::new(), |moved| {
            let rounds = chroma.iterations;
            format!("; colors still changed by {moved:.2} units in round {rounds}")
        });
        format!(
            "colored from {} views{truth}, export off by ΔE00 {:.2}{moved}",
            chroma.colored_views, chroma.bake.mean
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_that_diverged_can_be_read() {
        let diverged = LumaReport {
            loss: f64::NAN,
            ..LumaReport::default()
        };
        let text = serde_json::to_string(&diverged).expect("written");
        assert!(text.contains("\"loss\":null"), "{text}");
        let read: LumaReport = serde_json::from_str(&text).expect("read");
        assert!(read.loss.is_nan() && read.splats == diverged.splats);
    }
}
