//! All photos of a capture, loaded alike.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{
    Mutex, MutexGuard, PoisonError,
    atomic::{AtomicBool, Ordering},
};

use super::decode;
use super::error::CaptureError;
use super::mask::{self, MaskFolder, Masked};
use super::options::{LoadOptions, MaskSource, Normalize};
use super::orientation::SensorOrientation;
use super::original::Original;
use super::photo::{Photo, working_size};
use super::sample::Depth;
use super::tone;
use super::view::stance;
use super::{Camera, Capture, View};

/// Pixels of each photo that are sampled to find the range of all: of 20 photos, 400 lie beyond
/// each of the two percentiles.
const SAMPLED_PIXELS: usize = 4096;

/// The share of all values that may lie beyond either end of the range: specular
/// highlights, dead pixels.
const BEYOND: f64 = 0.005;

/// Photos whose range fills less of the scale than this are normalized: the device
/// keeps 8 bits, and one of them would say nothing.
const FULL_ENOUGH: f64 = 0.5;

/// Loads photos, all with the same options.
#[derive(Debug)]
pub struct Loader {
    options: LoadOptions,
    masks: Option<MaskFolder>,
    /// Depth of all photos' values; `None` where it is not needed.
    depth: Option<Depth>,
    /// Number of pixels of each loaded photo whose values are not finite; a photo may be loaded for
    /// several views.
    not_finite: Mutex<BTreeMap<String, usize>>,
    /// Photos whose files have an alpha channel that is taken for their mask.
    with_alpha: BTreeSet<String>,
    /// Loaded photos with alpha that are transparent anywhere.
    transparent: Mutex<BTreeSet<String>>,
    /// True if COLMAP saw any photo rotated by its EXIF orientation.
    turned: AtomicBool,
}

impl Loader {
    /// Loads single photos: without masks, and with [`Normalize::Auto`] taken for
    /// [`Normalize::Off`].
    pub fn new(options: LoadOptions) -> Self {
        Self {
            options: LoadOptions {
                normalize: match options.normalize {
                    Normalize::Auto => Normalize::Off,
                    decided => decided,
                },
                masks: MaskSource::Off,
                ..options
            },
            masks: None,
            depth: None,
            not_finite: Mutex::default(),
            with_alpha: BTreeSet::new(),
            transparent: Mutex::default(),
            turned: AtomicBool::new(false),
        }
    }

    /// Looks at a capture's masks and at the headers of its photos.
    ///
    /// # Errors
    /// If the masks that the options name are not there, a photo cannot be read, photos
    /// whose values mean different things were to be normalized together, or the range to
    /// normalize holds none of their values.
    pub fn open(capture: &Capture, options: &LoadOptions) -> Result<Self, CaptureError> {
        let masks = MaskFolder::open(capture, &options.masks, options.chosen.is_some())?;
        let mut loader = Self::new(options.clone());
        let takes_alpha = masks.is_none() && options.masks != MaskSource::Off;
        let one_range = options.normalize != Normalize::Off;
        let mut first: Option<(&View, Depth)> = None;
        for view in first_views(&capture.views) {
            if !(takes_alpha || one_range) {
                break;
            }
            let header = decode::header(&view.image_path)?;
            if takes_alpha && header.has_alpha() {
                loader.with_alpha.insert(view.photo.clone());
            }
            let depth = header.depth;
            match first {
                Some((other, other_depth)) if one_range && other_depth != depth => {
                    return Err(CaptureError::MixedDepths {
                        path: view.image_path.clone(),
                        depth: depth.to_string(),
                        other: other.image_path.clone(),
                        other_depth: other_depth.to_string(),
                    });
                }
                _ => first = Some((view, depth)),
            }
            if let Normalize::Range(range) = options.normalize
                && depth != Depth::Float
                && (range[0] >= depth.white() || range[1] <= 0.0)
            {
                return Err(CaptureError::RangeBeyond {
                    path: view.image_path.clone(),
                    depth: depth.to_string(),
                    white: depth.white(),
                    range,
                });
            }
        }
        loader.options.masks = match (&masks, loader.with_alpha.is_empty()) {
            (Some(_), _) => absolute(&options.masks),
            (None, false) => MaskSource::Alpha,
            (None, true) => MaskSource::Off,
        };
        loader.masks = masks;
        loader.depth = first.map(|(_, depth)| depth).filter(|_| one_range);
        if loader.depth > Some(Depth::Eight) {
            loader.options.normalize = options.normalize;
        }
        Ok(loader)
    }

