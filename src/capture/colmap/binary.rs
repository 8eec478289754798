//! COLMAP's `.bin` files: little-endian records after a count of them.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use super::model::{IMAGE, LONGEST_NAME};
use super::records::RecordSource;
use super::tracks::Sighting;
use crate::capture::error::{CaptureError, Position};
use crate::capture::lens::ModelName;
use crate::input::{self, excerpt};

/// Bytes that a record takes at least.
const SMALLEST: [(&str, u64); 5] = [
    // Id, model, width, height and the 2 parameters of EQUIRECTANGULAR.
    ("camera", 4 + 4 + 8 + 8 + 2 * 8),
    (IMAGE, SMALLEST_IMAGE),
    // Id, position, color, error, a zero count.
    ("point", 8 + 3 * 8 + 3 + 8 + 8),
    // Id and number of sensors.
    ("rig", 4 + 4),
    // Id, rig, quaternion, translation, number of data.
    ("frame", 4 + 4 + 4 * 8 + 3 * 8 + 4),
];
/// Id, quaternion, translation, camera, an ended empty name, a zero count.
const SMALLEST_IMAGE: u64 = 4 + 4 * 8 + 3 * 8 + 4 + 1 + 8;
/// x, y and the point's id.
const OBSERVATION: u64 = 8 + 8 + 8;
/// An image's id and the index of its observation.
const TRACK_ELEMENT: u64 = 4 + 4;
/// The point's id of a 2D point that belongs to none.
const NO_POINT: u64 = u64::MAX;
/// Number of images that a file announces, if it is long enough for them.
pub(super) fn count_images(path: &Path) -> Option<u64> {
    let mut file = input::open(path).ok()?;
    let most = file.metadata().ok()?.len() / SMALLEST_IMAGE;
    let mut count = [0; 8];
    file.read_exact(&mut count).ok()?;
    Some(u64::from_le_bytes(count)).filter(|&count| count <= most)
}

/// A binary file as a sequence of records. Every read is checked against what
/// the file still holds.
pub(super) struct Records {
    path: PathBuf,
    reader: BufReader<File>,
    /// The file's length in bytes.
    length: u64,
    /// The next byte to read.
    offset: u64,
    /// Start of the field read last, in bytes, for errors.
    field: u64,
    /// Name of a record, for errors.
    kind: &'static str,
    /// Number of records that the file announces.
    count: u64,
    /// The current record, from 1; 0 before the first.
    current: u64,
}

impl Records {
    /// Opens a file and checks its count of records of this kind.
    pub fn open(path: &Path, kind: &'static str) -> Result<Self, CaptureError> {
        let file = input::open(path).map_err(CaptureError::read(path))?;
        let length = file.metadata().map_err(CaptureError::read(path))?.len();
        let smallest = SMALLEST.iter().find(|(known, _)| *known == kind);
        let smallest = smallest.map_or(1, |(_, bytes)| *bytes);
        let mut records = Self {
            path: path.into(),
            reader: BufReader::new(file),
            length,
            offset: 0,
            field: 0,
            kind,
            count: 0,
            current: 0,
        };
        let count = records.u64("the count")?;
        if count > records.remaining() / smallest {
            let reason = format!(
                "the file announces {count} records but its {length} bytes cannot hold them: it is cut off or damaged"
            );
            return Err(records.malformed(reason));
        }
        records.count = count;
        Ok(records)
    }

    fn remaining(&self) -> u64 {
        self.length.saturating_sub(self.offset)
    }

    fn bytes<const N: usize>(&mut self, field: &str) -> Result<[u8; N], CaptureError> {
        self.field = self.offset;
        if self.remaining() < N as u64 {
            return Err(self.malformed(format!("the file ends within {field}: it is cut off")));
        }
        let mut bytes = [0; N];
        self.reader
            .read_exact(&mut bytes)
            .map_err(CaptureError::read(&self.path))?;
        self.offset += N as u64;
        Ok(bytes)
    }

    /// Number of elements of `size` bytes that follow; checks that the file can hold them.
    fn elements(&mut self, field: &str, size: u64, what: &str) -> Result<u32, CaptureError> {
        let count = self.u64(field)?;
        match u32::try_from(count) {
            Ok(fits) if count <= self.remaining() / size => Ok(fits),
            _ => Err(self.malformed(format!(
                "{count} {what} do not fit into the file: it is cut off or damaged"
            ))),
        }
    }
}

impl RecordSource for Records {
    /// After the last one nothing may follow.
    fn next(&mut self) -> Result<bool, CaptureError> {
        self.current += 1;
        if self.current <= self.count {
            return Ok(true);
        }
        self.field = self.offset;
        match self.remaining() {
            0 => Ok(false),
            more => Err(self.malformed(format!(
                "{more} bytes follow the last of {} records",
                self.count
            ))),
        }
    }

    fn u8(&mut self, field: &str) -> Result<u8, CaptureError> {
        self.bytes(field).map(u8::from_le_bytes)
    }

    fn u32(&mut self, field: &str) -> Result<u32, CaptureError> {
        self.bytes(field).map(u32::from_le_bytes)
    }

    fn u64(&mut self, field: &str) -> Result<u64, CaptureError> {
        self.bytes(field).map(u64::from_le_bytes)
    }

    fn f64(&mut self, field: &str) -> Result<f64, CaptureError> {
        self.bytes(field).map(f64::from_le_bytes)
    }

    fn model(&mut self) -> Result<Result<ModelName, String>, CaptureError> {
        let number = self.bytes("the model").map(i32::from_le_bytes)?;
        Ok(ModelName::numbered(number).ok_or_else(|| format!("number {number}")))
    }

    fn skip(&mut self) -> bool {
        false
    }

    fn check_parameters(&self, _: ModelName) -> Result<(), CaptureError> {
        Ok(())
    }

    /// A UTF-8 string that a zero byte ends.
    fn name(&mut self) -> Result<String, CaptureError> {
        self.field = self.offset;
        let mut name = Vec::new();
        let longest = self.remaining().min(LONGEST_NAME as u64);
        (&mut self.reader)
            .take(longest)
            .read_until(0, &mut name)
            .map_err(CaptureError::read(&self.path))?;
        let length = name.len() as u64;
        if name.pop() != Some(0) {
            return Err(self.malformed("the name does not end".into()));
        }
        let name = String::from_utf8(name).map_err(|error| {
            let name = String::from_utf8_lossy(error.as_bytes());
            self.bad_name(format!("the name {:?} is not UTF-8 text", excerpt(&name)))
        })?;
        self.offset += length;
        Ok(name)
    }

    fn sightings(&mut self) -> Result<Vec<Sighting>, CaptureError> {
        let count = self.elements("the number of observations", OBSERVATION, "observations")?;
        let mut seen = Vec::new();
        for index in 0..count {
            let pixel = self.f64s("an observation")?;
            let point = self.u64("an observation")?;
            if point != NO_POINT {
                seen.push(Sighting {
                    index,
                    point,
                    pixel,
                });
            }
        }
        Ok(seen)
    }

    fn track_length(&mut self) -> Result<u32, CaptureError> {
        self.elements("the track's length", TRACK_ELEMENT, "track elements")
    }

    fn is_camera(&mut self) -> Result<bool, CaptureError> {
        Ok(self.u32("the sensor's kind")? == 0)
    }

    fn place(&self) -> (PathBuf, String, Position) {
        let record = match self.current {
            0 => "header".into(),
            current => format!(
                "{} {} of {}",
                self.kind,
                current.min(self.count),
                self.count
            ),
        };
        (self.path.clone(), record, Position::Byte(self.field))
    }
}
