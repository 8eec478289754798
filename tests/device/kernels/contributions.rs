//! `Contributions` against the oracle, which draws one Gaussian white and all others black.

use gs_chroma::{
    raster::{Contributions, constants::NEAR_SHARE},
    splats::sh,
};

use crate::kernels::{
    harness::{camera, raster, splats},
    oracle::{
        random::{oblique_view, random_scene},
        render::render,
        scene::Scene,
        shade::Shading,
        view::View,
    },
};

/// The largest difference, in pixels.
fn apart(found: &[f32], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let each = found.iter().zip(expected);
    each.map(|(&f, e)| (f64::from(f) - e).abs())
        .fold(0.0, f64::max)
}

#[test]
fn a_gaussian_fills_what_it_shows_in_white() {
    let random = random_scene::<2>(43, 40, 0).0;
    let larger = (0..random.len()).map(|i| {
        let mut gaussian = random.gaussian(i);
        // Large enough to cover one another.
        gaussian.log_scale = gaussian.log_scale.map(|log_scale| log_scale + 0.9);
        gaussian
    });
    let scene = Scene::of(0, larger);
    let extent = oblique_view().near / NEAR_SHARE;
    let mut contributions = Contributions::new(&raster(), &splats(&scene), extent).unwrap();
    // The larger view needs other buffers, the last one none.
    for [width, height] in [[17, 33], [96, 64], [40, 30]] {
        let view = View {
            width,
            height,
            ..oblique_view()
        };
        let white = 1.0 / sh::C0;
        let expected: Vec<f64> = (0..scene.len())
            .map(|i| {
                let colored = (0..scene.len()).map(|k| {
                    let mut gaussian = scene.gaussian(k);
                    gaussian.sh = vec![[if k == i { white } else { 0.0 }, 0.0]];
                    gaussian
                });
                let picture = render(&Scene::of(0, colored), &view, Shading::Plain);
                picture.iter().map(|pixel| pixel[0]).sum()
            })
            .collect();
        let mut found = contributions.of(&camera(&view)).unwrap();
        let most = expected.iter().copied().fold(0.0, f64::max);
        assert!(most > 10.0, "{most}");
        let error = apart(&found, &expected);
        assert!(error < 1e-3, "{width} × {height}: {error} pixels");
        // The comparison notices one Gaussian too many.
        found[7] += 0.01;
        assert!(apart(&found, &expected) > 1e-3);
    }
}
