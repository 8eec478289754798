//! Silhouette carving: removes Gaussians outside the masks of the training views.

use glam::DVec3;

use crate::{
    capture::{CaptureError, Dataset, Photo},
    splats::Splats,
};

/// A Gaussian goes when more than this share of the views that see its center have it
/// removed: the hull of the silhouettes, with some patience for masks drawn by hand.
const REMOVED_SHARE: f64 = 0.25;

/// Mask of a photo with removed (black) pixels set to 255, since they are known to be empty.
pub(super) fn unknown(photo: &Photo) -> Option<Vec<u8>> {
    let mask = photo.mask.as_ref()?;
    let known =
        (photo.gray.iter().zip(mask)).map(|(&gray, &count)| if gray == 0 { 255 } else { count });
    Some(known.collect())
}

/// The Gaussians that lie inside the silhouettes of the training views; all of them where
/// nothing would be left.
pub fn carved(dataset: &Dataset, splats: &Splats) -> Result<Splats, CaptureError> {
    let places: Vec<DVec3> = (splats.means.iter())
        .map(|mean| DVec3::from(mean.map(f64::from)))
        .collect();
    // Views that see it, and those that have it removed.
    let mut counted = vec![[0_u32; 2]; places.len()];
    dataset.visit(&dataset.split.train, |view, photo| {
        let camera = &dataset.cameras[view];
        for (&place, [seen, removed]) in places.iter().zip(&mut counted) {
            if let Some([x, y]) = camera.pixel_of(place) {
                let pixel = y as usize * photo.width as usize + x as usize;
                *seen += 1;
                *removed += u32::from(photo.gray[pixel] == 0 && !photo.counts(pixel));
            }
        }
        Ok::<_, CaptureError>(())
    })?;
    let inside = |&i: &usize| {
        let [seen, removed] = counted[i].map(f64::from);
        removed <= REMOVED_SHARE * seen
    };
    let kept: Vec<usize> = (0..splats.len()).filter(inside).collect();
    Ok(match kept.len() {
        0 => splats.clone(),
        _ => splats.chosen(&kept),
    })
}
