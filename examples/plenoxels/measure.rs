//! Any radiance field's colors on a dataset's views, measured as `eval` does.

use gs_chroma::{
    capture::Dataset,
    chroma::{ChromaError, FrozenField, Supervision, native_rgb},
    measure::{Consistency, Flow, colorfulness, reported_psnr, visible},
    raster::RenderedImage,
    splats::ShField,
};

/// Share of the first picture that two views must share to be compared.
const LEAST_OVERLAP: f64 = 0.2;

/// Size and pictures of a held-out view, RGB: photo, gray field, teacher, colored field.
pub type Row = ([u32; 2], [Vec<[f32; 3]>; 4]);

/// Measures a field whose views are all of the dataset's, with luma and a/b harmonics, and prints
/// what is found.
pub fn measure(
    field: &dyn FrozenField,
    [luma, chroma]: [&ShField; 2],
    dataset: &Dataset,
    supervision: &Supervision,
) -> Result<Vec<Row>, ChromaError> {
    let fields = [field.colors(luma)?, field.colors(chroma)?];
    let (mut frames, mut rows, mut psnrs) = (Vec::new(), Vec::new(), Vec::new());
    let mut colorful = [0.0; 2];
    for (view, camera) in dataset.cameras.iter().enumerate() {
        let drawn = field.draw(view, &[&fields[0], &fields[1]])?;
        let (gray, ab) = (&drawn[0], &drawn[1]);
        let Some(taught) = supervision.shown(view)? else {
            continue;
        };
        if dataset.split.test.contains(&view) {
            let photo = dataset.color(view)?;
            let truth = photo.gray_values();
            let shown: Vec<f32> = gray.pixels.iter().map(|v| v.clamp(0.0, 1.0)).collect();
            psnrs.push(reported_psnr(&shown, &truth));
            let picture = |channels, pixels| RenderedImage {
                channels,
                pixels,
                ..gray.clone()
            };
            let wanted = picture(2, taught.ab.as_flattened().to_vec());
            let pictures = [
                photo.rgb_values(),
                gray.shown(),
                native_rgb(&picture(1, truth), &wanted),
                native_rgb(gray, ab),
            ];
            for (sum, k) in colorful.iter_mut().zip([3, 2]) {
                *sum += colorfulness(&pictures[k]);
            }
            rows.push(([camera.width, camera.height], pictures));
        }
        let own = ab.pixels.as_chunks::<2>().0.to_vec();
        frames.push((camera, field.depth(view)?, [own, taught.ab]));
    }
    let mut sums = [Consistency::default(); 2];
    for (i, (from, depth, ours)) in frames.iter().enumerate() {
        for (to, depth_there, theirs) in &frames[i + 1..] {
            let forward = Flow::geometric(from, to, depth);
            let seen = visible(&forward, &Flow::geometric(to, from, depth_there));
            let shared = seen.iter().filter(|seen| **seen).count();
            if (shared as f64) < LEAST_OVERLAP * seen.len() as f64 {
                continue;
            }
            let size = [to.width as usize, to.height as usize];
            for (sum, (ours, theirs)) in sums.iter_mut().zip(ours.iter().zip(theirs)) {
                sum.add(ours, theirs, size, &forward, &seen);
            }
        }
    }
    let views = rows.len().max(1) as f64;
    let psnr = psnrs.iter().sum::<f64>() / views;
    println!("gray held-out photos: {psnr:.2} dB");
    let [ours, theirs] = sums.map(|sum| sum.rms().unwrap_or(f64::NAN));
    let share = (ours / theirs).powi(2);
    println!(
        "views differ by {ours:.2}, the teacher's by {theirs:.2} (a, b, rms): {share:.3} of its mean square"
    );
    let [ours, theirs] = colorful.map(|sum| sum / views);
    println!("colorfulness {ours:.1}, the teacher's {theirs:.1}");
    Ok(rows)
}
