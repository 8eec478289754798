//! What `eval` measures: `eval.json` and its tables. docs/run-folder.md describes
//! every key.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::ColorError;
use crate::measure::{Consistency, DENOMINATOR_RULE, MASK_RULE, SCALE_RULE};

/// Version of the evaluation's layout; raised when a key changes its meaning.
pub const EVALUATION_VERSION: u32 = 1;

/// Whose pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Luma and a/b blended apart, in CIELAB.
    Native,
    /// The exported file, as viewers show it.
    Exported,
    /// The photo's lightness with the teacher's a/b.
    Teacher,
    /// RGB splats on the same geometry, fitted to the teacher's pictures.
    RgbSplats,
    /// The same by the recipe of ChromaDistill's paper.
    ChromadistillPaper,
    /// The same by that of its released code.
    ChromadistillCode,
    /// The gray scene, drawn and then colored by the teacher frame by frame.
    PerFrame,
    /// The photo itself.
    Photo,
}

impl Method {
    /// Part of the names of its files.
    pub fn file_stem(self) -> &'static str {
        match self {
            Self::Native => "native",
            Self::Exported => "exported",
            Self::Teacher => "teacher",
            Self::RgbSplats => "rgb-splats",
            Self::ChromadistillPaper => "chromadistill-paper",
            Self::ChromadistillCode => "chromadistill-code",
            Self::PerFrame => "per-frame",
            Self::Photo => "photo",
        }
    }
}

impl Method {
    /// What its pictures are called, in tables and under pictures.
    pub fn name(self) -> &'static str {
        match self {
            Self::Native => "ours, native",
            Self::Exported => "ours",
            Self::Teacher => "teacher",
            Self::RgbSplats => "RGB splats",
            Self::ChromadistillPaper => "ChromaDistill, paper",
            Self::ChromadistillCode => "ChromaDistill, code",
            Self::PerFrame => "teacher per frame",
            Self::Photo => "photo",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// `eval.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// [`EVALUATION_VERSION`].
    pub version: u32,
    /// Version of the program.
    pub program: String,
    /// The COLMAP folder's name.
    pub scene: String,
    /// Who colored the photos, where `--teacher` names someone.
    pub teacher: Option<serde_json::Value>,
    /// Colorfulness of the teacher's pictures, mean over all photos that it colored.
    pub teacher_colorfulness: Option<f64>,
    /// Views that were measured: `test`, or `train` without held-out ones.
    pub measured_on: String,
    /// Gray pictures, mean over these views.
    pub luma: LumaScore,
    /// ΔE00 between native and exported pictures, mean over these views.
    pub bake: Option<ColorError>,
    /// Colored pictures, mean over these views.
    pub pictures: Vec<PictureScore>,
    /// Each of these views.
    pub views: Vec<ViewScore>,
    /// What other ways to color the scene took.
    pub peers: Vec<PeerReport>,
    /// How the figures of consistency come about.
    pub rules: Rules,
    /// What was found doubtful and done all the same.
    pub warnings: Vec<String>,
    /// Along a rendered path.
    pub path: PathScore,
    /// Between photographed views.
    pub between: BetweenScore,
    /// Wall seconds.
    pub seconds: f64,
}

/// Quality of gray pictures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LumaScore {
    /// Peak signal-to-noise ratio in dB of the scene as viewers show it.
    pub psnr: f64,
    /// The same after the gain and offset that bring the picture closest to the photo; `None` in
    /// files that do not know it.
    #[serde(default)]
    pub corrected_psnr: Option<f64>,
    /// Structural similarity.
    pub ssim: f64,
    /// Variance of the picture's Laplacian, on the scale of 0 to 255.
    pub sharpness: f64,
    /// That of the photo.
    pub photo_sharpness: f64,
    /// Learned perceptual distance, with `--lpips`.
    pub lpips: Option<f64>,
}