    /// Returns true if [`Self::sample`]s of all photos are needed before one can be loaded.
    pub fn undecided(&self) -> bool {
        self.options.normalize == Normalize::Auto
    }

    /// Some of a photo's values, evenly spread over it.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn sample(&self, view: &View) -> Result<Vec<f32>, CaptureError> {
        let (picture, stance) = decoded(view)?;
        let mask = match self.alpha(view, &picture) {
            Some(alpha) => Some(alpha),
            None => self.mask(view, picture.header.size, stance)?,
        };
        let channel = self.options.channel;
        Ok(tone::sample(
            &picture,
            mask.as_deref(),
            channel,
            SAMPLED_PIXELS,
        ))
    }

    /// Chooses the range from [`Self::sample`]s of all photos, in any order.
    pub fn decide(&mut self, mut samples: Vec<f32>) {
        let white = self.depth.map_or(1.0, Depth::white);
        let range = percentiles(&mut samples);
        self.options.normalize = match range {
            Some([low, high]) if !fills(low / white, high / white) => Normalize::Range([low, high]),
            _ => Normalize::Off,
        };
    }

    /// Decodes the photo of a view, with its mask, takes its lens's distortion out where
    /// the view says so, and resizes its camera to it.
    ///
    /// Reads JPEG, PNG and TIFF: 8 or 16 bits a channel or floats, gray or RGB.
    /// Transparency is its mask where the options say so; color profiles are ignored. Pixels stay
    /// as the file has them, whatever its EXIF orientation says, because COLMAP ignores that; they
    /// are turned where only then they have the camera's shape. A photo whose longer side exceeds
    /// `max_side` is downscaled to it by area averaging of the encoded values, at its aspect
    /// ratio.
    ///
    /// # Errors
    /// If the photo or its mask cannot be read or decoded, is of another kind, is cut
    /// off or would take more than 512 MiB; if the photo has neither its camera's size
    /// to within a pixel a side nor its aspect ratio to within 1 %, or the mask not the
    /// photo's; or if no pixel counts.
    pub fn load(&self, view: &View) -> Result<(Photo, Camera), CaptureError> {
        let (picture, stance) = decoded(view)?;
        let mask = self.mask(view, picture.header.size, stance)?;
        let alpha = self.alpha(view, &picture);
        let transparent = alpha.is_some();
        let mut pixels = tone::develop(picture, &self.options);
        let not_finite = pixels.mask.iter().flatten().filter(|&&count| count == 0);
        self.counts().insert(view.photo.clone(), not_finite.count());
        pixels.cover(mask);
        pixels.cover(alpha);
        if pixels
            .mask
            .as_ref()
            .is_some_and(|mask| mask.iter().all(|&count| count == 0))
        {
            return Err(CaptureError::NothingCounts {
                path: view.image_path.clone(),
                reason: match self.masks.as_ref().and_then(|masks| masks.of(view)) {
                    Some(mask) => format!("its mask {} leaves no pixel", mask.display()),
                    None if transparent => "its transparency leaves no pixel".into(),
                    None => "has no finite value".into(),
                },
            });
        }
        let (lens, max_side) = (view.undistortion.as_ref(), self.options.max_side);
        let photo = pixels
            .shrunk_to(self.photo_side(view))
            .into_photo(self.options.masked);
        Ok(match lens {
            Some(lens) => lens.apply(&photo, &view.camera, max_side),
            None => {
                let camera = view.camera.resized(photo.width, photo.height);
                (photo, camera)
            }
        })
    }

    /// The least and the greatest value of a photo's file, in its unit; none of one of 8 bits.
    ///
    /// # Errors
    /// If it cannot be read or decoded.
    pub fn extremes(&self, path: &Path) -> Result<Option<[f64; 2]>, CaptureError> {
        let picture = decode::decode(path, |_| Ok(()))?;
        let deep = picture.header.depth > Depth::Eight;
        Ok(tone::extremes(&picture, self.options.channel).filter(|_| deep))
    }

    /// The photo of a view at its file's size and depth, with its lens's distortion, and what
    /// masks leave of it; of more than 8 bits in a range of its own.
    ///
    /// # Errors
    /// As [`Self::load`], but a photo of which no pixel counts is none.
    pub fn original(&self, view: &View, range: Normalize) -> Result<Original, CaptureError> {
        let (mut picture, stance) = decoded(view)?;
        let mask = self.mask(view, picture.header.size, stance)?;
        let alpha = self.alpha(view, &picture);
        let exif = picture.exif.take();
        let mut original = self.made_gray(&picture, range, stance, exif);
        for mask in [mask, alpha].into_iter().flatten() {
            original.mask = Some(match original.mask {
                Some(own) => (own.iter().zip(&mask)).map(|(a, b)| *a.min(b)).collect(),
                None => mask,
            });
        }
        Ok(original)
    }

    /// A photo that no view shows, as [`Self::original`] has it; turned where others were.
    ///
    /// # Errors
    /// If it cannot be read or decoded.
    pub fn unplaced(&self, path: &Path, range: Normalize) -> Result<Original, CaptureError> {
        let mut picture = decode::decode(path, |_| Ok(()))?;
        let turned = self.turned.load(Ordering::Relaxed);
        let stance = SensorOrientation::new(picture.header.orientation, turned);
        let exif = picture.exif.take();
        Ok(self.made_gray(&picture.turned(stance.from_file), range, stance, exif))
    }

    fn made_gray(
        &self,
        picture: &decode::DecodedImage,
        range: Normalize,
        stance: SensorOrientation,
        exif: Option<Vec<u8>>,
    ) -> Original {
        let [width, height] = picture.header.size;
        let depth = picture.header.depth;
        let deep = depth > Depth::Eight;
        let own = if deep { range } else { Normalize::Off };
        // What has another depth than the scene's photos is in no range of theirs.
        let scene = match self.depth {
            Some(scene) if scene != depth => own,
            _ => self.options.normalize,
        };
        let byte = |gray: u16| ((u32::from(gray) + 128) / 257) as u8;
        Original {
            width,
            height,
            gray: tone::gray(picture, own, &self.options),
            in_scene: (scene != own).then(|| {
                let gray = tone::gray(picture, scene, &self.options);
                gray.into_iter().map(byte).collect()
            }),
            deep,
            mask: tone::finite(
                &picture.samples,
                picture.header.channels,
                self.options.channel,
            ),
            stance,
            exif,
        }
    }

    /// The longest side that the photo of a view may have.
    fn photo_side(&self, view: &View) -> Option<u32> {
        match &view.undistortion {
            Some(lens) => lens.photo_side(&view.camera, self.options.max_side),
            None => self.options.max_side,
        }
    }

    /// The camera that [`Self::load`] gives, from the photo's header alone.
    ///
    /// # Errors
    /// If the header cannot be read or announces another shape than the camera's.
    pub fn camera(&self, view: &View) -> Result<Camera, CaptureError> {
        Ok(self.standing(view)?.0)
    }

    /// [`Self::camera`], and how the photo stands.
    ///
    /// # Errors
    /// As there.
    pub fn standing(&self, view: &View) -> Result<(Camera, SensorOrientation), CaptureError> {
        let (size, stance) = self.seen(view)?;
        let size = working_size(size, self.photo_side(view));
        let camera = match &view.undistortion {
            Some(lens) => lens.camera(size, &view.camera, self.options.max_side),
            None => view.camera.resized(size[0], size[1]),
        };
        Ok((camera, stance))
    }

    /// Width and height of the photo of a view in its file, turned as COLMAP saw it, and how it
    /// stands.
    ///
    /// # Errors
    /// As [`Self::standing`].
    pub fn seen(&self, view: &View) -> Result<([u32; 2], SensorOrientation), CaptureError> {
        let header = decode::header(&view.image_path)?;
        let stance = stance(view, &header)?;
        if !stance.from_file.is_none() {
            self.turned.store(true, Ordering::Relaxed);
        }
        Ok((stance.from_file.size(header.size), stance))
    }

    /// The options with what `Auto` came to, as the report keeps them.
    pub fn options(&self) -> &LoadOptions {
        &self.options
    }

    /// Number of views with a mask, or a photo with an alpha channel that is taken for it.
    pub fn masked_views(&self, views: &[View]) -> usize {
        let masked = |view: &&View| {
            let of_file = self.masks.as_ref().and_then(|masks| masks.of(view));
            of_file.is_some() || self.with_alpha.contains(&view.photo)
        };
        views.iter().filter(masked).count()
    }

    /// Summary of the mask folder, if there is one.
    pub fn masked(&self) -> Option<&Masked> {
        self.masks.as_ref().map(|masks| &masks.found)
    }

    /// Number of photos loaded so far that are transparent where that is taken for a mask.
    pub fn transparent(&self) -> usize {
        let known = self.transparent.lock();
        known.unwrap_or_else(PoisonError::into_inner).len()
    }

    /// Pixels of the photos loaded so far, at the files' sizes, whose values are not
    /// finite: they count nothing.
    pub fn not_finite(&self) -> usize {
        self.counts().values().sum()
    }

    fn counts(&self) -> MutexGuard<'_, BTreeMap<String, usize>> {
        // A count is whole even where a thread has panicked.
        self.not_finite
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    fn mask(
        &self,
        view: &View,
        size: [u32; 2],
        stance: SensorOrientation,
    ) -> Result<Option<Vec<u8>>, CaptureError> {
        let path = self.masks.as_ref().and_then(|masks| masks.of(view));
        path.map(|path| mask::read(path, &view.image_path, size, stance))
            .transpose()
    }

    /// The photo's transparency, where it is its mask.
    fn alpha(&self, view: &View, picture: &decode::DecodedImage) -> Option<Vec<u8>> {
        let taken = self.with_alpha.contains(&view.photo);
        let alpha = taken.then(|| tone::alpha(picture)).flatten()?;
        let known = self.transparent.lock();
        // A name is whole even where a thread has panicked.
        let mut known = known.unwrap_or_else(PoisonError::into_inner);
        known.insert(view.photo.clone());
        Some(alpha)
    }
}

