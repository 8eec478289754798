//! COLMAP's `.bin` files: little-endian records after a count of them.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::rigs::{self, Poses, Source};
use super::tracks::{Sighting, Sightings};
use super::{Cameras, Chosen, Image, LONGEST_NAME, Point, lens, relative_name};
use crate::capture::error::{CaptureError, Position};
use crate::capture::lens::{MOST_PARAMETERS, ModelName};
use crate::input::{self, excerpt};

/// Id, model, width, height and the 2 parameters of EQUIRECTANGULAR.
const SMALLEST_CAMERA: u64 = 4 + 4 + 8 + 8 + 2 * 8;
/// Id, quaternion, translation, camera, an ended empty name, a zero count.
const SMALLEST_IMAGE: u64 = 4 + 4 * 8 + 3 * 8 + 4 + 1 + 8;
/// Id, position, color, error, a zero count.
const SMALLEST_POINT: u64 = 8 + 3 * 8 + 3 + 8 + 8;
/// x, y and the point's id.
const OBSERVATION: u64 = 8 + 8 + 8;
/// An image's id and the index of its observation.
const TRACK_ELEMENT: u64 = 4 + 4;
/// The point's id of a 2D point that belongs to none.
const NO_POINT: u64 = u64::MAX;
/// Id and number of sensors.
const SMALLEST_RIG: u64 = 4 + 4;
/// Id, rig, quaternion, translation, number of data.
const SMALLEST_FRAME: u64 = 4 + 4 + 4 * 8 + 3 * 8 + 4;

/// How many images a file announces, if it is long enough for them.
pub(super) fn count_images(path: &Path) -> Option<u64> {
    let mut file = input::open(path).ok()?;
    let most = file.metadata().ok()?.len() / SMALLEST_IMAGE;
    let mut count = [0; 8];
    file.read_exact(&mut count).ok()?;
    Some(u64::from_le_bytes(count)).filter(|&count| count <= most)
}

pub(super) fn cameras(path: &Path) -> Result<Cameras, CaptureError> {
    let mut records = Records::open(path, "camera", SMALLEST_CAMERA)?;
    let mut cameras = Cameras::default();
    while records.next_record() {
        let id = records.u32("the id")?;
        let number = records.i32("the model")?;
        // How long the record is only its model tells: no image's camera or not, what
        // follows cannot be read.
        let Some(model) = ModelName::numbered(number) else {
            return Err(CaptureError::CameraModel {
                path: path.into(),
                camera_id: id,
                model: format!("number {number}"),
            });
        };
        let (width, height) = (records.u64("the width")?, records.u64("the height")?);
        let mut parameters = [0.0; MOST_PARAMETERS];
        let parameters = &mut parameters[..model.parameters];
        for parameter in &mut *parameters {
            *parameter = records.f64("the parameters")?;
        }
        let lens = lens(model, width, height, parameters);
        let lens = lens.map_err(|reason| records.malformed(reason));
        (cameras.insert(id, lens)).map_err(|reason| records.malformed(reason))?;
    }
    records.check_end()?;
    Ok(cameras)
}

pub(super) fn images(
    path: &Path,
    cameras: &Cameras,
    chosen: Option<&Chosen>,
) -> Result<(Vec<Image>, Sightings), CaptureError> {
    let mut records = Records::open(path, "image", SMALLEST_IMAGE)?;
    let mut images = Vec::with_capacity(records.capacity());
    let mut sightings = Sightings::of_all(chosen.is_none());
    while records.next_record() {
        let id = records.u32("the id")?;
        let quaternion = records.f64s("the quaternion")?;
        let translation = DVec3::from(records.f64s::<3>("the translation")?);
        let camera_id = records.u32("the camera")?;
        let camera = cameras
            .place(camera_id)
            .map_err(|reason| records.malformed(reason))?;
        let name = records.name()?;
        let name = relative_name(&name).map_err(|reason| records.bad_name(reason))?;
        let count = records.elements("the number of observations", OBSERVATION, "observations")?;
        let mut seen = Vec::new();
        for index in 0..count {
            let pixel = records.f64s("an observation")?;
            let point = records.u64("an observation")?;
            if point != NO_POINT {
                seen.push(Sighting {
                    index,
                    point,
                    pixel,
                });
            }
        }
        if chosen.is_some_and(|chosen| !chosen.has(&name)) {
            continue;
        }
        // Most 2D points may belong to none, and there are many images.
        seen.shrink_to_fit();
        sightings.insert(id, images.len(), seen);
        images.push(Image {
            id,
            name,
            quaternion,
            translation,
            camera,
        });
    }
    records.check_end()?;
    Ok((images, sightings))
}

