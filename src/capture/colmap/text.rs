//! COLMAP's `.txt` files: a record a line (two for an image), `#` comments.

use std::borrow::Cow;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::model::IMAGE;
use super::records::RecordSource;
use super::tracks::Sighting;
use crate::capture::error::{CaptureError, Position};
use crate::capture::lens::ModelName;
use crate::input::{self, excerpt};

/// Byte order mark that some editors write before the text.
const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();

/// Number of images in a file.
pub(super) fn count_images(path: &Path) -> Result<u64, CaptureError> {
    let mut lines = Lines::open(path, IMAGE)?;
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

/// Text after the first `count` fields of a line, trimmed.
fn after_fields(line: &str, count: usize) -> &str {
    (0..count).fold(line.trim(), |rest, _| {
        rest.find(char::is_whitespace)
            .map_or("", |end| rest[end..].trim_start())
    })
}

/// A text file, line by line.
pub(super) struct Lines {
    path: PathBuf,
    reader: BufReader<File>,
    /// The current line as it stands in the file.
    bytes: Vec<u8>,
    /// And as text.
    line: String,
    /// The first byte of it that was not read.
    at: usize,
    /// The current line's number, from 1.
    number: u64,
    /// Name of a record, for errors.
    kind: &'static str,
    /// The current record, from 1; 0 before the first.
    current: u64,
}

impl Lines {
    pub fn open(path: &Path, kind: &'static str) -> Result<Self, CaptureError> {
        let file = input::open(path).map_err(CaptureError::read(path))?;
        Ok(Self {
            path: path.into(),
            reader: BufReader::new(file),
            bytes: Vec::new(),
            line: String::new(),
            at: 0,
            number: 0,
            kind,
            current: 0,
        })
    }

    /// Goes to the next line; false at the file's end. Comments may have any encoding.
    fn next_line(&mut self) -> Result<bool, CaptureError> {
        self.number += 1;
        self.at = 0;
        self.bytes.clear();
        let length = (self.reader.read_until(b'\n', &mut self.bytes))
            .map_err(CaptureError::read(&self.path))?;
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

    /// The next field of the current line.
    fn field<T: FromStr>(&mut self, name: &str) -> Result<T, CaptureError> {
        let rest = self.line[self.at..].trim_start();
        let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
        self.at = self.line.len() - rest.len() + end;
        match &rest[..end] {
            "" => Err(self.malformed(format!("the line ends before {name}"))),
            field => (field.parse())
                .map_err(|_| self.malformed(format!("{:?} cannot be {name}", excerpt(field)))),
        }
    }

    /// Unread part of the current line, trimmed.
    fn rest(&self) -> &str {
        self.line[self.at..].trim()
    }
}

impl RecordSource for Lines {
    fn next(&mut self) -> Result<bool, CaptureError> {
        if !self.rest().is_empty() {
            let rest = excerpt(self.rest());
            return Err(self.malformed(format!("{rest:?} follows what the line announces")));
        }
        self.next_record()
    }

    fn u8(&mut self, field: &str) -> Result<u8, CaptureError> {
        self.field(field)
    }

    fn u32(&mut self, field: &str) -> Result<u32, CaptureError> {
        self.field(field)
    }

    fn u64(&mut self, field: &str) -> Result<u64, CaptureError> {
        self.field(field)
    }

    fn f64(&mut self, field: &str) -> Result<f64, CaptureError> {
        self.field(field)
    }

    fn model(&mut self) -> Result<Result<ModelName, String>, CaptureError> {
        let name: String = self.field("the model")?;
        Ok(ModelName::named(&name).ok_or_else(|| excerpt(&name).into_owned()))
    }

    fn skip(&mut self) -> bool {
        self.at = self.line.len();
        true
    }

    fn check_parameters(&self, model: ModelName) -> Result<(), CaptureError> {
        match self.rest().is_empty() {
            true => Ok(()),
            false => Err(self.malformed(format!(
                "{} has {} parameters, and more are there",
                model.name, model.parameters
            ))),
        }
    }

    /// The rest of the line: it may contain spaces.
    fn name(&mut self) -> Result<String, CaptureError> {
        let name = self.rest().to_owned();
        self.skip();
        Ok(name)
    }

    /// Those of the next line, which may be empty.
    fn sightings(&mut self) -> Result<Vec<Sighting>, CaptureError> {
        // A file without the second lines would lose every other image.
        let seen = match self.next_line()? {
            true => seen(&self.line),
            false => Some(Vec::new()),
        };
        self.skip();
        seen.ok_or_else(|| self.malformed(
            "this line should hold the observations, in threes, or be empty: an image takes two lines".into(),
        ))
    }

    fn track_length(&mut self) -> Result<u32, CaptureError> {
        let fields = self.rest().split_whitespace().count();
        Ok(fields.div_ceil(2) as u32)
    }

    fn is_camera(&mut self) -> Result<bool, CaptureError> {
        Ok(self.field::<String>("the sensor's kind")? == "CAMERA")
    }

    fn place(&self) -> (PathBuf, String, Position) {
        let record = format!("{} {}", self.kind, self.current.max(1));
        (self.path.clone(), record, Position::Line(self.number))
    }
}
