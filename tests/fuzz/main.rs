//! Damaged files of every kind that is read: no panic, no wait, and no more memory than the
//! file's size can explain.
//!
//! `cargo test --test fuzz` tries each kind a thousand times or less;
//! `GS_CHROMA_MUTATIONS=100000` as often as it says. What failed once is kept in
//! `tests/proptest-regressions/fuzz/`.

use std::{
    cell::Cell,
    fs,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};

use gs_chroma::{
    capture::{Capture, LoadOptions, Loader, View},
    chroma::teacher::{GrayImage, Teacher, TeacherError, TeacherSettings},
    low_level::oracle,
    measure::decode_flo,
    splats::{self, Format, WriteOptions, read_ply, read_splats, write_splats},
};
use peak_alloc::PeakAlloc;
use proptest::{
    prelude::*,
    test_runner::{Config, FailurePersistence, FileFailurePersistence, TestRunner},
};

mod mutation;
#[allow(dead_code, reason = "tests of the program use all of it")]
#[path = "../cli/scene.rs"]
mod scene;

use mutation::{Mutation, mutation};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Memory is counted for the whole process: one kind at a time.
static ALONE: Mutex<()> = Mutex::new(());

/// No file of these sizes may take longer.
const PATIENCE: Duration = Duration::from_secs(10);

/// Bytes that reading may take even for the smallest file: buffers, tables of decoders.
const FIXED: usize = 24 << 20;

/// Bytes that the `tiff` crate may reserve for a directory's lists before limits apply; pages that
/// no file fills are never touched.
const TIFF: usize = 256 << 20;

/// Times a file's size, of what is stored as it is read: lists and maps of small parts.
const PLAIN: usize = 64;

/// Times a file's size, of what is compressed: samples that a byte can stand for, as bytes, gray
/// and weights, see `capture::decode`.
const COMPRESSED: usize = 8 * 1032 * 8;

/// A kind of file.
struct Kind<'a> {
    name: &'a str,
    /// Sound files of it.
    corpus: Vec<Vec<u8>>,
    /// Path that it is read from.
    path: PathBuf,
    /// Reads it; whether it is accepted.
    read: &'a dyn Fn(&Path) -> bool,
    /// Bytes of memory for each of the file's.
    memory: usize,
    /// Number of tries by default.
    cases: u32,
}

/// Tries damaged files of a kind; what fails is kept.
fn survives(kind: &Kind<'_>) {
    for (number, sound) in kind.corpus.iter().enumerate() {
        fs::write(&kind.path, sound).expect("writable");
        assert!(
            (kind.read)(&kind.path),
            "{}: file {number} is refused",
            kind.name
        );
    }
    let kept = format!("tests/proptest-regressions/fuzz/{}.txt", kind.name);
    let kept = FileFailurePersistence::Direct(kept.leak());
    let [highest, slowest] =
        tried(kind, Some(Box::new(kept))).unwrap_or_else(|error| panic!("{error}"));
    println!(
        "| {} | {} | {highest:.1} | {slowest:.0} |",
        kind.name,
        cases(kind)
    );
}

fn cases(kind: &Kind<'_>) -> u32 {
    let asked = std::env::var("GS_CHROMA_MUTATIONS").ok();
    asked.map_or(kind.cases, |count| count.parse().expect("a number"))
}

