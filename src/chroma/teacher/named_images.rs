//! A folder of images that belong to photos by name.

use super::error::first_line;
use super::{GrayImage, TeacherError};
use image::DynamicImage;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fs;
use std::path::{Path, PathBuf};

/// How far the aspects of photo and image may differ: rounding to whole pixels
/// in a tool that works at a small size, not another cut of the photo.
const ASPECT_TOLERANCE: f64 = 0.02;

/// Images for any subset of the photos.
///
/// An image belongs to the photo with the same path below the folder, whatever
/// the two extensions are. Symbolic links to folders are not followed.
pub(super) struct NamedImages {
    /// Images by path below the folder, without extension.
    images: BTreeMap<String, PathBuf>,
}

impl NamedImages {
    /// Looks for images in `folder` and its subfolders.
    ///
    /// # Errors
    /// [`TeacherError::EmptyFolder`] where there is none,
    /// [`TeacherError::TwoImages`] where two differ only in their extension,
    /// [`TeacherError::Io`] where a folder cannot be read.
    pub fn open(folder: &Path) -> Result<Self, TeacherError> {
        let mut images = BTreeMap::new();
        let mut folders = vec![folder.to_path_buf()];
        while let Some(current) = folders.pop() {
            for entry in fs::read_dir(&current).map_err(TeacherError::io(&current))? {
                let entry = entry.map_err(TeacherError::io(&current))?;
                let path = entry.path();
                let kind = entry.file_type().map_err(TeacherError::io(&path))?;
                if kind.is_dir() {
                    folders.push(path);
                } else if is_image(&path) && path.is_file() {
                    let below = path.strip_prefix(folder).unwrap_or(&path);
                    match images.entry(key(below)) {
                        Entry::Vacant(entry) => {
                            entry.insert(path);
                        }
                        Entry::Occupied(entry) => {
                            return Err(TeacherError::TwoImages {
                                first: entry.get().min(&path).clone(),
                                second: entry.get().max(&path).clone(),
                            });
                        }
                    }
                }
            }
        }
        if images.is_empty() {
            return Err(TeacherError::EmptyFolder {
                path: folder.to_path_buf(),
            });
        }
        Ok(Self { images })
    }

    /// Whether there is an image for the photo with this path below the photo
    /// folder.
    pub fn covers(&self, name: &str) -> bool {
        self.images.contains_key(&key(Path::new(name)))
    }

    /// The image for a photo and where it lies; none where there is none.
    ///
    /// # Errors
    /// [`TeacherError::BadImage`] where it is damaged, [`TeacherError::Aspect`]
    /// where it shows another cut of the photo, [`TeacherError::Io`].
    pub fn load(
        &self,
        name: &str,
        photo: GrayImage<'_>,
    ) -> Result<Option<(&Path, DynamicImage)>, TeacherError> {
        let Some(path) = self.images.get(&key(Path::new(name))) else {
            return Ok(None);
        };
        let reader = image::ImageReader::open(path).map_err(TeacherError::io(path))?;
        // A .png that is really a JPEG is a common slip and does no harm.
        let reader = reader.with_guessed_format();
        let decoded = reader.map_err(TeacherError::io(path))?.decode();
        let image = decoded.map_err(|error| TeacherError::BadImage {
            path: path.clone(),
            reason: first_line(error),
        })?;
        let (width, height) = (image.width(), image.height());
        let aspect = f64::from(width) * f64::from(photo.height)
            / (f64::from(height) * f64::from(photo.width));
        if (aspect - 1.0).abs() > ASPECT_TOLERANCE {
            return Err(TeacherError::Aspect {
                path: path.clone(),
                size: [width, height],
                photo: name.to_string(),
                photo_size: [photo.width, photo.height],
            });
        }
        Ok(Some((path, image)))
    }
}

fn is_image(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default();
    ["png", "jpg", "jpeg"]
        .iter()
        .any(|known| extension.eq_ignore_ascii_case(known))
}

/// A path without its extension, with `/` between its parts on every system.
fn key(path: &Path) -> String {
    let path = path.with_extension("");
    let parts: Vec<_> = path
        .components()
        .filter(|part| !matches!(part, std::path::Component::CurDir))
        .map(|part| part.as_os_str().to_string_lossy())
        .collect();
    parts.join("/")
}
