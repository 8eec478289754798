//! Device memory of a training, estimated before any is allocated.

use super::{LumaSettings, loss::Targets};
use crate::{
    capture::Camera,
    gpu::GpuError,
    raster::{
        Canvas, ColorKind, Lists, LumaAdjoint, Model, ViewUniform, constants::GEOMETRY_PLANES,
    },
    splats::sh,
};

/// Bytes of a word.
const WORD: u64 = 4;

/// Tile-list entries that a set is expected to need for each Gaussian, at least.
pub(super) const ENTRIES_PER_SPLAT: usize = 4;

/// Words of a line of the plan that a change of the set follows.
const PLAN_WORDS: u64 = 12;

/// Photos stay on the device while they take at most one part in so many of a memory
/// limit: the rest is worth more to Gaussians, and a photo an iteration is little to
/// bring.
const PHOTO_SHARE: u64 = 4;

/// Without a limit, photos stay on the device while they take at most so many bytes: 1,000
/// photos of a megapixel, and little beside what the Gaussians of such a capture take.
const RESIDENT_MAX: u64 = 1 << 30;

/// Bytes that photos may take to stay on the device.
pub fn resident_photos(settings: &LumaSettings) -> u64 {
    match settings.memory_limit {
        _ if settings.stream_photos => 0,
        Some(limit) => limit / PHOTO_SHARE,
        None => RESIDENT_MAX,
    }
}

/// Memory demand that does not depend on the number of Gaussians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Demand {
    /// Pixels of the largest photo.
    pub max_pixels: usize,
    /// Tiles of the one that has most.
    pub max_tiles: usize,
    /// Bytes of the photos and masks on the device: all, or the largest if they are streamed.
    pub photos: u64,
    /// True if photos are streamed to the device one at a time.
    pub streams: bool,
    /// Degree of the luma harmonics.
    pub sh_degree: u32,
}

impl Demand {
    /// Demand of photos by these cameras; masks double it. Photos stay on the device while they
    /// take at most `resident` bytes ([`resident_photos`]).
    pub fn of<'a>(
        cameras: impl Iterator<Item = &'a Camera>,
        masked: bool,
        sh_degree: u32,
        resident: u64,
    ) -> Self {
        let mut demand = Self {
            max_pixels: 0,
            max_tiles: 0,
            photos: 0,
            streams: false,
            sh_degree,
        };
        let mut photos = 0;
        for camera in cameras {
            demand.hold(camera);
            let pixels = u64::from(camera.width) * u64::from(camera.height);
            photos += pixels.next_multiple_of(WORD);
        }
        let pictures = 1 + u64::from(masked);
        photos *= pictures;
        let streams = photos > resident;
        if streams {
            photos = pictures * (demand.max_pixels as u64).next_multiple_of(WORD);
        }
        Self {
            photos,
            streams,
            ..demand
        }
    }

    /// Demand if views by these cameras are validated as well; their photos stay on the host.
    pub fn watching<'a>(mut self, cameras: impl Iterator<Item = &'a Camera>) -> Self {
        for camera in cameras {
            self.hold(camera);
        }
        self
    }

    /// Pictures as large as a camera's.
    fn hold(&mut self, camera: &Camera) {
        let view = ViewUniform::new(camera, 1.0, 0, 0);
        self.max_pixels = self.max_pixels.max(view.pixel_count());
        self.max_tiles = self.max_tiles.max(view.tile_count());
    }

    /// Bytes while `splats` Gaussians with `entries` tile-list entries are trained.
    pub fn bytes(&self, splats: usize, entries: usize) -> u64 {
        Model::bytes(splats, self.sh_degree)
            + Lists::bytes(splats, self.max_tiles, entries)
            + Canvas::bytes(ColorKind::Luma, splats, self.max_pixels)
            + LumaAdjoint::bytes(splats, entries, self.max_pixels)
            + Targets::bytes(self.max_pixels)
            + self.photos
    }

    /// Checks that `splats` Gaussians with `entries` tile-list entries are within `limit` bytes.
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
        let again = Model::bytes(splats, self.sh_degree) + WORD * PLAN_WORDS * splats as u64;
        self.bytes(splats, ENTRIES_PER_SPLAT * splats) + again
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
        // Between what surely fits and what surely does not.
        let (mut fits, mut beyond) = (0, by_binding.saturating_add(1));
        while beyond - fits > 1 {
            let middle = fits + (beyond - fits) / 2;
            if self.peak_bytes(middle) <= limit {
                fits = middle;
            } else {
                beyond = middle;
            }
        }
        fits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEMAND: Demand = Demand {
        max_pixels: 57_600,
        max_tiles: 225,
        photos: 576_000,
        streams: false,
        sh_degree: 0,
    };

    #[test]
    fn the_largest_set_is_within_the_limit_and_the_next_is_not() {
        for limit in [8 << 20, 100 << 20, 4_u64 << 30] {
            let fits = DEMAND.largest_set(Some(limit), 1 << 40);
            assert!(DEMAND.peak_bytes(fits) <= limit);
            assert!(DEMAND.peak_bytes(fits + 1) > limit, "{fits}");
        }
        assert_eq!(DEMAND.largest_set(Some(1000), 1 << 40), 0);
    }

    #[test]
    fn a_gaussian_takes_at_most_450_bytes() {
        let of = |sh_degree| {
            let demand = Demand {
                sh_degree,
                ..DEMAND
            };
            (demand.bytes(1_000_000, 0) - demand.bytes(0, 0)) / 1_000_000
        };
        assert!(of(3) <= 450 && of(0) < 270, "{} {}", of(3), of(0));
    }

    #[test]
    fn bindings_bound_a_set_without_a_limit() {
        // Four entries with eight figures each.
        assert_eq!(DEMAND.largest_set(None, 128 << 20), 1 << 20);
    }
}
