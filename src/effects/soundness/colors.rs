//! Correlation of photos with the colors of COLMAP's points.

use super::{
    contradiction::{Contradiction, Contradictory, LEAST},
    photos::{ENOUGH, median, photos},
};
use crate::{
    capture::{Camera, Capture, Channel, Photo, Rejected},
    color::GrayTable,
    effects::{patch_means::PatchMeans, tracks::place_in},
};

/// Side of the square over which a photo is averaged, in pixels: points lie where luma has an
/// extremum, and larger squares lower the correlation of sound photos, to 0.59 for 2 pixels.
const SIDE: f64 = 1.0;

/// Standard deviation of the points' grays, 0 to 1, below which they say nothing: a step of 5
/// in 255.
const SPREAD: f64 = 0.02;

/// Grays of photos at the observations of points; photos are passed one after the other, in the
/// order of the views.
#[derive(Clone, Debug)]
pub struct PointColors {
    patch_means: PatchMeans,
    /// Photo of each request, and the point's gray, 0 to 1.
    asked: Vec<(usize, f64)>,
}

/// Agreement of photos with the points' colors.
#[derive(Clone, Debug, PartialEq)]
pub struct Agreement {
    /// Name and correlation, -1 to 1, of each photo that shows enough points with enough contrast.
    pub photos: Vec<(String, f64)>,
}

impl PointColors {
    /// Decides where photos will be looked at. `cameras` are those of the capture's views at
    /// working size; `channel` is what of a color photo becomes gray.
    pub fn of(capture: &Capture, cameras: &[Camera], channel: Channel) -> Self {
        let (_, photo_of) = photos(capture);
        let table = GrayTable::new();
        let mut patch_means = PatchMeans::of(cameras.len());
        let mut asked = Vec::new();
        for point in &capture.points {
            let gray = match channel {
                Channel::Luma => table.gray(point.color),
                Channel::R => point.color[0],
                Channel::G => point.color[1],
                Channel::B => point.color[2],
            };
            for seen in &point.track {
                let camera = &cameras[seen.view];
                let of_model = &capture.views[seen.view].camera;
                patch_means.ask(seen.view, place_in(camera, of_model, seen.pixel), SIDE);
                asked.push((photo_of[seen.view], f64::from(gray) / 255.0));
            }
        }
        Self { patch_means, asked }
    }

    /// Takes what is wanted of the photo of a view.
    pub fn look(&mut self, view: usize, photo: &Photo) {
        self.patch_means.look(view, photo);
    }

    /// Agreement over all photos; `capture` is the one it was made of.
    pub fn finish(self, capture: &Capture) -> Agreement {
        let (names, _) = photos(capture);
        let mut pairs = vec![Vec::new(); names.len()];
        for (&(photo, point), shown) in self.asked.iter().zip(self.patch_means.means()) {
            if let Some(shown) = shown {
                pairs[photo].push([point, shown]);
            }
        }
        let judged = names.iter().zip(pairs);
        let judged = judged.filter_map(|(name, pairs)| {
            let correlation = correlation(&pairs)?;
            Some(((*name).to_owned(), correlation))
        });
        Agreement {
            photos: judged.collect(),
        }
    }
}

impl Agreement {
    /// The lowest correlation.
    pub fn lowest(&self) -> Option<f64> {
        let correlations = self.photos.iter().map(|(_, found)| *found);
        correlations.min_by(f64::total_cmp)
    }

    /// The correlation of the photo in the middle.
    pub fn median(&self) -> Option<f64> {
        median(self.photos.iter().map(|(_, found)| *found).collect())
    }

    /// The photos that do not show what COLMAP saw: all, where more than half of them do not.
    pub fn contradictory(&self, capture: &Capture) -> Option<Contradictory> {
        let below = self.photos.iter().filter(|(_, found)| *found < LEAST);
        let photos: Vec<Rejected> = below
            .map(|(name, found)| Rejected {
                name: name.clone(),
                reason: format!(
                    "it does not show what COLMAP saw: turned, cropped or another photo (what it shows at the points correlates with their colors by {found:.3}, below {LEAST})"
                ),
            })
            .collect();
        let judged = self.photos.len();
        match self.median() {
            Some(median) if 2 * photos.len() > judged => {
                Some(Contradictory::All(Contradiction::Photos {
                    images: capture.root.join("images"),
                    photos,
                    judged,
                    median,
                }))
            }
            _ => (!photos.is_empty()).then_some(Contradictory::Some(photos)),
        }
    }
}

/// Pearson's correlation of pairs of a point's gray and a photo's. `None` where there are too
/// few, or points are too much alike; 0 of a photo that is the same everywhere.
pub(crate) fn correlation(pairs: &[[f64; 2]]) -> Option<f64> {
    if pairs.len() < ENOUGH {
        return None;
    }
    let count = pairs.len() as f64;
    let mean = |of: &dyn Fn(&[f64; 2]) -> f64| pairs.iter().map(of).sum::<f64>() / count;
    let means = [mean(&|pair| pair[0]), mean(&|pair| pair[1])];
    let product = |a: usize, b: usize| mean(&|pair| (pair[a] - means[a]) * (pair[b] - means[b]));
    let [of_points, of_photo] = [product(0, 0), product(1, 1)].map(f64::sqrt);
    (of_points >= SPREAD).then(|| product(0, 1) / (of_points * of_photo).max(f64::MIN_POSITIVE))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn correlation_follows_neither_gain_nor_offset() {
        let of = |shown: &dyn Fn(f64) -> f64| {
            let pairs: Vec<_> = (0..40).map(|i| f64::from(i) / 40.0).collect();
            correlation(&pairs.iter().map(|&x| [x, shown(x)]).collect::<Vec<_>>())
        };
        let is = |found: Option<f64>, wanted: f64| (found.unwrap() - wanted).abs() < 1e-12;
        assert!(is(of(&|x| 0.2 + 0.1 * x), 1.0));
        assert!(is(of(&|x| 1.0 - x), -1.0));
        assert!(is(of(&|_| 0.5), 0.0));
        // Points that are alike, or few, say nothing.
        assert_eq!(correlation(&[[0.5, 0.1]; 40]), None);
        assert_eq!(correlation(&[[0.0, 0.0], [1.0, 1.0]]), None);
    }
}
