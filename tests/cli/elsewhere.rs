//! Input from elsewhere: splats that another program trained, and photos that are in color or were
//! taken in another light.

use std::fs;

use gs_chroma::splats::{read_ply, write_ply};
use image::RgbImage;
use serde_json::Value;

use super::program::{Done, Place, files_below};
use super::scene;
use super::shared::{QUICK_FIT, onnx, place_with_run};
use super::splat_file::SplatFile;

fn write(place: &Place, file: &SplatFile) {
    let mut bytes = (file.header.join("\n") + "\n").into_bytes();
    let values = file.rows.iter().flatten();
    bytes.extend(values.flat_map(|value| value.to_le_bytes()));
    place.write("gray.ply", bytes);
}

/// The place with a run, and its luma as a file of its own, changed by `change`.
fn place_with_splats(change: impl Fn(&mut SplatFile)) -> Place {
    let place = place_with_run();
    let mut file = SplatFile::read(&place, "runs/scene/luma.ply");
    change(&mut file);
    write(&place, &file);
    place
}

fn colorized(place: &Place, more: &[&str]) -> Done {
    let teacher = onnx("ddcolor_tiny.onnx");
    let colorize = ["colorize", "gray.ply", "--colmap", "scene", "--rounds", "1"];
    let done = place.run(&[&colorize[..], &["--teacher", &teacher], more].concat());
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    done
}

#[test]
fn splats_that_show_something_else_are_told() {
    let sound = colorized(&place_with_splats(|_| ()), &[]);
    assert!(!sound.stderr.contains("warning"), "{}", sound.stderr);
    // To the side of every camera; upside down and backwards, as OpenGL has it.
    let aside = |file: &mut SplatFile| file.rows.iter_mut().for_each(|row| row[0] += 50.0);
    let turned = |file: &mut SplatFile| {
        for row in &mut file.rows {
            (row[1], row[2]) = (-row[1], 3.0 - row[2]);
        }
    };
    let frame = |told: &str| {
        let mut lines = told.lines();
        lines.any(|line| line.starts_with("warning: gray.ply") && line.contains("COLMAP's frame"))
    };
    for place in [place_with_splats(aside), place_with_splats(turned)] {
        let told = colorized(&place, &[]).stderr;
        assert!(frame(&told), "{told}");
    }
    // Whoever takes such a file is told.
    let init = [&QUICK_FIT[..], &["-o", "init", "--init", "gray.ply"]].concat();
    let render = ["render", "gray.ply", "--colmap", "scene", "-o", "pictures"];
    for arguments in [&render[..], &init] {
        for (place, wrong) in [(place_with_splats(aside), true), (place_with_run(), false)] {
            if !wrong {
                place.write("gray.ply", place.read("runs/scene/luma.ply"));
            }
            let done = place.run(arguments);
            assert_eq!(done.code, Some(0), "{}", done.stderr);
            assert_eq!(frame(&done.stderr), wrong, "{}", done.stderr);
        }
    }
}

#[test]
fn what_is_wholly_opaque_is_drawn() {
    let opaque = |logit: f32| {
        let place = place_with_splats(|file| {
            let opacity = file.place("opacity");
            file.rows
                .iter_mut()
                .step_by(3)
                .for_each(|row| row[opacity] = logit);
        });
        let render = ["render", "gray.ply", "--colmap", "scene", "-o", "pictures"];
        let done = place.run(&render);
        assert_eq!(done.code, Some(0), "{}", done.stderr);
        assert!(!done.stderr.contains("skipped"), "{}", done.stderr);
        super::picture::png(&place, "pictures/00.png")
    };
    let [infinite, large] = [f32::INFINITY, 20.0].map(opaque);
    assert!(super::picture::psnr(&infinite, &large) > 50.0);
}

