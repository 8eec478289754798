//! The header of a PLY file and where its numbers lie.

use super::{CENTER, OFFSET, PlyError, SHAPE, THIRD_SCALE, degree_of_rest_count, sh_names};
use glam::DVec3;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, ElementDef, Header, PropertyType, ScalarType};
use std::io::{BufRead, Read};
use std::path::Path;

/// Longest header that is read. A splat header takes 2 KiB; a file without
/// `end_header` must not be read to its end.
const MAX_HEADER_BYTES: u64 = 64 * 1024;

/// Colors that some programs write instead of `f_dc_0..2`.
const BYTE_COLORS: [&str; 3] = ["red", "green", "blue"];

/// Which numbers of a vertex make a Gaussian.
pub(super) struct VertexLayout {
    /// SH degree.
    pub degree: u32,
    /// For each needed number, in the order center, SH, shape: the place among
    /// the vertex's properties; none for the third scale of a disc.
    pub columns: Vec<Option<usize>>,
    /// Whether the first three SH are colors of 8 bits.
    pub byte_colors: bool,
    /// Types of all properties of a vertex, in file order.
    pub types: Vec<ScalarType>,
}

/// Reads up to and including the line `end_header`.
///
/// The header is cut out before it is parsed so that its length is bounded and
/// comments in any text encoding do no harm.
pub(super) fn read_header(path: &Path, file: &mut impl BufRead) -> Result<Header, PlyError> {
    let wrong = |reason: String| PlyError::Header {
        path: path.to_path_buf(),
        reason,
    };
    let mut bytes = Vec::new();
    let mut limited = file.take(MAX_HEADER_BYTES);
    loop {
        let start = bytes.len();
        let read = limited.read_until(b'\n', &mut bytes);
        read.map_err(PlyError::io(path))?;
        let line = bytes[start..].trim_ascii();
        if start == 0 && line != b"ply" {
            return Err(wrong("the first line is not \"ply\"".into()));
        }
        if line == b"end_header" {
            break;
        }
        if bytes.len() == start {
            return Err(wrong(format!(
                "no line \"end_header\" within {} KiB",
                MAX_HEADER_BYTES / 1024
            )));
        }
    }

    let text = String::from_utf8_lossy(&bytes);
    let header = Parser::<DefaultElement>::new()
        .read_header(&mut Reader::new(text.as_bytes()))
        .map_err(|error| {
            wrong(match error.line() {
                Some(number) => {
                    let line = text.lines().nth(number - 1).unwrap_or_default();
                    format!("line {number}: \"{}\"", line.trim())
                }
                None => error.to_string(),
            })
        })?;

    // The parser keeps one of two elements or properties with the same name,
    // which would shift every number after it.
    let lines_of = |word: &str| {
        let first_words = text.lines().map(|line| line.split_whitespace().next());
        first_words.filter(|first| *first == Some(word)).count()
    };
    let properties: usize = header.elements.values().map(|e| e.properties.len()).sum();
    if lines_of("element") != header.elements.len() || lines_of("property") != properties {
        return Err(wrong("two elements or properties have one name".into()));
    }
    Ok(header)
}

/// Whether the header's comments say that the Gaussians were trained antialiased, as
/// Brush or Postshot write it; the last one counts.
pub(super) fn is_antialiased(comments: &[String]) -> bool {
    let mut modes = comments.iter().filter_map(|comment| {
        let words: Vec<_> = comment.split_whitespace().collect();
        match words[..] {
            ["SplatRenderMode:", mode] => Some(mode == "mip"),
            ["antialiased", flag] => Some(flag == "1"),
            _ => None,
        }
    });
    modes.next_back().unwrap_or(false)
}

/// What the header's comments say was subtracted from the centers; the last one counts.
pub(super) fn offset(comments: &[String]) -> DVec3 {
    let mut offsets = comments.iter().filter_map(|comment| {
        let words: Vec<_> = comment.split_whitespace().collect();
        let [OFFSET, x, y, z] = words[..] else {
            return None;
        };
        let [x, y, z] = [x, y, z].map(|word| word.parse().ok());
        Some(DVec3::new(x?, y?, z?)).filter(|offset| offset.is_finite())
    });
    offsets.next_back().unwrap_or_default()
}

impl VertexLayout {
    /// Finds the properties of a Gaussian among those of the vertex element.
    pub fn new(path: &Path, vertex: &ElementDef) -> Result<Self, PlyError> {
        let properties = &vertex.properties;
        let types = properties
            .values()
            .map(|property| match &property.data_type {
                PropertyType::Scalar(scalar) => Ok(scalar.clone()),
                PropertyType::List(..) => Err(PlyError::Header {
                    path: path.to_path_buf(),
                    reason: format!("vertex property \"{}\" is a list", property.name),
                }),
            });
        let types = types.collect::<Result<_, _>>()?;

        let is_rest = |name: &&String| name.starts_with("f_rest_");
        let count = properties.keys().filter(is_rest).count();
        let degree = degree_of_rest_count(count).ok_or_else(|| PlyError::RestCount {
            path: path.to_path_buf(),
            count,
        })?;

        let has = |name: &str| properties.contains_key(name);
        if has(CENTER[0]) && !(SHAPE[..2].iter().any(|name| has(name)) || has("f_dc_0")) {
            return Err(PlyError::PointCloud {
                path: path.to_path_buf(),
            });
        }
        let byte_colors = !has("f_dc_0")
            && (BYTE_COLORS.iter()).all(|&name| {
                let property = properties.get(name);
                property.is_some_and(|p| p.data_type == PropertyType::Scalar(ScalarType::UChar))
            });
        let names = CENTER.into_iter().map(String::from);
        let names = names.chain(sh_names(degree).enumerate().map(|(place, name)| {
            match BYTE_COLORS.get(place).filter(|_| byte_colors) {
                Some(&color) => color.to_owned(),
                None => name,
            }
        }));
        let names = names.chain(SHAPE.into_iter().map(String::from));
        let columns = names.map(|property| match properties.get_index_of(&property) {
            None if property != THIRD_SCALE => Err(PlyError::MissingProperty {
                path: path.to_path_buf(),
                property,
            }),
            column => Ok(column),
        });
        Ok(Self {
            degree,
            columns: columns.collect::<Result<_, _>>()?,
            byte_colors,
            types,
        })
    }
}

/// Bytes of a number in a binary file.
pub(super) fn byte_size(scalar: &ScalarType) -> usize {
    match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

/// Reads the number at the start of `bytes`, which hold at least its size.
#[inline]
pub(super) fn decode(scalar: &ScalarType, big_endian: bool, bytes: &[u8]) -> f64 {
    macro_rules! number {
        ($type:ty) => {{
            let mut buffer = [0; size_of::<$type>()];
            buffer.copy_from_slice(&bytes[..size_of::<$type>()]);
            if big_endian {
                <$type>::from_be_bytes(buffer) as f64
            } else {
                <$type>::from_le_bytes(buffer) as f64
            }
        }};
    }
    match scalar {
        ScalarType::Char => number!(i8),
        ScalarType::UChar => number!(u8),
        ScalarType::Short => number!(i16),
        ScalarType::UShort => number!(u16),
        ScalarType::Int => number!(i32),
        ScalarType::UInt => number!(u32),
        ScalarType::Float => number!(f32),
        ScalarType::Double => number!(f64),
    }
}
