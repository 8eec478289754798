//! `Renderer`: pictures of several fields and sizes, one after the other.

use gs_chroma::raster::{Field, Geometry, Renderer};

use crate::kernels::{
    harness::{Stage, bits, camera, gpu, raster, splats},
    oracle::{
        random::{oblique_view, random_scene},
        view::View,
    },
};

/// Views that share a scene; some with fewer pixels have more tiles.
fn views() -> Vec<View> {
    let sizes = [[1, 1], [32, 16], [17, 17], [70, 5], [16, 33], [120, 90]];
    let view = |[width, height]: [usize; 2]| View {
        width,
        height,
        ..oblique_view()
    };
    sizes.map(view).to_vec()
}

#[test]
fn pictures_do_not_depend_on_those_before() {
    let mut luma = splats(&random_scene::<1>(40, 60, 2).0);
    // Wide enough to need more room than the lists begin with.
    let scales = luma.log_scales.as_flattened_mut();
    scales.iter_mut().for_each(|scale| *scale += 1.5);
    let mut chroma = luma.clone();
    chroma.sh = splats(&random_scene::<2>(41, 60, 1).0).sh;

    let geometry = Geometry::upload(gpu(), &luma).unwrap();
    let fields = [&luma, &chroma].map(|s| Field::upload(gpu(), &s.sh).unwrap());
    let near = oblique_view().near;
    let mut renderer = Renderer::new(raster(), geometry, fields.into(), near).unwrap();
    for view in views().iter().chain(views().iter().rev()) {
        let pictures = renderer.render(&camera(view)).unwrap();
        assert_eq!(pictures.len(), 2);
        for (picture, splats) in pictures.iter().zip([&luma, &chroma]) {
            let size = [picture.width as usize, picture.height as usize];
            assert_eq!(size, [view.width, view.height]);
            assert_eq!(picture.channels, splats.sh.channels);
            let alone = Stage::new(splats, view).forward();
            assert!(alone.iter().any(|&value| value != 0.0));
            assert!(bits(&picture.pixels) == bits(&alone), "{size:?}");
        }
    }
}
