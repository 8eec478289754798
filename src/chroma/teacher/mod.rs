//! Teachers: who says which colour a gray photo has.
//!
//! A teacher is a colorization network (an ONNX file) or a folder of images
//! that somebody or something else has coloured. Both answer with CIELAB a, b
//! for a whole photo; lightness always stays the photo's.

mod cache;
mod error;
mod folder;
mod images;
mod network;
mod profile;
pub(crate) mod runtime;

pub use error::TeacherError;
pub use folder::FolderTeacher;
pub use images::{AbImage, GrayImage};
pub use network::NetworkTeacher;

use serde::Serialize;
use std::path::Path;

/// Someone who colours photos.
pub enum Teacher {
    /// A colorization network.
    Network(NetworkTeacher),
    /// A folder of coloured images.
    Folder(FolderTeacher),
}

/// What a report says about a teacher.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TeacherInfo {
    /// Name of the file or folder.
    pub name: String,
    /// The network's profile, such as `DDColor`, or `folder`.
    pub kind: &'static str,
    /// SHA-256 of the `.onnx` file in hexadecimal; weights that lie in separate
    /// files beside it are not in it.
    pub sha256: Option<String>,
    /// Width and height at which the network sees photos.
    pub input_size: Option<[u32; 2]>,
}

impl Teacher {
    /// Opens an `.onnx` file or a folder of coloured images.
    ///
    /// A network's answers are kept in `cache_dir` (created where missing) and
    /// used again for the same photo, model and input size; a folder needs no
    /// cache.
    ///
    /// # Errors
    /// A [`TeacherError`] where the path is neither, the folder holds no image
    /// or two images of one name, ONNX Runtime is not installed, or the model
    /// is damaged or has inputs and outputs that no profile describes.
    pub fn open(path: &Path, cache_dir: Option<&Path>) -> Result<Self, TeacherError> {
        let metadata = std::fs::metadata(path).map_err(TeacherError::io(path))?;
        let is_onnx = path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("onnx"));
        if metadata.is_dir() {
            FolderTeacher::open(path).map(Self::Folder)
        } else if is_onnx {
            NetworkTeacher::open(path, cache_dir).map(Self::Network)
        } else {
            Err(TeacherError::NoTeacher {
                path: path.to_path_buf(),
            })
        }
    }

    /// Name, kind and identity, for reports.
    pub fn describe(&self) -> TeacherInfo {
        match self {
            Self::Network(network) => network.describe(),
            Self::Folder(folder) => folder.describe(),
        }
    }

    /// Colours one photo. `name` is its path relative to the photo folder.
    ///
    /// Answers at the photo's size; `None` where a folder has no image for this
    /// photo. The same photo gets the same answer on the same machine.
    ///
    /// # Errors
    /// A [`TeacherError`] that names the photo where the network fails or
    /// answers with numbers that are not finite, or where the folder's image is
    /// damaged or has another aspect than the photo.
    pub fn colorize(
        &mut self,
        name: &str,
        photo: GrayImage<'_>,
    ) -> Result<Option<AbImage>, TeacherError> {
        photo.check(name)?;
        match self {
            Self::Network(network) => network.colorize(name, photo).map(Some),
            Self::Folder(folder) => folder.colorize(name, photo),
        }
    }
}

/// The last part of a path, for reports.
fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests;
