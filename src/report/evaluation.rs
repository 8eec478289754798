//! Results of `eval`: `eval.json` and its tables. docs/schemas describes every key.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::ColorError;
use crate::measure::{Consistency, DENOMINATOR_RULE, MASK_RULE, SCALE_RULE};

/// Version of the evaluation's layout; raised when a key changes its meaning.
pub const EVALUATION_VERSION: u32 = 1;

/// Method that made the pictures.
///
/// The order is that of rows in tables.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The gray scene.
    Luma,
    /// The exported file, as viewers show it.
    Exported,
    /// Luma and a/b blended apart, in CIELAB.
    Native,
    /// The photo's lightness with the teacher's a/b.
    Teacher,
    /// RGB splats on the same geometry, fitted to the teacher's pictures.
    RgbSplats,
    /// The same by the recipe of ChromaDistill's paper.
    ChromadistillPaper,
    /// The same at full size alone.
    ChromadistillOneScale,
    /// The same by the recipe of its released code.
    ChromadistillCode,
    /// The same on R, G and B in place of CIELAB.
    ChromadistillRgb,
    /// The gray scene, drawn and then colored by the teacher frame by frame.
    PerFrame,
    /// The photo itself.
    Photo,
    /// Another program, by the name that the user gave it.
    #[serde(untagged)]
    Other(String),
}

impl Method {
    /// Another program's pictures; `None` for a name that is a method's own.
    pub fn other(name: &str) -> Option<Self> {
        let other = Self::Other(name.to_owned());
        let read = serde_json::from_value(name.into()).ok();
        (read.as_ref() == Some(&other)).then_some(other)
    }

    /// Part of the names of its files.
    pub fn file_stem(&self) -> String {
        if let Self::Other(name) = self {
            return format!("against-{name}");
        }
        // A variant without contents: serializing it cannot fail.
        let name = serde_plain::to_string(self).unwrap_or_default();
        name.replace('_', "-")
    }

