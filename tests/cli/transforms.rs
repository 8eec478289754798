//! `transforms.json` in the place of a COLMAP model.

use std::fs;

use gs_chroma::capture::{Camera, Capture, CaptureError, Dataset, LoadOptions};
use serde_json::{Value, json};

use crate::{
    program::Place,
    scene::{self, SIZE, VIEWS},
};

/// nerfstudio's turn of COLMAP's world.
const APPLIED: [[f64; 4]; 3] = [
    [1.0, 0.0, 0.0, 0.5],
    [0.0, 0.0, 1.0, 0.0],
    [0.0, -1.0, 0.0, 0.0],
];

/// Camera-to-world of a view with OpenGL's axes, its world turned by [`APPLIED`] if that is wanted.
fn pose(index: usize, applied: bool) -> Value {
    let view = scene::view(index, [0.0; 3]);
    let (r, t) = (view.rotation, view.translation);
    let sign = [1.0, -1.0, -1.0];
    let to_world: [[f64; 4]; 3] = std::array::from_fn(|row| {
        let center = -(0..3).map(|k| r[k][row] * t[k]).sum::<f64>();
        std::array::from_fn(|c| if c < 3 { sign[c] * r[c][row] } else { center })
    });
    let turned: [[f64; 4]; 3] = std::array::from_fn(|row| {
        std::array::from_fn(|c| {
            let sum: f64 = (0..3).map(|k| APPLIED[row][k] * to_world[k][c]).sum();
            sum + if c == 3 { APPLIED[row][3] } else { 0.0 }
        })
    });
    let rows = if applied { turned } else { to_world };
    json!([rows[0], rows[1], rows[2], [0, 0, 0, 1]])
}

/// The scene of [`scene::write`] as nerfstudio has it, lens and size for all.
fn transforms(applied: bool) -> Value {
    let frames: Vec<Value> = (0..VIEWS)
        .map(|view| {
            let path = format!("./images/{}", scene::name(view));
            json!({"file_path": path, "transform_matrix": pose(view, applied)})
        })
        .collect();
    let mut file = json!({
        "camera_model": "OPENCV", "w": SIZE[0], "h": SIZE[1], "fl_x": 60.0, "fl_y": 60.0,
        "cx": 32.0, "cy": 24.0, "k1": 0.0, "aabb_scale": 16, "frames": frames,
    });
    if applied {
        file["applied_transform"] = json!(APPLIED);
        file["ply_file_path"] = json!("points.ply");
    }
    file
}

/// Two points of the scene's world, turned by [`APPLIED`].
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n\
    property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n\
    0.5 0 0 1 2 3\n1.5 0 -0.25 4 5 6\n";

/// The folders of photos with COLMAP's model, and with `file`.
fn scenes(file: &Value) -> Place {
    let place = Place::new();
    scene::write(&place.path("colmap"));
    scene::write(&place.path("scene"));
    fs::remove_dir_all(place.path("scene/sparse")).expect("a model");
    place.write("scene/points.ply", PLY);
    place.write("scene/transforms.json", file.to_string());
    place
}

fn load(place: &Place, folder: &str) -> Result<Capture, CaptureError> {
    Capture::load(&place.path(folder))
}

fn assert_same_cameras(found: &Capture, wanted: &Capture) {
    assert_eq!(found.views.len(), wanted.views.len());
    for (found, wanted) in found.views.iter().zip(&wanted.views) {
        assert_eq!(found.name, wanted.name);
        let values = |camera: &Camera| {
            let lens = [camera.fx, camera.fy, camera.cx, camera.cy];
            let pose = camera.rotation.to_cols_array();
            [&lens[..], &pose, &camera.translation.to_array()].concat()
        };
        for (a, b) in values(&found.camera)
            .into_iter()
            .zip(values(&wanted.camera))
        {
            assert!((a - b).abs() < 1e-9, "{found:?} {wanted:?}");
        }
    }
}

