//! A folder of images that belong to photos by name.

use super::query::Original;
use super::settings::file_name;
use super::shown::stands;
use super::{GrayImage, Query, TeacherError};
use crate::capture::names::{NamedFiles, known, stem, visit_files};
use crate::capture::{Capture, Orientation, decode_image};
use crate::effects::listed;
use crate::input;
use image::{DynamicImage, ImageFormat};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::path::{Path, PathBuf};

/// Tolerance between the aspects of photo and image: rounding to whole pixels in a tool that works
/// at a small size, not another cut of the photo.
pub const ASPECT_TOLERANCE: f64 = 0.02;

/// Images for any subset of the photos.
///
/// An image belongs to the photo with the same path below the folder, with the extension of a
/// picture behind it or without; where there is none, to the only photo whose path differs in
/// nothing but the extension. Symbolic links to folders are not followed.
pub(super) struct NamedImages {
    folder: PathBuf,
    images: NamedFiles,
    /// Warnings about the images read so far, each with the names of its images.
    doubts: RefCell<BTreeMap<String, BTreeSet<String>>>,
}

/// An image that belongs to a photo.
pub(super) struct Found<'a> {
    /// Path of the image.
    pub path: &'a Path,
    /// In sRGB, and turned as the photo that COLMAP saw.
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
        Ok(Self {
            folder: folder.to_path_buf(),
            images,
            doubts: RefCell::default(),
        })
    }

    /// Warnings about the images read so far, a line each.
    pub fn doubts(&self) -> Vec<String> {
        let line = |(doubt, names): (&String, &BTreeSet<String>)| {
            let listed = listed(names.iter().map(String::as_str));
            let (count, folder) = (names.len(), self.folder.display());
            format!("{count} images in {folder} ({listed}) {doubt}")
        };
        self.doubts.borrow().iter().map(line).collect()
    }

    /// Keeps a doubt about an image, and the share of it that is concerned.
    pub fn doubt(&self, path: &Path, share: Option<f64>, doubt: String) {
        let mut name = file_name(path);
        if let Some(share) = share {
            name += &format!(" {:.0} %", 100.0 * share);
        }
        self.doubts
            .borrow_mut()
            .entry(doubt)
            .or_default()
            .insert(name);
    }

    /// Says which photos there are, so that an image of one is not taken for another's.
    pub fn know(&mut self, capture: &Capture) {
        self.images.know(known(&capture.views, &capture.rejected));
    }

    /// Returns true if there is an image for a photo, which may be given by its path below the
    /// photo folder.
    ///
    /// # Errors
    /// [`TeacherError::AmbiguousNames`] where nobody knows.
    pub fn covers<'a>(&'a self, query: impl Into<Query<'a>>) -> Result<bool, TeacherError> {
        Ok(self.of(query.into())?.is_some())
    }

    fn find(&self, name: &str) -> Result<Option<&Path>, TeacherError> {
        self.images.of(name).map_err(TeacherError::AmbiguousNames)
    }

    /// Path of the image for a view, and the photo it is of if that is not the view as it is.
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
    /// where it shows another cut of the photo, [`TeacherError::AmbiguousNames`] where two images
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
        let painting = decode_image(file).map_err(|reason| TeacherError::BadImage {
            path: path.to_path_buf(),
            reason,
        })?;
        if let Some(unheeded) = &painting.unheeded {
            self.doubt(path, None, format!(
                "say of their colors what cannot be heeded ({unheeded}), which are taken for sRGB: convert them to sRGB"
            ));
        }
        let size = [painting.image.width(), painting.image.height()];
        let fits = |way: &Orientation| {
            let [width, height] = way.size(size).map(f64::from);
            let aspect = width * f64::from(photo_size[1]) / (height * f64::from(photo_size[0]));
            (aspect - 1.0).abs() <= ASPECT_TOLERANCE
        };
        let ways: Vec<Orientation> = query
            .stance
            .ways(painting.orientation)
            .filter(fits)
            .collect();
        let way = match ways[..] {
            [] => {
                return Err(TeacherError::Aspect {
                    path: path.to_path_buf(),
                    size,
                    photo: name.to_string(),
                    photo_size,
                });
            }
            // What its file says holds.
            [way, ..] if !painting.orientation.is_none() => way,
            // Sides that are not swapped, or alike, do not tell.
            [lying, standing]
                if lying != standing
                    && original.is_none()
                    && stands(&painting.image, photo, [lying, standing]) =>
            {
                standing
            }
            [way, ..] => way,
        };
        Ok(Some(Found {
            path,
            image: way.image(painting.image),
            original,
        }))
    }
}

/// Returns true if a file's extension is that of a readable image, or if it has none and its first
/// bytes are an image's.
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
