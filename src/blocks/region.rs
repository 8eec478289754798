//! A part of the world above an area.

use glam::DVec3;

use super::{Area, Ground};

/// Part of the world above or below an area of the ground, in coordinates that were moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// The ground of COLMAP's world.
    pub ground: Ground,
    pub area: Area,
    /// Offset that was subtracted from COLMAP's coordinates, in world units.
    pub offset: DVec3,
}

impl Region {
    /// Returns true if a position lies in the region.
    pub fn holds(&self, place: [f32; 3]) -> bool {
        let place = DVec3::from(place.map(f64::from)) + self.offset;
        self.area.holds(self.ground.place(place))
    }
}
