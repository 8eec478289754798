//! What masks say is not there, taken out of a set of Gaussians.

use glam::DVec3;

use super::scene::{Scene, counts};
use crate::{
    capture::Photo,
    splats::{ShField, Splats},
};

/// A Gaussian goes when more than this share of the views that see its centre have it
/// removed: the hull of the silhouettes, with some patience for masks drawn by hand.
const REMOVED_SHARE: f64 = 0.25;

/// What a photo does not say: what its mask removes is black, and that it says.
pub(super) fn unknown(photo: &Photo) -> Option<Vec<u8>> {
    let mask = photo.mask.as_ref()?;
    let known =
        (photo.gray.iter().zip(mask)).map(|(&gray, &count)| if gray == 0 { 255 } else { count });
    Some(known.collect())
}

/// The Gaussians that lie inside the silhouettes of the training views; all of them where
/// nothing would be left.
pub(super) fn carved(scene: &Scene, splats: &Splats) -> Splats {
    let kept: Vec<usize> = (0..splats.len())
        .filter(|&i| is_inside(scene, DVec3::from(splats.means[i].map(f64::from))))
        .collect();
    match kept.len() {
        0 => splats.clone(),
        _ => chosen(splats, &kept),
    }
}

/// Whether enough views show something at a place.
fn is_inside(scene: &Scene, place: DVec3) -> bool {
    let (mut seen, mut removed) = (0.0, 0.0);
    for &view in &scene.split.train {
        let (photo, camera) = &scene.photos[view];
        if let Some([x, y]) = camera.pixel_of(place) {
            let pixel = y as usize * photo.width as usize + x as usize;
            let is_removed = photo.gray[pixel] == 0 && !counts(photo, pixel);
            seen += 1.0;
            removed += f64::from(u8::from(is_removed));
        }
    }
    removed <= REMOVED_SHARE * seen
}

/// Some of the Gaussians, in the order of `indices`.
pub(super) fn chosen(splats: &Splats, indices: &[usize]) -> Splats {
    let field = &splats.sh;
    Splats {
        means: indices.iter().map(|&i| splats.means[i]).collect(),
        quats: indices.iter().map(|&i| splats.quats[i]).collect(),
        log_scales: indices.iter().map(|&i| splats.log_scales[i]).collect(),
        opacity_logits: indices.iter().map(|&i| splats.opacity_logits[i]).collect(),
        sh: ShField {
            coefficients: (indices.iter())
                .flat_map(|&i| field.of(i).to_vec())
                .collect(),
            ..*field
        },
    }
}
