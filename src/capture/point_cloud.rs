//! Points of a PLY file.

use std::{io::BufReader, path::Path};

use ply_rs_bw::{
    parser::{Parser, Reader},
    ply::{PropertyAccess, PropertyAccessResult},
};

use super::{Point, error::CaptureError};
use crate::input::{self, excerpt};

/// Position and color of a vertex; what else it has is ignored.
struct Vertex([f64; 3], [u8; 3]);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self([0.0; 3], [127; 3])
    }

    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set_double(name, value.into())
    }

    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        set(&mut self.0, ["x", "y", "z"], name, value)
    }

    fn set_uchar(&mut self, name: &str, value: u8) -> PropertyAccessResult {
        set(&mut self.1, ["red", "green", "blue"], name, value)
    }
}

fn set<T>(values: &mut [T; 3], names: [&str; 3], name: &str, value: T) -> PropertyAccessResult {
    let Some(place) = names.iter().position(|known| *known == name) else {
        return PropertyAccessResult::Ignored;
    };
    values[place] = value;
    PropertyAccessResult::Set
}

/// Reads all vertices; their positions may be anything.
///
/// # Errors
/// If the file cannot be read, is damaged, or does not begin with positions.
pub(super) fn read(path: &Path) -> Result<Vec<Point>, CaptureError> {
    let file = input::open(path).map_err(CaptureError::read(path))?;
    let wrong = |reason: &str| CaptureError::Transforms {
        path: path.into(),
        reason: format!("is no point cloud: {}", excerpt(reason)),
    };
    let (parser, mut reader) = (Parser::<Vertex>::new(), Reader::new(BufReader::new(file)));
    let header = parser.read_header(&mut reader);
    let header = header.map_err(|error| wrong(&error.to_string()))?;
    let vertex = header
        .elements
        .first()
        .filter(|(name, _)| *name == "vertex");
    let has = |name| vertex.is_some_and(|(_, v)| v.properties.contains_key(name));
    let Some((_, vertex)) = vertex.filter(|_| ["x", "y", "z"].into_iter().all(has)) else {
        return Err(wrong("does not begin with vertices of x, y and z"));
    };
    let read = parser.read_payload_for_element(&mut reader, vertex, &header);
    let point = |Vertex(position, color)| Point {
        position: position.into(),
        color,
        track: Vec::new(),
    };
    let read = read.map_err(|error| wrong(&error.to_string()))?;
    Ok(read.into_iter().map(point).collect())
}
