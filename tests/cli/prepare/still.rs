//! Cameras that turn about one place or stand, by matches that a fake COLMAP has found.

use std::f64::consts::PI;

use super::fakes::{all_views, commands, place_with, refused, succeed};
use super::{PHOTOS, json, with};
use crate::program::Place;
use crate::scene::SIZE;

/// Focal length in pixels.
const FOCAL: f64 = 70.0;

/// COLMAP's number of a pair is the first image's by this, and the second's more.
const PAIR: i64 = 2_147_483_647;

/// Matches of photos that are turned by so many degrees from one to the next, and that are as
/// far from each other as `moves`, of places at distances 1 to 2.
fn matched(place: &Place, degrees: f64, moves: f64) {
    let database = rusqlite::Connection::open(place.path("fake/database")).expect("a database");
    let [width, height] = SIZE;
    let run = |statement: &str, values: &[&dyn rusqlite::ToSql]| {
        database.execute(statement, values).expect("a row");
    };
    run("INSERT INTO cameras VALUES (1, ?, ?)", &[&width, &height]);
    let places: Vec<[f64; 3]> = (0..900)
        .map(|k| {
            let angle = PI / 2.0 + f64::from(k) * 0.618 * PI;
            let height = f64::from(k % 30) / 30.0 - 0.5;
            let far = 1.0 + f64::from(k % 7) / 7.0;
            [far * angle.cos(), far * height, far * angle.sin()]
        })
        .collect();
    let pixels = |view: usize| {
        let (sine, cosine) = (degrees * view as f64).to_radians().sin_cos();
        places.iter().map(move |[x, y, z]| {
            let x = x - moves * view as f64;
            let [x, z] = [cosine * x - sine * z, sine * x + cosine * z];
            let pixel = [
                FOCAL * x / z + f64::from(width) / 2.0,
                FOCAL * y / z + f64::from(height) / 2.0,
            ];
            let inside =
                (pixel.iter().zip(SIZE)).all(|(at, side)| (0.0..f64::from(side)).contains(at));
            (z > 0.0 && inside).then_some(pixel)
        })
    };
    let views = all_views();
    for (view, name) in views.iter().enumerate() {
        let seen = pixels(view).flatten().flatten();
        let data: Vec<u8> = seen
            .flat_map(|value| (value as f32).to_le_bytes())
            .collect();
        run(
            "INSERT INTO images VALUES (?, ?, 1)",
            &[&(view as i64 + 1), name],
        );
        run(
            "INSERT INTO keypoints VALUES (?, 2, ?)",
            &[&(view as i64 + 1), &data],
        );
    }
    let index = |view: usize| {
        let mut count = 0_u32;
        let numbered = pixels(view).map(|pixel| {
            pixel.map(|_| {
                count += 1;
                count - 1
            })
        });
        numbered.collect::<Vec<_>>()
    };
    for first in 0..views.len() {
        for second in first + 1..views.len().min(first + 4) {
            let both = index(first).into_iter().zip(index(second));
            let both = both.filter_map(|(a, b)| Some([a?, b?])).flatten();
            let data: Vec<u8> = both.flat_map(u32::to_le_bytes).collect();
            let id = PAIR * (first as i64 + 1) + second as i64 + 1;
            let rows = data.len() as i64 / 8;
            run(
                "INSERT INTO two_view_geometries VALUES (?, ?, ?)",
                &[&id, &rows, &data],
            );
        }
    }
}

#[test]
fn a_camera_that_turns_has_poses_without_depth() {
    let place = place_with(&["colmap"]);
    matched(&place, 2.0, 0.0);
    let told = json(&place, &[]);
    assert_eq!(told["motion"]["camera"], "turns", "{told}");
    assert_eq!(told["poses"]["placed"], 10, "{told}");
    let turned = told["motion"]["turned"].as_f64().expect("degrees");
    assert!((turned - 18.0).abs() < 0.5, "{turned}");
    // Nothing is left beside the database.
    assert!(
        !place
            .files("house")
            .iter()
            .any(|file| file.ends_with("-wal"))
    );
    // No depth is looked for.
    assert_eq!(
        commands(&place),
        ["feature_extractor", "exhaustive_matcher"]
    );
    let info = place.json(&["info", "house", "--json"]);
    assert_eq!(info["views"], 10);
    assert!(info["points"].as_u64() > Some(100), "{info}");
    let camera = String::from_utf8(place.read("house/sparse/0/cameras.txt")).expect("text");
    let focal: f64 = camera
        .split_whitespace()
        .nth(4)
        .expect("a focal length")
        .parse()
        .expect("a number");
    assert!((focal / FOCAL - 1.0).abs() < 0.02, "{camera}");
    let done = place.run(&[
        "fit",
        "house",
        "-o",
        "run",
        "--preset",
        "draft",
        "--iterations",
        "3",
    ]);
    assert!(done.stderr.contains("a panorama without depth"), "{done:?}");
    let done = place.run(&["export", "run", "-o", "run.ply"]);
    assert!(done.stderr.contains("a panorama without depth"), "{done:?}");
}

#[test]
fn a_camera_that_stands_and_one_that_moves_are_told_apart() {
    for (moves, camera, ran) in [(0.0, "stands", 2), (0.02, "moves", 3)] {
        let place = place_with(&["colmap"]);
        matched(&place, 0.0, moves);
        let told = json(&place, &[]);
        assert_eq!(told["motion"]["camera"], camera, "{told}");
        assert_eq!(commands(&place).len(), ran, "{camera}");
    }
}

#[test]
fn users_know_better() {
    let place = place_with(&["colmap"]);
    matched(&place, 2.0, 0.0);
    let told = json(&place, &["--camera", "moves"]);
    assert_eq!(told["motion"]["camera"], "moves", "{told}");
    assert!(commands(&place).contains(&"mapper".to_owned()));
    let told = json(&place, &["--camera", "turns"]);
    assert_eq!(told["motion"]["camera"], "turns", "{told}");
    // Poses alone are made anew.
    assert_eq!(commands(&place), [""; 0]);
}

#[test]
fn a_database_that_nobody_knows_is_no_end() {
    let place = place_with(&["colmap"]);
    place.write("fake/database", "not of SQLite");
    let done = succeed(&place, &PHOTOS);
    assert!(
        done.stderr.contains("warning: ") && done.stderr.contains("no database of COLMAP's"),
        "{done:?}"
    );
    refused(
        &place,
        &with(&["--camera", "stands"]),
        &["database.db", "no database of COLMAP's"],
    );
}