#[test]
fn other_formats_are_named_with_the_remedy() {
    let place = place_with_run();
    place.write("scene.ksplat", [0; 64]);
    for arguments in [
        &["info", "scene.ksplat"][..],
        &["render", "scene.ksplat", "--colmap", "scene", "-o", "out"],
        &[
            "colorize",
            "scene.ksplat",
            "--colmap",
            "scene",
            "--teacher",
            "photos",
        ],
        &["export", "scene.ksplat", "-o", "out.ply"],
        &[&QUICK_FIT[..], &["--init", "scene.ksplat"]].concat(),
    ] {
        let done = place.run(arguments);
        assert_eq!(done.code, Some(1), "{arguments:?}: {}", done.stderr);
        let line = done.stderr.lines().last().unwrap_or_default();
        let words = ["error: scene.ksplat", "convert it to .ply"];
        assert!(words.iter().all(|word| line.contains(word)), "{line}");
    }
}

/// Photos of Gaussians smaller than a pixel, as an antialiased scene shows them; the file does
/// not say that it is one.
#[test]
fn splats_that_were_trained_antialiased_are_drawn_so() {
    let place = place_with_splats(|file| {
        let scales = file.place("scale_0");
        for row in &mut file.rows {
            row[scales..scales + 3].iter_mut().for_each(|s| *s -= 1.5);
        }
        file.header
            .insert(2, "comment SplatRenderMode: mip".to_owned());
    });
    let render = ["render", "gray.ply", "--colmap", "scene", "--views", "all"];
    place.succeed(&[&render[..], &["-o", "drawn"]].concat());
    fs::remove_dir_all(place.path("scene/images")).expect("photos");
    fs::rename(place.path("drawn"), place.path("scene/images")).expect("pictures");
    let told = colorized(&place, &[]).stderr;
    assert!(!told.contains("drawing gray.ply"), "{told}");
    let mut file = SplatFile::read(&place, "gray.ply");
    file.header.retain(|line| !line.contains("SplatRenderMode"));
    write(&place, &file);
    let told = colorized(&place, &[]).stderr;
    assert!(told.contains("drawing gray.ply antialiased"), "{told}");
    let colored = String::from_utf8_lossy(&place.read("gray-color.ply")).into_owned();
    assert!(colored.contains("SplatRenderMode: mip"));
}

/// Colors that splats come with are no start: noise and a wrong color end where gray does.
#[test]
fn the_colors_that_splats_come_with_do_not_count() {
    let channels = ["f_dc_0", "f_dc_1", "f_dc_2"];
    // The three sum to zero, so that the luma stays; in units of the coefficients.
    let tinted = |tint: &dyn Fn(usize) -> [f32; 3]| {
        let place = place_with_splats(|file| {
            let places = channels.map(|channel| file.place(channel));
            for (i, row) in file.rows.iter_mut().enumerate() {
                let tint = tint(i);
                (places.iter().zip(tint)).for_each(|(&place, tint)| row[place] += tint);
            }
        });
        colorized(&place, &[]);
        let file = SplatFile::read(&place, "gray-color.ply");
        channels.map(|channel| file.column(channel))
    };
    let gray = tinted(&|_| [0.0; 3]);
    let noise = |i: usize| (i * 37 % 101) as f32 / 50.0 - 1.0;
    let of_noise = |i: usize| [noise(i), -0.5 * noise(i), -0.5 * noise(i)];
    let wrong = |_: usize| [1.0, 0.5, -1.5];
    for start in [&of_noise as &dyn Fn(usize) -> [f32; 3], &wrong] {
        let channels = tinted(start).into_iter().zip(&gray);
        for (value, gray) in channels.flat_map(|(values, gray)| values.into_iter().zip(gray)) {
            // A few roundings of the luma.
            assert!((value - gray).abs() < 1e-3, "{value} and {gray}");
        }
    }
}

