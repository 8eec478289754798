//! A capture's photos on demand.

use std::{
    collections::HashMap,
    path::Path,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
};

use super::{
    Camera, Capture, CaptureError, Layers, LoadOptions, Loader, MaskSource, MaskUse, Masked,
    Normalize, Photo, Rejected, Split, View, first_views, in_order, split, split_as,
};

/// Notice given while a dataset is opened.
#[derive(Clone, Copy, Debug)]
pub enum Notice<'a> {
    /// A warning about the model's files.
    Doubt(&'a str),
    /// A view or points that are not used.
    LeftOut(&'a Rejected),
    /// Another photo has been looked at for the range of all.
    Sampled {
        /// Photos before it.
        done: usize,
        /// Photos in all.
        total: usize,
        /// The photo's name.
        name: &'a str,
    },
    /// The value that becomes black and the one that becomes white.
    Normalized([f64; 2]),
}

/// Views, cameras and photos at working size. Photos are decoded when they are asked for,
/// by any number of threads, and kept while they take little room.
#[derive(Debug)]
pub struct Dataset {
    /// The photos' views, points and cameras.
    pub capture: Capture,
    /// Training and held-out views.
    pub split: Split,
    /// Load options with every `Auto` resolved.
    pub options: LoadOptions,
    /// Camera of each view, at working size.
    pub cameras: Vec<Camera>,
    /// Views whose photo has a mask file, or an alpha channel that is taken for its mask.
    pub masked_views: usize,
    /// The scene's extent in world units, see [`Capture::extent`].
    pub extent: f64,
    loader: Loader,
    layers: Option<Layers>,
    cache: Mutex<Cache>,
    decoded: AtomicUsize,
}

impl Dataset {
    /// Bytes of gray and masks that are kept: less than the gigabyte that a training may
    /// take on the host leaves, and all photos of a small capture at the presets' sides.
    pub const CACHE_BYTES: usize = 256 << 20;

    /// Reads a COLMAP folder and the headers of its photos. With [`Normalize::Auto`]
    /// photos of more than 8 bits are all decoded once, for their range.
    ///
    /// # Errors
    /// [`CaptureError`] of the model, of the masks' folder and of what headers say.
    pub fn open(
        dir: &Path,
        options: &LoadOptions,
        tell: &mut dyn FnMut(Notice<'_>),
    ) -> Result<Self, CaptureError> {
        let mut capture = Capture::load_with(dir, options)?;
        for doubt in &capture.doubts {
            tell(Notice::Doubt(doubt));
        }
        for rejected in &capture.rejected {
            tell(Notice::LeftOut(rejected));
        }
        let mut loader = Loader::open(&capture, options)?;
        if loader.undecided() {
            let photos: Vec<&View> = first_views(&capture.views).collect();
            let mut samples = Vec::new();
            let mut done = 0;
            in_order(
                &photos,
                |view| loader.sample(view),
                |view, sample| {
                    samples.extend(sample?);
                    tell(Notice::Sampled {
                        done,
                        total: photos.len(),
                        name: &view.name,
                    });
                    done += 1;
                    Ok::<_, CaptureError>(())
                },
            )?;
            loader.decide(samples);
            if let Normalize::Range(range) = loader.options().normalize {
                tell(Notice::Normalized(range));
            }
        }
        let mut cameras = Vec::new();
        for view in &mut capture.views {
            let (camera, stance) = loader.standing(view)?;
            view.stance = stance;
            cameras.push(camera);
        }
        Ok(Self {
            split: match (&options.chosen, &capture.split) {
                (Some(chosen), _) => split_as(&capture.views, chosen),
                (None, Some(listed)) if options.holdout => split_as(&capture.views, listed),
                (None, _) => split(&capture.views, options.holdout),
            },
            options: loader.options().clone(),
            cameras,
            masked_views: loader.masked_views(&capture.views),
            extent: capture.extent(),
            capture,
            loader,
            layers: None,
            cache: Mutex::new(Cache::of(Self::CACHE_BYTES)),
            decoded: AtomicUsize::new(0),
        })
    }

    /// The same with another bound than [`Self::CACHE_BYTES`].
    pub fn caching(mut self, bytes: usize) -> Self {
        self.cache = Mutex::new(Cache::of(bytes));
        self
    }

    /// The same with these taken off its gray photos.
    pub fn without(mut self, layers: Layers) -> Self {
        let most = self.cache().most;
        self.layers = Some(layers);
        self.caching(most)
    }

    /// The gray photo of a view with its mask, from the cache where it is there.
    ///
    /// # Errors
    /// As [`Loader::load`].
    pub fn photo(&self, view: usize) -> Result<Arc<Photo>, CaptureError> {
        if let Some(photo) = self.cache().get(view) {
            return Ok(photo);
        }
        let mut photo = self.color(view)?;
        photo.rgb = None;
        if let Some(layers) = &self.layers {
            layers.take_off(view, &mut photo.gray)?;
        }
        let photo = Arc::new(photo);
        self.cache().put(view, photo.clone());
        Ok(photo)
    }

    /// The photo of a view with its colors, decoded anew.
    ///
    /// # Errors
    /// As [`Loader::load`].
    pub fn color(&self, view: usize) -> Result<Photo, CaptureError> {
        self.decoded.fetch_add(1, Ordering::Relaxed);
        Ok(self.loader.load(&self.capture.views[view])?.0)
    }

    /// Loader of the photos.
    pub fn loader(&self) -> &Loader {
        &self.loader
    }

    /// Hands the [photos](Self::photo) of some views to `look`, in this order; threads
    /// decode those that come next meanwhile.
    ///
    /// # Errors
    /// [`CaptureError`] of the first photo that has one, and those of `look`.
    pub fn visit<E: From<CaptureError>>(
        &self,
        views: &[usize],
        mut look: impl FnMut(usize, &Photo) -> Result<(), E>,
    ) -> Result<(), E> {
        in_order(
            views,
            |&view| self.photo(view),
            |&view, photo: Result<Arc<Photo>, CaptureError>| look(view, &*photo?),
        )
    }

    /// As [`Self::visit`], with [colors](Self::color).
    ///
    /// # Errors
    /// As there.
    pub fn visit_colors<E: From<CaptureError>>(
        &self,
        views: &[usize],
        mut look: impl FnMut(usize, Photo) -> Result<(), E>,
    ) -> Result<(), E> {
        in_order(
            views,
            |&view| self.color(view),
            |&view, photo| look(view, photo?),
        )
    }

    /// The views to measure on: the held-out ones, or all where none is.
    pub fn measured(&self) -> (&'static str, &[usize]) {
        if self.split.test.is_empty() {
            ("train", &self.split.train)
        } else {
            ("test", &self.split.test)
        }
    }

    /// Returns true if masked pixels are removed: photos are black there, and that counts.
    pub fn removes_masked(&self) -> bool {
        self.masked_views > 0 && self.options.masked == MaskUse::Remove
    }

    /// Summary of the mask folder, if there is one.
    pub fn masked(&self) -> Option<&Masked> {
        self.loader.masked()
    }

    /// Once all photos have been decoded: how many are transparent and masked by that. Alpha
    /// channels that are opaque everywhere are no masks from here on.
    pub fn settle_transparency(&mut self) -> usize {
        let transparent = self.loader.transparent();
        if transparent == 0 && self.options.masks == MaskSource::Alpha {
            self.options.masks = MaskSource::Off;
            self.masked_views = 0;
        }
        transparent
    }

    /// Pixels of the photos decoded so far whose values are not finite.
    pub fn not_finite(&self) -> usize {
        self.loader.not_finite()
    }

    /// Number of times that a photo was decoded so far.
    pub fn decoded(&self) -> usize {
        self.decoded.load(Ordering::Relaxed)
    }

    /// Empties the cache: for whoever needs the room more than the photos.
    pub fn release(&self) {
        let mut cache = self.cache();
        let most = cache.most;
        *cache = Cache::of(most);
    }

    /// Bytes that the cache holds.
    pub fn cached_bytes(&self) -> usize {
        self.cache().bytes
    }

    fn cache(&self) -> MutexGuard<'_, Cache> {
        // What is in it is whole even where a thread has panicked.
        self.cache.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Photos within so many bytes; the one that was not asked for the longest goes first.
#[derive(Debug)]
struct Cache {
    most: usize,
    bytes: usize,
    /// Photo of each view, with the time of its last use.
    photos: HashMap<usize, (Arc<Photo>, u64)>,
    now: u64,
}

impl Cache {
    fn of(most: usize) -> Self {
        Self {
            most,
            bytes: 0,
            photos: HashMap::new(),
            now: 0,
        }
    }

    fn get(&mut self, view: usize) -> Option<Arc<Photo>> {
        self.now += 1;
        let (photo, asked) = self.photos.get_mut(&view)?;
        *asked = self.now;
        Some(photo.clone())
    }

    fn put(&mut self, view: usize, photo: Arc<Photo>) {
        let bytes = bytes(&photo);
        if bytes > self.most {
            return;
        }
        self.now += 1;
        self.bytes += bytes;
        if let Some((old, _)) = self.photos.insert(view, (photo, self.now)) {
            self.bytes -= self::bytes(&old);
        }
        while self.bytes > self.most {
            let oldest = self.photos.iter().min_by_key(|(_, (_, asked))| *asked);
            let Some(oldest) = oldest.map(|(&view, _)| view) else {
                break;
            };
            if let Some((photo, _)) = self.photos.remove(&oldest) {
                self.bytes -= self::bytes(&photo);
            }
        }
    }
}

/// Bytes of a photo's gray and mask.
fn bytes(photo: &Photo) -> usize {
    photo.gray.len() + photo.mask.as_ref().map_or(0, Vec::len)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn demo() -> Dataset {
        let options = LoadOptions {
            max_side: Some(96),
            ..LoadOptions::default()
        };
        let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/demo");
        Dataset::open(&dir, &options, &mut |_| {}).expect("the bundled scene")
    }

    fn visit_all(dataset: &Dataset) {
        let all: Vec<usize> = (0..dataset.cameras.len()).collect();
        let mut seen = Vec::new();
        let visited: Result<(), CaptureError> = dataset.visit(&all, |view, photo| {
            let camera = &dataset.cameras[view];
            assert_eq!([photo.width, photo.height], [camera.width, camera.height]);
            seen.push(view);
            Ok(())
        });
        visited.expect("photos");
        assert_eq!(seen, all);
    }

    #[test]
    fn a_cache_that_holds_all_decodes_each_photo_once() {
        let dataset = demo();
        assert_eq!(dataset.decoded(), 0);
        for _ in 0..3 {
            visit_all(&dataset);
        }
        assert_eq!(dataset.decoded(), dataset.cameras.len());
    }

    #[test]
    fn a_smaller_cache_keeps_within_its_bytes_and_the_photos_asked_for_last() {
        let first = demo().photo(0).expect("photo");
        let dataset = demo().caching(3 * bytes(&first));
        visit_all(&dataset);
        assert!(dataset.cached_bytes() <= 3 * bytes(&first));
        let before = dataset.decoded();
        let last = dataset.cameras.len() - 1;
        dataset.photo(last).expect("photo");
        assert_eq!(dataset.decoded(), before);
        assert_eq!(dataset.photo(0).expect("photo"), first);
        assert_eq!(dataset.decoded(), before + 1);
        dataset.release();
        assert_eq!(dataset.cached_bytes(), 0);
        // Nothing is kept, and all is there.
        let nothing = demo().caching(0);
        assert_eq!(nothing.photo(0).expect("photo"), first);
        assert_eq!(nothing.cached_bytes(), 0);
    }

    #[test]
    fn colors_come_where_they_are_asked_for() {
        let dataset = demo();
        assert_eq!(dataset.photo(1).expect("photo").rgb, None);
        let color = dataset.color(1).expect("photo");
        assert!(color.rgb.is_some());
        assert_eq!(color.gray, dataset.photo(1).expect("photo").gray);
    }
}
