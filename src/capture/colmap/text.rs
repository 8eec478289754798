//! COLMAP's `.txt` files: a record a line (two for an image), `#` comments.

use std::borrow::Cow;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::str::{FromStr, SplitWhitespace};

use glam::DVec3;

use super::rigs::{self, Poses, Source};
use super::tracks::{Sighting, Sightings};
use super::{Cameras, Chosen, Image, Point, lens, relative_name};
use crate::capture::error::{CaptureError, Position};
use crate::capture::lens::{MOST_PARAMETERS, ModelName};
use crate::input::{self, excerpt};

/// What some editors write before the text.
const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();

/// A record of the images file, for errors.
const IMAGE: &str = "image";

/// `CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]`
pub(super) fn cameras(path: &Path) -> Result<Cameras, CaptureError> {
    let mut lines = Lines::open(path, "camera")?;
    let mut cameras = Cameras::default();
    while lines.next_record()? {
        let mut fields = lines.fields();
        let id = lines.field(&mut fields, "the id")?;
        let name: String = lines.field(&mut fields, "the model")?;
        let Some(model) = ModelName::named(&name) else {
            let unknown = CaptureError::CameraModel {
                path: path.into(),
                camera_id: id,
                model: excerpt(&name).into_owned(),
            };
            (cameras.insert(id, Err(unknown))).map_err(|reason| lines.malformed(reason))?;
            continue;
        };
        let width = lines.field(&mut fields, "the width")?;
        let height = lines.field(&mut fields, "the height")?;
        let mut parameters = [0.0; MOST_PARAMETERS];
        let parameters = &mut parameters[..model.parameters];
        for parameter in &mut *parameters {
            *parameter = lines.field(&mut fields, "the parameters")?;
        }
        if fields.next().is_some() {
            return Err(lines.malformed(format!(
                "{name} has {} parameters, and more are there",
                model.parameters
            )));
        }
        let lens = lens(model, width, height, parameters);
        let lens = lens.map_err(|reason| lines.malformed(reason));
        (cameras.insert(id, lens)).map_err(|reason| lines.malformed(reason))?;
    }
    Ok(cameras)
}

/// `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME`, then a line of `X Y POINT3D_ID`
/// triples, which may be empty.
pub(super) fn images(
    path: &Path,
    cameras: &Cameras,
    chosen: Option<&Chosen>,
) -> Result<(Vec<Image>, Sightings), CaptureError> {
    let mut lines = Lines::open(path, IMAGE)?;
    let mut images = Vec::new();
    let mut sightings = Sightings::of_all(chosen.is_none());
    while lines.next_record()? {
        let mut fields = lines.fields();
        let id = lines.field(&mut fields, "the id")?;
        let quaternion = lines.numbers(&mut fields, "the quaternion")?;
        let translation = DVec3::from(lines.numbers::<3>(&mut fields, "the translation")?);
        let camera_id = lines.field(&mut fields, "the camera")?;
        let camera = cameras
            .place(camera_id)
            .map_err(|reason| lines.malformed(reason))?;
        // The name is the tenth field and may contain spaces.
        let name =
            relative_name(after_fields(&lines.line, 9)).map_err(|reason| lines.bad_name(reason))?;
        // A file without the second lines would lose every other image.
        let seen = if lines.next_line()? {
            seen(&lines.line).ok_or_else(|| lines.malformed(
                "this line should hold the observations, in threes, or be empty: an image takes two lines".into(),
            ))?
        } else {
            Vec::new()
        };
        if chosen.is_some_and(|chosen| !chosen.has(&name)) {
            continue;
        }
        sightings.insert(id, images.len(), seen);
        images.push(Image {
            id,
            name,
            quaternion,
            translation,
            camera,
        });
    }
    Ok((images, sightings))
}

