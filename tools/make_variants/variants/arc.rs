//! Scenes of few photos.

use super::scene::{Scene, View};

/// Photos that stay.
const PHOTOS: usize = 11;

/// Keeps the photos that are turned to one side the most, and points that two of them see.
pub fn short(scene: &mut Scene) -> String {
    let nearest = |from: &View| {
        let mut angles: Vec<(f64, usize)> = scene
            .views
            .iter()
            .enumerate()
            .map(|(index, view)| {
                let [one, other] = [from, view].map(|view| view.rotation.row(2));
                (one.angle_between(other), index)
            })
            .collect();
        angles.sort_by(|a, b| a.0.total_cmp(&b.0));
        angles.truncate(PHOTOS);
        angles
    };
    let widest = |angles: &Vec<(f64, usize)>| angles.last().map_or(0.0, |last| last.0);
    let chosen = (scene.views.iter().map(nearest))
        .min_by(|a, b| widest(a).total_cmp(&widest(b)))
        .unwrap_or_default();
    let mut kept: Vec<usize> = chosen.iter().map(|&(_, index)| index).collect();
    kept.sort_unstable();
    let mut index = 0;
    scene.views.retain(|_| {
        index += 1;
        kept.contains(&(index - 1))
    });
    scene.points.retain_mut(|point| {
        let untracked = point.track.is_empty();
        point.track.retain_mut(|seen| {
            let place = kept.binary_search(&seen.view);
            place.map(|place| seen.view = place).is_ok()
        });
        untracked || point.track.len() >= 2
    });
    format!(
        "photos within {:.0} degrees of one",
        widest(&chosen).to_degrees()
    )
}
