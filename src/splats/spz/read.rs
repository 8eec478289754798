//! Reading.

use std::{
    io::{self, Read},
    path::Path,
};

use flate2::read::MultiGzDecoder;
use ruzstd::decoding::StreamingDecoder;

use super::*;
use crate::splats::{
    ReadSplats, SplatError,
    axes::{Turn, turned},
    quantize::{logit, of_smallest_three},
    sh::MAX_DEGREE,
    shared::{SplatBuilder, check_count, memory},
};

/// Longest extensions that are read, in bytes.
const MOST_EXTENSIONS: u64 = 1 << 16;

/// Fields of the header.
struct Header {
    version: u32,
    count: usize,
    degree: u32,
    fractional_bits: u8,
    flags: u8,
}

/// Reads a file of version 1 to 4.
pub(in crate::splats) fn read(path: &Path, bytes: &[u8]) -> Result<ReadSplats, SplatError> {
    match bytes.starts_with(&MAGIC) {
        true => read_streams(path, bytes),
        false => read_gzip(path, bytes),
    }
}

fn read_gzip(path: &Path, bytes: &[u8]) -> Result<ReadSplats, SplatError> {
    let mut stream = MultiGzDecoder::new(bytes);
    let mut begin = [0; HEADER];
    stream.read_exact(&mut begin).map_err(|error| {
        let reason = format!("neither NGSP nor a gzip stream that begins with it ({error})");
        SplatError::damaged(path, "header", reason)
    })?;
    let header = Header::of(path, begin, bytes.len())?;
    if header.version > 3 {
        let reason = format!("version {} in a gzip stream", header.version);
        return Err(SplatError::damaged(path, "version", reason));
    }
    let sizes = part_bytes(header.version, header.degree);
    let parts = sizes.map(|size| size * header.count);
    let wanted: usize = parts.iter().sum();
    let mut body = Vec::new();
    let mut limited = stream.take(wanted as u64);
    let read = limited.read_to_end(&mut body);
    if matches!(read, Ok(found) if found < wanted) {
        return Err(header.cut_off(path, body.len(), wanted));
    }
    // The stream's end has its checksum.
    let mut extensions = Vec::new();
    let end = read.and_then(|_| {
        let mut limited = limited.into_inner().take(MOST_EXTENSIONS);
        limited.read_to_end(&mut extensions)?;
        limited.into_inner().read(&mut [0])
    });
    end.map_err(|error| SplatError::damaged(path, "gzip stream", error.to_string()))?;
    let mut rest = &body[..];
    let parts = parts.map(|size| {
        let (part, behind) = rest.split_at(size);
        rest = behind;
        part
    });
    header.extended(path, header.gather(parts), &extensions)
}

