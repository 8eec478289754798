//! Variants of the bundled scene are what their names say.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use gs_chroma::capture::Capture;
use gs_chroma::measure::psnr;
use image::RgbImage;

use super::lens::Lens;
use super::resample::remap;
use super::scene::{Developed, Point, Scene, View};
use super::{Variant, arc, defects, depth, distances, exposure, gloss, make, sky, warp};

fn demo() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/demo")
}

fn read() -> Scene {
    Scene::read(&demo()).expect("the bundled scene")
}

/// Pixels that differ, as a share of all.
fn changed(a: &RgbImage, b: &RgbImage) -> f64 {
    let different = a.pixels().zip(b.pixels()).filter(|(a, b)| a != b).count();
    different as f64 / f64::from(a.width() * a.height())
}

/// Mean distance in pixels between where points are observed and where they project to.
fn reprojection_error(scene: &Scene) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for point in &scene.points {
        for seen in &point.track {
            let view = &scene.views[seen.view];
            let place = view.seen(point.position);
            let pixel = view.camera.pixel([place.x / place.z, place.y / place.z]);
            sum += (pixel[0] - seen.pixel[0]).hypot(pixel[1] - seen.pixel[1]);
            count += 1.0;
        }
    }
    sum / count
}

/// The photo as a pinhole of the source's focal length would have taken it, and the
/// source's own, both without the border where one has no pixels: as gray.
fn straightened(view: &View, source: &View) -> [Vec<f32>; 2] {
    let camera = &view.camera;
    let straight = remap(&view.picture, source.camera.size, |pixel| {
        camera.pixel(source.camera.ray(pixel))
    });
    [&straight, &source.picture].map(|picture| {
        let inside = picture.enumerate_pixels().filter(|(x, y, _)| {
            let pixel = [x, y].map(|&k| f64::from(k) + 0.5);
            camera.contains(camera.pixel(source.camera.ray(pixel)), 4.0)
        });
        inside
            .map(|(_, _, pixel)| f32::from(pixel.0[1]) / 255.0)
            .collect()
    })
}

#[test]
fn lenses_move_photos_and_observations_alike() {
    let source = read();
    let before = reprojection_error(&source);
    assert!(before < 0.15, "{before}");
    type Warp = fn(&mut Scene, bool) -> String;
    for (made, strong) in [(warp::barrel as Warp, true), (warp::barrel, false)]
        .into_iter()
        .chain([(warp::fisheye as Warp, true), (warp::fisheye, false)])
    {
        let mut scene = read();
        let note = made(&mut scene, strong);
        let shift = scene.views[0].camera.largest_shift();
        assert_eq!(shift > 8.0, strong, "{note}");
        assert_eq!(shift < 0.3, !strong, "{note}");
        let after = reprojection_error(&scene);
        assert!(after < 1.3 * before, "{note}: {before} {after}");
        assert!(scene.points.len() > 4000, "{note}: {}", scene.points.len());
        for index in [1, 9] {
            let [a, b] = straightened(&scene.views[index], &source.views[index]);
            let quality = psnr(&a, &b);
            assert!(a.len() > 50_000 && quality > 31.0, "{note}: {quality} dB");
        }
    }
}

#[test]
fn held_out_photos_stay_clean_and_others_do_not() {
    let source = read();
    type Spoil = fn(&mut Scene, u64) -> String;
    let spoils: [(Spoil, _); 4] = [
        (|scene, seed| exposure::vary(scene, 1.0, seed), 0.8..=1.0),
        (
            |scene, seed| defects::dust(scene, defects::DUST_AREA, seed),
            0.01..=0.3,
        ),
        (
            |scene, seed| defects::dust(scene, defects::HEAVY_DUST_AREA, seed),
            0.04..=0.4,
        ),
        (defects::masked, 0.03..=0.3),
    ];
    for (spoil, share) in spoils {
        let mut scene = read();
        let note = spoil(&mut scene, 7);
        for (view, source) in scene.views.iter().zip(&source.views) {
            let changed = changed(&view.picture, &source.picture);
            match view.held_out {
                true => assert!(changed == 0.0 && view.mask.is_none(), "{note}"),
                false => assert!(share.contains(&changed), "{note}: {changed}"),
            }
        }
    }
}

#[test]
fn masks_hide_all_that_was_painted() {
    let (source, mut scene) = (read(), read());
    defects::masked(&mut scene, 3);
    for (view, source) in scene.views.iter().zip(&source.views) {
        let Some(mask) = &view.mask else {
            assert!(view.held_out);
            continue;
        };
        for (x, y, pixel) in mask.enumerate_pixels() {
            if pixel.0 == [255] {
                let [now, before] = [&view.picture, &source.picture].map(|p| p.get_pixel(x, y));
                assert_eq!(now, before, "{} {x} {y}", view.stem);
            }
        }
    }
}

#[test]
fn distances_spread_fourfold_and_observations_follow() {
    let before = reprojection_error(&read());
    let mut scene = read();
    distances::quarter(&mut scene);
    let focal: Vec<f64> = scene.views.iter().map(|v| v.camera.focal[0]).collect();
    let [low, high] = [f64::min, f64::max].map(|f| focal.iter().copied().reduce(f));
    assert_eq!(high, low.map(|low| 4.0 * low));
    let quarters = |held_out| {
        let views = scene.views.iter().filter(|v| v.held_out == held_out);
        views.filter(|v| Some(v.camera.focal[0]) == low).count()
    };
    assert_eq!([quarters(false), quarters(true)], [6, 1]);
    assert!(reprojection_error(&scene) < before);
}

