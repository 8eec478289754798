//! Files of weights that lie beside a model, as large exports have them.

use super::TeacherError;
use crate::{hash::Hasher, input};
use std::collections::BTreeSet;
use std::io::{self, BufReader, Read, Seek};
use std::path::{Component, Path};

/// SHA-256 of a model in hexadecimal: of its `.onnx` file, and where that names files of
/// weights, of these names and files as well, in the order of the names. No file is in memory as
/// a whole.
///
/// # Errors
/// [`TeacherError::Io`], [`TeacherError::NoWeights`] where a file of weights is not there.
pub(super) fn identity(path: &Path) -> Result<String, TeacherError> {
    let mut hasher = Hasher::default();
    let mut file = input::open(path).map_err(TeacherError::io(path))?;
    hasher
        .update_with(&mut file)
        .and_then(|()| file.rewind())
        .map_err(TeacherError::io(path))?;
    let length = file.metadata().map_err(TeacherError::io(path))?.len();
    let mut names = BTreeSet::new();
    let mut messages = Messages {
        from: BufReader::new(file),
        names: &mut names,
    };
    // What does not decode is for ONNX Runtime to complain of.
    if messages.walk(Kind::Model, length, 0).is_err() {
        names.clear();
    }
    for name in names {
        let inside = |part| matches!(part, Component::Normal(_) | Component::CurDir);
        let missing = || TeacherError::NoWeights {
            path: path.to_path_buf(),
            weights: name.clone(),
        };
        // The runtime looks nowhere else either.
        if !Path::new(&name).components().all(inside) {
            return Err(missing());
        }
        let folder = path.parent().unwrap_or(Path::new("."));
        hasher.update(format!("\n{name}\n").as_bytes());
        let file = input::open(&folder.join(&name));
        file.and_then(|file| hasher.update_with(file))
            .map_err(|_| missing())?;
    }
    Ok(hasher.finish())
}

/// ONNX's messages that lead to files of weights.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Model,
    Function,
    Graph,
    Node,
    Attribute,
    Tensor,
    /// A key and a value.
    Entry,
    Text,
}

impl Kind {
    /// Kind of a field's contents; none if it is not followed. Tags are those of `onnx.proto`.
    fn field(self, tag: u64) -> Option<Self> {
        Some(match (self, tag) {
            (Self::Model, 7) | (Self::Attribute, 6 | 11) => Self::Graph,
            (Self::Model, 25) => Self::Function,
            (Self::Graph, 1) | (Self::Function, 7) => Self::Node,
            (Self::Node, 5) => Self::Attribute,
            (Self::Graph, 5) | (Self::Attribute, 5 | 10) => Self::Tensor,
            (Self::Tensor, 13) => Self::Entry,
            (Self::Entry, 1 | 2) => Self::Text,
            _ => return None,
        })
    }
}

/// Graphs in attributes of graphs are followed so far: none comes near it.
const DEPTH: usize = 100;

/// Protobuf's ways to write a field.
const VARINT: u64 = 0;
const FIXED_64: u64 = 1;
const DELIMITED: u64 = 2;
const FIXED_32: u64 = 5;

/// A model as its messages come by.
struct Messages<'a, R> {
    from: R,
    names: &'a mut BTreeSet<String>,
}

impl<R: Read> Messages<'_, R> {
    /// Reads a message of so many bytes.
    fn walk(&mut self, kind: Kind, length: u64, depth: usize) -> io::Result<()> {
        let damaged = || io::Error::from(io::ErrorKind::InvalidData);
        if depth > DEPTH {
            return Err(damaged());
        }
        let (mut left, mut entry) = (length, [const { String::new() }; 2]);
        while left > 0 {
            let key = self.varint(&mut left)?;
            let size = match key & 7 {
                VARINT => {
                    self.varint(&mut left)?;
                    continue;
                }
                FIXED_64 => 8,
                FIXED_32 => 4,
                DELIMITED => self.varint(&mut left)?,
                _ => return Err(damaged()),
            };
            left = left.checked_sub(size).ok_or_else(damaged)?;
            match kind.field(key >> 3).filter(|_| key & 7 == DELIMITED) {
                None => self.skip(size)?,
                Some(Kind::Text) => {
                    let text = &mut entry[usize::from(key >> 3 == 2)];
                    text.clear();
                    (&mut self.from).take(size).read_to_string(text)?;
                }
                Some(inner) => self.walk(inner, size, depth + 1)?,
            }
        }
        let [key, value] = entry;
        if kind == Kind::Entry && key == "location" {
            self.names.insert(value);
        }
        Ok(())
    }

    fn varint(&mut self, left: &mut u64) -> io::Result<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let mut byte = [0];
            self.from.read_exact(&mut byte)?;
            *left = left.checked_sub(1).ok_or(io::ErrorKind::InvalidData)?;
            value |= u64::from(byte[0] & 127) << shift;
            if byte[0] < 128 {
                return Ok(value);
            }
        }
        Err(io::ErrorKind::InvalidData.into())
    }

    fn skip(&mut self, size: u64) -> io::Result<()> {
        let skipped = io::copy(&mut (&mut self.from).take(size), &mut io::sink())?;
        if skipped < size {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        Ok(())
    }
}