fn read_streams(path: &Path, bytes: &[u8]) -> Result<ReadSplats, SplatError> {
    let cut_off = || SplatError::damaged(path, "header", "it is cut off");
    let begin = *bytes.first_chunk::<HEADER>().ok_or_else(cut_off)?;
    let header = Header::of(path, begin, bytes.len())?;
    if header.version != 4 {
        let reason = format!("version {} without a gzip stream", header.version);
        return Err(SplatError::damaged(path, "version", reason));
    }
    let wrong = |reason: String| SplatError::damaged(path, "table of streams", reason);
    let table = bytes.get(HEADER..HEADER + 4).ok_or_else(cut_off)?;
    let table = word(table, 0) as usize;
    let streams = usize::from(bytes[15]);
    let expected = if header.degree == 0 { 5 } else { 6 };
    if table < LONG_HEADER || streams != expected {
        return Err(wrong(format!("{streams} streams at byte {table}")));
    }
    let mut at = table.saturating_add(streams * TABLE_ROW);
    let rows = bytes
        .get(table..at)
        .ok_or_else(|| wrong("it is cut off".to_owned()))?;
    let sizes = part_bytes(header.version, header.degree);
    let mut parts: [Vec<u8>; 6] = Default::default();
    for (index, row) in rows.as_chunks::<TABLE_ROW>().0.iter().enumerate() {
        let (compressed, plain) = row.split_at(8);
        let number = |bytes: &[u8]| bytes.try_into().map_or(0, u64::from_le_bytes) as usize;
        let wanted = sizes[index] * header.count;
        if number(plain) != wanted {
            return Err(wrong(format!(
                "stream {index} has {} bytes, not {wanted}",
                number(plain)
            )));
        }
        let end = at.saturating_add(number(compressed));
        let stream = bytes.get(at..end).ok_or_else(|| {
            let reason = format!("stream {index} goes beyond the end; the file is cut off");
            SplatError::damaged(path, "streams", reason)
        })?;
        at = end;
        let unpacked = StreamingDecoder::new(stream)
            .map_err(io::Error::other)
            .and_then(|stream| stream.take(wanted as u64).read_to_end(&mut parts[index]));
        let reason = match unpacked {
            Ok(found) if found == wanted => continue,
            Ok(found) => format!("stream {index} holds {found} bytes, not {wanted}"),
            Err(error) => format!("stream {index}: {error}"),
        };
        return Err(SplatError::damaged(path, "streams", reason));
    }
    let read = header.gather(parts.each_ref().map(Vec::as_slice));
    header.extended(
        path,
        read,
        bytes.get(LONG_HEADER..table).unwrap_or_default(),
    )
}

/// From the axes of a system to right, down, front.
fn to_ply(system: &str) -> Turn {
    [['R', 'L'], ['D', 'U'], ['F', 'B']].map(|[along, against]| {
        match (system.find(along), system.find(against)) {
            (Some(place), _) => (place, 1.0),
            // One of the two is there.
            (None, place) => (place.unwrap_or(0), -1.0),
        }
    })
}

/// Four bytes of some as a number.
fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

impl Header {
    fn of(path: &Path, bytes: [u8; HEADER], file_bytes: usize) -> Result<Self, SplatError> {
        let wrong = |field, reason: String| Err(SplatError::damaged(path, field, reason));
        let (version, count) = (word(&bytes, 4), word(&bytes, 8) as usize);
        if bytes[..4] != MAGIC {
            return wrong("header", "does not begin with NGSP".to_owned());
        }
        if !(1..=4).contains(&version) {
            return wrong("version", format!("{version} is not read, only 1 to 4"));
        }
        let [degree, fractional_bits, flags] = [bytes[12], bytes[13], bytes[14]];
        if u32::from(degree) > MAX_DEGREE {
            return wrong("SH degree", format!("{degree} is above {MAX_DEGREE}"));
        }
        if version > 1 && fractional_bits > 30 {
            return wrong("fractional bits", format!("{fractional_bits} is above 30"));
        }
        let packed: usize = part_bytes(version, degree.into()).iter().sum();
        let each = memory(degree.into()) + packed;
        check_count(path, count, each, file_bytes)?;
        Ok(Self {
            version,
            count,
            degree: degree.into(),
            fractional_bits,
            flags,
        })
    }

    fn cut_off(&self, path: &Path, found: usize, wanted: usize) -> SplatError {
        let reason = format!(
            "{found} bytes where {} Gaussians take {wanted}; it is cut off or damaged",
            self.count
        );
        SplatError::damaged(path, "gzip stream", reason)
    }

