//! The change report: where each frame's colors come from, beside the film.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::{
    change_report::{ChangeReport, ChangedFrame, ChangedOutput, ChangedSource},
    out::timecode_of,
    shots::Shot,
};
use crate::{
    archive::NumberedName,
    capture::Film,
    disk,
    frames::{Strokes, WeightedColors},
    hash, input,
    report::{
        Report, Table, TeacherReport,
        html::{TAIL, escaped, head, push_table},
    },
    store::{Codec, StoreError, files, is_film},
};

/// Sources of a pixel's color, and what they are.
const SOURCES: [&str; 6] = [
    "scene",
    "teacher",
    "steadied",
    "interpolated",
    "spread",
    "painted",
];
const NOTES: [&str; 2] = [
    "Mean shares of the pixels by the source of their colors; frames of one row have most from the same. Each frame is in the JSON file.",
    "scene: one color for each place, from all frames. teacher: the network, in this frame alone. steadied: the network, drawn towards the frame before along optical flow. interpolated: carried along optical flow from other frames. spread: from what is around. painted: by hand.",
];

/// Shares of a picture's pixels by [`SOURCES`]; together 1.
pub(super) type Shares = [f64; SOURCES.len()];

/// Shares of a photo with a pose: the scene's by its weights, and of the rest what the photo before
/// has a say in; `taught` is true if a teacher was asked.
pub(super) fn placed(
    seen: &WeightedColors,
    before: Option<&WeightedColors>,
    taught: bool,
    strokes: Option<&Strokes>,
) -> Shares {
    let steadied = before.map_or(0.0, |before| {
        let open = before.weight.iter().zip(&seen.weight);
        let sum: f64 = open.map(|(b, c)| f64::from(b * (1.0 - c))).sum();
        sum / seen.weight.len().max(1) as f64
    });
    let scene = seen.share();
    let rest = (1.0 - scene - steadied).max(0.0);
    let shares = match taught {
        true => [scene, rest, steadied, 0.0, 0.0, 0.0],
        false => [scene, 0.0, 0.0, steadied, rest, 0.0],
    };
    painted_over(shares, strokes)
}

/// Shares of a photo without a pose, of which `carried` is known from others.
pub(super) fn unplaced(carried: f64, taught: bool, strokes: Option<&Strokes>) -> Shares {
    let shares = match taught {
        true => [0.0, 1.0 - carried, 0.0, carried, 0.0, 0.0],
        false => [0.0, 0.0, 0.0, carried, 1.0 - carried, 0.0],
    };
    painted_over(shares, strokes)
}

/// Strokes lie over what the scene leaves open.
fn painted_over(mut shares: Shares, strokes: Option<&Strokes>) -> Shares {
    let open = 1.0 - shares[0];
    let painted = strokes.map_or(0.0, Strokes::share).min(open);
    if painted > 0.0 {
        shares[1..]
            .iter_mut()
            .for_each(|share| *share *= 1.0 - painted / open);
        shares[5] = painted;
    }
    shares
}

/// A frame and the sources of its colors.
#[derive(Clone, Copy)]
pub(super) struct FrameSources {
    /// Its place among all.
    pub index: usize,
    /// True if it has a pose.
    pub pose: bool,
    pub shares: Shares,
}

impl FrameSources {
    /// The source of most pixels.
    fn main(&self) -> Option<usize> {
        (0..SOURCES.len()).max_by(|&a, &b| self.shares[a].total_cmp(&self.shares[b]))
    }
}

/// All that a report is made of.
pub(super) struct Changes<'a> {
    pub output: &'a Path,
    /// The folder of hints that is named.
    pub hints: Option<&'a Path>,
    /// What was asked for.
    pub settings: Value,
    pub report: &'a Report,
    pub film: Option<&'a Film>,
    /// The COLMAP folder.
    pub root: &'a Path,
    pub codec: Codec,
    pub rate: [u32; 2],
    /// Teachers that were asked about frames.
    pub teachers: Vec<TeacherReport>,
    pub shots: &'a [Shot],
    pub frames: Vec<FrameSources>,
}