/// How many images a file holds.
pub(super) fn count_images(path: &Path) -> Result<u64, CaptureError> {
    let mut lines = Lines::open(path, "image")?;
    while lines.next_record()? {
        lines.next_line()?;
    }
    Ok(lines.current)
}

/// The 2D points of an image that belong to a 3D point; none where the line is no
/// sequence of `X Y POINT3D_ID`.
fn seen(line: &str) -> Option<Vec<Sighting>> {
    /// The point's id of a 2D point that belongs to none.
    const NO_POINT: &str = "-1";
    let mut fields = line.split_whitespace();
    let mut seen = Vec::new();
    for index in 0.. {
        let Some(x) = fields.next() else { break };
        let (y, point) = (fields.next()?, fields.next()?);
        if point != NO_POINT {
            seen.push(Sighting {
                index,
                point: point.parse().ok()?,
                pixel: [x.parse().ok()?, y.parse().ok()?],
            });
        }
    }
    Some(seen)
}

/// `POINT3D_ID X Y Z R G B ERROR TRACK[]`, the track being pairs of an image's id and
/// the index of a 2D point.
pub(super) fn points(path: &Path, sightings: &Sightings) -> Result<Vec<Point>, CaptureError> {
    let mut lines = Lines::open(path, "point")?;
    let mut points = Vec::new();
    while lines.next_record()? {
        let mut fields = lines.fields();
        let id = lines.field(&mut fields, "the id")?;
        let position = DVec3::from(lines.numbers::<3>(&mut fields, "the position")?);
        let mut color = [0; 3];
        for channel in &mut color {
            *channel = lines.field(&mut fields, "the color")?;
        }
        lines.field::<f64>(&mut fields, "the error")?;
        let mut track = Vec::new();
        let mut shown = fields.clone().next().is_none();
        while fields.clone().next().is_some() {
            let image = lines.field(&mut fields, "the track")?;
            let index = lines.field(&mut fields, "the track")?;
            shown |= sightings.has(image);
            track.extend(sightings.observation(id, image, index));
        }
        if !shown {
            continue;
        }
        points.push(Point {
            position,
            color,
            track,
        });
    }
    Ok(points)
}

/// What follows the first `count` fields of a line, trimmed.
fn after_fields(line: &str, count: usize) -> &str {
    (0..count).fold(line.trim(), |rest, _| {
        rest.find(char::is_whitespace)
            .map_or("", |end| rest[end..].trim_start())
    })
}

/// The poses of images, from the files of rigs and frames.
pub(super) fn poses([of_rigs, of_frames]: [PathBuf; 2]) -> Result<Poses, CaptureError> {
    let words = |path: &Path, kind| Lines::open(path, kind).map(|lines| Words { lines, at: 0 });
    rigs::read(words(&of_rigs, "rig")?, words(&of_frames, "frame")?)
}

/// The fields of lines, one after the other.
struct Words {
    lines: Lines,
    /// The first byte of the line that was not read.
    at: usize,
}

impl Words {
    fn field<T: FromStr>(&mut self, name: &str) -> Result<T, CaptureError> {
        let line = &self.lines.line;
        let rest = line[self.at..].trim_start();
        let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
        self.at = line.len() - rest.len() + end;
        self.lines.field(&mut rest[..end].split_whitespace(), name)
    }
}

impl Source for Words {
    fn next(&mut self) -> Result<bool, CaptureError> {
        let rest = self.lines.line.get(self.at..).unwrap_or_default();
        if self.lines.current > 0 && !rest.trim().is_empty() {
            let reason = format!("{:?} follows what the line announces", excerpt(rest.trim()));
            return Err(self.lines.malformed(reason));
        }
        self.at = 0;
        self.lines.next_record()
    }

    fn integer(&mut self, _: usize, field: &str) -> Result<u64, CaptureError> {
        self.field(field)
    }

    fn is_camera(&mut self) -> Result<bool, CaptureError> {
        Ok(self.field::<String>("the sensor's kind")? == "CAMERA")
    }

