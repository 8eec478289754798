//! What a run tells about itself: `report.json`, the contact sheet, and what `eval`
//! finds.
//! docs/run-folder.md describes every key.

mod contact_sheet;
mod effects;
mod evaluation;
mod evaluation_tables;
pub(crate) mod html;
mod page;
mod table;
mod timings;
mod verdict;

pub use contact_sheet::{Row, contact_sheet, to_image, write_text};
pub use effects::EffectReport;
pub use evaluation::{
    BetweenScore, ConsistencyScore, EVALUATION_VERSION, Evaluation, LumaScore, Method,
    PathConsistency, PathScore, PeerReport, PictureScore, Rules, ViewScore,
};
pub use page::{Figure, Flight, MAP_END, PageRow, error_map, evaluation_page};
pub use table::Table;
pub use timings::{KernelReport, kernel_reports, timings_table};

use std::fmt::Write;

use serde::{Deserialize, Deserializer, Serialize};

use crate::{
    capture::{Exposure, LoadOptions},
    chroma::{
        ChromaSettings,
        teacher::{TeacherInfo, Upsample},
    },
    luma::{CurvePoint, Goal, LumaSettings, Preset},
    measure::DeltaE,
};

/// Version of the report's layout; raised when a key changes its meaning.
pub const REPORT_VERSION: u32 = 2;

/// `report.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// [`REPORT_VERSION`].
    pub version: u32,
    /// Version of the program.
    pub program: String,
    /// What was photographed.
    pub capture: CaptureReport,
    /// What it ran on.
    pub device: DeviceReport,
    /// The preset that settings come from where nothing else was asked for.
    pub preset: Preset,
    /// What was decided about each effect of image formation.
    pub effects: Vec<EffectReport>,
    /// What `fit` found doubtful and did all the same.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// Stage 1.
    pub luma: LumaReport,
    /// Stage 2, once `colorize` has run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chroma: Option<ChromaReport>,
}

/// JSON has no NaN and is given `null`; a run that diverged can still be read.
fn number_or_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// What was photographed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaptureReport {
    /// The COLMAP folder, absolute.
    pub path: String,
    /// Views with a usable pose.
    pub views: usize,
    /// Views trained on.
    pub train: usize,
    /// Views held out.
    pub test: usize,
    /// Triangulated points.
    pub points: usize,
    /// Views or points left out, with the reason.
    pub rejected: Vec<String>,
    /// How the photos were loaded.
    #[serde(flatten)]
    pub load: LoadOptions,
    /// Views whose photo has a mask file.
    pub masked_views: usize,
    /// Pixels of all photos, at the files' sizes, whose values are not finite.
    pub not_finite: usize,
    /// Radius of the cameras as 3DGS takes it, in world units.
    pub extent: f64,
    /// What was subtracted from the world's coordinates, in world units.
    pub offset: [f64; 3],
    /// The files of the photos, in the order of their names.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub photos: Vec<PhotoReport>,
}

/// A photo's file as `fit` read it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct PhotoReport {
    /// Path below the folder of photos.
    pub name: String,
    /// The first 16 hexadecimal digits of its SHA-256: it is chance that they are to stand, not
    /// forgers.
    pub sha256: String,
}

/// What it ran on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DeviceReport {
    /// Adapter and driver.
    pub name: String,
    /// Vulkan, Metal or DX12.
    pub backend: String,
    /// Whether it is a software adapter.
    pub software: bool,
}

