//! A folder of images that belong to photos by name.

use super::error::first_line;
use super::query::Original;
use super::{GrayImage, Query, TeacherError};
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

/// An image that belongs to a photo.
pub(super) struct Found<'a> {
    /// Where it lies.
    pub path: &'a Path,
    pub image: DynamicImage,
    /// Set where the image is of the photo before its lens was taken out.
    pub original: Option<Original<'a>>,
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

    /// The image for a photo; none where there is none. A face of a photo may have
    /// an image of its own; otherwise it is part of the photo's.
    ///
    /// # Errors
    /// [`TeacherError::BadImage`] where it is damaged, [`TeacherError::Aspect`]
    /// where it shows another cut of the photo, [`TeacherError::Io`].
    pub fn load<'a>(
        &'a self,
        query: Query<'a>,
        photo: GrayImage<'_>,
    ) -> Result<Option<Found<'a>>, TeacherError> {
        let find = |name: &str| self.images.get(&key(Path::new(name)));
        let whole = || {
            let original = query.original?;
            Some((original.name, find(original.name)?, Some(original)))
        };
        // A view with its photo's name has no image of its own, but its photo's.
        let own = match query.original {
            Some(original) if original.name == query.name => None,
            _ => find(query.name).map(|path| (query.name, path, None)),
        };
        let Some((name, path, original)) = own.or_else(whole) else {
            return Ok(None);
        };
        let photo_size = original.map_or([photo.width, photo.height], |original| original.size());
        let reader = image::ImageReader::open(path).map_err(TeacherError::io(path))?;
        // A .png that is really a JPEG is a common slip and does no harm.
        let reader = reader.with_guessed_format();
        let decoded = reader.map_err(TeacherError::io(path))?.decode();
        let image = decoded.map_err(|error| TeacherError::BadImage {
            path: path.clone(),
            reason: first_line(error),
        })?;
        let (width, height) = (image.width(), image.height());
        let aspect = f64::from(width) * f64::from(photo_size[1])
            / (f64::from(height) * f64::from(photo_size[0]));
        if (aspect - 1.0).abs() > ASPECT_TOLERANCE {
            return Err(TeacherError::Aspect {
                path: path.clone(),
                size: [width, height],
                photo: name.to_string(),
                photo_size,
            });
        }
        Ok(Some(Found {
            path,
            image,
            original,
        }))
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