    /// The Gaussians of parts that have the sizes which the header says.
    fn gather(&self, parts: [&[u8]; 6]) -> ReadSplats {
        let sizes = part_bytes(self.version, self.degree);
        let mut gathered = SplatBuilder::new(self.count, self.degree);
        let mut coefficients = vec![0.0; coefficient_count(self.degree) * CHANNELS];
        for index in 0..self.count {
            let [center, opacity, color, scale, rotation, rest] =
                [0, 1, 2, 3, 4, 5].map(|k| &parts[k][index * sizes[k]..(index + 1) * sizes[k]]);
            let (constant, above) = coefficients.split_at_mut(CHANNELS);
            for (value, &byte) in constant.iter_mut().zip(color) {
                *value = ((f64::from(byte) / 255.0 - 0.5) / COLOR_SCALE) as f32;
            }
            for (value, &byte) in above.iter_mut().zip(rest) {
                *value = ((f64::from(byte) - SH_LEVELS) / SH_LEVELS) as f32;
            }
            gathered.push(
                [0, 1, 2].map(|axis| self.coordinate(center, axis)),
                self.rotation(rotation),
                [0, 1, 2].map(|k| (f64::from(scale[k]) / SCALE_STEPS + LOWEST_SCALE) as f32),
                logit(f64::from(opacity[0]) / 255.0),
                &coefficients,
            );
        }
        ReadSplats {
            antialiased: self.flags & ANTIALIASED != 0,
            ..gathered.finish()
        }
    }

    /// Does to the Gaussians what extensions say.
    fn extended(
        &self,
        path: &Path,
        mut read: ReadSplats,
        mut extensions: &[u8],
    ) -> Result<ReadSplats, SplatError> {
        let unknown = self.flags & !(ANTIALIASED | EXTENDED);
        if unknown != 0 {
            (read.doubts).push(format!("flags {unknown:#x} of the header are not known"));
        }
        if self.flags & EXTENDED == 0 {
            return Ok(read);
        }
        let (mut axes, mut other) = (0, None);
        while !extensions.is_empty() {
            let cut_off = || SplatError::damaged(path, "extensions", "they are cut off");
            let (begin, rest) = extensions.split_first_chunk::<8>().ok_or_else(cut_off)?;
            let [which, length] = [0, 4].map(|at| word(begin, at));
            let (payload, rest) = (rest.split_at_checked(length as usize)).ok_or_else(cut_off)?;
            extensions = rest;
            match which {
                AXES if payload.len() == 4 => axes = word(payload, 0),
                ORBIT => {}
                _ => other = Some(which),
            }
        }
        if let Some(other) = other {
            (read.doubts).push(format!("extension {other:#x} is not read"));
        }
        match (axes as usize).checked_sub(1).map(|at| SYSTEMS.get(at)) {
            None | Some(Some(&"RDF")) => {}
            Some(Some(system)) => {
                read.splats = turned(read.splats, to_ply(system));
                (read.notes).push(format!("axes {system}, as it says, are turned to RDF"));
            }
            Some(None) => (read.doubts).push(format!(
                "axes {axes} are not known: they are taken for those of a .ply, RDF"
            )),
        }
        Ok(read)
    }

    fn coordinate(&self, center: &[u8], axis: usize) -> f32 {
        if self.version == 1 {
            let half = half::f16::from_le_bytes([center[2 * axis], center[2 * axis + 1]]);
            return half.into();
        }
        let [a, b, c] = [0, 1, 2].map(|k| center[3 * axis + k]);
        // In the upper bytes, so that the sign is the number's.
        let fixed = i32::from_le_bytes([0, a, b, c]) >> 8;
        (f64::from(fixed) / f64::from(1_u32 << self.fractional_bits)) as f32
    }

    fn rotation(&self, bytes: &[u8]) -> [f32; 4] {
        if self.version < 3 {
            let [x, y, z] = [0, 1, 2].map(|k| f32::from(bytes[k]) / 127.5 - 1.0);
            let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
            return [w, x, y, z];
        }
        let word = word(bytes, 0);
        let small = [20, 10, 0].map(|shift| {
            let level = f64::from(word >> shift & ROTATION_LEVELS) / f64::from(ROTATION_LEVELS);
            if word >> (shift + 9) & 1 == 1 {
                -level
            } else {
                level
            }
        });
        let [x, y, z, w] = of_smallest_three((word >> 30) as usize, small);
        [w, x, y, z]
    }
}
