//! Reading splat files of any make.

use super::collect::Collector;
use super::header::{VertexLayout, byte_size, decode, is_antialiased, offset, read_header};
use super::{ReadSplats, SplatError, compressed};
use crate::input::{self, excerpt};
use ply_rs_bw::ply::{ElementDef, Encoding, PropertyType, ScalarType};
use std::fs::File;
use std::io::{self, BufRead, BufReader, ErrorKind, Read};
use std::path::Path;

/// Bytes of the body that are read at once.
const CHUNK_BYTES: usize = 1 << 20;

/// Reads a 3D Gaussian Splatting `.ply` file, compressed or not.
///
/// Uncompressed ones are text or binary of either byte order; properties in any order and of any
/// type; further properties and elements are ignored. Numbers are rounded to
/// f32. Gaussians of two scales are flat; `red green blue` of 8 bits stand for `f_dc_0..2`.
///
/// # Errors
/// A [`SplatError`] where the header is damaged or longer than 64 KiB, a property
/// is missing, the number of `f_rest_*` fits no degree, or the file is shorter
/// than its header says (found out before memory is taken for it).
pub fn read_ply(path: &Path) -> Result<ReadSplats, SplatError> {
    let file = input::open(path).map_err(SplatError::io(path))?;
    let file_bytes = file.metadata().map_err(SplatError::io(path))?.len();
    let mut file = BufReader::with_capacity(CHUNK_BYTES, file);
    let header = read_header(path, &mut file)?;
    if compressed::is_compressed(&header) {
        return compressed::read(path, &header, &mut file);
    }
    let antialiased = is_antialiased(&header.comments);
    let mut body = Body {
        path,
        encoding: header.encoding,
        file,
        line: String::new(),
    };

    let mut elements = header.elements.values();
    while let Some(element) = elements.next() {
        if element.name != "vertex" {
            body.skip(element)?;
            continue;
        }
        let layout = VertexLayout::new(path, element, header.encoding)?;
        let sizes = layout.types.iter().map(byte_size);
        let min_row_bytes = match header.encoding {
            // A digit and a separator each.
            Encoding::Ascii => 2 * layout.types.len(),
            _ => sizes.sum(),
        };
        // One byte of grace: the last line of a text file may lack its end.
        if element.count as u128 * min_row_bytes as u128 > u128::from(file_bytes) + 1 {
            return Err(SplatError::truncated(path, element));
        }
        let read = body.read_vertices(element, &layout)?;
        return Ok(ReadSplats {
            antialiased,
            offset: offset(&header.comments),
            surplus: body.surplus(elements)?,
            doubts: layout.unread(element).into_iter().collect(),
            ..read
        });
    }
    Err(SplatError::missing(path, "x"))
}

/// The numbers after the header.
struct Body<'a> {
    path: &'a Path,
    encoding: Encoding,
    file: BufReader<File>,
    line: String,
}

