//! Mask files: which pixels of a photo count.

use std::path::{Path, PathBuf};

use super::decode::{self, DecodedImage};
use super::error::CaptureError;
use super::names::{self, NamedFiles, composed, is_one_of, visit_files};
use super::options::MaskSource;
use super::orientation::{Orientation, SensorOrientation};
use super::photo::same_shape;
use super::resample::downscale;
use super::sample::{Depth, Header, Samples};
use super::{Capture, View, first_views};

/// Default folder of masks, beside `images/`.
const BESIDE: &str = "masks";

/// A folder of masks with COLMAP's names: for `images/a/b.jpg` the file
/// `a/b.jpg.png`, and where there is none and no other photo is meant, `a/b.png`.
#[derive(Debug)]
pub(super) struct MaskFolder {
    files: NamedFiles,
    pub found: Masked,
}

/// Summary of a mask folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Masked {
    /// The folder.
    pub dir: PathBuf,
    /// Photos that the capture has views of.
    pub photos: usize,
    /// Number of these that have a mask.
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
        let masks = match source {
            MaskSource::Off | MaskSource::Alpha => return Ok(None),
            MaskSource::ImageMetadata => capture.root.join(BESIDE),
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
        files.know(names::known(&capture.views, &capture.rejected));
        let (mut photos, mut masked) = (0, 0);
        for view in first_views(&capture.views) {
            photos += 1;
            masked += usize::from(files.of(&view.photo)?.is_some());
        }
        if masked == 0 && partial {
            return Ok(None);
        }
        if same_folder(&masks, &capture.photos) || masked == 0 {
            return Err(CaptureError::NoMasks {
                dir: masks,
                example: with_png(Path::new(&capture.views[0].photo)),
            });
        }
        // Photos without a pose may have masks as well.
        let mut all = files.clone();
        let placed_or_not = capture.all_photos();
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

/// Values up to this are numbers and not grays, where there are no others.
const NUMBERS: u8 = 20;

/// Fewer different values than this are no soft edge.
const FEW: usize = 20;

/// Color channels differ by so much of the greatest where the color is another, and below this
/// level nothing tells.
const ANOTHER_COLOR: f32 = 0.1;
const DARK: u8 = 64;

/// Reads the mask of a photo that COLMAP saw with `size` pixels and that has this stance: weights
/// from 0 to 255, `[height, width]`, the largest color channel of each pixel, never its alpha.
/// A single nonzero value that is small or a palette color becomes 255.
///
/// # Errors
/// If the file cannot be read or decoded, is not of 8 bits, has another shape, or if its values
/// are labels of several things.
pub(crate) fn read(
    path: &Path,
    photo: &Path,
    size: [u32; 2],
    stance: SensorOrientation,
) -> Result<Vec<u8>, CaptureError> {
    let mut way = Orientation::default();
    let DecodedImage {
        header, samples, ..
    } = decode::decode_beside(path, |mask| {
        let ways = || stance.ways(mask.orientation);
        let exact = ways().find(|way| way.size(mask.size) == size);
        let near = || ways().find(|way| same_shape(way.size(mask.size), size));
        way = exact.or_else(near).ok_or_else(|| CaptureError::MaskSize {
            path: path.into(),
            mask: mask.size,
            photo: photo.into(),
            size,
        })?;
        Ok(())
    })?;
    let failed = |reason| CaptureError::Photo {
        path: path.into(),
        reason,
    };
    let Samples::Eight(values) = samples else {
        debug_assert_ne!(header.depth, Depth::Eight);
        return Err(failed(format!(
            "is a mask of {} a channel; save it with 8 bits or 1 bit",
            header.depth
        )));
    };
    if let Some(reason) = several_things(&values, &header) {
        return Err(failed(reason));
    }
    let colors = if header.channels < 3 { 1 } else { 3 };
    let mut mask: Vec<u8> = values
        .chunks_exact(header.channels)
        .map(|pixel| pixel[..colors].iter().copied().max().unwrap_or_default())
        .collect();
    let most = mask.iter().copied().max().unwrap_or_default();
    let two = mask.iter().all(|&value| value == 0 || value == most);
    if two && (most <= NUMBERS || header.indexed) {
        let counts = |value: u8| if value > 0 { u8::MAX } else { 0 };
        mask.iter_mut().for_each(|value| *value = counts(*value));
    }
    let mask = way.turned(mask, 1, header.size);
    Ok(resized(mask, way.size(header.size), size))
}

/// Reason why a mask is ambiguous, if any: its values are numbers or colors of several things, or
/// only its transparency tells.
fn several_things(values: &[u8], header: &Header) -> Option<String> {
    let colors = if header.channels < 3 { 1 } else { 3 };
    let mut known = [false; 256];
    let mut hues: Vec<[u8; 3]> = Vec::new();
    let (mut alike, mut opaque) = (true, true);
    for pixel in values.chunks_exact(header.channels) {
        let most = pixel[..colors].iter().copied().max().unwrap_or_default();
        known[usize::from(most)] = true;
        alike &= pixel[..colors] == values[..colors];
        opaque &= !header.has_alpha() || pixel[colors] == u8::MAX;
        if let &[r, g, b, ..] = pixel
            && most >= DARK
            && hues.len() <= FEW
        {
            let share = |value: u8| f32::from(value) / f32::from(most);
            let (hue, of) = ([r, g, b].map(share), f32::from(u8::MAX));
            let another = |known: &[u8; 3]| {
                let known = known.map(|value| f32::from(value) / of);
                (0..3).any(|k| (known[k] - hue[k]).abs() > ANOTHER_COLOR)
            };
            if hues.iter().all(another) {
                hues.push(hue.map(|share| (of * share).round() as u8));
            }
        }
    }
    let found: Vec<u8> = (0..=u8::MAX).filter(|&v| known[usize::from(v)]).collect();
    let remedy = "black where it does not count, white where it does";
    if alike && !opaque && header.has_alpha() && found != [0] {
        return Some(format!(
            "is a mask by its transparency alone; save it without, {remedy}"
        ));
    }
    if (2..=FEW).contains(&hues.len()) {
        return Some(format!(
            "is a mask of {} colors, which are labels; make it {remedy}",
            hues.len()
        ));
    }
    // 255 often stands for what has no label.
    let labels: Vec<u8> = found.iter().copied().filter(|&v| v < u8::MAX).collect();
    let numbers = labels.iter().all(|&v| v <= NUMBERS) && labels.iter().any(|&v| v > 0);
    let dim = labels.len() == found.len() && found.len() <= FEW;
    if numbers && found.iter().filter(|&&v| v > 0).count() > 1 || dim && found.len() > 2 {
        let named: Vec<String> = found.iter().take(6).map(u8::to_string).collect();
        let more = if found.len() > named.len() {
            ", …"
        } else {
            ""
        };
        return Some(format!(
            "is a mask of the values {}{more}, which are labels; make it {remedy}",
            named.join(", ")
        ));
    }
    None
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