#[test]
fn cameras_are_those_of_the_colmap_model() {
    for applied in [false, true] {
        let place = scenes(&transforms(applied));
        let wanted = load(&place, "colmap").expect("COLMAP's");
        let found = load(&place, "scene").expect("transforms.json");
        assert_same_cameras(&found, &wanted);
        assert_eq!(found.photos, place.path("scene/images"));
        if applied {
            let points: Vec<_> = found
                .points
                .iter()
                .map(|p| (p.position.to_array(), p.color))
                .collect();
            assert_eq!(
                points,
                [([0.0; 3], [1, 2, 3]), ([1.0, 0.25, 0.0], [4, 5, 6])]
            );
            assert_eq!(found.doubts, [""; 0]);
        } else {
            assert!(found.doubts[0].contains("random"), "{:?}", found.doubts);
            let seen = |view: &gs_chroma::capture::View| {
                found
                    .points
                    .iter()
                    .filter(|p| view.camera.pixel_of(p.position).is_some())
                    .count()
            };
            assert!(found.views.iter().map(seen).min() > Some(500));
            // The same each time.
            assert_eq!(load(&place, "scene").expect("again").points, found.points);
        }
    }
}

#[test]
fn lenses_are_of_each_frame_or_of_all() {
    let mut file = transforms(false);
    let fields = file.as_object_mut().expect("an object");
    for name in ["w", "h", "fl_x", "fl_y", "cx", "cy", "camera_model"] {
        fields.remove(name);
    }
    let angle = 2.0 * (32.0_f64 / 60.0).atan();
    fields.insert("camera_angle_x".into(), angle.into());
    let place = scenes(&file);
    assert_same_cameras(
        &load(&place, "scene").expect("by its angle"),
        &load(&place, "colmap").expect("COLMAP's"),
    );

    file["frames"][3]["fl_x"] = json!(70.0);
    file["frames"][4]["k1"] = json!(-0.1);
    file["frames"][5]["camera_model"] = json!("OPENCV_FISHEYE");
    file["frames"][6]["k3"] = json!(0.01);
    let place = scenes(&file);
    let capture = load(&place, "scene").expect("lenses");
    assert_eq!(capture.views[3].camera.fx, 70.0);
    let models = capture.views[4..7]
        .iter()
        .map(|view| view.undistortion.as_ref().map(|u| u.lens.model));
    assert_eq!(
        Vec::from_iter(models),
        [Some("OPENCV"), Some("OPENCV_FISHEYE"), None]
    );
    assert!(capture.distortion > 0.0);
}

#[test]
fn blender_s_files_say_what_is_held_out() {
    let place = scenes(&transforms(false));
    fs::remove_file(place.path("scene/transforms.json")).expect("a file");
    for (group, views) in [("train", 0..7), ("test", 7..10), ("val", 0..1)] {
        let frames: Vec<Value> = views
            .map(|view| {
                let name = format!("{group}/r_{view}");
                place.write(&format!("scene/{name}.png"), place.read(&format!("colmap/images/{}", scene::name(view))));
                json!({"file_path": format!("./{name}"), "rotation": 0.1, "transform_matrix": pose(view, false)})
            })
            .collect();
        let file = json!({"camera_angle_x": 0.9, "frames": frames});
        place.write(&format!("scene/transforms_{group}.json"), file.to_string());
    }
    let capture = load(&place, "scene").expect("a scene");
    let names: Vec<&str> = capture.views.iter().map(|view| &*view.name).collect();
    assert_eq!(
        names[..4],
        [
            "test/r_7.png",
            "test/r_8.png",
            "test/r_9.png",
            "train/r_0.png"
        ]
    );
    let plan = place.succeed(&["plan", "scene"]);
    assert!(plan.contains("exposure"), "{plan}");
    let options = LoadOptions::default();
    let dataset = Dataset::open(&place.path("scene"), &options, &mut |_| {}).expect("photos");
    assert_eq!(
        (dataset.split.train.len(), dataset.split.test),
        (7, vec![0, 1, 2])
    );
}

#[test]
fn nerfstudio_s_folder_with_its_own_colmap_model() {
    let place = scenes(&transforms(false));
    fs::create_dir_all(place.path("scene/colmap")).expect("writable");
    fs::rename(
        place.path("colmap/sparse"),
        place.path("scene/colmap/sparse"),
    )
    .expect("a model");
    fs::rename(place.path("scene/images"), place.path("scene/images_2")).expect("photos");
    let capture = load(&place, "scene").expect("COLMAP's");
    assert_eq!(capture.points.len(), scene::POINTS);
    assert_eq!(capture.photos, place.path("scene/images_2"));
}

#[test]
fn photos_that_are_not_there_are_left_out() {
    let place = scenes(&transforms(true));
    fs::remove_file(place.path("scene/images/03.png")).expect("a photo");
    let capture = load(&place, "scene").expect("others");
    assert_eq!(capture.views.len(), VIEWS - 1);
    assert_eq!(capture.rejected[0].name, "03.png");
    fs::remove_dir_all(place.path("scene/images")).expect("photos");
    let error = load(&place, "scene").expect_err("none").to_string();
    assert!(error.contains("10 of 10 are missing"), "{error}");
}

