//! Coverage of areas by photos.

use glam::DVec3;

use super::{Area, Ground};
use crate::capture::Capture;

/// Points that stand for all where nobody knows which photo shows which; an even choice.
const SAMPLES: usize = 2000;

/// Number of observations of each photo, in all and by area.
#[derive(Clone, Debug, PartialEq)]
pub struct PhotoCoverage {
    /// The photos' names, sorted.
    pub photos: Vec<String>,
    /// Each photo's observations of points.
    pub all: Vec<u32>,
    /// Each area's observations by each photo, of points above it.
    pub of: Vec<Vec<u32>>,
}

impl PhotoCoverage {
    /// Counts observations; where a model has none, points that project into photos.
    pub fn count(capture: &Capture, ground: &Ground, areas: &[Area]) -> Self {
        let mut photos: Vec<String> = Vec::new();
        let photo_of: Vec<usize> = (capture.views.iter())
            .map(|view| {
                if photos.last() != Some(&view.photo) {
                    photos.push(view.photo.clone());
                }
                photos.len() - 1
            })
            .collect();
        let mut seen = Self {
            all: vec![0; photos.len()],
            of: vec![vec![0; photos.len()]; areas.len()],
            photos,
        };
        let tracked = capture.points.iter().any(|point| !point.track.is_empty());
        let step = match tracked {
            true => 1,
            false => capture.points.len().div_ceil(SAMPLES),
        };
        for point in capture.points.iter().step_by(step) {
            let at = ground.place(point.position + capture.offset);
            let holding: Vec<usize> = (0..areas.len()).filter(|&a| areas[a].holds(at)).collect();
            let mut look = |view: usize| {
                let photo = photo_of[view];
                seen.all[photo] += 1;
                holding.iter().for_each(|&a| seen.of[a][photo] += 1);
            };
            match tracked {
                true => point.track.iter().for_each(|seen| look(seen.view)),
                false => views_of(capture, point.position).for_each(&mut look),
            }
        }
        seen
    }

    /// The share of a photo's observations that an area has; 0 where it has none at all.
    pub fn share(&self, area: usize, photo: usize) -> f64 {
        f64::from(self.of[area][photo]) / f64::from(self.all[photo].max(1))
    }
}

/// The views into whose pictures a place projects.
fn views_of(capture: &Capture, place: DVec3) -> impl Iterator<Item = usize> {
    let shown = move |&view: &usize| capture.views[view].camera.pixel_of(place).is_some();
    (0..capture.views.len()).filter(shown)
}
