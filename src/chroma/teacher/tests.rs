//! Teachers as a whole. The networks need ONNX Runtime.

use super::cache::Cache;
use super::*;
use std::fs;
use std::path::PathBuf;

pub fn fixture(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/onnx");
    folder.join(name)
}

/// Opens a teacher asked as usual.
fn open(path: &Path, cache: Option<&Path>) -> Result<Teacher, TeacherError> {
    open_with(path, cache, &TeacherSettings::default())
}

pub fn open_with(
    path: &Path,
    cache: Option<&Path>,
    settings: &TeacherSettings,
) -> Result<Teacher, TeacherError> {
    match Teacher::open(path, cache, settings) {
        Err(error @ (TeacherError::NoRuntime { .. } | TeacherError::BadRuntime { .. })) => {
            panic!("these tests need ONNX Runtime: {error}")
        }
        result => result,
    }
}

fn refusal(path: &Path) -> String {
    let message = open(path, None).err().expect("must be refused").to_string();
    assert!(!message.contains('\n'), "{message}");
    let name = path.file_name().unwrap().to_str().unwrap();
    assert!(message.contains(name), "{message}");
    message
}

pub fn gray(width: u32, height: u32, pixels: &[u8]) -> GrayImage<'_> {
    GrayImage {
        width,
        height,
        pixels,
    }
}

/// Bytes of a model `[1,3,H,W] -> [1,2,H,W]` with open H and W that answers
/// with the logarithm of red and green: -∞ for black. Protocol buffers by hand,
/// field numbers from onnx.proto.
fn logarithm_model() -> Vec<u8> {
    fn number(field: u8, value: u8) -> Vec<u8> {
        vec![field << 3, value]
    }
    fn bytes(field: u8, content: impl AsRef<[u8]>) -> Vec<u8> {
        let content = content.as_ref();
        assert!(content.len() < 128 * 128);
        let (low, high) = (content.len() as u8 & 127, (content.len() >> 7) as u8);
        let mut message = vec![field << 3 | 2, low | 128, high];
        message.extend(content);
        message
    }
    let ints = |name: &str, value: u8| {
        let parts = [bytes(1, name), number(8, value), vec![160, 1, 7]];
        bytes(5, parts.concat())
    };
    let value = |name: &str, channels: u8| {
        let dimensions = [
            number(1, 1),
            number(1, channels),
            bytes(2, "H"),
            bytes(2, "W"),
        ];
        let shape = dimensions.map(|dimension| bytes(1, dimension)).concat();
        let tensor = [number(1, 1), bytes(2, shape)].concat();
        [bytes(1, name), bytes(2, bytes(1, tensor))].concat()
    };
    let slice = [
        bytes(1, "input"),
        bytes(2, "two"),
        bytes(4, "Slice"),
        ints("axes", 1),
        ints("starts", 0),
        ints("ends", 2),
    ];
    let logarithm = [bytes(1, "two"), bytes(2, "output"), bytes(4, "Log")];
    let graph = [
        bytes(1, slice.concat()),
        bytes(1, logarithm.concat()),
        bytes(2, "graph"),
        bytes(11, value("input", 3)),
        bytes(12, value("output", 2)),
    ];
    let operators = [bytes(1, ""), number(2, 9)].concat();
    [number(1, 4), bytes(7, graph.concat()), bytes(8, operators)].concat()
}

#[test]
fn a_network_colors_in_closed_form() {
    let mut teacher = open(&fixture("ddcolor_tiny.onnx"), None).unwrap();
    for (level, a, b) in [(0u8, -40.0, 40.0), (255, 40.0, -20.0), (51, -24.0, 28.0)] {
        let pixels = [level; 15];
        let answer = teacher
            .colorize("v.png", gray(5, 3, &pixels), None)
            .unwrap()
            .unwrap();
        assert_eq!((answer.width, answer.height, answer.ab.len()), (5, 3, 15));
        for ab in answer.ab {
            assert!(
                (ab[0] - a).abs() < 1e-3 && (ab[1] - b).abs() < 1e-3,
                "{ab:?}"
            );
        }
    }
}

#[test]
fn the_picture_is_neither_turned_nor_mirrored() {
    let mut teacher = open(&fixture("ddcolor_tiny.onnx"), None).unwrap();
    let pixels: Vec<u8> = (0..64 * 32)
        .map(|i| (i % 64 * 2 + i / 64 * 4) as u8)
        .collect();
    let answer = teacher
        .colorize("v.png", gray(64, 32, &pixels), None)
        .unwrap()
        .unwrap();
    for (i, (ab, level)) in answer.ab.iter().zip(&pixels).enumerate() {
        let (x, y) = (i % 64, i / 64);
        if (2..62).contains(&x) && (2..30).contains(&y) {
            let expected = 40.0 * (2.0 * f32::from(*level) / 255.0 - 1.0);
            assert!(
                (ab[0] - expected).abs() < 0.1,
                "({x}, {y}) {ab:?} {expected}"
            );
        }
    }
}

