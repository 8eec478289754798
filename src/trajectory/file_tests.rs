//! Files of paths, there and back.

use super::*;
use crate::trajectory::fixtures::camera;

fn cameras() -> Vec<Camera> {
    let tilt = DMat3::from_rotation_x(0.3) * DMat3::from_rotation_z(-0.2);
    (0..4)
        .map(|k| {
            let camera = camera(DVec3::new(f64::from(k), 1.0, -2.0), 0.2 * f64::from(k));
            let (center, rotation) = (camera.center(), tilt * camera.rotation);
            Camera {
                rotation,
                translation: -(rotation * center),
                cx: 21.5,
                ..camera
            }
        })
        .collect()
}

fn same(a: &[Camera], b: &[Camera]) -> bool {
    a.len() == b.len()
        && a.iter().zip(b).all(|(a, b)| {
            a.rotation.abs_diff_eq(b.rotation, 1e-9)
                && a.translation.abs_diff_eq(b.translation, 1e-9)
                && [a.fx - b.fx, a.fy - b.fy, a.cx - b.cx, a.cy - b.cy]
                    .iter()
                    .all(|d| d.abs() < 1e-9)
                && (a.width, a.height) == (b.width, b.height)
        })
}

#[test]
fn it_is_read_as_it_was_written_and_as_nerfstudio_reads_it() {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("camera_path.json");
    write_path(&path, &cameras(), 24.0).unwrap();
    let read = read_path(&path, [1, 1]).unwrap();
    assert!(same(&read.cameras, &cameras()));
    assert_eq!(
        (read.rate, read.coordinates),
        (Some(24.0), Coordinates::Colmap)
    );
    let text = std::fs::read_to_string(&path).unwrap();
    let value: Value = serde_json::from_str(&text).unwrap();
    let frame = &value["camera_path"][2];
    // The position is the last column; the third is away from what is seen.
    let matrix: Vec<f64> = typed(frame["camera_to_world"].clone()).unwrap();
    let forward = cameras()[2].rotation.row(2);
    for row in 0..3 {
        assert!((matrix[4 * row + 3] - cameras()[2].center()[row]).abs() < 1e-9);
        assert!((matrix[4 * row + 2] + forward[row]).abs() < 1e-9);
    }
    let fov = frame["fov"].as_f64().unwrap();
    assert!((15.0 / (0.5 * fov.to_radians()).tan() - 50.0).abs() < 1e-9);
    assert_eq!(
        (value["fps"].as_f64(), value["seconds"].as_f64()),
        (Some(24.0), Some(4.0 / 24.0))
    );
}

#[test]
fn nerfstudio_s_own_world_is_brought_back() {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("camera_path.json");
    let turn = DMat3::from_rotation_x(1.0) * DMat3::from_rotation_y(0.4);
    let row = |r: usize| {
        let row = turn.row(r);
        [row.x, row.y, row.z, r as f64 - 0.5]
    };
    let moved = serde_json::json!({"transform": [row(0), row(1), row(2)], "scale": 0.25});
    std::fs::write(place.path().join(MOVED), moved.to_string()).unwrap();
    write_path(&path, &cameras(), 30.0).unwrap();
    assert!(same(&read_path(&path, [1, 1]).unwrap().cameras, &cameras()));
    // In nerfstudio's world a center is scale · (turn · x + way).
    let value: Value = read_json(&path).unwrap();
    let x = value["camera_path"][1]["camera_to_world"][3]
        .as_f64()
        .unwrap();
    let expected = 0.25 * ((turn * cameras()[1].center()).x - 0.5);
    assert!((x - expected).abs() < 1e-9);
    let bad =
        serde_json::json!({"transform": [[1, 0, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0]], "scale": 1});
    std::fs::write(place.path().join(MOVED), bad.to_string()).unwrap();
    let error = read_path(&path, [1, 1]).unwrap_err().to_string();
    assert!(
        error.contains(MOVED) && error.contains("rotation"),
        "{error}"
    );
}

#[test]
fn other_programs_files() {
    let [x, y, z] = [0, 1, 2].map(|r| cameras()[1].rotation.row(r));
    let at = cameras()[1].center();
    let gl = |r: usize| [x[r], -y[r], -z[r], at[r]];
    let mut transforms = serde_json::json!({
        "w": 40, "h": 30, "fl_x": 50, "cx": 21.5, "cy": 15,
        "frames": [{"file_path": "a", "transform_matrix": [gl(0), gl(1), gl(2), [0, 0, 0, 1]]}],
    });
    let trained = serde_json::json!([{
        "id": 0, "width": 40, "height": 30, "position": at.to_array(), "fx": 50, "fy": 50,
        "rotation": [[x[0], y[0], z[0]], [x[1], y[1], z[1]], [x[2], y[2], z[2]]],
    }]);
    let one = &cameras()[1..2];
    assert!(same(
        &parse(transforms.clone(), [1, 1]).unwrap().cameras,
        one
    ));
    // The same after nerfstudio has turned the world.
    let turned = [gl(0), gl(2), gl(1).map(|v| -v)];
    transforms["frames"][0]["transform_matrix"] =
        serde_json::json!([turned[0], turned[1], turned[2], [0, 0, 0, 1]]);
    let applied = serde_json::json!([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0]]);
    transforms["applied_transform"] = applied;
    assert!(same(
        &parse(transforms.clone(), [1, 1]).unwrap().cameras,
        one
    ));
    transforms["applied_transform"][0][0] = 2.into();
    let error = parse(transforms, [1, 1]).unwrap_err();
    assert!(error.contains("applied_transform"), "{error}");
    let centered = [Camera {
        cx: 20.0,
        ..one[0].clone()
    }];
    assert!(same(&parse(trained, [1, 1]).unwrap().cameras, &centered));
}

#[test]
fn what_is_wrong_is_named() {
    let pose: Vec<f64> = to_opengl(&cameras()[0]).to_vec();
    let path = |width: f64, fov: f64, pose: &[f64], kind: &str| {
        serde_json::json!({
            "camera_type": kind, "render_width": width, "render_height": 30,
            "camera_path": [{"camera_to_world": pose, "fov": fov}],
        })
    };
    assert!(parse(path(40.0, 50.0, &pose, "perspective"), [1, 1]).is_ok());
    let mut flat = pose.clone();
    flat[..3].fill(0.0);
    let cases = [
        (path(0.0, 50.0, &pose, "perspective"), "render_width"),
        (path(1e9, 50.0, &pose, "perspective"), "render_width"),
        (path(40.0, 180.0, &pose, "perspective"), "fov"),
        (path(40.0, 50.0, &pose[1..], "perspective"), "16 numbers"),
        (
            path(40.0, 50.0, &flat, "perspective"),
            "camera_path[0]: camera_to_world is no pose",
        ),
        (path(40.0, 50.0, &pose, "fisheye"), "fisheye"),
        (serde_json::json!({"camera_path": 3}), "expected"),
        (
            serde_json::json!({"frames": [{"transform_matrix": []}]}),
            "expected",
        ),
        (serde_json::json!({}), "no camera path"),
        (serde_json::json!(7), "no camera path"),
    ];
    for (value, word) in cases {
        let error = parse(value.clone(), [1, 1]).unwrap_err();
        assert!(error.contains(word), "{value}: {error}");
    }
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("path.json");
    for (text, word) in [("[]", "0 frames"), ("{", "no JSON"), ("", "no JSON")] {
        std::fs::write(&file, text).unwrap();
        let error = read_path(&file, [1, 1]).unwrap_err().to_string();
        assert!(
            error.contains(word) && error.contains("path.json"),
            "{error}"
        );
    }
}