/// Stage 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LumaReport {
    /// What it was trained with.
    pub settings: LumaSettings,
    /// Iterations that led to the set that was kept, those of a run that went on included.
    pub iterations: usize,
    /// The iteration at which training went back to an earlier one, where it was best.
    pub given_up: Option<usize>,
    /// Gaussians at the end.
    pub splats: usize,
    /// How many of them, the last ones in `luma.ply`, are surroundings: a shell far around the
    /// scene, for what no photo shows.
    #[serde(default)]
    pub surroundings: usize,
    /// SHA-256 of the merged scene among which a block went on.
    #[serde(default)]
    pub around: Option<String>,
    /// Gaussians that the last views culled for values that are not finite.
    pub poisoned: usize,
    /// Gradients refused for not being finite, since the set last changed.
    pub refused: usize,
    /// Loss at the end.
    #[serde(deserialize_with = "number_or_nan")]
    pub loss: f64,
    /// What was to end the run; its seconds are those of all of it.
    pub goal: Goal,
    /// Wall seconds.
    pub seconds: LumaSeconds,
    /// Largest resident memory of the process in bytes, where the system tells.
    pub peak_host_memory: Option<u64>,
    /// Largest memory of the device's buffers in bytes, where the backend tells.
    pub peak_device_memory: Option<u64>,
    /// Bytes that a training of as many Gaussians as there are at the end was expected
    /// to take on the device at most.
    pub estimated_device_memory: u64,
    /// How bright each photo shows the scene, where they differ.
    pub exposures: Vec<ViewExposure>,
    /// What the training gained with time.
    pub curve: Vec<CurvePoint>,
    /// Views of which up to three were looked at for it, or all held-out ones where these have
    /// a PSNR to reach: `test`, or `train` without held-out ones.
    pub curve_on: String,
    /// Longer side at which held-out views were measured, where it is not that of training.
    pub measured_side: Option<u32>,
    /// Mean over the held-out views, if any.
    pub held_out: Option<LumaQuality>,
    /// Each held-out view.
    pub held_out_views: Vec<LumaView>,
    /// Where the device's time went, with `--timings`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timings: Option<Vec<KernelReport>>,
}

/// Wall seconds of stage 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LumaSeconds {
    /// Reading poses and photos, placing the first Gaussians.
    pub load: f64,
    /// Seconds of training.
    pub train: f64,
    /// Looking at views meanwhile.
    pub curve: f64,
    /// Measuring on held-out views.
    pub measure: f64,
    /// The whole run but for writing its files.
    pub all: f64,
}

/// Quality of gray pictures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LumaQuality {
    /// Peak signal-to-noise ratio in dB of the scene as viewers show it.
    pub psnr: f64,
    /// The same after the gain and offset that bring each picture closest to its photo; `None` in
    /// reports that do not know it.
    #[serde(default)]
    pub corrected_psnr: Option<f64>,
    /// Structural similarity of the scene as viewers show it.
    pub ssim: f64,
}

impl LumaQuality {
    /// PSNR in dB whatever the photo's exposure, where that is known.
    pub fn psnr_of_scene(&self) -> f64 {
        self.corrected_psnr.unwrap_or(self.psnr)
    }

    /// Both kinds of PSNR, in words.
    pub fn psnr_in_words(&self) -> String {
        let corrected = self.corrected_psnr.map_or(String::new(), |psnr| {
            format!(" ({psnr:.2} dB after each photo's own gain and offset)")
        });
        format!("PSNR {:.2} dB{corrected}", self.psnr)
    }
}

/// How bright a photo shows the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewExposure {
    /// The photo's name.
    pub name: String,
    /// Its gain and offset.
    #[serde(flatten)]
    pub exposure: Exposure,
}

/// One held-out view of stage 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LumaView {
    /// The photo's name.
    pub name: String,
    /// Its quality.
    #[serde(flatten)]
    pub quality: LumaQuality,
}

