//! Rectangles on the ground.

use serde::{Deserialize, Serialize};

/// A rectangle on the ground: least and most along each of its two axes, in world units. What
/// lies on the lower edge belongs to it, what lies on the upper edge to its neighbor. In JSON
/// an edge at infinity is `null`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "[[Option<f64>; 2]; 2]", from = "[[Option<f64>; 2]; 2]")]
pub struct Area(pub [[f64; 2]; 2]);

impl Area {
    /// All of the ground.
    pub const EVERYWHERE: Self = Self([[f64::NEG_INFINITY, f64::INFINITY]; 2]);

    /// Returns true if a ground position lies in the area.
    pub fn holds(&self, place: [f64; 2]) -> bool {
        (self.0.iter().zip(place)).all(|(&[least, most], at)| least <= at && at < most)
    }

    /// Its parts on both sides of a line across an axis.
    pub(super) fn cut(self, axis: usize, at: f64) -> [Self; 2] {
        let mut parts = [self; 2];
        parts[0].0[axis][1] = at;
        parts[1].0[axis][0] = at;
        parts
    }

    /// Intersection with another area.
    pub fn within(&self, other: &Self) -> Self {
        Self([0, 1].map(|axis| {
            let ([a, b], [c, d]) = (self.0[axis], other.0[axis]);
            [a.max(c), b.min(d)]
        }))
    }

    /// Larger on each side by a share of its length along that axis; an infinite one stays.
    pub(super) fn grown(&self, share: f64) -> Self {
        Self(self.0.map(|[least, most]| {
            let margin = match (most - least).is_finite() {
                true => share * (most - least),
                false => 0.0,
            };
            [least - margin, most + margin]
        }))
    }
}

impl From<Area> for [[Option<f64>; 2]; 2] {
    fn from(area: Area) -> Self {
        area.0
            .map(|edges| edges.map(|edge| Some(edge).filter(|edge| edge.is_finite())))
    }
}

impl From<[[Option<f64>; 2]; 2]> for Area {
    fn from(area: [[Option<f64>; 2]; 2]) -> Self {
        Self(area.map(|[least, most]| {
            [
                least.unwrap_or(f64::NEG_INFINITY),
                most.unwrap_or(f64::INFINITY),
            ]
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_belongs_to_one_part() {
        let [left, right] = Area::EVERYWHERE.cut(0, 2.0);
        for (place, is_left) in [
            ([2.0, 0.0], false),
            ([1.99, 1e9], true),
            ([1e12, -3.0], false),
        ] {
            assert_eq!([left.holds(place), right.holds(place)], [is_left, !is_left]);
        }
    }

    #[test]
    fn what_is_written_is_read_again() {
        let area = Area::EVERYWHERE.cut(0, 2.0)[0].cut(1, -1.5)[1];
        let text = serde_json::to_string(&area).unwrap();
        assert_eq!(text, "[[null,2.0],[-1.5,null]]");
        assert_eq!(serde_json::from_str::<Area>(&text).unwrap(), area);
    }

    #[test]
    fn finite_sides_grow() {
        let area = Area([[0.0, 10.0], [f64::NEG_INFINITY, 1.0]]);
        let grown = Area([[-1.5, 11.5], [f64::NEG_INFINITY, 1.0]]);
        assert_eq!(area.grown(0.15), grown);
    }
}
