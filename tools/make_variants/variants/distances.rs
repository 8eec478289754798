//! Photos that show the same place with more and with fewer pixels.

use gs_chroma::capture::downscale;
use image::RgbImage;

use super::scene::{Scene, View};

/// Every other training photo, and every other held-out one, at a quarter of its size.
pub fn quarter(scene: &mut Scene) -> String {
    let mut seen = [0, 0];
    let shrinks = scene.views.iter().map(|view| {
        let number = &mut seen[usize::from(view.held_out)];
        *number += 1;
        if *number % 2 == 0 { 4 } else { 1 }
    });
    let shrinks: Vec<u32> = shrinks.collect();
    shrink(scene, |view| shrinks[view]);
    "every other photo at a quarter of its size".into()
}

/// All photos at half their size.
pub fn halve(scene: &mut Scene) -> String {
    shrink(scene, |_| 2);
    "all photos at half their size".into()
}

fn shrink(scene: &mut Scene, by: impl Fn(usize) -> u32) {
    let scales: Vec<[f64; 2]> = scene
        .views
        .iter_mut()
        .enumerate()
        .map(|(index, view)| shrink_view(view, by(index)))
        .collect();
    scene.move_observations(|view, pixel| Some([0, 1].map(|k| pixel[k] * scales[view][k])));
}

/// Shrinks the photo and its camera, and says by what along x and y.
fn shrink_view(view: &mut View, by: u32) -> [f64; 2] {
    let from = view.camera.size;
    let to = from.map(|side| (side / by).max(1));
    let [wide, narrow] = [from, to].map(|size| size.map(|side| side as usize));
    let smaller = downscale::<3>(view.picture.as_chunks().0, wide, narrow);
    view.picture = RgbImage::from_raw(to[0], to[1], smaller.into_flattened())
        .expect("three bytes for each pixel");
    let scale = [0, 1].map(|k| f64::from(to[k]) / f64::from(from[k]));
    view.camera.size = to;
    view.camera.focal = [0, 1].map(|k| view.camera.focal[k] * scale[k]);
    view.camera.center = [0, 1].map(|k| view.camera.center[k] * scale[k]);
    scale
}