#[test]
fn the_same_photo_gets_the_same_answer() {
    let pixels: Vec<u8> = (0..40 * 30).map(|i| (i * i % 251) as u8).collect();
    let photo = gray(40, 30, &pixels);
    let mut answers = (0..3).map(|_| {
        let mut teacher = open(&fixture("ddcolor_tiny.onnx"), None).unwrap();
        teacher.colorize("v.png", photo, None).unwrap().unwrap()
    });
    let first = answers.next().unwrap();
    assert!(answers.all(|answer| answer == first));
}

#[test]
fn descriptions() {
    let info = open(&fixture("ddcolor_tiny.onnx"), None)
        .unwrap()
        .describe();
    assert_eq!(info.name, "ddcolor_tiny.onnx");
    assert_eq!(info.kind, "DDColor");
    assert_eq!(info.sha256.as_ref().unwrap().len(), 64);
    assert_eq!(info.input_size, Some([32, 32]));
    let json = serde_json::to_string(&info).unwrap();
    assert!(json.contains(r#""input_size":[32,32]"#), "{json}");

    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("v.png"), "").unwrap();
    let info = open(folder.path(), None).unwrap().describe();
    assert_eq!(
        (&info.kind[..], info.sha256, info.input_size),
        ("folder", None, None)
    );
}

#[test]
fn answers_come_from_the_cache() {
    let folder = tempfile::tempdir().unwrap();
    let pixels = [255; 12];
    let ask = || {
        let mut teacher = open(&fixture("ddcolor_tiny.onnx"), Some(folder.path())).unwrap();
        teacher
            .colorize("v.png", gray(4, 3, &pixels), None)
            .unwrap()
            .unwrap()
    };
    let first = ask();
    let files: Vec<_> = fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(files.len(), 1);
    let path = files[0].as_ref().unwrap().path();

    // Another answer in its place shows that the network is not asked again.
    let planted = AbImage {
        width: 1,
        height: 1,
        ab: vec![[7.0, 8.0]],
    };
    let key = path.file_stem().unwrap().to_str().unwrap();
    Cache::open(folder.path())
        .unwrap()
        .store(key, &planted)
        .unwrap();
    let near = |ab: &[f32; 2]| (ab[0] - 7.0).abs() < 1e-5 && (ab[1] - 8.0).abs() < 1e-5;
    assert!(ask().ab.iter().all(near));

    // A damaged one is made again.
    fs::write(&path, "damaged").unwrap();
    assert_eq!(ask(), first);
    fs::remove_file(&path).unwrap();
    assert_eq!(ask(), first);
    assert!(path.exists());
}

#[test]
fn models_that_are_no_teachers() {
    for name in ["wrong_rank.onnx", "wrong_channels.onnx", "two_inputs.onnx"] {
        let message = refusal(&fixture(name));
        // What it has, and what would do.
        for part in [
            "input Float32 [1,",
            "output Float32 [1,",
            "DDColor ([1,3,H,W] to [1,2,h,w])",
        ] {
            assert!(message.contains(part), "{message}");
        }
    }
    assert!(refusal(&fixture("two_inputs.onnx")).contains("style Float32"));
    assert!(refusal(&fixture("truncated.onnx")).contains("not a usable ONNX model"));
}

#[test]
fn files_that_are_no_models() {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in [("empty.onnx", ""), ("text.onnx", "hello")] {
        let path = folder.path().join(name);
        fs::write(&path, content).unwrap();
        assert!(refusal(&path).contains("not a usable ONNX model"));
    }
    let path = folder.path().join("teacher.pth");
    fs::write(&path, "").unwrap();
    assert!(refusal(&path).contains(".onnx file or a folder"));
    refusal(&folder.path().join("missing.onnx"));
}

#[test]
fn answers_that_are_not_finite_name_the_photo() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("logarithm.onnx");
    fs::write(&path, logarithm_model()).unwrap();
    let cache = folder.path().join("cache");
    let mut teacher = open(&path, Some(&cache)).unwrap();
    assert_eq!(teacher.describe().input_size, Some([512, 512]));

    let white = teacher
        .colorize("white.png", gray(2, 2, &[255; 4]), None)
        .unwrap()
        .unwrap();
    assert_eq!(white.ab, [[0.0, 0.0]; 4]);
    let error = teacher
        .colorize("left/black.png", gray(2, 2, &[0; 4]), None)
        .unwrap_err();
    let message = error.to_string();
    for part in ["logarithm.onnx", "left/black.png", "-inf"] {
        assert!(message.contains(part), "{message}");
    }
    // Only the good answer is kept.
    assert_eq!(fs::read_dir(cache).unwrap().count(), 1);
}

#[test]
fn photos_that_do_not_fill_their_size_are_refused() {
    let mut teacher = open(&fixture("ddcolor_tiny.onnx"), None).unwrap();
    let error = teacher
        .colorize("v.png", gray(3, 2, &[0; 5]), None)
        .unwrap_err();
    assert!(error.to_string().contains("v.png"));
}
