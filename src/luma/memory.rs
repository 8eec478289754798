//! How much room a training takes on the device, known before any is taken.

use crate::{
    capture::Camera,
    gpu::GpuError,
    raster::{ViewUniform, constants::*},
    splats::sh,
};

/// Bytes of a word.
const WORD: u64 = 4;

/// Tile-list entries that a set is expected to need for each Gaussian, at least.
pub(super) const ENTRIES_PER_SPLAT: usize = 4;

/// Words that a Gaussian takes besides its parameters: projection 8, four flags and
/// ranks, keys and places of the depth sort 4, its histogram, colour, gradient on the
/// image plane 8, of its mean 3, statistics.
const SCRATCH_WORDS: f64 = 8.0 + 4.0 + 4.0 + 0.125 + 1.0 + 8.0 + 3.0 + STATISTICS_PLANES as f64;

/// Words of a line of the plan that a change of the set follows.
const PLAN_WORDS: f64 = 12.0;

/// Words of a tile-list entry: keys and places of the tile sort 4, its histogram, the
/// Gaussian's index, the gradient's eight figures (stored in full; half storage takes less).
const ENTRY_WORDS: f64 = 4.0 + 0.125 + 1.0 + 8.0;

/// Words of a pixel: picture, last entry, gradient, three slopes of SSIM.
const PIXEL_WORDS: u64 = 6;

/// Photos stay on the device while they take at most one part in so many of a memory
/// limit: the rest is worth more to Gaussians, and a photo an iteration is little to
/// bring.
const PHOTO_SHARE: u64 = 4;

/// Without a limit, photos stay on the device while they take at most so many bytes: 1,000
/// photos of a megapixel, and little beside what the Gaussians of such a capture take.
const RESIDENT_MAX: u64 = 1 << 30;

/// What does not depend on the number of Gaussians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Demand {
    /// Pixels of the largest photo.
    pub max_pixels: u64,
    /// Bytes of the photos and masks on the device: all, or the largest if they are streamed.
    pub photos: u64,
    /// Whether photos are brought to the device one at a time.
    pub streams: bool,
    /// Degree of the luma harmonics.
    pub sh_degree: u32,
}

impl Demand {
    /// What photos by these cameras ask for within `limit` bytes, if there is one;
    /// with masks, twice as much.
    pub fn of<'a>(
        cameras: impl Iterator<Item = &'a Camera>,
        masked: bool,
        sh_degree: u32,
        limit: Option<u64>,
    ) -> Self {
        let (mut max_pixels, mut photos) = (0, 0);
        for camera in cameras {
            let pixels = ViewUniform::new(camera, 1.0, 0, 0).pixel_count() as u64;
            max_pixels = max_pixels.max(pixels);
            photos += pixels.next_multiple_of(WORD);
        }
        let pictures = 1 + u64::from(masked);
        photos *= pictures;
        let streams = photos > limit.map_or(RESIDENT_MAX, |limit| limit / PHOTO_SHARE);
        if streams {
            photos = pictures * max_pixels.next_multiple_of(WORD);
        }
        Self {
            max_pixels,
            photos,
            streams,
            sh_degree,
        }
    }

    /// What is asked for when views by these cameras are looked at besides; their photos
    /// stay on the host.
    pub fn watching<'a>(mut self, cameras: impl Iterator<Item = &'a Camera>) -> Self {
        for camera in cameras {
            let pixels = ViewUniform::new(camera, 1.0, 0, 0).pixel_count() as u64;
            self.max_pixels = self.max_pixels.max(pixels);
        }
        self
    }

    fn parameters(&self) -> f64 {
        (GEOMETRY_PLANES + sh::coefficient_count(self.sh_degree)) as f64
    }

    /// Bytes for each Gaussian, tile lists not counted: its parameters three times
    /// (values and both moments of Adam; gradients are never stored) and what a view
    /// leaves. At most 450 at degree 3.
    pub fn bytes_per_splat(&self) -> f64 {
        WORD as f64 * (3.0 * self.parameters() + SCRATCH_WORDS)
    }

    /// Bytes while `splats` Gaussians with `entries` tile-list entries are trained.
    pub fn bytes(&self, splats: usize, entries: usize) -> u64 {
        let words = ENTRY_WORDS * entries as f64;
        let moving = self.bytes_per_splat() * splats as f64 + WORD as f64 * words;
        moving as u64 + WORD * PIXEL_WORDS * self.max_pixels + self.photos
    }

    /// Whether `splats` Gaussians with `entries` tile-list entries are within `limit`
    /// bytes.
    ///
    /// # Errors
    /// [`GpuError::OverLimit`] if not.
    pub fn check(&self, limit: Option<u64>, splats: usize, entries: usize) -> Result<(), GpuError> {
        let needed = self.bytes(splats, entries);
        match limit {
            Some(limit) if needed > limit => Err(GpuError::OverLimit {
                splats,
                needed,
                limit,
            }),
            _ => Ok(()),
        }
    }

    /// Bytes at most: while the set changes, parameters and moments exist twice.
    pub fn peak_bytes(&self, splats: usize) -> u64 {
        let twice = WORD as f64 * (3.0 * self.parameters() + PLAN_WORDS) * splats as f64;
        self.bytes(splats, ENTRIES_PER_SPLAT * splats) + twice as u64
    }

    /// The largest number of Gaussians whose [`Self::peak_bytes`] are within `limit`
    /// bytes and whose buffers are within `binding_limit` bytes each; 0 when not even
    /// the pictures are.
    pub fn largest_set(&self, limit: Option<u64>, binding_limit: u64) -> usize {
        let planes = GEOMETRY_PLANES.max(sh::coefficient_count(self.sh_degree));
        // A buffer of parameters, or the gradients of the tile lists' entries.
        let widest = WORD * planes.max(8 * ENTRIES_PER_SPLAT) as u64;
        let by_binding = (binding_limit / widest) as usize;
        let Some(limit) = limit else {
            return by_binding;
        };
        let fixed = self.bytes(0, 0);
        let each = self.peak_bytes(1_000_000).saturating_sub(fixed) as f64 / 1e6;
        by_binding.min((limit.saturating_sub(fixed) as f64 / each) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEMAND: Demand = Demand {
        max_pixels: 57_600,
        photos: 576_000,
        streams: false,
        sh_degree: 0,
    };

    #[test]
    fn the_largest_set_is_within_the_limit_and_the_next_is_not() {
        for limit in [8 << 20, 100 << 20, 4_u64 << 30] {
            let fits = DEMAND.largest_set(Some(limit), u64::MAX);
            assert!(DEMAND.peak_bytes(fits) <= limit);
            assert!(DEMAND.peak_bytes(fits + 2) > limit, "{fits}");
        }
        assert_eq!(DEMAND.largest_set(Some(1000), u64::MAX), 0);
    }

    #[test]
    fn a_gaussian_takes_at_most_450_bytes() {
        let of = |sh_degree| {
            Demand {
                sh_degree,
                ..DEMAND
            }
            .bytes_per_splat()
        };
        assert!(of(3) <= 450.0 && of(0) < 270.0, "{} {}", of(3), of(0));
    }

    #[test]
    fn bindings_bound_a_set_without_a_limit() {
        // Four entries with eight figures each.
        assert_eq!(DEMAND.largest_set(None, 128 << 20), 1 << 20);
    }
}
