//! Mask files: which pixels of a photo count.

use std::path::{Path, PathBuf};

use super::decode::{self, Picture};
use super::error::CaptureError;
use super::names::{self, NamedFiles, composed, is_one_of, visit_files};
use super::options::MaskSource;
use super::photo::same_shape;
use super::resample::downscale;
use super::sample::{Depth, Samples};
use super::unplaced::photos_in;
use super::{Capture, IMAGES, View, first_views};

/// Where masks lie unless told otherwise.
const BESIDE: &str = "masks";

/// A folder of masks with COLMAP's names: for `images/a/b.jpg` the file
/// `a/b.jpg.png`, and where there is none and no other photo is meant, `a/b.png`.
#[derive(Debug)]
pub(super) struct MaskFolder {
    files: NamedFiles,
    pub found: Masked,
}

/// What a folder of masks holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Masked {
    /// The folder.
    pub dir: PathBuf,
    /// Photos that the capture has views of.
    pub photos: usize,
    /// How many of these have a mask.
    pub masked: usize,
    /// Pictures in the folder that belong to no photo in `images/`, sorted.
    pub strays: Vec<String>,
}

impl MaskFolder {
    /// The folder that `source` names, if there is one. `partial` captures may well have photos
    /// without masks only.
    ///
    /// # Errors
    /// If a folder is named that is not there or holds the photos themselves, if
    /// it has no mask for any photo, or if nobody knows which photo a mask belongs to.
    pub fn open(
        capture: &Capture,
        source: &MaskSource,
        partial: bool,
    ) -> Result<Option<Self>, CaptureError> {
        let images = capture.root.join(IMAGES);
        let masks = match source {
            MaskSource::Off | MaskSource::Alpha => return Ok(None),
            MaskSource::Beside => capture.root.join(BESIDE),
            MaskSource::Folder(path) => path.clone(),
        };
        if !masks.is_dir() {
            return match source {
                MaskSource::Folder(_) => Err(CaptureError::NoMaskFolder { dir: masks }),
                _ => Ok(None),
            };
        }
        let (mut files, mut others) = (NamedFiles::default(), Vec::new());
        let read = visit_files(&masks, &mut |name, path| {
            let extension = path.extension().unwrap_or_default().to_string_lossy();
            if is_one_of(&extension, &["png"]) {
                files.insert(&name, path);
            } else if names::stem(&name) != name {
                others.push(composed(&name));
            }
        });
        read.map_err(|(path, source)| CaptureError::Read { path, source })?;
        files.know(names::known(capture));
        let (mut photos, mut masked) = (0, 0);
        for view in first_views(&capture.views) {
            photos += 1;
            masked += usize::from(files.of(&view.photo)?.is_some());
        }
        if masked == 0 && partial {
            return Ok(None);
        }
        if same_folder(&masks, &images) || masked == 0 {
            return Err(CaptureError::NoMasks {
                dir: masks,
                example: with_png(Path::new(&capture.views[0].photo)),
            });
        }
        // Photos without a pose may have masks as well.
        let mut all = files.clone();
        let placed_or_not = photos_in(&images);
        all.know(placed_or_not.iter().map(String::as_str));
        others.extend(all.strays().into_iter().map(str::to_owned));
        others.sort();
        Ok(Some(Self {
            files,
            found: Masked {
                dir: masks,
                photos,
                masked,
                strays: others,
            },
        }))
    }

    /// The view's mask, if it has one.
    pub fn of(&self, view: &View) -> Option<&Path> {
        // `open` has asked for every photo.
        self.files.of(&view.photo).ok().flatten()
    }
}

fn with_png(name: &Path) -> PathBuf {
    let mut name = name.as_os_str().to_owned();
    name.push(".png");
    name.into()
}

fn same_folder(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// Reads the mask of a photo of `size` pixels: what each pixel counts, `[height,
/// width]`. Of a color mask the lightest channel counts, alpha never. A mask of
/// nothing but 0 and 1 is one of numbers, not of grays, and 1 counts fully.
///
/// # Errors
/// If the file cannot be read or decoded, is not of 8 bits, or has another shape.
pub(super) fn read(path: &Path, photo: &Path, size: [u32; 2]) -> Result<Vec<u8>, CaptureError> {
    let Picture {
        header, samples, ..
    } = decode::decode_beside(path, |mask| {
        if same_shape(mask, size) {
            return Ok(());
        }
        Err(CaptureError::MaskSize {
            path: path.into(),
            mask,
            photo: photo.into(),
            size,
        })
    })?;
    let Samples::Eight(values) = samples else {
        debug_assert_ne!(header.depth, Depth::Eight);
        return Err(CaptureError::Photo {
            path: path.into(),
            reason: format!(
                "is a mask of {} a channel; save it with 8 bits or 1 bit",
                header.depth
            ),
        });
    };
    let colors = if header.channels < 3 { 1 } else { 3 };
    let mut mask: Vec<u8> = values
        .chunks_exact(header.channels)
        .map(|pixel| pixel[..colors].iter().copied().max().unwrap_or_default())
        .collect();
    if mask.iter().all(|&value| value <= 1) {
        mask.iter_mut().for_each(|value| *value *= u8::MAX);
    }
    Ok(resized(mask, header.size, size))
}

/// The mask at the photo's size: area means, or where it is the smaller one, the
/// nearest pixel.
fn resized(mask: Vec<u8>, from: [u32; 2], to: [u32; 2]) -> Vec<u8> {
    let as_sizes = |size: [u32; 2]| size.map(|side| side as usize);
    let (from, to) = (as_sizes(from), as_sizes(to));
    if from == to {
        return mask;
    }
    if from[0] >= to[0] && from[1] >= to[1] {
        return downscale(mask.as_chunks::<1>().0, from, to).into_flattened();
    }
    let nearest = |i: usize, axis: usize| (2 * i + 1) * from[axis] / (2 * to[axis]);
    (0..to[1])
        .flat_map(|y| (0..to[0]).map(move |x| (x, y)))
        .map(|(x, y)| mask[nearest(y, 1) * from[0] + nearest(x, 0)])
        .collect()
}

#[cfg(test)]
#[path = "mask_tests.rs"]
mod tests;
