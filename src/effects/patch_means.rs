//! Places in photos whose gray is wanted, gathered before the photos are there.

use crate::capture::Photo;

/// Squares in the photos of many views, whose means come photo by photo.
#[derive(Clone, Debug, Default)]
pub(super) struct PatchMeans {
    /// Squares to average in the photo of each view.
    by_view: Vec<Vec<Square>>,
    /// In the order in which they were asked for; not a number where there is none.
    means: Vec<f64>,
}

/// A square in a photo, in pixels.
#[derive(Clone, Copy, Debug)]
struct Square {
    /// Index into the means.
    index: usize,
    center: [f64; 2],
    side: f64,
}

impl PatchMeans {
    /// Nothing is wanted of the photos of so many views.
    pub fn of(views: usize) -> Self {
        Self {
            by_view: vec![Vec::new(); views],
            means: Vec::new(),
        }
    }

    /// Asks for the mean gray of a square in the photo of a view.
    pub fn ask(&mut self, view: usize, center: [f64; 2], side: f64) {
        self.by_view[view].push(Square {
            index: self.means.len(),
            center,
            side,
        });
        self.means.push(f64::NAN);
    }

    /// Takes what is wanted of the photo of a view.
    pub fn look(&mut self, view: usize, photo: &Photo) {
        for square in std::mem::take(&mut self.by_view[view]) {
            if let Some(mean) = mean_around(photo, square.center, square.side) {
                self.means[square.index] = mean;
            }
        }
    }

    /// Mean gray of each square in the order of the requests, 0 to 1; `None` if a square leaves its
    /// photo or meets a masked pixel.
    pub fn means(&self) -> impl Iterator<Item = Option<f64>> {
        let means = self.means.iter().copied();
        means.map(|mean| (!mean.is_nan()).then_some(mean))
    }
}

/// The mean gray of a photo, in [0, 1], over a square around a place in pixels; `None` where
/// the square leaves the photo or meets a masked pixel.
fn mean_around(photo: &Photo, at: [f64; 2], side: f64) -> Option<f64> {
    let [left, top] = at.map(|along| along - 0.5 * side);
    let [right, bottom] = at.map(|along| along + 0.5 * side);
    let inside = left >= 0.0
        && top >= 0.0
        && right <= f64::from(photo.width)
        && bottom <= f64::from(photo.height);
    if !inside {
        return None;
    }
    // How much of a pixel's side lies between two places.
    let within = |pixel: usize, from: f64, to: f64| {
        let pixel = pixel as f64;
        (to.min(pixel + 1.0) - from.max(pixel)).max(0.0)
    };
    let mut sum = 0.0;
    for y in top as usize..bottom.ceil() as usize {
        for x in left as usize..right.ceil() as usize {
            let pixel = y * photo.width as usize + x;
            if photo.mask.as_ref().is_some_and(|mask| mask[pixel] < 255) {
                return None;
            }
            let area = within(x, left, right) * within(y, top, bottom);
            sum += area * f64::from(photo.gray[pixel]) / 255.0;
        }
    }
    Some(sum / (side * side))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn photo() -> Photo {
        Photo {
            width: 3,
            height: 2,
            gray: vec![0, 51, 102, 153, 204, 255],
            rgb: None,
            mask: None,
        }
    }

    #[test]
    fn means_cover_parts_of_pixels() {
        let photo = photo();
        let close = |a: Option<f64>, b: f64| (a.unwrap() - b).abs() < 1e-12;
        assert!(close(mean_around(&photo, [1.5, 0.5], 1.0), 0.2));
        assert!(close(mean_around(&photo, [1.0, 1.0], 2.0), 0.4));
        assert!(close(mean_around(&photo, [2.0, 1.0], 1.0), 0.6));
        // A quarter of each.
        assert!(close(mean_around(&photo, [1.0, 0.5], 1.0), 0.1));
        assert!(close(mean_around(&photo, [2.75, 1.75], 0.5), 1.0));
        assert_eq!(mean_around(&photo, [0.4, 1.0], 1.0), None);
        assert_eq!(mean_around(&photo, [1.5, 1.6], 1.0), None);
    }

    #[test]
    fn a_masked_neighbor_says_nothing() {
        let mut photo = photo();
        photo.mask = Some(vec![255, 255, 0, 255, 255, 255]);
        assert_eq!(mean_around(&photo, [2.2, 1.0], 1.0), None);
        assert!(mean_around(&photo, [1.2, 1.0], 1.0).is_some());
    }
}
