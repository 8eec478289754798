//! Tests of the oracle's gradients: against finite differences, and against dual
//! numbers through the whole brute-force render.

use super::gradient::gradient;
use super::random::{Random, opaque_stack, random_scene};
use super::render::{decision_margin, render};
use super::scene::Scene;
use super::seed;
use super::shade::Shading;
use super::view::View;

/// Random v, zero where a pixel is within `margin` of a decision.
fn upstream<const C: usize>(scene: &Scene<f64, C>, view: &View, margin: f64) -> Vec<[f64; C]> {
    let mut random = Random::new(99);
    decision_margin(scene, view)
        .into_iter()
        .map(|m| {
            let v = random.array(-1.0, 1.0);
            if m < margin { [0.0; C] } else { v }
        })
        .collect()
}

fn scalar<const C: usize>(picture: &[[f64; C]], v: &[[f64; C]]) -> f64 {
    (picture.iter().flatten())
        .zip(v.iter().flatten())
        .map(|(out, v)| out * v)
        .sum()
}

fn against_finite_differences<const C: usize>(scene: &Scene<f64, C>, view: &View) {
    let shading = Shading::of_channels(C);
    let v = upstream(scene, view, 1e-3);
    let kept = v.iter().filter(|v| v[0] != 0.0).count();
    assert!(kept > v.len() / 2, "{kept} pixels left of {}", v.len());
    let result = gradient(scene, view, shading, &v);
    let step = 1e-6;
    let mut met = 0;
    for index in 0..scene.len() {
        let count = scene.gaussian(index).parameters_mut().count();
        // Not every one: a brute-force render is dear.
        for parameter in (0..count).filter(|p| (p + index) % 5 == 0) {
            let shifted = |by: f64| {
                let rows = (0..scene.len()).map(|i| {
                    let mut row = scene.gaussian(i);
                    if i == index {
                        *row.parameters_mut().nth(parameter).unwrap() += by;
                    }
                    row
                });
                scalar(&render(&Scene::of(scene.degree, rows), view, shading), &v)
            };
            let difference = (shifted(step) - shifted(-step)) / (2.0 * step);
            let mut row = result.gaussian(index);
            let exact = *row.parameters_mut().nth(parameter).unwrap();
            let scale = if C == 2 { 40.0 } else { 1.0 };
            assert!(
                (difference - exact).abs() < 1e-6 * (scale + exact.abs()),
                "Gaussian {index}, parameter {parameter}: {difference} or {exact}"
            );
            met += usize::from(exact != 0.0);
        }
    }
    assert!(met > scene.len(), "only {met} derivatives differ from zero");
}

#[test]
fn agrees_with_finite_differences_luma() {
    let (scene, view) = random_scene::<1>(11, 10, 3);
    against_finite_differences(&scene, &view);
}

#[test]
fn agrees_with_finite_differences_chroma() {
    let (scene, view) = random_scene::<2>(12, 10, 1);
    against_finite_differences(&scene, &view);
}

#[test]
fn agrees_with_finite_differences_rgb() {
    let (scene, view) = random_scene::<3>(13, 10, 2);
    against_finite_differences(&scene, &view);
}

#[test]
fn agrees_with_finite_differences_opaque() {
    let (scene, view) = opaque_stack::<1>(14, 12, 0);
    against_finite_differences(&scene, &view);
}

#[test]
fn shortcut_equals_dual_numbers_through_everything() {
    let (scene, view) = random_scene::<1>(15, 12, 1);
    let v = upstream(&scene, &view, 0.0);
    let fast = gradient(&scene, &view, Shading::Offset, &v);
    for index in 0..scene.len() {
        for parameter in [0, 4, 8, 10, 12] {
            let rows = (0..scene.len()).map(|i| {
                let mut row = scene.gaussian(i).to_dual();
                if i == index {
                    let value = row.parameters_mut().nth(parameter).unwrap();
                    *value = seed(value.re);
                }
                row
            });
            let picture = render(&Scene::of(1, rows), &view, Shading::Offset);
            let slow: f64 = (picture.iter().flatten())
                .zip(v.iter().flatten())
                .map(|(out, v)| out.eps * v)
                .sum();
            let mut row = fast.gaussian(index);
            let value = *row.parameters_mut().nth(parameter).unwrap();
            assert!((value - slow).abs() <= 1e-12 * (1.0 + slow.abs()));
        }
    }
}