/// The highest memory in MB, and the longest time in ms; else the smallest damage that is not
/// survived.
fn tried(kind: &Kind<'_>, kept: Option<Box<dyn FailurePersistence>>) -> Result<[f64; 2], String> {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let mut runner = TestRunner::new(Config {
        cases: cases(kind),
        failure_persistence: kept,
        max_shrink_iters: 500,
        ..Config::default()
    });
    let (highest, slowest) = (Cell::new(0), Cell::new(Duration::ZERO));
    let files = prop::sample::select((0..kind.corpus.len()).collect::<Vec<_>>());
    let damage = prop::collection::vec(mutation(), 0..5);
    let outcome = runner.run(
        &(files, damage),
        |(file, damage): (usize, Vec<Mutation>)| {
            let mut bytes = kind.corpus[file].clone();
            damage
                .iter()
                .for_each(|mutation| mutation.apply(&mut bytes));
            fs::write(&kind.path, &bytes).expect("writable");
            let (before, begun) = (MEMORY.current_usage(), Instant::now());
            MEMORY.reset_peak_usage();
            (kind.read)(&kind.path);
            let taken = MEMORY.peak_usage().saturating_sub(before);
            let took = begun.elapsed();
            prop_assert!(took < PATIENCE, "takes {took:?}");
            let reserved = if kind.name == "tiff" { TIFF } else { 0 };
            let bound = FIXED + reserved + kind.memory * bytes.len();
            prop_assert!(taken <= bound, "takes {taken} bytes, not {bound}");
            highest.set(highest.get().max(taken));
            slowest.set(slowest.get().max(took));
            Ok(())
        },
    );
    outcome.map_err(|error| format!("{}: {error}", kind.name))?;
    Ok([
        highest.get() as f64 / 1e6,
        slowest.get().as_secs_f64() * 1e3,
    ])
}

/// Readers that do not survive are found.
#[test]
fn bad_readers_are_found() {
    let place = tempfile::tempdir().expect("a folder");
    let sound = vec![7; 100];
    let panics = |path: &Path| {
        assert!(fs::read(path).expect("a file").len() < 120, "too long");
        true
    };
    let allocates = |path: &Path| {
        let file = fs::read(path).expect("a file");
        let count = file.get(9).map_or(0, |&byte| usize::from(byte) << 20);
        drop(std::hint::black_box(vec![1_u8; count]));
        true
    };
    let good = |path: &Path| fs::read(path).is_ok();
    for (read, expected) in [
        (&panics as &dyn Fn(&Path) -> bool, Some("too long")),
        (&allocates, Some("bytes, not")),
        (&good, None),
    ] {
        let kind = Kind {
            name: "bytes",
            corpus: vec![sound.clone()],
            path: place.path().join("file"),
            read,
            memory: PLAIN,
            cases: 300,
        };
        let outcome = tried(&kind, None);
        match expected {
            Some(words) => assert!(outcome.unwrap_err().contains(words)),
            None => assert!(outcome.is_ok()),
        }
    }
}

/// A folder with a small scene.
fn place() -> tempfile::TempDir {
    let below = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let made = tempfile::Builder::new().prefix("fuzz-").tempdir_in(below);
    let made = made.expect("the target folder is writable");
    scene::write(made.path());
    made
}

#[test]
fn models() {
    for (text, name) in [
        (false, "cameras.bin"),
        (false, "images.bin"),
        (false, "points3D.bin"),
        (true, "cameras.txt"),
        (true, "images.txt"),
        (true, "points3D.txt"),
    ] {
        let place = place();
        let mut model = place.path().join("sparse/0");
        if text {
            fs::remove_dir_all(&model).expect("a model");
            scene::write_moved(place.path(), [0.0; 3]);
            model = place.path().join("sparse");
        }
        let path = model.join(name);
        survives(&Kind {
            name: &name.replace('.', "-"),
            corpus: vec![fs::read(&path).expect("a file")],
            path,
            read: &|_| Capture::load(place.path()).is_ok(),
            memory: PLAIN,
            cases: 300,
        });
    }
}

#[test]
fn transforms_and_their_points() {
    let place = place();
    fs::remove_dir_all(place.path().join("sparse")).expect("a model");
    let frame = |view: usize| {
        let name = scene::name(view);
        format!(
            "{{\"file_path\":\"images/{name}\",\"transform_matrix\":[[1,0,0,{view}],[0,1,0,0],[0,0,1,0]]}}"
        )
    };
    let frames: Vec<String> = (0..scene::VIEWS).map(frame).collect();
    let json = format!(
        "{{\"w\":64,\"h\":48,\"fl_x\":60.5,\"k1\":0.01,\"ply_file_path\":\"points.ply\",\"frames\":[{}]}}",
        frames.join(",")
    );
    let ply = b"ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty double x\nproperty float y\nproperty float z\nproperty uchar red\nend_header\n";
    // Two at the origin.
    let ply = [&ply[..], &[0; 34]].concat();
    let paths = ["transforms.json", "points.ply"].map(|name| place.path().join(name));
    for (path, file) in paths.iter().zip([json.as_bytes(), &ply]) {
        fs::write(path, file).expect("writable");
    }
    for path in paths {
        let corpus = vec![fs::read(&path).expect("a file")];
        let name = path
            .file_name()
            .expect("a name")
            .to_string_lossy()
            .replace('.', "-");
        survives(&Kind {
            name: &name,
            corpus: corpus.clone(),
            path: path.clone(),
            read: &|_| Capture::load(place.path()).is_ok(),
            memory: PLAIN,
            cases: 300,
        });
        fs::write(path, &corpus[0]).expect("writable");
    }
}