#[test]
fn photos_in_color_are_a_teacher() {
    let place = place_with_run();
    let colorize = ["colorize", "runs/scene", "--json", "--teacher"];
    let of = |teacher: &str| -> Value {
        place.json(&[&colorize[..], &[teacher]].concat())["chroma"].clone()
    };
    let (photos, folder) = (of("photos"), of("scene/images"));
    assert_eq!(photos["pictures"], folder["pictures"]);
    assert_eq!(photos["teachers"][0]["name"], "images");
    let error = photos["pictures"]["ab_error"].as_f64();
    assert!(error.is_none_or(|error| error < 12.0), "{photos}");
    // A folder of that name is meant by a slash.
    place.write("photos/00.txt", "no image");
    assert_eq!(of("photos")["pictures"], folder["pictures"]);
    let done = place.run(&[&colorize[..], &["photos/"]].concat());
    assert!(
        done.code == Some(1) && done.stderr.contains("photos/: holds no"),
        "{}",
        done.stderr
    );
}

#[test]
fn gray_photos_and_gray_images_color_nothing() {
    let place = place_with_run();
    for index in 0..scene::VIEWS {
        let gray = image::DynamicImage::from(scene::photo(index)).to_luma8();
        for folder in ["scene/images", "some"] {
            let path = place.path(folder).join(scene::name(index));
            fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            match (folder, index) {
                ("some", 1) => scene::photo(index).save(&path),
                _ => gray.save(&path),
            }
            .expect("an image");
        }
    }
    // A folder of that name here is another's.
    fs::create_dir_all(place.path("photos")).expect("a folder");
    let colored = scene::photo(1).save(place.path("photos").join(scene::name(1)));
    colored.expect("an image");
    let done = place.run(&["colorize", "runs/scene", "--teacher", "photos"]);
    assert!(
        // That the photos are others is said before.
        done.code == Some(1) && done.stderr.lines().count() == 2,
        "{}",
        done.stderr
    );
    assert!(
        done.stderr.contains("scene/images: these photos are gray"),
        "{}",
        done.stderr
    );
    let done = place.run(&["colorize", "runs/scene", "--teacher", "photos/"]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let done = place.run(&["colorize", "runs/scene", "--teacher", "some"]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let told = done
        .stderr
        .lines()
        .find(|line| line.starts_with("warning: 7 of 8"));
    assert!(
        told.is_some_and(|line| line.contains("images in some are gray")),
        "{}",
        done.stderr
    );
}

/// The same scene in another light, from the same places: its colors and its lightness are
/// taken, the geometry stays, and the run keeps its own files.
#[test]
fn a_scene_is_lit_anew() {
    let place = place_with_run();
    scene::write(&place.path("evening"));
    for index in 0..scene::VIEWS {
        let mut photo: RgbImage = scene::photo(index);
        for (x, _, pixel) in photo.enumerate_pixels_mut() {
            let left = 1.0 - 0.6 * x as f32 / scene::SIZE[0] as f32;
            let [r, g, b] = pixel.0.map(|value| left * f32::from(value));
            pixel.0 = [r, 0.8 * g, 0.5 * b].map(|value| value as u8);
        }
        let path = place.path("evening/images").join(scene::name(index));
        photo.save(path).expect("a photo");
    }
    let before = files_below(&place.path("runs"));
    let colorize = [
        "colorize",
        "runs/scene",
        "--colmap",
        "evening",
        "--teacher",
        "photos",
        "--rounds",
        "4",
    ];
    let error = |more: &[&str], output: &str| -> f64 {
        let output = ["-o", output, "--json"];
        let report = place.json(&[&colorize[..], &output, more].concat());
        report["chroma"]["pictures"]["delta_e"]["mean"]
            .as_f64()
            .expect("a number")
    };
    let lit = error(&["--relight"], "lit.ply");
    assert_eq!(files_below(&place.path("runs")), before);
    let (luma, found) = (
        SplatFile::read(&place, "runs/scene/luma.ply"),
        SplatFile::read(&place, "lit.ply"),
    );
    for property in ["x", "y", "z", "opacity", "scale_0", "rot_2"] {
        assert_eq!(luma.column(property), found.column(property), "{property}");
    }
    // That the photos are others than those that were trained on is what was asked for. With
    // thousands of Gaussians that no photo shows there is no room for all.
    let path = place.path("runs/scene/luma.ply");
    let mut scene = read_ply(&path).expect("a scene").splats;
    let mut above = scene.chosen(&vec![0; 9000]);
    above.means.fill([0.0, 1000.0, 0.0]);
    scene.append(above);
    write_ply(&path, &scene, glam::DVec3::ZERO, &[]).expect("writable");
    place.forget_files("runs/scene");
    let again = ["--relight", "--memory-limit", "1", "-o", "again.ply"];
    let told = place.run(&[&colorize[..], &again].concat()).stderr;
    assert!(!told.contains("warning"), "{told}");
    assert!(
        told.contains("that a photo may show come at a time"),
        "{told}"
    );
    let again = SplatFile::read(&place, "again.ply");
    let both = (found.column("f_dc_0").into_iter()).zip(again.column("f_dc_0"));
    let apart: Vec<f32> = both
        .map(|(whole, streamed)| (whole - streamed).abs())
        .collect();
    // On average no level of eight bits, of which a constant coefficient is 1 / 0.282.
    let mean = apart.iter().sum::<f32>() / apart.len() as f32;
    assert!(0.282 * mean < 1.0 / 255.0, "{mean}");
    let plain = error(&[], "plain.ply");
    assert!(lit < 0.7 * plain, "{lit} of {plain}");
    let done = place.run(&[&colorize[..], &["--relight"]].concat());
    assert!(
        done.code == Some(2) && done.stderr.contains("--output"),
        "{}",
        done.stderr
    );
}

#[test]
fn what_no_training_view_needs_is_left_out() {
    // One far to the side of every camera, and one that is not opaque enough to be drawn.
    let place = place_with_splats(|file| {
        let opacity = file.place("opacity");
        let [mut aside, mut faint] = [file.rows[0].clone(), file.rows[1].clone()];
        aside[0] += 500.0;
        faint[opacity] = -8.0;
        let before = file.count();
        file.rows.extend([aside, faint]);
        for line in &mut file.header {
            *line = line.replace(
                &format!("vertex {before}"),
                &format!("vertex {}", before + 2),
            );
        }
    });
    let export = ["export", "gray.ply", "-o", "clean.ply", "--clean", "--json"];
    let done = place.run(&[&export[..], &["--colmap", "scene"]].concat());
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let told: Value = serde_json::from_str(&done.stdout).expect("JSON");
    let dropped = told["cleaned"]["dropped"].as_u64().expect("a number");
    assert!(dropped >= 2, "{told}");
    assert!(
        told["cleaned"]["psnr"].as_f64().expect("a number") > 60.0,
        "{told}"
    );
    let [before, after] = ["gray.ply", "clean.ply"].map(|name| SplatFile::read(&place, name));
    assert_eq!(after.count() as u64, before.count() as u64 - dropped);
    assert!(after.rows.iter().all(|row| row[0] < 250.0));
    // Nobody knows where a file's cameras are.
    let done = place.run(&export);
    assert_eq!(done.code, Some(1), "{}", done.stderr);
    assert!(done.stderr.contains("--colmap"), "{}", done.stderr);
    // A run knows them; its surroundings stay.
    let done = place.run(&["export", "runs/scene", "--luma", "-o", "run.ply", "--clean"]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(
        done.stdout.contains("no training view needs"),
        "{}",
        done.stdout
    );
    let around = place.report("runs/scene")["luma"]["surroundings"].as_u64();
    let around = around.expect("a number") as usize;
    let [before, after] = ["runs/scene/luma.ply", "run.ply"].map(|name| {
        let rows = SplatFile::read(&place, name).rows;
        rows[rows.len() - around..].to_vec()
    });
    assert!(around > 0 && before == after);
}
