//! Purpose of the antialiased projection: a picture of fewer pixels shows the mean of the pixels of
//! a finer one.

use crate::kernels::{
    harness::{Stage, splats},
    oracle::{
        random::{oblique_view, random_scene_before},
        view::View,
    },
};

/// Pixels of the fine picture along a side of a pixel of the coarse one.
const FINER: usize = 4;

/// The view with `FINER` times as many pixels along each side.
fn finer(view: &View) -> View {
    let by = FINER as f64;
    View {
        fx: by * view.fx,
        fy: by * view.fy,
        cx: by * view.cx,
        cy: by * view.cy,
        width: FINER * view.width,
        height: FINER * view.height,
        ..view.clone()
    }
}

/// Mean difference between the coarse picture and the means over the fine one's pixels.
fn disagreement(seed: u64, antialiased: bool) -> f64 {
    let coarse = View {
        antialiased,
        ..oblique_view()
    };
    let fine = finer(&coarse);
    // A pixel or two wide in the fine view.
    let scene = random_scene_before::<1>(&finer(&oblique_view()), seed, 300, 0);
    let mut splats = splats(&scene);
    for log_scale in splats.log_scales.as_flattened_mut() {
        *log_scale -= 0.7;
    }
    let [shown, pixels] = [&coarse, &fine].map(|view| Stage::new(&splats, view).forward());
    let errors = shown.iter().enumerate().map(|(i, &value)| {
        let [x, y] = [i % coarse.width, i / coarse.width].map(|at| FINER * at);
        let block = (0..FINER * FINER).map(|k| {
            let [x, y] = [x + k % FINER, y + k / FINER];
            f64::from(pixels[y * fine.width + x])
        });
        (f64::from(value) - block.sum::<f64>() / (FINER * FINER) as f64).abs()
    });
    errors.sum::<f64>() / shown.len() as f64
}

#[test]
fn a_coarse_picture_shows_the_mean_of_a_fine_one() {
    for seed in [3, 4] {
        let [plain, antialiased] = [false, true].map(|on| disagreement(seed, on));
        println!("{plain:.5} without, {antialiased:.5} with");
        assert!(antialiased < 0.4 * plain, "{antialiased} and {plain}");
    }
}
