//! RGB harmonics fitted to pictures, as a viewer would draw them: black is as dark as a
//! Gaussian gets.

use std::ops::ControlFlow;

use gs_chroma::{
    chroma::{
        ChromaSettings, FrozenViews, MemoryBudget, Recipe, Targets, Task, bake, bake_rgb, fit_rgb,
        follow_recipe, native_rgb,
    },
    raster::{ColorKind, Field, Geometry, RenderedImage, Renderer, constants::NEAR_SHARE},
    splats::{ShField, Splats, sh},
};

use crate::kernels::harness::{bits, cameras, gpu, overlapping, raster};

const EXTENT: f64 = 1.0;

/// `fields` on the geometry of `splats`, for each camera a picture of each.
fn drawn(splats: &Splats, fields: &[&ShField]) -> Vec<Vec<RenderedImage>> {
    let geometry = Geometry::upload(gpu(), splats).unwrap();
    let fields = (fields.iter())
        .map(|field| Field::upload(gpu(), field).unwrap())
        .collect();
    let mut renderer = Renderer::new(raster(), geometry, fields, NEAR_SHARE * EXTENT).unwrap();
    (cameras().iter())
        .map(|camera| renderer.render(camera).unwrap())
        .collect()
}

/// Pictures as a viewer shows them.
fn shown(splats: &Splats) -> Vec<Vec<[f32; 3]>> {
    (drawn(splats, &[&splats.sh]).iter())
        .map(|pictures| {
            let pixels = pictures[0].pixels.chunks_exact(3);
            pixels
                .map(|rgb| [0, 1, 2].map(|c| rgb[c].clamp(0.0, 1.0)))
                .collect()
        })
        .collect()
}

/// Mean distance of two sets of pictures, channel by channel.
fn distance(a: &[Vec<[f32; 3]>], b: &[Vec<[f32; 3]>]) -> f64 {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    let differences: Vec<f64> = pairs
        .flat_map(|(a, b)| [0, 1, 2].map(|c| f64::from((a[c] - b[c]).abs())))
        .collect();
    differences.iter().sum::<f64>() / differences.len() as f64
}

/// Colors of which some are far below black.
fn colorful() -> Splats {
    let mut splats = overlapping::<3>();
    for (k, value) in splats.sh.coefficients.iter_mut().enumerate() {
        let level = (k * 37 % 101) as f64 / 100.0;
        *value = ((1.6 * level - 0.6 - 0.5) / sh::C0) as f32;
    }
    splats
}

fn frozen(splats: &Splats) -> FrozenViews {
    let room = MemoryBudget::of(ColorKind::Rgb, 0);
    FrozenViews::new(&raster(), splats, EXTENT, &cameras(), 3, room).unwrap()
}

fn settings() -> ChromaSettings {
    ChromaSettings {
        correct_views: false,
        robust: None,
        fill: false,
        settled: 0.0,
        anchor: 0.0,
        ..ChromaSettings::irls()
    }
}

#[test]
fn rgb_harmonics_are_fitted_to_what_is_shown() {
    let truth = colorful();
    let pictures = shown(&truth);
    let fitted = |spoilt: f32| {
        // Degree 3 settles slowly.
        let settings = ChromaSettings {
            rounds: 60,
            ..settings()
        };
        let mut targets = Targets::new(settings.target_scales());
        let tasks = (0..).zip(&pictures).map(|(view, wanted)| {
            let mut wanted = wanted.clone();
            let mut weights = vec![1.0; wanted.len()];
            for pixel in 0..wanted.len() / 10 {
                wanted[pixel] = [spoilt; 3];
                weights[pixel] = 0.0;
            }
            let camera = &cameras()[view];
            let size = [camera.width, camera.height];
            let target = targets.push_rgb(size, &wanted, Some(&weights)).unwrap();
            Task { view, target }
        });
        let tasks = tasks.collect();
        let frozen = frozen(&truth);
        let mut told = |_| ControlFlow::Continue(());
        fit_rgb(&frozen, &settings, &targets, tasks, &mut told).unwrap()
    };
    let sh = fitted(0.0);
    let error = distance(
        &shown(&Splats {
            sh: sh.clone(),
            ..truth.clone()
        }),
        &pictures,
    );
    // 0.0028 without the second fit, which knows what is black.
    assert!(error < 0.0025, "{error}");
    // What does not count does not count.
    assert_eq!(bits(&sh.coefficients), bits(&fitted(1.0).coefficients));
}