/// The photo of a view as COLMAP saw it.
fn decoded(view: &View) -> Result<(decode::DecodedImage, SensorOrientation), CaptureError> {
    let mut found = SensorOrientation::default();
    let picture = decode::decode(&view.image_path, |header| {
        found = stance(view, header)?;
        Ok(())
    })?;
    Ok((picture.turned(found.from_file), found))
}

/// The first view of each photo; all views of a photo are neighbors.
pub fn first_views(views: &[View]) -> impl Iterator<Item = &View> {
    views
        .chunk_by(|a, b| a.photo == b.photo)
        .map(|views| &views[0])
}

/// Summary of the headers of a capture's photos.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Headers {
    /// Kinds of photos in words, and how many there are of each.
    pub kinds: BTreeMap<String, usize>,
    /// Photos that have less than half the sides of their cameras.
    pub shrunk: Option<Shrunk>,
}

/// Photos that are much smaller than their cameras: small versions of the photos that COLMAP
/// saw, or thumbnails.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shrunk {
    /// Number of such photos.
    pub count: usize,
    /// The first of them.
    pub name: String,
    /// Its width and height.
    pub photo: [u32; 2],
    /// Its camera's width and height.
    pub camera: [u32; 2],
}

impl Headers {
    /// Reads the header of every photo.
    ///
    /// # Errors
    /// If one cannot be read.
    pub fn read(views: &[View]) -> Result<Self, CaptureError> {
        let mut read = Self::default();
        for view in first_views(views) {
            let header = decode::header(&view.image_path)?;
            let color = ["gray", "gray and alpha", "RGB", "RGB and alpha"];
            let color = color[header.channels.clamp(1, 4) - 1];
            let kind = format!("{color}, {}", header.depth);
            *read.kinds.entry(kind).or_default() += 1;
            let camera = view.photo_size();
            let photo = stance(view, &header)
                .map_or(header.size, |stance| stance.from_file.size(header.size));
            if (0..2).all(|side| 2 * u64::from(photo[side]) < u64::from(camera[side])) {
                let shrunk = read.shrunk.get_or_insert_with(|| Shrunk {
                    count: 0,
                    name: view.photo.clone(),
                    photo,
                    camera,
                });
                shrunk.count += 1;
            }
        }
        Ok(read)
    }
}

/// A folder's path that holds wherever the program runs next.
fn absolute(source: &MaskSource) -> MaskSource {
    match source {
        MaskSource::Folder(path) => {
            MaskSource::Folder(path.canonicalize().unwrap_or_else(|_| PathBuf::from(path)))
        }
        other => other.clone(),
    }
}

/// Values below which, and above which, a share of [`BEYOND`] lies; `None` where there
/// is no value, or but one.
pub(crate) fn percentiles(values: &mut [f32]) -> Option<[f64; 2]> {
    let last = values.len().checked_sub(1)?;
    let mut rank = |share: f64| {
        let rank = (share * last as f64).round() as usize;
        f64::from(*values.select_nth_unstable_by(rank, f32::total_cmp).1)
    };
    let range = [rank(BEYOND), rank(1.0 - BEYOND)];
    (range[0] < range[1]).then_some(range)
}

/// Returns true if a range, in shares of the scale, needs no normalization.
fn fills(low: f64, high: f64) -> bool {
    low >= 0.0 && high <= 1.0 && high - low >= FULL_ENOUGH
}