/// Stage 2.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChromaReport {
    /// All teachers, in the order of the command line.
    pub teachers: Vec<TeacherReport>,
    /// What the teachers' a and b were multiplied by.
    pub strength: f32,
    /// How answers smaller than the photo were enlarged.
    pub upsample: Upsample,
    /// Views with painted hints.
    pub hints: usize,
    /// The folder of hints, absolute; `None` without hints, and where it is no UTF-8.
    #[serde(default)]
    pub hint_folder: Option<String>,
    /// Share of the Gaussians that hints claim by half or more; `None` where none grew.
    #[serde(default)]
    pub claimed: Option<f64>,
    /// Held-out views that were painted by hand: colors were learned from them, and they were not
    /// measured.
    #[serde(default)]
    pub painted_held_out: Vec<String>,
    /// Views that colors were learned from and that a teacher colored or that have hints.
    pub colored_views: usize,
    /// How chroma was solved for.
    pub settings: ChromaSettings,
    /// Share of the Gaussians that no colored view shows to speak of; `None` of Adam.
    pub unseen: Option<f64>,
    /// What colors were multiplied by to be as strong as the teachers'.
    pub saturation: f64,
    /// Iterations of Adam, or rounds of least squares that were needed.
    pub iterations: usize,
    /// The last of them, counted from the start of stage 1.
    pub until: usize,
    /// Drawings of a view with their adjoints, those of coarser scales by their share of
    /// the pixels.
    pub passes: f64,
    /// How far the last round of least squares moved the colors, in CIELAB units; `None` of
    /// Adam, and where it was undone.
    pub moved: Option<f64>,
    /// What was decided about each effect of stage 2.
    pub effects: Vec<EffectReport>,
    /// What `colorize` found doubtful and did all the same.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// Loss at the end, in CIELAB units.
    #[serde(deserialize_with = "number_or_nan")]
    pub loss: f64,
    /// Wall seconds.
    pub seconds: ChromaSeconds,
    /// Largest resident memory of the process in bytes, where the system tells.
    pub peak_host_memory: Option<u64>,
    /// Largest memory of the device's buffers in bytes, where the backend tells.
    pub peak_device_memory: Option<u64>,
    /// Bytes of the device that solving and baking were expected to take at most.
    pub estimated_device_memory: u64,
    /// Views whose tile lists and wanted colors stayed on the device.
    pub pinned_views: usize,
    /// ΔE00 between the native picture and the exported file's.
    pub bake: ColorError,
    /// Views that the bake was measured on: `test`, or `train` without held-out ones.
    pub measured_on: String,
    /// Mean over those views of the exported file's pictures.
    pub pictures: ColorQuality,
    /// Each of them.
    pub views: Vec<ColorView>,
    /// Where the device's time went, with `--timings`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timings: Option<Vec<KernelReport>>,
}

/// A teacher.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TeacherReport {
    /// Name, kind and identity.
    #[serde(flatten)]
    pub info: TeacherInfo,
    /// Its file or folder, absolute, or its name in the catalog; `None` where that is no UTF-8.
    #[serde(default)]
    pub path: Option<String>,
    /// What its answers count beside the other teachers'.
    pub weight: f32,
}

/// Wall seconds of stage 2.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChromaSeconds {
    /// Asking the teacher.
    pub teacher: f64,
    /// Seconds of solving for a/b.
    pub distill: f64,
    /// Baking to RGB.
    pub bake: f64,
    /// Measuring, and drawing the contact sheet.
    pub measure: f64,
    /// From the start until files are written; 0 in reports of former versions.
    #[serde(default)]
    pub all: f64,
}

/// A color difference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ColorError {
    /// Mean ΔE00.
    pub mean: f64,
    /// Mean over the views of each view's 95th percentile.
    pub percentile_95: f64,
}

impl From<DeltaE> for ColorError {
    fn from(
        DeltaE {
            mean,
            percentile_95,
        }: DeltaE,
    ) -> Self {
        Self {
            mean,
            percentile_95,
        }
    }
}

/// Quality of colored pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ColorQuality {
    /// ΔE00 to the photo, where the photo has colors.
    pub delta_e: Option<ColorError>,
    /// Colorfulness (Hasler and Süsstrunk 2003).
    pub colorfulness: f64,
    /// Colorfulness of the teacher's picture.
    pub teacher_colorfulness: Option<f64>,
}

/// One colored picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColorView {
    /// The photo's name.
    pub name: String,
    /// Its quality.
    #[serde(flatten)]
    pub quality: ColorQuality,
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
        let quality = luma.held_out.map_or(String::new(), |quality| {
            format!(
                ", held-out {}, SSIM {:.3}",
                quality.psnr_in_words(),
                quality.ssim
            )
        });
        let given_up = luma.given_up.map_or(String::new(), |iteration| {
            format!(" (stopped at {iteration}, rolled back to the best)")
        });
        format!(
            "{} Gaussians after {} iterations{given_up}{quality}",
            luma.splats, luma.iterations
        )
    }

    /// What the training gained with time, as a table of at most so many rows; nothing
    /// where there was but one look.
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
            format!("; round {rounds} still moved colors by {moved:.2} units")
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