/// A photo of the small scene as files of every kind.
fn pictures() -> [(&'static str, Vec<Vec<u8>>); 3] {
    use image::ImageFormat::{Jpeg, Png};
    let photo = image::DynamicImage::from(scene::photo(3));
    let gray = image::DynamicImage::from(photo.to_luma8());
    let alpha = image::DynamicImage::from(photo.to_rgba8());
    let deep = image::DynamicImage::from(photo.to_luma16());
    let encoded = |picture: &image::DynamicImage, format| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).expect("a picture");
        bytes.into_inner()
    };
    let mut tiffs = Vec::new();
    for compression in [
        tiff::encoder::Compression::Uncompressed,
        tiff::encoder::Compression::Lzw,
        tiff::encoder::Compression::Deflate(tiff::encoder::DeflateLevel::Balanced),
    ] {
        let mut file = std::io::Cursor::new(Vec::new());
        let encoder = tiff::encoder::TiffEncoder::new(&mut file).expect("a file");
        encoder
            .with_compression(compression)
            .write_image::<tiff::encoder::colortype::Gray16>(
                gray.width(),
                gray.height(),
                deep.as_luma16().expect("16 bits"),
            )
            .expect("a picture");
        tiffs.push(file.into_inner());
    }
    [
        (
            "png",
            [&photo, &gray, &alpha, &deep]
                .map(|p| encoded(p, Png))
                .to_vec(),
        ),
        ("jpeg", [&photo, &gray].map(|p| encoded(p, Jpeg)).to_vec()),
        ("tiff", tiffs),
    ]
}

#[test]
fn photos() {
    let place = place();
    let capture = Capture::load(place.path()).expect("a scene");
    let loader = Loader::new(LoadOptions::default());
    for (name, corpus) in pictures() {
        let path = place.path().join("photo");
        let view = View {
            image_path: path.clone(),
            ..capture.views[0].clone()
        };
        survives(&Kind {
            name,
            corpus,
            path,
            read: &|_| loader.camera(&view).is_ok() && loader.load(&view).is_ok(),
            memory: COMPRESSED,
            cases: 150,
        });
    }
}