#[test]
fn the_bake_comes_closer_than_each_gaussian_by_itself() {
    let luma = overlapping::<1>();
    let mut chroma = ShField::zeros(luma.len(), 0, 2);
    for (k, value) in chroma.coefficients.iter_mut().enumerate() {
        *value = ((k * 53 % 81) as f64 - 40.0) as f32 / sh::C0 as f32;
    }
    let native: Vec<Vec<[f32; 3]>> = (drawn(&luma, &[&luma.sh, &chroma]).iter())
        .map(|pictures| native_rgb(&pictures[0], &pictures[1]))
        .collect();
    let alone = distance(&shown(&bake_rgb(&luma, &chroma)), &native);
    let baked = bake(&frozen(&luma), &luma, &chroma, &mut |_| {
        ControlFlow::Continue(())
    })
    .unwrap();
    let together = distance(&shown(&baked), &native);
    assert!(together < 0.8 * alone, "{together} {alone}");
    // Nothing but colors has moved.
    assert_eq!(baked.means, luma.means);
}

/// A Gaussian that is darker than black cannot lower a channel: others have to.
#[test]
fn the_bake_knows_that_nothing_gets_darker_than_black() {
    let mut luma = overlapping::<1>();
    for (k, value) in luma.sh.coefficients.iter_mut().enumerate() {
        let level = (k * 37 % 101) as f64 / 100.0;
        *value = ((1.2 * level - 0.6 - 0.5) / sh::C0) as f32;
    }
    let mut chroma = ShField::zeros(luma.len(), 0, 2);
    for (k, value) in chroma.coefficients.iter_mut().enumerate() {
        *value = ((k * 53 % 61) as f64 - 30.0) as f32 / sh::C0 as f32;
    }
    let native: Vec<Vec<[f32; 3]>> = (drawn(&luma, &[&luma.sh, &chroma]).iter())
        .map(|pictures| native_rgb(&pictures[0], &pictures[1]))
        .collect();
    let baked = bake(&frozen(&luma), &luma, &chroma, &mut |_| {
        ControlFlow::Continue(())
    })
    .unwrap();
    let error = distance(&shown(&baked), &native);
    // 0.0058; 0.0102 without floors, 0.0121 each Gaussian by itself.
    assert!(error < 0.007, "{error}");
    let black = (-0.5 / sh::C0) as f32;
    assert!(baked.sh.coefficients.iter().all(|&c| c >= black - 1e-4));
}

/// Recipes start from gray and end near what is wanted, with the same bits each time; one that
/// moves constant harmonics alone leaves the others gray.
#[test]
fn recipes_color_what_is_gray() {
    let mut truth = colorful();
    // Not below black, where nothing pulls a Gaussian up again.
    for value in &mut truth.sh.coefficients {
        *value = value.max(-1.5);
    }
    let pictures = shown(&truth);
    let mut luma = truth.to_luma();
    assert_eq!(luma.sh.degree, 0);
    luma.sh = ShField {
        degree: 1,
        coefficients: (luma.sh.coefficients.iter())
            .flat_map(|&constant| [constant, 0.0, 0.0, 0.0])
            .collect(),
        ..luma.sh
    };
    for (recipe, closer) in [
        (
            Recipe {
                iterations: 150,
                rates: [2e-2, 2e-3],
                ..Recipe::chromadistill_paper()
            },
            0.5,
        ),
        (
            Recipe {
                iterations: 150,
                rates: [2e-2, 2e-3],
                ..Recipe::chromadistill_one_scale()
            },
            0.5,
        ),
        (
            Recipe {
                iterations: 300,
                ..Recipe::chromadistill_code()
            },
            0.6,
        ),
        (
            Recipe {
                iterations: 300,
                ..Recipe::chromadistill_rgb()
            },
            0.6,
        ),
    ] {
        let mut targets = Targets::new(recipe.target_scales());
        let tasks: Vec<Task> = (pictures.iter().enumerate())
            .map(|(view, wanted)| {
                let camera = &cameras()[view];
                let size = [camera.width, camera.height];
                let target = targets.push_rgb(size, wanted, None).unwrap();
                Task { view, target }
            })
            .collect();
        let colored = || {
            let frozen = frozen(&luma);
            let mut told = |_| ControlFlow::Continue(());
            follow_recipe(
                &frozen,
                &recipe,
                &targets,
                tasks.clone(),
                &luma,
                3,
                &mut told,
            )
            .unwrap()
        };
        let found = colored();
        assert!(bits(&found.coefficients) == bits(&colored().coefficients));
        let rest = found
            .coefficients
            .chunks_exact(3 * sh::coefficient_count(found.degree));
        let gray_rest = rest
            .flat_map(|of_splat| of_splat[3..].as_chunks::<3>().0)
            .all(|rgb| rgb.iter().all(|value| *value == rgb[0]));
        assert_eq!(gray_rest, recipe.rest_share.is_none());
        let with = |sh: ShField| shown(&Splats { sh, ..luma.clone() });
        // All harmonics that learn are there, also those that luma has not.
        assert_eq!(found.degree, if gray_rest { luma.sh.degree } else { 3 });
        let (before, after) = (
            distance(&with(luma.sh.to_rgb()), &pictures),
            distance(&with(found), &pictures),
        );
        assert!(after < closer * before, "{before} became {after}");
    }
}
