//! Errors of splat files of any format.

use std::{
    io,
    path::{Path, PathBuf},
};

use ply_rs_bw::ply::ElementDef;

use super::Format;
use crate::input::excerpt;

/// Error of reading or writing a splat file.
#[derive(Debug, thiserror::Error)]
pub enum SplatError {
    /// The file system returned an error.
    #[error("{}: {source}", path.display())]
    Io {
        /// File at fault.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The extension of the output file belongs to no format.
    #[error(
        "{}: no format of splat files has this extension; those known are {}", path.display(), Format::list(|_| true)
    )]
    UnknownFormat {
        /// File at fault.
        path: PathBuf,
    },
    /// The file has a format that is not read.
    #[error(
        "{}: {format} files are not read; {remedy} (those read are {})", path.display(), Format::list(Format::is_read)
    )]
    OtherFormat {
        /// File at fault.
        path: PathBuf,
        /// Extension of the file.
        format: String,
        /// Conversion to a format that is read.
        remedy: &'static str,
    },
    /// A part of the file contradicts its format.
    #[error("{}: {field}: {reason}", path.display())]
    Damaged {
        /// File at fault.
        path: PathBuf,
        /// The part of the file.
        field: &'static str,
        /// Defect of that part.
        reason: String,
    },
    /// The format's numbers are too coarse for the scene.
    #[error(
        "{}: not written: this format would move {moved} of {count} Gaussians by up to half their size or more; write a .ply or a .compressed.ply", path.display()
    )]
    Coarse {
        /// The file that was to be written.
        path: PathBuf,
        /// Gaussians that are smaller than a step of the format's numbers.
        moved: usize,
        /// All Gaussians.
        count: usize,
    },
    /// The arrays are not a splat scene, or the format has no place for so many.
    #[error("{}: not written: {reason}", path.display())]
    NotWritten {
        /// The file that was to be written.
        path: PathBuf,
        /// Reason of the refusal.
        reason: String,
    },
    /// The vertices are points, not Gaussians.
    #[error(
        "{}: a point cloud, not a splat file: its vertices have neither opacity nor scales; give a trained scene, or none, and training starts from COLMAP's points", path.display()
    )]
    PointCloud {
        /// File at fault.
        path: PathBuf,
    },
    /// A property that every Gaussian needs is missing.
    #[error("{}: not a splat file: vertices have no property \"{property}\"", path.display())]
    MissingProperty {
        /// The splat file.
        path: PathBuf,
        /// The property's name.
        property: String,
    },
    /// A number of a Gaussian is an integer.
    #[error(
        "{}: vertex property \"{property}\" has an integer type, which holds no logarithm, quaternion or harmonic; write it as float, or all as ushort, for floats of 16 bits in a binary file", path.display()
    )]
    Integer {
        /// The splat file.
        path: PathBuf,
        /// The property's name.
        property: String,
    },
    /// The spherical harmonics have no known degree.
    #[error(
        "{}: {count} properties f_rest_* where 0, 9, 24 or 45 (SH degree 0 to 3) are expected", path.display()
    )]
    RestCount {
        /// The splat file.
        path: PathBuf,
        /// Number of `f_rest_*` properties.
        count: usize,
    },
    /// The file ends before its last Gaussian.
    #[error(
        "{}: the header announces {announced} {element} rows, more than the file holds; it is cut off or damaged", path.display()
    )]
    Truncated {
        /// The splat file.
        path: PathBuf,
        /// The element whose rows are missing.
        element: String,
        /// The count in the header.
        announced: usize,
    },
    /// A row of a text file is not what the header says.
    #[error("{}: {element} row {index} does not hold the numbers that the header announces", path.display())]
    Row {
        /// The splat file.
        path: PathBuf,
        /// The element of the row.
        element: String,
        /// The row, from 0.
        index: usize,
    },
    /// A Gaussian cannot be written.
    #[error("{}: not written: {property} of splat {index} is {value}", path.display())]
    BadValue {
        /// The file that was to be written.
        path: PathBuf,
        /// The Gaussian, from 0.
        index: usize,
        /// Its property.
        property: &'static str,
        /// The offending value.
        value: f64,
    },
}

impl SplatError {
    /// Names the file of an I/O error.
    pub(super) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Io { path, source }
    }

    /// Says that an element's rows go beyond the end of the file.
    pub(super) fn truncated(path: &Path, element: &ElementDef) -> Self {
        Self::Truncated {
            path: path.to_path_buf(),
            element: excerpt(&element.name).into_owned(),
            announced: element.count,
        }
    }

    /// Names the property that every Gaussian needs.
    pub(super) fn missing(path: &Path, property: &str) -> Self {
        Self::MissingProperty {
            path: path.to_path_buf(),
            property: property.to_owned(),
        }
    }

    /// Names the file and the part that is damaged.
    pub(super) fn damaged(path: &Path, field: &'static str, reason: impl Into<String>) -> Self {
        Self::Damaged {
            path: path.to_path_buf(),
            field,
            reason: reason.into(),
        }
    }
}