/// Changes the file and gives the error, which is one line and begins with the file's path.
fn error_of(change: impl Fn(&mut Value)) -> String {
    let mut file = transforms(true);
    change(&mut file);
    let place = scenes(&file);
    let done = place.run(&["plan", "scene"]);
    assert_eq!(
        (done.code, done.stderr.lines().count()),
        (Some(1), 1),
        "{}",
        done.stderr
    );
    done.stderr
}

#[test]
fn what_is_malformed_is_named() {
    type Change = fn(&mut Value);
    let cases: [(Change, &str); 15] = [
        (|f| *f = json!([]), "is no transforms.json"),
        (|f| f["frames"] = json!([]), "lists no frames"),
        (|f| f["frames"][2] = json!({}), "missing field `file_path`"),
        (
            |f| f["frames"][2]["transform_matrix"] = json!([[1, 0, 0, 0]]),
            "frames[2].transform_matrix has neither",
        ),
        (
            |f| f["frames"][2]["transform_matrix"][0][0] = json!(7),
            "frames[2].transform_matrix is no rotation",
        ),
        (
            |f| f["frames"][2]["transform_matrix"][0] = json!([1, 2, 3]),
            "is no transforms.json",
        ),
        (
            |f| f["frames"][2]["file_path"] = json!("../x.png"),
            "leads out of its folder",
        ),
        (
            |f| f["frames"][2]["file_path"] = f["frames"][1]["file_path"].clone(),
            "frames[2].file_path is that of another",
        ),
        (
            |f| f["frames"][2]["fl_x"] = json!("60"),
            "frames[2].fl_x is no number",
        ),
        (|f| f["fl_x"] = json!(-60), "focal length"),
        (|f| f["w"] = json!(1e12), "width"),
        (
            |f| f["k4"] = json!(0.1),
            "camera_model OPENCV with its coefficients is not read",
        ),
        (
            |f| f["camera_model"] = json!("ORTHOPHOTO"),
            "camera_model ORTHOPHOTO",
        ),
        (
            |f| f["applied_transform"][0][0] = json!(2),
            "applied_transform is no rotation",
        ),
        (
            |f| f["ply_file_path"] = json!("none.ply"),
            "none.ply: cannot be read",
        ),
    ];
    for (change, wanted) in cases {
        let error = error_of(change);
        assert!(error.contains(wanted), "{error} {wanted}");
    }
    let unlike: Change = |f| {
        let fields = f.as_object_mut().expect("an object");
        fields.retain(|name, _| !["fl_x", "fl_y"].contains(&&**name));
    };
    assert!(error_of(unlike).contains("fl_x and camera_angle_x are missing"));
}

#[test]
fn damaged_points_are_named() {
    for ply in [
        "",
        "ply\n",
        &PLY[..PLY.len() - 5],
        &PLY.replace("float z", "float w"),
        &PLY.replace("vertex 2", "vertex 99999999999"),
    ] {
        let place = scenes(&transforms(true));
        place.write("scene/points.ply", ply);
        let error = load(&place, "scene").expect_err("damaged").to_string();
        assert!(error.contains("points.ply: is no point cloud"), "{error}");
    }
}

#[test]
fn files_of_other_programs_are_known() {
    for (name, text, wanted) in [
        (
            "cameras.xml",
            "<?xml version=\"1.0\"?>\n<document version=\"2.0.0\">\n <chunk label=\"a\">",
            "Metashape",
        ),
        (
            "images/01.xmp",
            "<x:xmpmeta xmlns:xcr=\"http://www.capturingreality.com/ns/xcr/1.1#\" xcr:Version=\"3\">",
            "RealityScan",
        ),
        (
            "poses.csv",
            "#name,x,y,alt,heading,pitch,roll,f\n",
            "RealityScan",
        ),
    ] {
        let place = scenes(&json!({}));
        fs::remove_file(place.path("scene/transforms.json")).expect("a file");
        place.write(&format!("scene/{name}"), text);
        let error = load(&place, "scene").expect_err("foreign").to_string();
        for word in [wanted, name, "Export", "COLMAP"] {
            assert!(error.contains(word), "{error}");
        }
    }
}
