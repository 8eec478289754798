//! Scenes fitted to viewers.

use gs_chroma::{
    low_level::viewers::{FitSettings, Pictures, Viewer, fit, pictures, shown_psnr, start},
    raster::RasterOptions,
    splats::Splats,
};

use crate::kernels::harness::{bits, cameras, overlapping, raster};

const EXTENT: f64 = 1.0;

/// Colors from black to white and some brighter, small Gaussians among large ones.
fn scene() -> Splats {
    let mut splats = overlapping::<3>();
    for (k, value) in splats.sh.coefficients.iter_mut().enumerate() {
        *value = (k * 37 % 101) as f32 / 100.0 * 4.2 - 1.7;
    }
    for (k, scales) in splats.log_scales.iter_mut().enumerate() {
        let smaller = [0.0, 1.0, 2.0][k % 3];
        *scales = scales.map(|scale| scale - smaller);
    }
    splats
}

fn wanted(splats: &Splats, antialiased: bool) -> Pictures {
    let drawn = RasterOptions {
        antialiased,
        ..RasterOptions::default()
    };
    pictures(&raster(), splats, drawn, &cameras(), EXTENT).unwrap()
}

/// PSNR in dB in the viewers, of the scene itself and of one that is fitted to some of them.
fn shown(viewers: &[Viewer], antialiased: bool) -> [[f64; 2]; 2] {
    let scene = scene();
    let (wanted, cameras) = (wanted(&scene, antialiased), cameras());
    let settings = FitSettings {
        iterations: 150,
        ..FitSettings::DEFAULT
    };
    let from = start(viewers, &scene);
    let task = (&cameras[..], &wanted);
    let observe = &mut |_, _| {};
    let fitted = fit(&raster(), viewers, &from, task, EXTENT, &settings, observe).unwrap();
    // Centers and rotations are no matter of kernels.
    assert_eq!(
        bits(fitted.means.as_flattened()),
        bits(from.means.as_flattened())
    );
    if viewers != [Viewer::Spark] {
        assert_eq!(from.means, scene.means);
    }
    let shown = [&scene, &fitted].map(|splats| {
        Viewer::ALL
            .map(|viewer| shown_psnr(&raster(), viewer, splats, &wanted, &cameras, EXTENT).unwrap())
    });
    println!("{viewers:?}: {shown:.1?}");
    shown
}

#[test]
fn a_fitted_scene_is_shown_as_it_is() {
    let [before, after] = shown(&[Viewer::PlayCanvas], false);
    assert!(after[1] > before[1] + 8.0);
    let [before, after] = shown(&[Viewer::Spark], false);
    assert!(after[0] > before[0] + 8.0);
}

#[test]
fn the_compromise_is_better_than_the_worse_of_both() {
    let [before, after] = shown(&Viewer::ALL, false);
    assert!(after[0].min(after[1]) > before[1] + 2.0);
}

#[test]
fn antialiased_scenes_are_fitted_for_viewers_without() {
    let [before, after] = shown(&[Viewer::Spark], true);
    assert!(after[0] > before[0] + 5.0);
}

#[test]
fn a_fit_repeats_bit_for_bit() {
    let scene = scene();
    let (wanted, cameras) = (wanted(&scene, false), cameras());
    let settings = FitSettings {
        iterations: 20,
        ..FitSettings::DEFAULT
    };
    let planes = || {
        let from = start(&Viewer::ALL, &scene);
        let task = (&cameras[..], &wanted);
        let (viewers, observe) = (&Viewer::ALL, &mut |_, _| {});
        let fitted = fit(&raster(), viewers, &from, task, EXTENT, &settings, observe).unwrap();
        let mut all = bits(&fitted.sh.coefficients);
        all.extend(bits(fitted.log_scales.as_flattened()));
        all.extend(bits(&fitted.opacity_logits));
        all
    };
    assert_eq!(planes(), planes());
}
