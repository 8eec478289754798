//! Teachers: who says which color a gray photo has.
//!
//! A teacher is a colorization network (an ONNX file) or a folder of images
//! that somebody or something else has colored. Both answer with CIELAB a, b
//! for a whole photo; lightness always stays the photo's.

mod bounded;
mod cache;
mod catalog;
mod checkup;
mod device;
mod error;
mod folder;
mod guess;
mod hints;
mod images;
mod model;
mod named_images;
mod network;
mod places;
mod plausible;
mod profile;
mod query;
mod runtime;
mod settings;
mod shown;
mod tensor;
mod trial;
mod upsample;
mod weights;

pub use catalog::{Catalog, KnownTeacher};
pub use checkup::{Checkup, NetworkCheck, Trial, check};
pub use error::TeacherError;
pub use folder::FolderTeacher;
pub use hints::{HintFolder, HintImage};
pub use images::{AbImage, GrayImage};
pub(super) use images::{Filter, resample};
#[cfg(feature = "cli")]
pub(crate) use named_images::ASPECT_TOLERANCE;
pub use network::{NetworkTeacher, ProfileSource};
pub use query::Query;
pub use settings::{TeacherDevice, TeacherInfo, TeacherSettings};
pub use upsample::Upsample;
#[cfg(feature = "cli")]
pub(crate) use {device::load_model, places::cache_folder};

use std::path::{Path, PathBuf};

/// Someone who colors photos.
pub struct Teacher {
    source: TeacherKind,
    upsample: Upsample,
}

enum TeacherKind {
    Network(Box<NetworkTeacher>),
    Folder(Box<FolderTeacher>),
}

