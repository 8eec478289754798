//! A folder of images that belong to photos by name.

use super::query::Original;
use super::{GrayImage, Query, TeacherError};
use crate::capture::names::{NamedFiles, known, stem, visit_files};
use crate::capture::{Capture, decode_image};
use crate::input;
use image::{DynamicImage, ImageFormat};
use std::io::Read;
use std::path::Path;

/// How far the aspects of photo and image may differ: rounding to whole pixels
/// in a tool that works at a small size, not another cut of the photo.
const ASPECT_TOLERANCE: f64 = 0.02;

/// Images for any subset of the photos.
///
/// An image belongs to the photo with the same path below the folder, with the extension of a
/// picture behind it or without; where there is none, to the only photo whose path differs in
/// nothing but the extension. Symbolic links to folders are not followed.
pub(super) struct NamedImages {
    images: NamedFiles,
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
    /// [`TeacherError::Io`] where a folder cannot be read.
    pub fn open(folder: &Path) -> Result<Self, TeacherError> {
        let mut images = NamedFiles::default();
        let read = visit_files(folder, &mut |name, path| {
            if is_image(&path) {
                images.insert(&name, path);
            }
        });
        read.map_err(|(path, source)| TeacherError::Io { path, source })?;
        if images.is_empty() {
            return Err(TeacherError::EmptyFolder {
                path: folder.to_path_buf(),
            });
        }
        Ok(Self { images })
    }

    /// Says which photos there are, so that an image of one is not taken for another's.
    pub fn know(&mut self, capture: &Capture) {
        self.images.know(known(capture));
    }

    /// Whether there is an image for a photo, which may be given by its path below the photo
    /// folder.
    ///
    /// # Errors
    /// [`TeacherError::Ambiguous`] where nobody knows.
    pub fn covers<'a>(&'a self, query: impl Into<Query<'a>>) -> Result<bool, TeacherError> {
        Ok(self.of(query.into())?.is_some())
    }

    fn find(&self, name: &str) -> Result<Option<&Path>, TeacherError> {
        self.images.of(name).map_err(TeacherError::Ambiguous)
    }

    /// Where the image for a view lies, and of which photo it is where that is not the view as
    /// it is.
    fn of<'a>(
        &'a self,
        query: Query<'a>,
    ) -> Result<Option<(&'a Path, Option<Original<'a>>)>, TeacherError> {
        // A view with its photo's name has no image of its own, but its photo's.
        let own = match query.original {
            Some(original) if original.name == query.name => None,
            _ => self.find(query.name)?.map(|path| (path, None)),
        };
        Ok(match (own, query.original) {
            (None, Some(original)) => {
                let path = self.find(original.name)?;
                path.map(|path| (path, Some(original)))
            }
            (own, _) => own,
        })
    }

    /// The image for a photo; none where there is none. A face of a photo may have
    /// an image of its own; otherwise it is part of the photo's.
    ///
    /// # Errors
    /// [`TeacherError::BadImage`] where it is damaged, [`TeacherError::Aspect`]
    /// where it shows another cut of the photo, [`TeacherError::Ambiguous`] where two images
    /// may be the photo's or the image may be another's, [`TeacherError::Io`].
    pub fn load<'a>(
        &'a self,
        query: Query<'a>,
        photo: GrayImage<'_>,
    ) -> Result<Option<Found<'a>>, TeacherError> {
        let Some((path, original)) = self.of(query)? else {
            return Ok(None);
        };
        let name = original.map_or(query.name, |original| original.name);
        let photo_size = original.map_or([photo.width, photo.height], |original| original.size());
        let file = input::read(path).map_err(TeacherError::io(path))?;
        let image = decode_image(file).map_err(|reason| TeacherError::BadImage {
            path: path.to_path_buf(),
            reason,
        })?;
        let (width, height) = (image.width(), image.height());
        let aspect = f64::from(width) * f64::from(photo_size[1])
            / (f64::from(height) * f64::from(photo_size[0]));
        if (aspect - 1.0).abs() > ASPECT_TOLERANCE {
            return Err(TeacherError::Aspect {
                path: path.to_path_buf(),
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

/// Whether a file's name says that it is an image that can be read, or its first bytes do where
/// its name does not say that it is a picture.
fn is_image(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default();
    let named = ["png", "jpg", "jpeg", "tif", "tiff"];
    if named
        .iter()
        .any(|known| extension.eq_ignore_ascii_case(known))
    {
        return true;
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut magic = Vec::new();
    let read = |mut file: std::fs::File| file.by_ref().take(16).read_to_end(&mut magic);
    stem(&name) == name
        && input::open(path).and_then(read).is_ok()
        && matches!(
            image::guess_format(&magic),
            Ok(ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Tiff)
        )
}