    /// Name of its pictures, in tables and under pictures.
    pub fn name(&self) -> &str {
        match self {
            Self::Luma => "luma",
            Self::Exported => "ours",
            Self::Native => "ours, native",
            Self::Teacher => "teacher",
            Self::RgbSplats => "RGB splats",
            Self::ChromadistillPaper => "ChromaDistill, paper",
            Self::ChromadistillOneScale => "ChromaDistill, one scale",
            Self::ChromadistillCode => "ChromaDistill, code",
            Self::ChromadistillRgb => "ChromaDistill, RGB",
            Self::PerFrame => "teacher per frame",
            Self::Photo => "photo",
            Self::Other(name) => name,
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
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Evaluation {
    /// Layout of the file; raised when a key changes its meaning.
    ///
    /// [`EVALUATION_VERSION`].
    pub version: u32,
    /// Version of gs-chroma.
    pub program: String,
    /// Name of the COLMAP folder.
    pub scene: String,
    /// Teacher that colored the photos, with `--teacher`.
    #[cfg_attr(test, schemars(with = "Option<crate::chroma::teacher::TeacherInfo>"))]
    pub teacher: Option<serde_json::Value>,
    /// Colorfulness of all pictures of the teacher, mean.
    pub teacher_colorfulness: Option<f64>,
    /// Colorfulness of the exported file's pictures of the same photos, mean.
    #[serde(default)]
    pub colorfulness: Option<f64>,
    /// Views measured: `test`, or `train` without held-out ones.
    pub measured_on: String,
    /// Gray pictures against gray photos, mean over these views.
    pub luma: LumaScore,
    /// `exported` against `native`, mean over these views.
    ///
    /// `None` without `chroma.npy`.
    pub bake: Option<ColorError>,
    /// Colored pictures of each method, mean over these views.
    pub pictures: Vec<PictureScore>,
    /// Each of these views.
    pub views: Vec<ViewScore>,
    /// Cost of `--baselines` and `--recipe`.
    pub peers: Vec<PeerReport>,
    /// Rules by which consistency is computed.
    pub rules: Rules,
    /// Warnings of `eval`.
    pub warnings: Vec<String>,
    /// Consistency along a rendered path.
    pub path: PathScore,
    /// Consistency between photographed views.
    pub between: BetweenScore,
    /// Wall time, in seconds.
    pub seconds: f64,
}

/// Quality of gray pictures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LumaScore {
    /// PSNR of the scene as viewers show it, in dB; at most 100.
    pub psnr: f64,
    /// The same after each picture's best gain and offset, in dB.
    ///
    /// `None` in files that do not know it.
    #[serde(default)]
    pub corrected_psnr: Option<f64>,
    /// PSNR of the exported file in a viewer without antialiasing, in dB.
    ///
    /// Mean over the held-out views, only where the scene is antialiased.
    #[serde(default)]
    pub plain_psnr: Option<f64>,
    /// Structural similarity, 1 for equal pictures.
    pub ssim: f64,
    /// Variance of the Laplacian, of grays from 0 to 255.
    pub sharpness: f64,
    /// Sharpness of the photo.
    pub photo_sharpness: f64,
    /// Learned perceptual distance, with `--lpips`.
    pub lpips: Option<f64>,
}

/// Cost of coloring the scene by another method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct PeerReport {
    /// Method of coloring.
    pub method: Method,
    /// Rounds of least squares, or iterations of Adam.
    pub iterations: usize,
    /// Passes over a view at full size.
    pub passes: f64,
    /// Wall time without the teacher's, in seconds.
    pub seconds: f64,
}

/// Quality of one method's colored pictures; fidelity only where photos have colors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct PictureScore {
    /// Method of the pictures; or a name given with `--against`.
    pub method: Method,
    /// PSNR of R, G and B together, in dB.
    pub psnr: Option<f64>,
    /// Structural similarity, mean of R, G and B.
    pub ssim: Option<f64>,
    /// Difference to the photo.
    pub delta_e: Option<ColorError>,
    /// Root mean square difference of a and b, in CIELAB units.
    ///
    /// Lightness and geometry do not enter.
    pub ab_error: Option<f64>,
    /// Hasler and Süsstrunk's, signed as they define it.
    ///
    /// On RGB from 0 to 255.
    pub colorfulness: f64,
    /// Effective number of colors.
    ///
    /// Exponential entropy over squares of five CIELAB units; see
    /// [`color_diversity`](crate::measure::color_diversity).
    pub diversity: f64,
    /// PSNR of the lightness, in dB.
    ///
    /// The picture's, as gray, to the photo's.
    pub gray_psnr: f64,
    /// Variance of the Laplacian of the lightness.
    ///
    /// Of grays from 0 to 255.
    pub sharpness: f64,
    /// Learned perceptual distance to the photo, with `--lpips`; to the teacher's picture where the
    /// photo is gray.
    pub lpips: Option<f64>,
}

/// One measured view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ViewScore {
    /// The photo's name, or a face's.
    pub name: String,
    /// Its gray picture.
    pub luma: LumaScore,
    /// Its colored pictures.
    pub pictures: Vec<PictureScore>,
}

/// Definitions of the consistency figures, in words.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Rules {
    /// Pixels that are not compared.
    pub mask: String,
    /// Values whose differences are squared.
    pub scale: String,
    /// Divisor of the sum.
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
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct PathScore {
    /// Frames of the path.
    pub frames: usize,
    /// Width and height of a frame, in pixels.
    pub size: [u32; 2],
    /// `geometric` from depth and poses, or `files` with `--flow`.
    pub flow: String,
    /// Distances too long for the path, in frames.
    pub skipped: Vec<usize>,
    /// One entry a distance and method.
    pub consistency: Vec<PathConsistency>,
    /// Frames of each method against gray ones of 8 bits, mean over the path.
    #[serde(default)]
    pub pictures: Vec<PictureScore>,
    /// Objects detected in the frames of each method, with `--detector`.
    #[serde(default)]
    pub detections: Vec<DetectionScore>,
}

