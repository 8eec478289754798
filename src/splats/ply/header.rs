//! The header of a PLY file and where its numbers lie.

use super::{
    CENTER, FILTER, OFFSET, SHAPE, SplatError, THIRD_SCALE, degree_of_rest_count, sh_names,
};
use crate::input::excerpt;
use glam::DVec3;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, ElementDef, Encoding, Header, PropertyType, ScalarType};
use std::io::{BufRead, Read};
use std::path::Path;

/// The part of a file that is damaged where this one does not read it.
pub(super) const HEADER: &str = "not a readable PLY header";

/// Longest header that is read. A splat header takes 2 KiB; a file without
/// `end_header` must not be read to its end.
const MAX_HEADER_BYTES: u64 = 64 * 1024;

/// Colors that some programs write instead of `f_dc_0..2`.
const BYTE_COLORS: [&str; 3] = ["red", "green", "blue"];

/// Properties of others that change no picture, or all that begin so with `_`: normals, colors
/// beside harmonics, labels, features.
const HARMLESS: &str = "nx ny nz red green blue alpha f_rest_ obj_dc_ ins_feat_ semantic_ \
    language_feature_ label segment class instance object_id cluster_id id ids confidence";

/// Names that a sentence lists.
const LISTED: usize = 3;

/// Vertex properties that make up a Gaussian.
pub(super) struct VertexLayout {
    /// SH degree.
    pub degree: u32,
    /// For each needed number, in the order center, SH, shape, filter if there is one: the place
    /// among the vertex's properties; none for the third scale of a disc.
    pub columns: Vec<Option<usize>>,
    /// True if the first three SH are colors of 8 bits.
    pub byte_colors: bool,
    /// True if `ushort` columns hold half-precision floats.
    pub half: bool,
    /// Types of all properties of a vertex, in file order.
    pub types: Vec<ScalarType>,
}

/// Reads up to and including the line `end_header`.
///
/// The header is cut out before it is parsed so that its length is bounded and
/// comments in any text encoding do no harm.
pub(super) fn read_header(path: &Path, file: &mut impl BufRead) -> Result<Header, SplatError> {
    let wrong = |reason: String| SplatError::damaged(path, HEADER, reason);
    let mut bytes = Vec::new();
    let mut limited = file.take(MAX_HEADER_BYTES);
    loop {
        let start = bytes.len();
        let read = limited.read_until(b'\n', &mut bytes);
        read.map_err(SplatError::io(path))?;
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
                    format!("line {number}: \"{}\"", excerpt(line.trim()))
                }
                None => excerpt(&error.to_string()).into_owned(),
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

/// Returns true if the header's comments mark the Gaussians as trained antialiased, as Brush or
/// Postshot write it; the last one counts.
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

/// Offset subtracted from the centers, by the header's comments; the last one counts.
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
    pub fn new(path: &Path, vertex: &ElementDef, encoding: Encoding) -> Result<Self, SplatError> {
        let properties = &vertex.properties;
        let types = properties
            .values()
            .map(|property| match &property.data_type {
                PropertyType::Scalar(scalar) => Ok(scalar.clone()),
                PropertyType::List(..) => {
                    let name = excerpt(&property.name);
                    let reason = format!("vertex property \"{name}\" is a list");
                    Err(SplatError::damaged(path, HEADER, reason))
                }
            });
        let types: Vec<_> = types.collect::<Result<_, _>>()?;

        let is_rest = |name: &&String| name.starts_with("f_rest_");
        let count = properties.keys().filter(is_rest).count();
        let degree = degree_of_rest_count(count).ok_or_else(|| SplatError::RestCount {
            path: path.to_path_buf(),
            count,
        })?;

        let has = |name: &str| properties.contains_key(name);
        if has(CENTER[0]) && !(SHAPE[..2].iter().any(|name| has(name)) || has("f_dc_0")) {
            return Err(SplatError::PointCloud {
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
        let names = names.chain(has(FILTER).then(|| FILTER.to_owned()));
        let columns = names.map(|property| match properties.get_index_of(&property) {
            None if property != THIRD_SCALE => Err(SplatError::missing(path, &property)),
            column => Ok(column),
        });
        let columns: Vec<Option<usize>> = columns.collect::<Result<_, _>>()?;
        let colors = CENTER.len()..CENTER.len() + BYTE_COLORS.len();
        let floats = (columns.iter().enumerate())
            .filter(|(place, _)| !(byte_colors && colors.contains(place)))
            .filter_map(|(place, column)| Some((place, (*column)?)));
        let half = encoding != Encoding::Ascii
            && floats
                .clone()
                .all(|(_, column)| types[column] == ScalarType::UShort);
        let is_float = |kind: &ScalarType| matches!(kind, ScalarType::Float | ScalarType::Double);
        // Centers may be whole numbers.
        let mut integers = floats.filter(|&(place, column)| {
            let kind = &types[column];
            !is_float(kind) && (place >= CENTER.len() || *kind == ScalarType::UShort)
        });
        if let Some((_, column)) = integers.next().filter(|_| !half) {
            return Err(SplatError::Integer {
                path: path.to_path_buf(),
                property: properties[column].name.clone(),
            });
        }
        Ok(Self {
            degree,
            columns,
            byte_colors,
            half,
            types,
        })
    }

    /// True if each Gaussian has a 3D smoothing filter (Mip-Splatting).
    pub fn filtered(&self) -> bool {
        self.columns.len() > CENTER.len() + sh_names(self.degree).count() + SHAPE.len()
    }

    /// Names properties that are not read, if there are any that may change the picture.
    pub fn unread(&self, vertex: &ElementDef) -> Option<String> {
        let harmless = |name: &str| {
            let is = |known: &str| name == known || known.ends_with('_') && name.starts_with(known);
            HARMLESS.split_ascii_whitespace().any(is)
        };
        let names: Vec<_> = (vertex.properties.keys().enumerate())
            .filter(|(column, name)| !(self.columns.contains(&Some(*column)) || harmless(name)))
            .map(|(_, name)| excerpt(name))
            .collect();
        let listed = names[..names.len().min(LISTED)].join(", ");
        let more = match names.len().saturating_sub(LISTED) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        (!names.is_empty()).then(|| format!("vertex properties {listed}{more} are not read: if they move, reshape or color Gaussians, pictures differ from the trainer's"))
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
