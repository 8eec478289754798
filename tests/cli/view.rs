//! `render`.

use super::program::Place;
use super::scene;
use super::shared::{QUICK_FIT, place_with_run, place_with_scene};

/// Returns true if all pixels of a picture are gray.
fn is_gray(place: &Place, name: &str) -> bool {
    let image = image::open(place.path(name))
        .expect("a picture")
        .into_rgb8();
    image.pixels().all(|pixel| pixel.0 == [pixel.0[0]; 3])
}

#[test]
fn one_picture_a_view_in_the_photos_folders() {
    let place = place_with_run();
    let all: Vec<String> = (0..scene::VIEWS).map(scene::name).collect();
    let (test, train): (Vec<_>, Vec<_>) = (0..scene::VIEWS).partition(|index| index % 8 == 0);
    let names = |views: Vec<usize>| views.into_iter().map(scene::name).collect::<Vec<_>>();
    for (views, wanted) in [("train", names(train)), ("test", names(test)), ("all", all)] {
        let printed = place.succeed(&["render", "--views", views, "-o", views]);
        assert_eq!(place.files(views), wanted);
        assert!(
            printed.contains(&format!("wrote {} pictures", wanted.len())),
            "{printed}"
        );
    }
    place.succeed(&["render", "runs/scene", "-o", "new/folder"]);
    assert_eq!(place.files("new/folder"), place.files("test"));
    for name in place.files("all") {
        let path = format!("all/{name}");
        let image = image::open(place.path(&path)).expect("a picture");
        assert_eq!([image.width(), image.height()], scene::SIZE);
        assert!(!is_gray(&place, &path), "{name}");
    }
}

#[test]
fn luma_is_gray() {
    let place = place_with_run();
    place.succeed(&["render", "--luma", "-o", "luma"]);
    assert!(
        place
            .files("luma")
            .iter()
            .all(|name| is_gray(&place, &format!("luma/{name}")))
    );
    // The same without a color to leave away.
    std::fs::remove_file(place.path("runs/scene/color.ply")).expect("a file");
    place.succeed(&["render", "-o", "gray"]);
    for name in place.files("luma") {
        let [a, b] = ["luma", "gray"].map(|folder| place.read(&format!("{folder}/{name}")));
        assert!(a == b, "{name}");
    }
}

#[test]
fn a_splat_file_is_drawn_with_colmaps_cameras() {
    let place = place_with_run();
    let colmap = ["--colmap", "scene", "--views", "all"];
    let file = ["render", "runs/scene/color.ply", "-o", "file"];
    place.succeed(&[&file[..], &colmap].concat());
    place.succeed(&["render", "--views", "all", "-o", "run"]);
    for name in place.files("run") {
        let [a, b] = ["run", "file"].map(|folder| place.read(&format!("{folder}/{name}")));
        assert!(a == b, "{name}");
    }
    let luma = ["render", "runs/scene/color.ply", "-o", "luma", "--luma"];
    place.succeed(&[&luma[..], &colmap].concat());
    assert!(is_gray(&place, "luma/00.png"));
}

#[test]
fn pictures_have_the_size_that_was_trained_on() {
    let place = place_with_scene();
    place.succeed(&[&QUICK_FIT[..], &["--max-side", "32"]].concat());
    place.succeed(&["render", "-o", "small"]);
    let image = image::open(place.path("small/00.png")).expect("a picture");
    assert_eq!(
        [image.width(), image.height()],
        scene::SIZE.map(|side| side / 2)
    );
}

#[test]
fn all_views_where_none_is_held_out() {
    let place = place_with_scene();
    place.succeed(&[&QUICK_FIT[..], &["--no-holdout"]].concat());
    place.succeed(&["render", "-o", "pictures"]);
    assert_eq!(place.files("pictures").len(), scene::VIEWS);
}