impl Teacher {
    /// Opens an `.onnx` file, a folder of colored images, or a network of the [`Catalog`] by
    /// its name.
    ///
    /// A network's answers are kept in `cache_dir` (created where missing) and
    /// used again for the same photo, model, profile, input size and hints; where that cannot be
    /// written to they are not kept, see [`Self::unkept`]. A folder needs no cache.
    ///
    /// # Errors
    /// A [`TeacherError`] where the path is none of these, the network is not on this machine
    /// or another than the catalog says, the folder holds no image
    /// or two images of one name, ONNX Runtime is not installed, the model is
    /// damaged, or its inputs and outputs fit no profile, not the one that is
    /// asked for, or more than one.
    pub fn open(
        path: &Path,
        cache_dir: Option<&Path>,
        settings: &TeacherSettings,
    ) -> Result<Self, TeacherError> {
        let catalog = Catalog::open()?;
        let path = &*catalog.locate(path)?;
        let metadata = std::fs::metadata(path).map_err(TeacherError::io(path))?;
        let is_onnx = path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("onnx"));
        let source = if metadata.is_dir() {
            TeacherKind::Folder(Box::new(FolderTeacher::open(path)?))
        } else if is_onnx {
            TeacherKind::Network(Box::new(NetworkTeacher::open(
                path, cache_dir, settings, &catalog,
            )?))
        } else {
            return Err(TeacherError::NoTeacher {
                path: path.to_path_buf(),
            });
        };
        Ok(Self {
            source,
            upsample: settings.upsample,
        })
    }

    /// Returns true if it is a network and not a folder.
    pub fn is_network(&self) -> bool {
        matches!(self.source, TeacherKind::Network(_))
    }

    /// Says which photos there are, so that a folder's image of one is not taken for another's.
    pub fn know(&mut self, capture: &crate::capture::Capture) {
        if let TeacherKind::Folder(folder) = &mut self.source {
            folder.know(capture);
        }
    }

    /// Returns true if it can answer for a photo: a network always, a folder if there is an image.
    ///
    /// # Errors
    /// [`TeacherError::AmbiguousNames`] where nobody knows.
    pub fn covers<'a>(&'a self, query: impl Into<Query<'a>>) -> Result<bool, TeacherError> {
        match &self.source {
            TeacherKind::Network(_) => Ok(true),
            TeacherKind::Folder(folder) => folder.covers(query),
        }
    }

    /// Name, kind and identity, for reports.
    pub fn describe(&self) -> TeacherInfo {
        match &self.source {
            TeacherKind::Network(network) => network.describe(),
            TeacherKind::Folder(folder) => folder.describe(),
        }
    }

    /// Error that prevents a network's answers from being cached, if any.
    pub fn unkept(&self) -> Option<&TeacherError> {
        match &self.source {
            TeacherKind::Network(network) => network.unkept.as_ref(),
            TeacherKind::Folder(_) => None,
        }
    }

    /// Warnings about preferred devices that fail to run a network, a line each.
    pub fn passed_over(&self) -> Vec<String> {
        match &self.source {
            TeacherKind::Network(network) => network.passed_over(),
            TeacherKind::Folder(_) => Vec::new(),
        }
    }

    /// Warnings about the images that a folder has answered with so far, a line each.
    pub fn doubts(&self) -> Vec<String> {
        match &self.source {
            TeacherKind::Network(_) => Vec::new(),
            TeacherKind::Folder(folder) => folder.doubts(),
        }
    }

    /// Refuses a folder whose images so far show other photos than those whose names they have.
    ///
    /// # Errors
    /// [`TeacherError::OtherPhotos`].
    pub fn check_images(&self) -> Result<(), TeacherError> {
        match &self.source {
            TeacherKind::Network(_) => Ok(()),
            TeacherKind::Folder(folder) => folder.check(),
        }
    }

    /// Colors one photo, which may be given by its path relative to the photo folder;
    /// `hints` are told to a network that takes hints.
    ///
    /// Answers at the photo's size; `None` where a folder has no image for this
    /// photo. The same photo gets the same answer on the same machine.
    ///
    /// # Errors
    /// A [`TeacherError`] that names the photo where the network fails or
    /// answers with numbers that are not finite or no colors, or where the folder's image is
    /// damaged or has another aspect than the photo.
    pub fn colorize<'a>(
        &mut self,
        query: impl Into<Query<'a>>,
        photo: GrayImage<'_>,
        hints: Option<&HintImage>,
    ) -> Result<Option<AbImage>, TeacherError> {
        let query = query.into();
        photo.check(query.name)?;
        let answer = match &mut self.source {
            TeacherKind::Network(network) => Some(asked(network, query, photo, hints)?),
            TeacherKind::Folder(folder) => folder.colorize(query, photo)?,
        };
        Ok(answer.map(|answer| answer.upsampled(photo, self.upsample)))
    }
}

/// Answer of a network for a photo, which is shown to it upright.
fn asked(
    network: &mut NetworkTeacher,
    query: Query<'_>,
    photo: GrayImage<'_>,
    hints: Option<&HintImage>,
) -> Result<AbImage, TeacherError> {
    let upright = query.stance.upright;
    if upright.is_none() {
        return network.colorize(query.name, photo, hints);
    }
    let pixels = photo.turned(upright);
    let [width, height] = upright.size([photo.width, photo.height]);
    let standing = GrayImage {
        width,
        height,
        pixels: &pixels,
    };
    let hints = hints.map(|hints| hints.turned(upright));
    let answer = network.colorize(query.name, standing, hints.as_ref())?;
    Ok(answer.turned(upright.inverse()))
}

/// The file or folder that a user means by what is given as a teacher: what is at this path, or
/// else the network of the [`Catalog`] of this name.
///
/// # Errors
/// [`TeacherError::UnknownTeacher`], [`TeacherError::NotFetched`], and those of
/// [`Catalog::open`].
pub fn located(path: &Path) -> Result<PathBuf, TeacherError> {
    Catalog::open()?.locate(path)
}

#[cfg(test)]
mod contract_tests;
#[cfg(test)]
mod export_tests;
#[cfg(test)]
mod tests;
