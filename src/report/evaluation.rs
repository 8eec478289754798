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

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Native => "native",
            Self::Exported => "exported",
            Self::Teacher => "teacher",
            Self::RgbSplats => "RGB splats",
            Self::ChromadistillPaper => "ChromaDistill, paper",
            Self::ChromadistillCode => "ChromaDistill, code",
            Self::PerFrame => "per frame",
            Self::Photo => "photo",
        })
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
    /// Peak signal-to-noise ratio in dB.
    pub psnr: f64,
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

/// A table: title, head, rows and what has to be said below it.
pub struct Table {
    /// What it shows.
    pub title: String,
    /// Names of the columns.
    pub head: Vec<String>,
    /// The rows.
    pub rows: Vec<Vec<String>>,
    /// What has to be known to read it, a line each.
    pub notes: Vec<String>,
}

impl Evaluation {
    /// The evaluation as indented JSON.
    pub fn to_json(&self) -> String {
        // Plain structs with string keys: serializing them cannot fail.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// Quality and consistency as tables.
    pub fn tables(&self) -> [Table; 2] {
        [self.quality_table(), self.consistency_table()]
    }

    fn quality_table(&self) -> Table {
        let head = [
            "pictures",
            "PSNR",
            "SSIM",
            "ΔE00",
            "95 %",
            "a/b error",
            "colorful",
            "colors",
            "gray PSNR",
            "sharp",
            "LPIPS",
        ];
        let luma = vec![
            "luma".to_owned(),
            format!("{:.2}", self.luma.psnr),
            format!("{:.3}", self.luma.ssim),
            dash(),
            dash(),
            dash(),
            dash(),
            dash(),
            dash(),
            figure(Some(self.luma.psnr), 2),
            figure(Some(self.luma.sharpness), 0),
            figure(self.luma.lpips, 3),
        ];
        let colored = self.pictures.iter().map(|score| {
            vec![
                score.method.to_string(),
                figure(score.psnr, 2),
                figure(score.ssim, 3),
                figure(score.delta_e.map(|e| e.mean), 2),
                figure(score.delta_e.map(|e| e.percentile_95), 2),
                figure(score.ab_error, 2),
                figure(Some(score.colorfulness), 1),
                figure(Some(score.diversity), 1),
                figure(Some(score.gray_psnr), 2),
                figure(Some(score.sharpness), 0),
                figure(score.lpips, 3),
            ]
        });
        let which = if self.measured_on == "test" {
            "held-out"
        } else {
            "training"
        };
        let mut notes = vec![
            "PSNR in dB; a/b error: root mean square in CIELAB units, lightness taken from the photo."
                .to_owned(),
            "Colors: effective number of a/b squares five units wide; sharp: variance of the Laplacian of the gray picture, 0 to 255."
                .to_owned(),
        ];
        notes.extend(self.peers.iter().map(|peer| {
            format!(
                "{}: {} steps, {:.0} passes over a view, {:.1} s.",
                peer.method, peer.iterations, peer.passes, peer.seconds
            )
        }));
        notes.extend(self.bake.map(|bake| {
            format!(
                "Exported against native: ΔE00 {:.2}, 95 % {:.2}.",
                bake.mean, bake.percentile_95
            )
        }));
        Table {
            title: match self.views.len() {
                1 => format!("One {which} view against its photo"),
                count => format!("{count} {which} views against their photos"),
            },
            head: head.map(str::to_owned).to_vec(),
            rows: std::iter::once(luma).chain(colored).collect(),
            notes,
        }
    }

    fn consistency_table(&self) -> Table {
        let methods = |scores: &mut dyn Iterator<Item = Method>| {
            let mut methods: Vec<Method> = scores.collect();
            methods.sort();
            methods.dedup();
            methods
        };
        let path = self.path.consistency.iter().map(|c| c.score.method);
        let between = self.between.consistency.iter().map(|c| c.method);
        let methods = methods(&mut path.chain(between));
        let row = |name: String, scores: &[ConsistencyScore]| {
            let mut cells = vec![name];
            cells.extend(match scores.first() {
                Some(any) => [
                    any.pairs.to_string(),
                    format!("{:.0} %", 100.0 * any.visible),
                    any.values.to_string(),
                ],
                None => [dash(), dash(), dash()],
            });
            cells.extend(methods.iter().map(|method| {
                let score = scores.iter().find(|score| score.method == *method);
                score
                    .and_then(|score| Some(format!("{:.2} ({:.1e})", score.rms?, score.error?)))
                    .unwrap_or_else(dash)
            }));
            cells
        };
        let mut deltas: Vec<usize> = self.path.consistency.iter().map(|c| c.delta).collect();
        deltas.dedup();
        let mut rows: Vec<_> = deltas
            .into_iter()
            .map(|delta| {
                let at = self.path.consistency.iter().filter(|c| c.delta == delta);
                let scores: Vec<_> = at.map(|c| c.score).collect();
                row(format!("path, Δ = {delta}"), &scores)
            })
            .collect();
        rows.push(row(
            "photographed views".to_owned(),
            &self.between.consistency,
        ));
        let mut head: Vec<_> = ["consistency", "pairs", "visible", "values"]
            .map(str::to_owned)
            .to_vec();
        head.extend(methods.iter().map(Method::to_string));
        let mut notes = vec![
            format!(
                "Root mean square in CIELAB units, and in brackets the mean square of {}; denominator: {}.",
                self.rules.scale, self.rules.denominator
            ),
            format!(
                "Path of {} frames, {} flow; photographed views are a pair where {:.0} % or more is visible.",
                self.path.frames,
                self.path.flow,
                100.0 * self.between.least_overlap
            ),
            format!("Pixels are {}.", self.rules.mask),
        ];
        notes.extend(self.between.flow_error.map(|pixels| {
            format!(
                "Between photographed views the flow misses COLMAP's points by {pixels:.1} pixels (median)."
            )
        }));
        if !self.path.skipped.is_empty() {
            notes.push(format!(
                "The path is too short for Δ = {:?}.",
                self.path.skipped
            ));
        }
        Table {
            title: "Differences of a, b between views of one place".to_owned(),
            head,
            rows,
            notes,
        }
    }
}

fn dash() -> String {
    "–".to_owned()
}

fn figure(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(dash, |value| format!("{value:.digits$}"))
}

impl fmt::Display for Table {
    /// As Markdown with aligned columns.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = |column: usize| {
            let cells = self.rows.iter().map(|row| &row[column]);
            let all = cells.chain([&self.head[column]]);
            all.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.head.len()).map(width).collect();
        writeln!(f, "{}:\n", self.title)?;
        let line = |f: &mut fmt::Formatter<'_>, cells: &[String]| {
            for (column, (cell, width)) in cells.iter().zip(&widths).enumerate() {
                match column {
                    0 => write!(f, "| {cell:<width$} |")?,
                    _ => write!(f, " {cell:>width$} |")?,
                }
            }
            writeln!(f)
        };
        line(f, &self.head)?;
        for (column, width) in widths.iter().enumerate() {
            match column {
                0 => write!(f, "|{:-<1$}|", "", width + 2)?,
                _ => write!(f, "{:-<1$}:|", "", width + 1)?,
            }
        }
        writeln!(f)?;
        for row in &self.rows {
            line(f, row)?;
        }
        write!(f, "\n{}", self.notes.join("\n"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_aligned_markdown() {
        let table = Table {
            title: "Two".to_owned(),
            head: vec!["a".to_owned(), "ΔE00".to_owned()],
            rows: vec![vec!["long".to_owned(), "1.5".to_owned()]],
            notes: vec!["one".to_owned(), "two".to_owned()],
        };
        let want = "Two:\n\n| a    | ΔE00 |\n|------|-----:|\n| long |  1.5 |\n\none\ntwo";
        assert_eq!(table.to_string(), want);
    }
}