/// Objects that a detector sees in one method's frames, with scores of 0.3 or more.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct DetectionScore {
    /// Method of the pictures.
    pub method: Method,
    /// Detections in a frame, mean.
    pub per_frame: f64,
    /// Score of a detection, mean.
    pub score: Option<f64>,
    /// Share of the detections with one of the same class in the next frame at the same place.
    ///
    /// Intersection over union of 0.5 or more; the motion between frames is not taken out.
    pub kept: Option<f64>,
}

/// One method's consistency at one distance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct PathConsistency {
    /// Distance of the two pictures, in frames.
    pub delta: usize,
    /// Method of the pictures, and the figures.
    #[serde(flatten)]
    pub score: ConsistencyScore,
}

/// Consistency between photographed views.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct BetweenScore {
    /// Views compared, at most 60.
    ///
    /// With a teacher those that it colored.
    pub views: usize,
    /// Width and height of the first view's pictures, in pixels.
    pub size: [u32; 2],
    /// Share of visible pixels that makes a pair.
    pub least_overlap: f64,
    /// Median distance of the flow from COLMAP's points, in pixels.
    ///
    /// What the scene's depth is worth.
    pub flow_error: Option<f64>,
    /// One entry a method.
    pub consistency: Vec<ConsistencyScore>,
}

/// One method's consistency.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ConsistencyScore {
    /// Method of the pictures.
    pub method: Method,
    /// Pairs of pictures.
    pub pairs: u64,
    /// Share of the pixels that were compared.
    pub visible: f64,
    /// The denominator: compared pixels × 2 channels.
    pub values: u64,
    /// Mean squared difference of a, b mapped to [0, 1].
    ///
    /// `None` where nothing is visible.
    pub error: Option<f64>,
    /// Its root times 255, in CIELAB units.
    pub rms: Option<f64>,
    /// `rms` at the teacher's colorfulness, in CIELAB units.
    ///
    /// Times the teacher's colorfulness over the method's own, both of `pictures`: as if the
    /// colors were made as strong. `None` without a teacher.
    #[serde(default)]
    pub equal_rms: Option<f64>,
}

impl ConsistencyScore {
    /// The figures of a sum.
    pub fn new(method: &Method, sum: &Consistency) -> Self {
        Self {
            method: method.clone(),
            pairs: sum.pairs(),
            visible: sum.visible_share(),
            values: sum.values(),
            error: sum.error(),
            rms: sum.rms(),
            equal_rms: None,
        }
    }

    /// `equal_rms` by the colorfulness of `pictures`.
    pub fn at_equal_colorfulness(&self, pictures: &[PictureScore]) -> Option<f64> {
        let strength =
            |method: &Method| Some(pictures.iter().find(|p| p.method == *method)?.colorfulness);
        let factor = strength(&Method::Teacher)? / strength(&self.method)?;
        Some(self.rms? * factor).filter(|_| factor.is_finite())
    }
}

impl Evaluation {
    /// The evaluation as indented JSON.
    pub fn to_json(&self) -> String {
        // Plain structs with string keys: serializing them cannot fail.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paler_colors_do_not_agree_better_at_equal_colorfulness() {
        let painted = |method: &str, colorfulness: f64| {
            serde_json::from_value(serde_json::json!({
                "method": method, "colorfulness": colorfulness,
                "diversity": 1.0, "gray_psnr": 30.0, "sharpness": 1.0,
            }))
        };
        let equal = |rms, own| {
            let mut score = ConsistencyScore::new(&Method::Exported, &Consistency::default());
            score.rms = Some(rms);
            let pictures = [painted("exported", own), painted("teacher", 20.0)];
            score.at_equal_colorfulness(&pictures.map(|picture| picture.expect("a score")))
        };
        assert_eq!(equal(2.0, 20.0), Some(2.0));
        // Half as strong, and for that alone half as far apart; then farther than that.
        assert_eq!(equal(1.0, 10.0), Some(2.0));
        assert_eq!(equal(1.2, 10.0), Some(2.4));
        assert_eq!(equal(1.0, 0.0), None);
    }
}
