//! What can be wrong with a splat file.

use std::io;
use std::path::{Path, PathBuf};

/// Why a splat file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum PlyError {
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The splat file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The file is no PLY file, or its header cannot be understood.
    #[error("{}: not a readable PLY header: {reason}", path.display())]
    Header {
        /// The splat file.
        path: PathBuf,
        /// What is wrong, with the line.
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
    /// A property that every Gaussian needs is not there.
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
        /// How many there are.
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
    /// The arrays in memory are not a splat scene.
    #[error("{}: not written: {reason}", path.display())]
    BadSplats {
        /// The file that was to be written.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
}

impl PlyError {
    /// Names the file of an I/O error.
    pub(super) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Io { path, source }
    }
}