/// What coloring the scene in another way took.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PeerReport {
    /// Which way.
    pub method: Method,
    /// Rounds, or iterations of Adam.
    pub iterations: usize,
    /// Passes over a view at full size.
    pub passes: f64,
    /// Seconds, the teacher's not among them.
    pub seconds: f64,
}

/// Quality of one method's colored pictures; fidelity only where photos have colors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PictureScore {
    /// Whose pictures.
    pub method: Method,
    /// Peak signal-to-noise ratio of RGB in dB.
    pub psnr: Option<f64>,
    /// Structural similarity, mean of R, G and B.
    pub ssim: Option<f64>,
    /// ΔE00 to the photo.
    pub delta_e: Option<ColorError>,
    /// Root mean square of the differences of a and b, in CIELAB units.
    pub ab_error: Option<f64>,
    /// Colorfulness (Hasler and Süsstrunk 2003).
    pub colorfulness: f64,
    /// Effective number of colors; see [`color_diversity`](crate::measure::color_diversity).
    pub diversity: f64,
    /// Peak signal-to-noise ratio in dB of the picture's lightness, as gray, to the photo's.
    pub gray_psnr: f64,
    /// Variance of the Laplacian of that gray, on the scale of 0 to 255.
    pub sharpness: f64,
    /// Learned perceptual distance to the photo, with `--lpips`.
    pub lpips: Option<f64>,
}

/// One measured view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewScore {
    /// The photo's name.
    pub name: String,
    /// Its gray picture.
    pub luma: LumaScore,
    /// Its colored pictures.
    pub pictures: Vec<PictureScore>,
}

/// How the figures of consistency come about, in words.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rules {
    /// Which pixels are not compared.
    pub mask: String,
    /// What is squared.
    pub scale: String,
    /// What the sum is divided by.
    pub denominator: String,
}

impl Default for Rules {
    fn default() -> Self {
        Self {
            mask: MASK_RULE.to_owned(),
            scale: SCALE_RULE.to_owned(),
            denominator: DENOMINATOR_RULE.to_owned(),
        }
    }
}

/// Consistency along a rendered path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathScore {
    /// Frames of the path.
    pub frames: usize,
    /// Width and height of a frame in pixels.
    pub size: [u32; 2],
    /// `geometric`, or `files` with `--flow`.
    pub flow: String,
    /// Distances in frames for which the path is too short.
    pub skipped: Vec<usize>,
    /// One entry a distance and method.
    pub consistency: Vec<PathConsistency>,
}

/// One method's consistency at one distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathConsistency {
    /// Distance in frames.
    pub delta: usize,
    /// Whose pictures, and the figures.
    #[serde(flatten)]
    pub score: ConsistencyScore,
}

/// Consistency between photographed views.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BetweenScore {
    /// Views that were compared.
    pub views: usize,
    /// Width and height of the first one's pictures in pixels.
    pub size: [u32; 2],
    /// Share of visible pixels that makes a pair.
    pub least_overlap: f64,
    /// By how many pixels the flow misses COLMAP's points, median over visible ones.
    pub flow_error: Option<f64>,
    /// One entry a method.
    pub consistency: Vec<ConsistencyScore>,
}

/// One method's consistency.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConsistencyScore {
    /// Whose pictures.
    pub method: Method,
    /// Pairs of pictures.
    pub pairs: u64,
    /// Share of the pixels that were compared.
    pub visible: f64,
    /// The denominator: visible pixels × 2 channels.
    pub values: u64,
    /// Mean squared difference of a, b mapped to [0, 1].
    pub error: Option<f64>,
    /// Its root in CIELAB units.
    pub rms: Option<f64>,
}

impl ConsistencyScore {
    /// The figures of a sum.
    pub fn new(method: Method, sum: &Consistency) -> Self {
        Self {
            method,
            pairs: sum.pairs(),
            visible: sum.visible_share(),
            values: sum.values(),
            error: sum.error(),
            rms: sum.rms(),
        }
    }
}

impl Evaluation {
    /// The evaluation as indented JSON.
    pub fn to_json(&self) -> String {
        // Plain structs with string keys: serializing them cannot fail.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }
}