impl Body<'_> {
    /// Names the file, and the element where the file ended too early.
    fn failed(&self, element: &ElementDef, source: io::Error) -> SplatError {
        match source.kind() {
            ErrorKind::UnexpectedEof => SplatError::truncated(self.path, element),
            _ => SplatError::io(self.path)(source),
        }
    }

    /// The next line of a text file.
    fn next_line(&mut self, element: &ElementDef, index: usize) -> Result<&str, SplatError> {
        self.line.clear();
        match self.file.read_line(&mut self.line) {
            Ok(0) => Err(SplatError::truncated(self.path, element)),
            Ok(_) => Ok(&self.line),
            Err(error) if error.kind() == ErrorKind::InvalidData => {
                Err(self.bad_row(element, index))
            }
            Err(error) => Err(self.failed(element, error)),
        }
    }

    fn bad_row(&self, element: &ElementDef, index: usize) -> SplatError {
        SplatError::Row {
            path: self.path.to_path_buf(),
            element: excerpt(&element.name).into_owned(),
            index,
        }
    }

    /// Bytes after the last row of these elements, unless all are white space: some programs
    /// end binary files like lines. None where the elements themselves are cut off, which does
    /// the vertices no harm.
    fn surplus<'e>(
        &mut self,
        mut elements: impl Iterator<Item = &'e ElementDef>,
    ) -> Result<u64, SplatError> {
        if elements.any(|element| self.skip(element).is_err()) {
            return Ok(0);
        }
        let (mut bytes, mut blank) = (0, true);
        loop {
            let chunk = self.file.fill_buf().map_err(SplatError::io(self.path))?;
            let length = chunk.len();
            if length == 0 {
                return Ok(if blank { 0 } else { bytes });
            }
            bytes += length as u64;
            blank &= chunk.iter().all(u8::is_ascii_whitespace);
            self.file.consume(length);
        }
    }

    /// Passes over an element.
    fn skip(&mut self, element: &ElementDef) -> Result<(), SplatError> {
        if element.properties.is_empty() {
            return Ok(());
        }
        for index in 0..element.count {
            if self.encoding == Encoding::Ascii {
                self.next_line(element, index)?;
                continue;
            }
            for property in element.properties.values() {
                let bytes = match &property.data_type {
                    PropertyType::Scalar(scalar) => byte_size(scalar) as u64,
                    PropertyType::List(length, scalar) => {
                        let length = self.read_number(element, length)?;
                        if !(length >= 0.0 && length.fract() == 0.0) {
                            return Err(self.bad_row(element, index));
                        }
                        length as u64 * byte_size(scalar) as u64
                    }
                };
                let skipped = io::copy(&mut (&mut self.file).take(bytes), &mut io::sink());
                if skipped.map_err(|error| self.failed(element, error))? < bytes {
                    return Err(SplatError::truncated(self.path, element));
                }
            }
        }
        Ok(())
    }

    fn read_number(&mut self, element: &ElementDef, kind: &ScalarType) -> Result<f64, SplatError> {
        let mut buffer = [0; 8];
        let read = self.file.read_exact(&mut buffer[..byte_size(kind)]);
        read.map_err(|error| self.failed(element, error))?;
        Ok(decode(kind, self.big_endian(), &buffer))
    }

    fn big_endian(&self) -> bool {
        self.encoding == Encoding::BinaryBigEndian
    }

    fn read_vertices(
        &mut self,
        element: &ElementDef,
        layout: &VertexLayout,
    ) -> Result<ReadSplats, SplatError> {
        let mut collected = Collector::new(element.count, layout);
        let mut needed = vec![0.0; layout.columns.len()];
        if self.encoding == Encoding::Ascii {
            let mut row = Vec::new();
            for index in 0..element.count {
                row.clear();
                let words = self.next_line(element, index)?.split_ascii_whitespace();
                row.extend(words.map_while(|word| word.parse::<f64>().ok()));
                if row.len() != layout.types.len() {
                    return Err(self.bad_row(element, index));
                }
                for (value, column) in needed.iter_mut().zip(&layout.columns) {
                    *value = column.map_or(f32::NEG_INFINITY, |column| row[column] as f32);
                }
                collected.push(&mut needed);
            }
            return Ok(collected.finish());
        }

        // For each number of a Gaussian: where it lies in a row, and its type.
        let mut stride = 0;
        let mut offsets = Vec::with_capacity(layout.types.len());
        for kind in &layout.types {
            offsets.push(stride);
            stride += byte_size(kind);
        }
        let place = |column: usize| (offsets[column], layout.types[column].clone());
        let columns = layout.columns.iter();
        let places: Vec<_> = columns.map(|column| column.map(place)).collect();

        let big_endian = self.big_endian();
        let chunk_rows = (CHUNK_BYTES / stride).clamp(1, element.count.max(1));
        let mut buffer = vec![0; chunk_rows * stride];
        let mut remaining = element.count;
        while remaining > 0 {
            let rows = remaining.min(chunk_rows);
            let chunk = &mut buffer[..rows * stride];
            let read = self.file.read_exact(chunk);
            read.map_err(|error| self.failed(element, error))?;
            for row in chunk.chunks_exact(stride) {
                for (value, place) in needed.iter_mut().zip(&places) {
                    *value = match place {
                        Some((offset, ScalarType::UShort)) if layout.half => {
                            let bits = decode(&ScalarType::UShort, big_endian, &row[*offset..]);
                            half::f16::from_bits(bits as u16).to_f32()
                        }
                        Some((offset, kind)) => decode(kind, big_endian, &row[*offset..]) as f32,
                        // A disc has no extent along its normal.
                        None => f32::NEG_INFINITY,
                    };
                }
                collected.push(&mut needed);
            }
            remaining -= rows;
        }
        Ok(collected.finish())
    }
}