impl Changes<'_> {
    /// Writes JSON and page beside the output, as `colored.changes.json` beside `colored.mov`;
    /// gives the path of the JSON.
    pub fn write(mut self) -> Result<PathBuf, StoreError> {
        self.frames.sort_by_key(|frame| frame.index);
        let output = self.output;
        // A folder may be named by dots.
        let whole = output.canonicalize().map_err(files::at(output))?;
        let place = output.file_name().map_or(&*whole, |_| output);
        let name = match is_film(output) {
            true => place.file_stem(),
            false => place.file_name(),
        };
        let name = name.unwrap_or_default().to_string_lossy();
        let beside = |kind: &str| place.with_file_name(format!("{name}.changes.{kind}"));
        let report = serde_json::to_value(self.report())
            .map_err(|error| StoreError::file(&beside("json"), error.to_string()))?;
        files::write(&beside("html"), self.page(&report).as_bytes())?;
        files::write(&beside("json"), format!("{report:#}\n").as_bytes())?;
        Ok(beside("json"))
    }

    fn report(&self) -> ChangeReport {
        let (output, film) = (self.output, self.film);
        let text = |path: &Path| path.to_string_lossy().into_owned();
        let code = film.and_then(timecode_of);
        let chroma = self.report.chroma.as_ref();
        let noted = chroma.and_then(|chroma| chroma.hint_folder.clone());
        let frames = self.frames.iter().map(|frame| {
            let [scene, teacher, steadied, interpolated, spread, painted] = frame.shares;
            ChangedFrame {
                number: frame.index + 1,
                name: self.shots[frame.index].output.clone(),
                timecode: code.map(|code| code.after(frame.index as u64).to_string()),
                pose: frame.pose,
                scene,
                teacher,
                steadied,
                interpolated,
                spread,
                painted,
            }
        });
        ChangeReport {
            program: env!("CARGO_PKG_VERSION"),
            source: ChangedSource {
                path: text(film.map_or(self.root, |film| &film.source)),
                sha256: film.and_then(hash_of_film),
                frame_rate: film.map(|film| film.frame_rate),
                start: film.map(|film| film.start),
                signal: film.and_then(|film| film.signal.clone()),
            },
            output: ChangedOutput {
                path: text(output),
                sha256: is_film(output).then(|| hash_of_file(output)).flatten(),
                codec: self.codec,
                frame_rate: self.rate,
                timecode: code.map(|code| code.at_rate(self.rate).to_string()),
                field_order: "progressive",
            },
            frames: frames.collect(),
            scene: self.report.files.clone(),
            scene_teachers: chroma.map(|chroma| chroma.teachers.clone()),
            hints: self.hints.map(text).or(noted),
            teachers: self.teachers.clone(),
            settings: self.settings.clone(),
        }
    }

    /// A page of two tables: ranges of frames, and sources.
    fn page(&self, report: &Value) -> String {
        let mut html = head("Changes");
        html += &format!(
            "<h1>{}</h1>\n<p class=\"note\">These colors are not in the source: gs-chroma {} kept each frame's lightness and added color from the sources below. Frames are progressive, with square pixels.</p>\n",
            escaped(&self.output.to_string_lossy()),
            env!("CARGO_PKG_VERSION"),
        );
        push_table(&mut html, &self.ranges(report));
        push_table(&mut html, &sources(report));
        html + TAIL
    }

    /// Frames that follow each other and have most colors from the same source, in a row.
    fn ranges(&self, report: &Value) -> Table {
        let key = |frame: &FrameSources| (frame.pose, frame.main(), frame.shares[5] > 0.0);
        let follows =
            |a: &FrameSources, b: &FrameSources| a.index + 1 == b.index && key(a) == key(b);
        let mut begin = 0;
        let rows = self.frames.chunk_by(follows).map(|frames| {
            let ends = [begin, begin + frames.len() - 1].map(|i| &report["frames"][i]);
            begin += frames.len();
            let range = |key: &str| {
                let [first, last] = ends.map(|end| plain(&end[key]));
                if first == last {
                    first
                } else {
                    format!("{first} to {last}")
                }
            };
            let pose = if frames[0].pose { "yes" } else { "no" };
            let mut cells = vec![
                range("number"),
                range("name"),
                range("timecode"),
                pose.to_owned(),
            ];
            cells.extend((0..SOURCES.len()).map(|source| {
                let sum: f64 = frames.iter().map(|frame| frame.shares[source]).sum();
                format!("{:.1} %", 100.0 * sum / frames.len() as f64)
            }));
            cells
        });
        let columns = ["frames", "names", "time code", "pose"];
        Table {
            title: "Frames".to_owned(),
            rows: rows.collect(),
            head: columns
                .iter()
                .chain(&SOURCES)
                .map(|name| (*name).to_owned())
                .collect(),
            notes: NOTES.map(str::to_owned).to_vec(),
        }
    }
}

/// Files that colors and pictures come from.
fn sources(report: &Value) -> Table {
    let row = |what: &str, file: &Value| {
        let name = if file["path"].is_null() {
            &file["name"]
        } else {
            &file["path"]
        };
        vec![what.to_owned(), plain(name), plain(&file["sha256"])]
    };
    let mut rows = Vec::new();
    for (what, key) in [
        ("source", "source"),
        ("teacher", "teachers"),
        ("teacher of the scene", "scene_teachers"),
        ("scene", "scene"),
        ("output", "output"),
    ] {
        match report[key].as_array() {
            Some(files) => rows.extend(files.iter().map(|file| row(what, file))),
            None => rows.push(row(what, &report[key])),
        }
    }
    rows.push(row("hints", &json!({ "name": report["hints"] })));
    Table {
        title: "Sources".to_owned(),
        head: ["what", "file", "SHA-256"].map(str::to_owned).to_vec(),
        rows,
        notes: vec!["Of the scene's files the first 16 digits.".to_owned()],
    }
}

/// A value as a table shows it.
fn plain(value: &Value) -> String {
    match value {
        Value::Null => "–".to_owned(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

fn hash_of_file(path: &Path) -> Option<String> {
    hash::of_file(input::open(path).ok()?).ok()
}

/// SHA-256 of a film's file, or of the shot's numbered pictures one after the other; none where one
/// is gone.
fn hash_of_film(film: &Film) -> Option<String> {
    let signal = film.signal.as_ref();
    let names = signal.and_then(|signal| signal.names.as_ref());
    let Some(name) = names.and_then(|names| NumberedName::parse(names)) else {
        return hash_of_file(&film.source);
    };
    let (folder, first) = (disk::folder_of(&film.source), signal?.first);
    let mut hasher = hash::Hasher::default();
    for number in first..first + film.frames.len() as u64 {
        let file = input::open(&folder.join(name.name(number))).ok()?;
        hasher.update_with(file).ok()?;
    }
    Some(hasher.finish())
}