#[test]
fn splat_files() {
    let place = place();
    let splats = splats::Splats {
        means: vec![[0.5, -1.0, 2.0]; 20],
        quats: vec![[1.0, 0.0, 0.0, 0.5]; 20],
        log_scales: vec![[-1.0; 3]; 20],
        opacity_logits: vec![0.5; 20],
        sh: splats::ShField::zeros(20, 2, 1),
    };
    let path = place.path().join("scene.ply");
    let offset = glam::DVec3::ZERO;
    splats::write_ply(&path, &splats, offset, &[]).expect("writable");
    let ours = fs::read(&path).expect("a file");
    let text = b"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nproperty float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\nproperty float opacity\nproperty float scale_0\nproperty float scale_1\nproperty float scale_2\nproperty float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float rot_3\nend_header\n0 0 1 .1 .2 .3 1 -2 -2 -2 1 0 0 0\n1 0 1 .1 .2 .3 1 -2 -2 -2 1 0 0 0\n";
    survives(&Kind {
        name: "ply",
        corpus: vec![ours, text.to_vec()],
        path,
        read: &|path| read_ply(path).is_ok(),
        memory: PLAIN,
        cases: 300,
    });
    for format in Format::ALL.into_iter().filter(|format| format.is_read()) {
        let path = place.path().join(format!("scene{}", format.extension()));
        write_splats(&path, &splats, &WriteOptions::default()).expect("writable");
        survives(&Kind {
            name: &format.extension().trim_start_matches('.').replace('.', "-"),
            corpus: vec![fs::read(&path).expect("a file")],
            path,
            read: &|path| read_splats(path).is_ok(),
            memory: COMPRESSED,
            cases: 300,
        });
    }
    let path = place.path().join("chroma.npy");
    let field = splats::ShField::zeros(20, 1, 2);
    survives(&Kind {
        name: "npy",
        corpus: vec![splats::npy::encode(&field)],
        path,
        read: &|path| splats::npy::decode(&fs::read(path).expect("a file"), 20, 2).is_ok(),
        memory: PLAIN,
        cases: 300,
    });
    let flow = [
        &b"PIEH"[..],
        &4_u32.to_le_bytes(),
        &3_u32.to_le_bytes(),
        &[0; 96],
    ]
    .concat();
    let path = place.path().join("pair.flo");
    survives(&Kind {
        name: "flo",
        corpus: vec![flow],
        path,
        read: &|path| decode_flo(&fs::read(path).expect("a file"), 4, 3).is_ok(),
        memory: PLAIN,
        cases: 150,
    });
}

#[test]
#[cfg(feature = "cli")]
fn reports() {
    let place = place();
    let path = place.path().join("report.json");
    let folder = gs_chroma::low_level::RunFolder::at(place.path());
    survives(&Kind {
        name: "report",
        corpus: vec![include_bytes!("../fixtures/report.json").to_vec()],
        path,
        read: &|_| folder.read_report().is_ok(),
        memory: PLAIN,
        cases: 300,
    });
}

fn network(name: &str) -> PathBuf {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/onnx");
    fixtures.join(name)
}

/// Opens a teacher and asks it.
fn ask(path: &Path, profile: Option<&Path>) -> Result<(), TeacherError> {
    let settings = TeacherSettings {
        profile: profile.map(|path| path.to_string_lossy().into_owned()),
        time_limit: Duration::from_secs(2),
        ..TeacherSettings::default()
    };
    let [width, height] = scene::SIZE;
    let pixels = vec![128; (width * height) as usize];
    let gray = GrayImage {
        width,
        height,
        pixels: &pixels,
    };
    Teacher::open(path, None, &settings)?
        .colorize("00.png", gray, None)
        .map(drop)
}

#[test]
fn teachers() {
    let place = place();
    ask(&network("ddcolor_tiny.onnx"), None).expect("a network");
    let path = place.path().join("network.onnx");
    let names = ["ddcolor_tiny", "siggraph17_tiny"];
    let read = |name: &&str| fs::read(network(&format!("{name}.onnx"))).expect("a network");
    survives(&Kind {
        name: "onnx",
        corpus: names.iter().map(read).collect(),
        path,
        read: &|path| ask(path, None).is_ok(),
        memory: PLAIN,
        cases: 300,
    });
    let path = place.path().join("manifest.toml");
    let manifest = "name = \"Mine\"\ninputs = [\"image\"]\nimage = \"gray-rgb\"\ninput_range = [0.0, 1.0]\nmean = [0, 0, 0]\nstd = [1, 1, 1]\nsize = 32\nsize_multiple = 1\nresize = \"stretch\"\nfilter = \"average\"\noutput = \"ab\"\noutput_range = [-110.0, 110.0]\n";
    let plain = network("ddcolor_tiny.onnx");
    survives(&Kind {
        name: "manifest",
        corpus: vec![manifest.as_bytes().to_vec()],
        path,
        read: &|path| ask(&plain, Some(path)).is_ok(),
        memory: PLAIN,
        cases: 150,
    });
    let [png, ..] = pictures();
    let folder = place.path().join("colored");
    fs::create_dir(&folder).expect("writable");
    survives(&Kind {
        name: "teacher-image",
        corpus: png.1,
        path: folder.join("00.png"),
        read: &|_| ask(&folder, None).is_ok(),
        memory: COMPRESSED,
        cases: 150,
    });
}
