//! Effects of image formation: what is off is not there, what is on does its work and
//! repeats bit for bit.

use std::collections::BTreeSet;

use gs_chroma::{
    capture::{Camera, Exposure},
    gpu::shaders,
    luma::{LumaSettings, LumaTrainer, Schedule, TrainingView, outliers},
    raster::{Field, Geometry, Renderer},
    splats::Splats,
};
use naga::front::wgsl;

use crate::kernels::harness::{bits, cameras, gpu, overlapping, raster};

/// Names of all that a shader declares: bindings, structs, functions, constants.
fn names(source: &str) -> BTreeSet<String> {
    let module = wgsl::parse_str(source).unwrap();
    let globals = module.global_variables.iter().map(|(_, v)| v.name.clone());
    let functions = module.functions.iter().map(|(_, f)| f.name.clone());
    let types = module.types.iter().map(|(_, t)| t.name.clone());
    let constants = module.constants.iter().map(|(_, c)| c.name.clone());
    (globals.chain(functions).chain(types).chain(constants))
        .flatten()
        .collect()
}

#[test]
fn what_is_off_is_in_no_kernel() {
    let plain = names(shaders::LUMA_LOSS);
    let beyond = |source: &str| -> Vec<String> {
        let names = names(source);
        assert!(plain.is_subset(&names));
        names.difference(&plain).cloned().collect()
    };
    assert_eq!(
        beyond(shaders::LUMA_LOSS_EXPOSED),
        ["LumaLossParameters", "is_beyond", "parameters"]
    );
    assert_eq!(
        beyond(shaders::LUMA_LOSS_MASKED),
        ["mask", "weight", "weight_quad", "weight_run"]
    );
    for word in ["mask", "weight(", "gain", "parameters"] {
        assert!(!shaders::LUMA_LOSS.contains(word), "{word}");
    }
    for word in ["compensation", "mip"] {
        assert!(!shaders::PROJECT.contains(word), "{word}");
        assert!(!shaders::PROJECT_BACKWARD_STEP.contains(word), "{word}");
    }
}

/// Pictures of the scene from the cameras, in 8 bits.
fn photos(splats: &Splats) -> Vec<(Camera, Vec<u8>)> {
    let geometry = Geometry::upload(gpu(), splats).unwrap();
    let field = Field::upload(gpu(), &splats.sh).unwrap();
    let mut renderer = Renderer::new(raster(), geometry, vec![field], 0.01).unwrap();
    (cameras().into_iter())
        .map(|camera| {
            let picture = renderer.render(&camera).unwrap().remove(0);
            let gray = picture.pixels.iter().map(|v| (v * 255.0).round() as u8);
            (camera, gray.collect())
        })
        .collect()
}

/// A block of pixels.
fn is_spoilt(camera: &Camera, pixel: usize) -> bool {
    let (x, y) = (pixel as u32 % camera.width, pixel as u32 / camera.width);
    let middle = [camera.width / 2, camera.height / 2];
    x.abs_diff(middle[0]) <= 3 && y.abs_diff(middle[1]) <= 3
}

#[test]
fn a_defect_is_found_where_it_is_and_nowhere_else() {
    let splats = overlapping::<1>();
    let mut photos = photos(&splats);
    const SPOILT: usize = 2;
    let (camera, gray) = &mut photos[SPOILT];
    for (pixel, value) in gray.iter_mut().enumerate() {
        if is_spoilt(camera, pixel) {
            *value = if *value < 128 { 255 } else { 0 };
        }
    }
    let geometry = Geometry::upload(gpu(), &splats).unwrap();
    let field = Field::upload(gpu(), &splats.sh).unwrap();
    let seen: Vec<_> = (photos.iter())
        .map(|(camera, gray)| TrainingView::new(camera.clone(), gray.clone()))
        .collect();
    let mut masks = Vec::new();
    // Too little room at first: it is made.
    outliers::Scene {
        raster: &raster(),
        geometry: &geometry,
        field: &field,
        near: 0.01,
        capacity: 8,
    }
    .masks(&seen, |_, mask| masks.push(mask))
    .unwrap();
    for (index, ((camera, _), mask)) in photos.iter().zip(&masks).enumerate() {
        let left_out = |pixel: usize| mask[pixel] == 0;
        let spoilt = (0..mask.len()).filter(|&p| is_spoilt(camera, p)).count();
        let found = (0..mask.len()).filter(|&p| left_out(p)).count();
        if index == SPOILT {
            let hit = (0..mask.len())
                .filter(|&p| is_spoilt(camera, p) && left_out(p))
                .count();
            assert_eq!(hit, spoilt);
            // It grows by two pixels at most: one for the mean, one on purpose.
            assert!(found <= 11 * 11, "{found}");
        } else {
            assert_eq!(found, 0, "view {index}");
        }
    }
}

#[test]
fn training_with_all_effects_repeats_and_leaves_the_defect_out() {
    let target = overlapping::<1>();
    let mut start = target.clone();
    for value in start.sh.coefficients.iter_mut() {
        *value *= 0.5;
    }
    let train = |robust: bool| {
        let views: Vec<TrainingView> = (photos(&target).into_iter().enumerate())
            .map(|(index, (camera, mut gray))| {
                let exposure = Exposure {
                    gain: 0.8 + 0.1 * index as f64,
                    offset: 0.01,
                };
                for (pixel, value) in gray.iter_mut().enumerate() {
                    let luma = f64::from(*value) / 255.0;
                    *value = (255.0 * exposure.shown(luma)).round() as u8;
                    if index == 2 && is_spoilt(&camera, pixel) {
                        *value = 255;
                    }
                }
                let mut view = TrainingView::new(camera, gray);
                view.exposure = exposure;
                view.mask = Some(
                    (0..view.gray.len())
                        .map(|p| if p % 11 == 0 { 0 } else { 255 })
                        .collect(),
                );
                view
            })
            .collect();
        let mut settings = LumaSettings::new(80);
        settings.sh_degree = 0;
        settings.robust = robust;
        settings.max_splats = start.len();
        let mut trainer = LumaTrainer::new(raster(), settings, 4.0, &start, views).unwrap();
        trainer.follow(Schedule {
            densify_until: 0,
            ..trainer.schedule().clone()
        });
        let mut loss = 0.0;
        trainer.train(&mut |progress| loss = progress.loss).unwrap();
        (trainer.splats().unwrap(), loss)
    };
    let (first, with) = train(true);
    let (second, _) = train(true);
    assert_eq!(bits(&first.sh.coefficients), bits(&second.sh.coefficients));
    assert_eq!(
        bits(first.means.as_flattened()),
        bits(second.means.as_flattened())
    );
    let (_, without) = train(false);
    assert!(with < 0.8 * without, "{with} {without}");
}
