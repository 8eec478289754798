//! Figures of pixels gathered by the Gaussians: drawing turned around.

use gs_chroma::{
    chroma::FrozenField,
    splats::{ShField, sh},
};

use crate::kernels::wall::{PIXELS, Problem, cameras, chroma_view, drawn, wall};

/// For any colors x of the Gaussians and any figures y of the pixels, y times the picture of x is
/// x times what is gathered of y.
#[test]
fn gathering_is_the_adjoint_of_drawing() {
    let mut random = fastrand::Rng::with_seed(5);
    let wall = wall();
    let cameras = cameras(2);
    let views: Vec<_> = (cameras.iter().cloned())
        .map(|camera| chroma_view(camera, vec![[0.0; 2]; PIXELS]))
        .collect();
    let problem = Problem::new(&wall, &views);
    let count = wall.means.len();
    for (view, camera) in cameras.iter().enumerate() {
        let figures: Vec<[f32; 4]> = (0..PIXELS)
            .map(|_| [(); 4].map(|()| 2.0 * random.f32() - 1.0))
            .collect();
        let gathered = problem.frozen.gather(view, &figures).unwrap();
        let chroma = ShField {
            degree: 0,
            channels: 2,
            coefficients: (0..2 * count).map(|_| random.f32()).collect(),
        };
        let picture = drawn(&chroma, camera);
        for figure in 0..4 {
            // Figures two and three are gathered on another way than zero and one.
            let channel = figure % 2;
            let (of_pixels, size) =
                (picture.iter().zip(&figures)).fold((0.0, 0.0), |(sum, size), (ab, figures)| {
                    let product = ab[channel] * f64::from(figures[figure]);
                    (sum + product, size + product.abs())
                });
            let of_splats: f64 = (gathered.iter().enumerate())
                .map(|(i, sums)| {
                    let color = sh::C0 * f64::from(chroma.coefficients[2 * i + channel]);
                    color * f64::from(sums[figure])
                })
                .sum();
            let off = (of_pixels - of_splats).abs();
            assert!(
                off < 1e-5 * size,
                "{figure}: {of_pixels} {of_splats} of {size}"
            );
        }
    }
    // Ones give how much of each Gaussian all pixels show, and no more than there are pixels.
    let shown = problem.frozen.gather(0, &[[1.0; 4]; PIXELS]).unwrap();
    assert!(
        shown
            .iter()
            .all(|sums| (0.0..PIXELS as f32).contains(&sums[3]))
    );
    assert!(shown.iter().map(|sums| sums[3]).sum::<f32>() > 0.5 * PIXELS as f32);
}
