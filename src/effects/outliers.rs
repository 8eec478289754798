//! Outliers in photos: dust, scratches, passers-by.
//!
//! Places half-way between neighboring points mostly lie on the surface too. COLMAP
//! matched nothing there, so that a defect has not driven the match away as it does at
//! the points themselves. Where several views agree about such a place and one does not,
//! that one shows something else.

use std::collections::BTreeSet;

use super::patch_means::PatchMeans;
use crate::{
    capture::{Camera, Capture, Exposure, Photo},
    splats::nearest_neighbors,
};

/// Neighbors of each point: more lie farther off, and so do the places between from
/// the surface.
const NEIGHBORS: usize = 3;

/// Side of the square over which a photo's luma is averaged, in pixels: specks are small.
const SIDE: f64 = 1.0;

/// Views that must agree about a place.
const WITNESSES: usize = 3;

/// They agree when their lumas lie within this, in gray.
const AGREEMENT: f64 = 0.06;

/// One disagrees when it is this far from their median, in gray.
const DISAGREEMENT: f64 = 0.2;

/// Places half-way between neighboring points, and what the views that see both show there.
#[derive(Clone, Debug, Default)]
pub(super) struct Midpoints {
    /// Views of each place.
    views: Vec<Vec<usize>>,
    patch_means: PatchMeans,
}

impl Midpoints {
    /// The places of a capture, of which nothing is known yet; `cameras` are those of its
    /// views at working size.
    pub fn of(capture: &Capture, cameras: &[Camera]) -> Self {
        let positions: Vec<[f32; 3]> = (capture.points.iter())
            .map(|point| point.position.as_vec3().to_array())
            .collect();
        let neighbors = nearest_neighbors(&positions, NEIGHBORS);
        let mut pairs = BTreeSet::new();
        for (a, of_a) in neighbors.iter().enumerate() {
            for &b in of_a {
                let b = b as usize;
                pairs.insert((a.min(b), a.max(b)));
            }
        }
        let mut patch_means = PatchMeans::of(cameras.len());
        let mut views = Vec::with_capacity(pairs.len());
        for (a, b) in pairs {
            let [first, second] = [a, b].map(|index| &capture.points[index]);
            let middle = 0.5 * (first.position + second.position);
            let mut seeing = Vec::new();
            for seen in &first.track {
                if second.track.iter().all(|also| also.view != seen.view) {
                    continue;
                }
                if let Some(pixel) = cameras[seen.view].pixel_of(middle) {
                    patch_means.ask(seen.view, pixel, SIDE);
                    seeing.push(seen.view);
                }
            }
            views.push(seeing);
        }
        Self { views, patch_means }
    }

    /// Takes what is wanted of the photo of a view.
    pub fn look(&mut self, view: usize, photo: &Photo) {
        self.patch_means.look(view, photo);
    }

    /// Share of the samples at places about which the other views agree that disagree with
    /// them; `None` where there is no such place.
    pub fn outlier_share(&self, exposures: &[Exposure]) -> Option<f64> {
        let (mut judged, mut disagreeing) = (0_u64, 0_u64);
        let mut means = self.patch_means.means();
        for views in &self.views {
            let mut lumas: Vec<f64> = (views.iter().zip(&mut means))
                .filter_map(|(&view, mean)| {
                    let Exposure { gain, offset } = exposures[view];
                    Some((mean? - offset) / gain)
                })
                .collect();
            lumas.sort_by(f64::total_cmp);
            let [total, without] = judge(&lumas);
            judged += total;
            disagreeing += without;
        }
        (judged > 0).then(|| disagreeing as f64 / judged as f64)
    }
}

/// Counts sorted lumas at one place: those on which the others agree, and how many of these
/// disagree with them.
fn judge(lumas: &[f64]) -> [u64; 2] {
    let n = lumas.len();
    if n <= WITNESSES {
        return [0, 0];
    }
    let mut counts = [0, 0];
    for (i, &luma) in lumas.iter().enumerate() {
        let other = |k: usize| lumas[if k < i { k } else { k + 1 }];
        if other(n - 2) - other(0) <= AGREEMENT {
            counts[0] += 1;
            counts[1] += u64::from((luma - other((n - 1) / 2)).abs() > DISAGREEMENT);
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_against_all_is_an_outlier() {
        assert_eq!(judge(&[0.1, 0.4, 0.41, 0.42]), [1, 1]);
        assert_eq!(judge(&[0.4, 0.41, 0.42, 0.43]), [4, 0]);
        // Nobody agrees, or nobody is there.
        assert_eq!(judge(&[0.1, 0.2, 0.3, 0.4]), [0, 0]);
        assert_eq!(judge(&[0.1, 0.4, 0.41]), [0, 0]);
        // Two of one kind are not one against all.
        assert_eq!(judge(&[0.1, 0.1, 0.4, 0.41, 0.42]), [0, 0]);
    }
}