#[test]
fn the_narrow_range_holds_the_same_grays() {
    let [mut narrow, mut plain] = [read(), read()];
    depth::sixteen(&mut narrow);
    depth::eight(&mut plain);
    for (narrow, plain) in narrow.views.iter().zip(&plain.views) {
        let (Some(Developed::Gray16(narrow)), Some(Developed::Gray(plain))) =
            (&narrow.developed, &plain.developed)
        else {
            panic!("other formats");
        };
        for (narrow, plain) in narrow.pixels().zip(plain.pixels()) {
            let part = (f64::from(narrow.0[0]) / 65535.0 - 0.2) / 0.15;
            assert_eq!((255.0 * part).round() as u8, plain.0[0]);
        }
    }
}

#[test]
fn gloss_is_of_the_scene_and_not_of_the_photo() {
    let (source, mut scene) = (read(), read());
    gloss::polish(&mut scene, 0);
    // Within one photo some patches brighten and others darken.
    let both = scene.views.iter().zip(&source.views).any(|(view, source)| {
        let pairs = view.picture.iter().zip(source.picture.iter());
        let ratios = pairs
            .filter(|(_, b)| **b > 60)
            .map(|(a, b)| f64::from(*a) / f64::from(*b));
        let ratios: Vec<f64> = ratios.collect();
        let share = |part: f64| part / ratios.len() as f64;
        let darker = share(ratios.iter().filter(|r| **r < 0.9).count() as f64);
        let brighter = share(ratios.iter().filter(|r| **r > 1.1).count() as f64);
        darker > 0.1 && brighter > 0.1
    });
    assert!(both);
}

#[test]
fn as_many_points_without_the_far_ones() {
    let [mut far, mut even] = [read(), read()];
    sky::open(&mut far);
    sky::thin(&mut even, 1);
    assert_eq!(far.points.len(), even.points.len());
    let center = far.center();
    let farthest = |scene: &Scene| {
        let distances = scene.points.iter().map(|p| p.position.distance(center));
        distances.fold(0.0, f64::max)
    };
    assert!(farthest(&far) < 0.9 * farthest(&even));
}

#[test]
fn behind_a_backdrop_nothing_is_left() {
    let (source, mut scene) = (read(), read());
    sky::backdrop(&mut scene);
    assert!(scene.points.len() < source.points.len() / 2);
    let is_plain = |view: &View, [x, y]: [f64; 2]| {
        let last = view.camera.size.map(|side| side - 1);
        let pixel = view
            .picture
            .get_pixel(last[0].min(x as u32), last[1].min(y as u32));
        pixel.0 == [200; 3]
    };
    // All photos agree about what is left.
    let plain_share = |points: &[&Point]| {
        let seen: Vec<_> = points.iter().flat_map(|point| &point.track).collect();
        let plain = (seen.iter()).filter(|seen| is_plain(&scene.views[seen.view], seen.pixel));
        plain.count() as f64 / seen.len() as f64
    };
    let is_left = |point: &&Point| {
        let mut left = scene.points.iter();
        left.any(|kept| kept.position == point.position)
    };
    let (left, gone): (Vec<_>, Vec<_>) = source.points.iter().partition(is_left);
    let shares = [plain_share(&left), plain_share(&gone)];
    assert!(shares[0] < 0.1 && shares[1] > 0.9, "{shares:?}");
}

#[test]
fn an_arc_has_eleven_photos_and_what_two_of_them_see() {
    let before = reprojection_error(&read());
    let mut scene = read();
    let note = arc::short(&mut scene);
    assert_eq!(scene.views.len(), 11);
    assert!(scene.points.iter().all(|point| point.track.len() >= 2));
    assert!(scene.points.len() > 4000, "{note}");
    assert!(reprojection_error(&scene) < 1.1 * before, "{note}");
}

#[test]
fn the_same_arguments_give_the_same_files_and_the_program_reads_them() {
    let out = tempfile::tempdir().expect("a folder");
    for variant in [Variant::Dust, Variant::Masked, Variant::SkyControl] {
        let [first, second] = ["a", "b"].map(|name| {
            let folder = out.path().join(format!("{variant:?}-{name}"));
            make(&demo(), variant, &folder, 4).expect("made");
            folder
        });
        for file in [
            "images/garden_03.png",
            "sparse/0/images.txt",
            "sparse/0/points3D.txt",
        ] {
            let [a, b] = [&first, &second].map(|folder| std::fs::read(folder.join(file)));
            assert_eq!(a.expect("a file"), b.expect("a file"), "{variant:?} {file}");
        }
        let (made, source) = (Capture::load(&first), Capture::load(&demo()));
        let (made, source) = (made.expect("a capture"), source.expect("a capture"));
        let pairs = made.views.iter().zip(&source.views);
        for (made, source) in pairs {
            let moved = made.camera.center().distance(source.camera.center());
            assert!(moved < 1e-9, "{moved}");
        }
        assert!(made.points.iter().all(|point| point.track.len() >= 2));
        let again = make(&demo(), variant, &first, 4);
        assert!(
            again
                .expect_err("there already")
                .to_string()
                .contains("exists")
        );
    }
}

#[test]
fn names_of_controls() {
    let name = |v: &Variant| v.to_possible_value().expect("a name").get_name().to_owned();
    let names: Vec<String> = Variant::value_variants().iter().map(name).collect();
    let (paired, alone) = names.split_at(names.len() - 5);
    for pair in paired.chunks_exact(2) {
        assert_eq!(pair[1], format!("{}-control", pair[0]));
    }
    assert_eq!(paired.len() % 2, 0);
    assert_eq!(
        alone,
        ["infrared-tiff", "heavy-dust", "flicker", "arc", "backdrop"]
    );
    assert_eq!(Lens::Pinhole.name(), "PINHOLE");
}