pub(super) fn points(path: &Path, sightings: &Sightings) -> Result<Vec<Point>, CaptureError> {
    let mut records = Records::open(path, "point", SMALLEST_POINT)?;
    let mut points = Vec::new();
    while records.next_record() {
        let id = records.u64("the id")?;
        let position = DVec3::from(records.f64s::<3>("the position")?);
        let color = records.bytes("the color")?;
        records.f64("the error")?;
        let count = records.elements("the track's length", TRACK_ELEMENT, "track elements")?;
        let mut track = Vec::with_capacity(sightings.room(count));
        let mut shown = count == 0;
        for _ in 0..count {
            let image = records.u32("the track")?;
            let index = records.u32("the track")?;
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
    records.check_end()?;
    Ok(points)
}

/// The poses of images, from the files of rigs and frames.
pub(super) fn poses([of_rigs, of_frames]: [PathBuf; 2]) -> Result<Poses, CaptureError> {
    rigs::read(
        Records::open(&of_rigs, "rig", SMALLEST_RIG)?,
        Records::open(&of_frames, "frame", SMALLEST_FRAME)?,
    )
}

impl Source for Records {
    fn next(&mut self) -> Result<bool, CaptureError> {
        match self.next_record() {
            true => Ok(true),
            false => self.check_end().map(|()| false),
        }
    }

    fn integer(&mut self, bytes: usize, field: &str) -> Result<u64, CaptureError> {
        match bytes {
            1 => self.bytes(field).map(|[byte]| byte.into()),
            4 => self.u32(field).map(u64::from),
            _ => self.u64(field),
        }
    }

    fn is_camera(&mut self) -> Result<bool, CaptureError> {
        Ok(self.i32("the sensor's kind")? == 0)
    }

    fn float(&mut self, field: &str) -> Result<f64, CaptureError> {
        self.f64(field)
    }

    fn wrong(&self, reason: String) -> CaptureError {
        self.malformed(reason)
    }
}

/// A binary file as a sequence of records. Every read is checked against what
/// the file still holds.
struct Records {
    path: PathBuf,
    reader: BufReader<File>,
    /// The file's length in bytes.
    length: u64,
    /// The next byte to read.
    offset: u64,
    /// Where the field read last begins, for errors.
    field: u64,
    /// What a record is, for errors.
    kind: &'static str,
    /// How many records the file announces.
    count: u64,
    /// The current record, from 1; 0 before the first.
    current: u64,
}

impl Records {
    /// Opens a file and checks its count of records, of which none is smaller
    /// than `smallest` bytes.
    fn open(path: &Path, kind: &'static str, smallest: u64) -> Result<Self, CaptureError> {
        let read_error = |source| CaptureError::Read {
            path: path.into(),
            source,
        };
        let file = input::open(path).map_err(read_error)?;
        let length = file.metadata().map_err(read_error)?.len();
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

    /// The count, which `open` has checked against the file's length.
    fn capacity(&self) -> usize {
        self.count as usize
    }

    /// Goes to the next record, if there is one.
    fn next_record(&mut self) -> bool {
        self.current += 1;
        self.current <= self.count
    }

    /// Checks that nothing follows the last record.
    fn check_end(&mut self) -> Result<(), CaptureError> {
        self.field = self.offset;
        match self.remaining() {
            0 => Ok(()),
            more => Err(self.malformed(format!(
                "{more} bytes follow the last of {} records",
                self.count
            ))),
        }
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
            .map_err(|source| self.read_error(source))?;
        self.offset += N as u64;
        Ok(bytes)
    }

    fn u32(&mut self, field: &str) -> Result<u32, CaptureError> {
        self.bytes(field).map(u32::from_le_bytes)
    }

    fn i32(&mut self, field: &str) -> Result<i32, CaptureError> {
        self.bytes(field).map(i32::from_le_bytes)
    }

    fn u64(&mut self, field: &str) -> Result<u64, CaptureError> {
        self.bytes(field).map(u64::from_le_bytes)
    }

    fn f64(&mut self, field: &str) -> Result<f64, CaptureError> {
        self.bytes(field).map(f64::from_le_bytes)
    }

    fn f64s<const N: usize>(&mut self, field: &str) -> Result<[f64; N], CaptureError> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64(field)?;
        }
        Ok(values)
    }

    /// A UTF-8 string that a zero byte ends.
    fn name(&mut self) -> Result<String, CaptureError> {
        self.field = self.offset;
        let mut name = Vec::new();
        (&mut self.reader)
            .take(
                self.length
                    .saturating_sub(self.offset)
                    .min(LONGEST_NAME as u64),
            )
            .read_until(0, &mut name)
            .map_err(|source| CaptureError::Read {
                path: self.path.clone(),
                source,
            })?;
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

    /// How many elements of `size` bytes follow, which the file can hold.
    fn elements(&mut self, field: &str, size: u64, what: &str) -> Result<u32, CaptureError> {
        let count = self.u64(field)?;
        match u32::try_from(count) {
            Ok(fits) if count <= self.remaining() / size => Ok(fits),
            _ => Err(self.malformed(format!(
                "{count} {what} do not fit into the file: it is cut off or damaged"
            ))),
        }
    }

    /// The current record, in words.
    fn record(&self) -> String {
        match self.current {
            0 => "header".into(),
            current => format!(
                "{} {} of {}",
                self.kind,
                current.min(self.count),
                self.count
            ),
        }
    }

    fn bad_name(&self, reason: String) -> CaptureError {
        CaptureError::ImageName {
            path: self.path.clone(),
            record: self.record(),
            position: Position::Byte(self.field),
            reason,
        }
    }

    fn malformed(&self, reason: String) -> CaptureError {
        CaptureError::Malformed {
            path: self.path.clone(),
            record: self.record(),
            position: Position::Byte(self.field),
            reason,
        }
    }

    fn read_error(&self, source: std::io::Error) -> CaptureError {
        CaptureError::Read {
            path: self.path.clone(),
            source,
        }
    }
}