    fn float(&mut self, field: &str) -> Result<f64, CaptureError> {
        self.field(field)
    }

    fn wrong(&self, reason: String) -> CaptureError {
        self.lines.malformed(reason)
    }
}

/// A text file, line by line.
struct Lines {
    path: PathBuf,
    reader: BufReader<File>,
    /// The current line as it stands in the file.
    bytes: Vec<u8>,
    /// And as text.
    line: String,
    /// The current line's number, from 1.
    number: u64,
    /// What a record is, for errors.
    kind: &'static str,
    /// The current record, from 1; 0 before the first.
    current: u64,
}

impl Lines {
    fn open(path: &Path, kind: &'static str) -> Result<Self, CaptureError> {
        let file = input::open(path).map_err(|source| CaptureError::Read {
            path: path.into(),
            source,
        })?;
        Ok(Self {
            path: path.into(),
            reader: BufReader::new(file),
            bytes: Vec::new(),
            line: String::new(),
            number: 0,
            kind,
            current: 0,
        })
    }

    /// Goes to the next line; false at the file's end. Comments may have any encoding.
    fn next_line(&mut self) -> Result<bool, CaptureError> {
        self.number += 1;
        self.bytes.clear();
        let length = (self.reader.read_until(b'\n', &mut self.bytes)).map_err(|source| {
            CaptureError::Read {
                path: self.path.clone(),
                source,
            }
        })?;
        let bytes = match self.bytes.strip_prefix(BYTE_ORDER_MARK) {
            Some(rest) if self.number == 1 => rest,
            _ => &self.bytes,
        };
        let text = String::from_utf8_lossy(bytes);
        let is_utf8 = matches!(text, Cow::Borrowed(_));
        self.line.clear();
        self.line.push_str(&text);
        if is_utf8 || self.line.trim_start().starts_with('#') {
            return Ok(length > 0);
        }
        let name = after_fields(&self.line, 9);
        if self.kind == IMAGE && !name.is_empty() {
            let reason = format!("the name {:?} is not UTF-8 text", excerpt(name));
            // The record that this line begins.
            self.current += 1;
            return Err(self.bad_name(reason));
        }
        Err(self.malformed("the line is not UTF-8 text".into()))
    }

    /// Goes to the next line that is neither empty nor a comment.
    fn next_record(&mut self) -> Result<bool, CaptureError> {
        while self.next_line()? {
            let line = self.line.trim_start();
            if !line.is_empty() && !line.starts_with('#') {
                self.current += 1;
                return Ok(true);
            }
        }
        Ok(false)
    }

    fn fields(&self) -> SplitWhitespace<'_> {
        self.line.split_whitespace()
    }

    /// The next field of the current line.
    fn field<T: FromStr>(
        &self,
        fields: &mut SplitWhitespace<'_>,
        name: &str,
    ) -> Result<T, CaptureError> {
        let field = fields
            .next()
            .ok_or_else(|| self.malformed(format!("the line ends before {name}")))?;
        field
            .parse()
            .map_err(|_| self.malformed(format!("{:?} cannot be {name}", excerpt(field))))
    }

    fn numbers<const N: usize>(
        &self,
        fields: &mut SplitWhitespace<'_>,
        name: &str,
    ) -> Result<[f64; N], CaptureError> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.field(fields, name)?;
        }
        Ok(values)
    }

    fn bad_name(&self, reason: String) -> CaptureError {
        CaptureError::ImageName {
            path: self.path.clone(),
            record: format!("{} {}", self.kind, self.current.max(1)),
            position: Position::Line(self.number),
            reason,
        }
    }

    fn malformed(&self, reason: String) -> CaptureError {
        CaptureError::Malformed {
            path: self.path.clone(),
            record: format!("{} {}", self.kind, self.current.max(1)),
            position: Position::Line(self.number),
            reason,
        }
    }
}
