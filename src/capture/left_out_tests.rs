//! Photos that a capture does without, and cameras that no photo has.

use super::fixtures::{Model, folder, load, load_files, write};
use super::{Capture, Chosen, Dataset, LoadOptions, Rejected};

#[test]
fn cameras_without_photos_do_not_matter() {
    let wide = ("SIMPLE_RADIAL", 2);
    let strange: [(_, u64, &[f64]); 3] = [
        (("SIMPLE_PINHOLE", 0), 8, &[0.0, 4.5, 3.5]),
        (("SIMPLE_PINHOLE", 0), u64::MAX, &[12.0, 4.5, 3.5]),
        (wide, 8, &[1.5, 4.0, 3.0, -8.1]),
    ];
    for (kind, width, parameters) in strange {
        let sound = load(&Model::of_one_camera()).unwrap();
        let mut unused = Model::of_one_camera();
        unused.cameras[1].model = kind;
        unused.cameras[1].width = width;
        unused.cameras[1].parameters = parameters.into();
        let mut used = unused.clone();
        used.images[1].camera = 3;
        for extension in ["bin", "txt"] {
            let load = |model: &Model| match extension {
                "bin" => load(model),
                _ => load_files(model, model.text(), extension),
            };
            let capture = load(&unused).unwrap();
            assert_eq!(capture.views.len(), sound.views.len());
            assert_eq!((capture.rejected.len(), capture.distortion), (0, 0.0));
            // Its photo goes, with a reason, and the others stay.
            let capture = load(&used).unwrap();
            assert_eq!((capture.views.len(), capture.distortion), (2, 0.0));
            let [photo] = &capture.rejected[..] else {
                panic!("{:?}", capture.rejected)
            };
            assert_eq!(photo.name, "left/a c.png");
            let named = ["its camera cannot be", "cameras", "camera"];
            assert!(
                named.iter().all(|word| photo.reason.contains(word)),
                "{photo:?}"
            );
        }
    }
    // Text files have a line for each, whatever it says.
    let mut unused = Model::of_one_camera();
    unused.cameras[1].model = ("WARP", 99);
    let capture = load_files(&unused, unused.text(), "txt").unwrap();
    assert_eq!(capture.views.len(), 3);
}

#[test]
fn photos_that_are_not_wanted_are_left_out() {
    let model = Model::example();
    let dir = folder(&model);
    write(dir.path(), "sparse/0", model.binary(), "bin");
    let unwanted = Rejected {
        name: "b.png".into(),
        reason: "turned".into(),
    };
    let options = LoadOptions {
        left_out: vec![unwanted.clone()],
        ..LoadOptions::default()
    };
    let capture = Capture::load_with(dir.path(), &options).unwrap();
    assert_eq!(capture.rejected, [unwanted]);
    let names: Vec<&str> = capture.views.iter().map(|v| v.name.as_str()).collect();
    assert_eq!(names, ["a.png", "left/a c.png"]);
    // Tracks know the views that are left.
    assert_eq!(capture.points[0].track.len(), 1);
    assert_eq!(capture.points[0].track[0].view, 0);
    assert!(capture.points[1].track.is_empty());
}

#[test]
fn of_a_part_only_its_photos_and_what_they_show_are_read() {
    let model = Model::example();
    let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect();
    let options = |train: &[&str], test: &[&str]| LoadOptions {
        chosen: Some(Chosen {
            train: names(train),
            test: names(test),
        }),
        ..LoadOptions::default()
    };
    for (files, extension) in [(model.binary(), "bin"), (model.text(), "txt")] {
        let dir = folder(&model);
        write(dir.path(), "sparse/0", files, extension);
        let load = |options: &LoadOptions| Capture::load_with(dir.path(), options);
        let part = options(&["left/a c.png", "gone.png"], &["a.png"]);
        let capture = load(&part).unwrap();
        let views: Vec<&str> = capture.views.iter().map(|view| &*view.name).collect();
        assert_eq!(views, ["a.png", "left/a c.png"]);
        // The second point is shown by another photo alone.
        assert_eq!(capture.points.len(), 1);
        assert_eq!(capture.points[0].track.len(), 1);
        let [missing] = &capture.rejected[..] else {
            panic!("{:?}", capture.rejected)
        };
        assert!(missing.name == "gone.png" && missing.reason.contains("does not place"));
        let dataset = Dataset::open(dir.path(), &part, &mut |_| {}).unwrap();
        assert_eq!(
            (dataset.split.train, dataset.split.test),
            (vec![1], vec![0])
        );
        assert!(load(&options(&["gone.png"], &[])).is_err());
    }
}

#[test]
fn without_tracks_a_part_has_all_points() {
    let mut model = Model::example();
    model
        .points
        .iter_mut()
        .for_each(|(_, _, track)| track.clear());
    let dir = folder(&model);
    write(dir.path(), "sparse/0", model.binary(), "bin");
    let chosen = Chosen {
        train: ["a.png".to_owned()].into(),
        ..Chosen::default()
    };
    let options = LoadOptions {
        chosen: Some(chosen),
        ..LoadOptions::default()
    };
    let capture = Capture::load_with(dir.path(), &options).unwrap();
    assert_eq!((capture.views.len(), capture.points.len()), (1, 2));
}
