//! From 2D points in images and 3D points' tracks to observations.

use std::collections::HashMap;

use crate::capture::Observation;

/// The 2D points of all images that belong to a 3D point.
///
/// Kept only while the points file is read. Most 2D points belong to none and
/// are not held at all.
pub(super) struct Sightings {
    /// By COLMAP's id: the image's place in the file, its sightings by index.
    images: HashMap<u32, (usize, Vec<Sighting>)>,
    /// True if no image of the file was left out.
    whole: bool,
}

/// A 2D point of an image that belongs to a 3D point.
pub(super) struct Sighting {
    /// Its number among the image's 2D points.
    pub index: u32,
    /// COLMAP's id of the 3D point.
    pub point: u64,
    /// x and y in pixels.
    pub pixel: [f64; 2],
}

impl Sightings {
    /// None yet, of the `whole` file or of a part of its images.
    pub fn of_all(whole: bool) -> Self {
        Self {
            images: HashMap::new(),
            whole,
        }
    }

    /// Returns true if points seen by this image are used; in a whole file all are.
    pub fn has(&self, image_id: u32) -> bool {
        self.whole || self.images.contains_key(&image_id)
    }

    /// Observations to make room for where a track has so many elements.
    pub fn room(&self, elements: u32) -> usize {
        match self.whole {
            true => elements as usize,
            false => 0,
        }
    }

    /// Adds the image at `place` in the file; `sightings` ascend by index.
    pub fn insert(&mut self, image_id: u32, place: usize, sightings: Vec<Sighting>) {
        self.images.insert(image_id, (place, sightings));
    }

    /// Observation for an element of a point's track; its `view` is the image's place in the file.
    ///
    /// None where the image is unknown or does not say that it sees the point
    /// there: some tools write tracks, but no 2D points.
    pub fn observation(&self, point: u64, image_id: u32, index: u32) -> Option<Observation> {
        let (view, sightings) = self.images.get(&image_id)?;
        let found = sightings.binary_search_by_key(&index, |sighting| sighting.index);
        let sighting = &sightings[found.ok()?];
        let sound = sighting.point == point && sighting.pixel.iter().all(|c| c.is_finite());
        sound.then_some(Observation {
            view: *view,
            pixel: sighting.pixel,
        })
    }
}
