//! FFmpeg, COLMAP and Python as scripts: they write down how they were called, and do as they
//! are told by files in `fake/`.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

use crate::program::{Done, Place};
use crate::scene;

/// COLMAP's options by version.
const OLD: &str = "--random_seed --SiftExtraction.use_gpu --SiftMatching.use_gpu";
const NEW: &str = "--random_seed --FeatureExtraction.use_gpu --FeatureMatching.use_gpu";

const COLMAP: &str = r#"#!/bin/sh
echo "colmap $*" >> "$FAKE/log"
command=$1
if [ "$command" = help ]; then
  echo "COLMAP $(/bin/cat "$FAKE/version") -- Structure-from-Motion"
  exit 0
fi
if [ "$2" = --help ]; then /bin/cat "$FAKE/options"; exit 0; fi
shift
while [ $# -gt 0 ]; do
  case ${1#--} in
    database_path) database=$2 ;;
    output_path) output=$2 ;;
    ImageReader.camera_model)
      case "$2 $(/bin/cat "$FAKE/version")" in EQUI*\ 3*)
        echo "[reader.cc:41] Check failed: ExistsCameraModelWithName(camera_model)" >&2
        exit 1 ;;
      esac ;;
    match_list_path) /bin/cp "$2" "$FAKE/pairs" ;;
    ImageReader.mask_path) /bin/cp -r "$2" "$FAKE/seen-masks" ;;
  esac
  shift 2
done
if [ -f "$FAKE/fail-$command" ]; then
  echo "first line" >&2
  echo "E20250101 10:00:00.0 1 x.cc:1] no $command today" >&2
  exit 1
fi
if [ -f "$FAKE/wait-$command" ]; then
  echo half > "$database"
  echo $$ > "$FAKE/waiting"
  exec /bin/sleep 60
fi
case $command in
  feature_extractor) echo "Processed file [1/2]"; /bin/cp "$FAKE/database" "$database"; echo features >> "$database" ;;
  *_matcher|matches_importer) echo "Matching image [1/2] in 0.1s"; echo matches >> "$database" ;;
  mapper) echo "Registering image #1 (3)"; /bin/cp -r "$FAKE/models/." "$output" ;;
esac
"#;

const PYTHON: &str = r#"#!/bin/sh
[ "$1" = -I ] || { echo "the current folder is heeded" >&2; exit 1; }
shift
case "$1 $2" in
  "-m venv") /bin/mkdir -p bin; /bin/cp "$0" bin/python3; exit 0 ;;
  "-m pip")
    echo "$*" >> "$FAKE/log"
    if [ -f "$FAKE/pip-fails" ]; then /bin/cat "$FAKE/pip-fails" >&2; exit 1; fi
    echo 4.2.1 > "$FAKE/pycolmap"; exit 0 ;;
  *"print('pycolmap'"*) [ -f "$FAKE/pycolmap" ] || exit 1; echo "pycolmap $(/bin/cat "$FAKE/pycolmap")"; exit 0 ;;
esac
shift 2
exec "$FAKE/colmap" "$@"
"#;

const FFMPEG: &str = r#"#!/bin/sh
echo "ffmpeg $*" >> "$FAKE/log"
case "$*" in
  *-filters) /bin/cat "$FAKE/filters" ;;
  -version) echo "ffmpeg version $(/bin/cat "$FAKE/ffmpeg-version") Copyright" ;;
  *rawvideo*) /bin/cat "$FAKE/tiny" ;;
  *idet*)
    echo "[Parsed_idet_0 @ 0x1] Repeated Fields: Neither: 9 Top: 0 Bottom: 0" >&2
    echo "[Parsed_idet_0 @ 0x1] Multi frame detection: $(/bin/cat "$FAKE/idet")" >&2 ;;
  *) echo "frame=3"; /bin/cp "$FAKE"/frames/* . ;;
esac
"#;

const FFPROBE: &str = r#"#!/bin/sh
/bin/cat "$FAKE/probe"
"#;

/// A database without photos; SQLite does not read what follows it.
fn database(path: &Path) {
    // As COLMAP keeps it.
    let tables = "PRAGMA journal_mode = WAL;
        CREATE TABLE cameras (camera_id, width, height);
        CREATE TABLE images (image_id, name, camera_id);
        CREATE TABLE keypoints (image_id, cols, data);
        CREATE TABLE two_view_geometries (pair_id, rows, data);";
    let database = rusqlite::Connection::open(path).expect("writable");
    database.execute_batch(tables).expect("tables");
}

/// A folder with `photos/`, the photos of the scene, and with fakes of these programs.
pub fn place_with(programs: &[&str]) -> Place {
    let place = Place::new();
    scene::write(&place.path("scene"));
    fs::rename(place.path("scene/images"), place.path("photos")).expect("writable");
    fs::create_dir_all(place.path("bin")).expect("writable");
    for (name, script) in [
        ("bin/colmap", COLMAP),
        ("bin/python3", PYTHON),
        ("bin/ffmpeg", FFMPEG),
        ("bin/ffprobe", FFPROBE),
        ("fake/colmap", COLMAP),
    ] {
        if name.starts_with("fake/") || programs.iter().any(|p| name.ends_with(p)) {
            place.write(name, script);
            let executable = fs::Permissions::from_mode(0o755);
            fs::set_permissions(place.path(name), executable).expect("writable");
        }
    }
    version(&place, "3.8");
    database(&place.path("fake/database"));
    place.write("fake/ffmpeg-version", "5.1.9");
    place.write("fake/idet", "TFF: 0 BFF: 0 Progressive: 9 Undetermined: 0");
    piece(&place, 0, &all_views());
    place
}

/// Names of all photos of the scene.
pub fn all_views() -> Vec<String> {
    (0..scene::VIEWS).map(scene::name).collect()
}

/// COLMAP of another version.
pub fn version(place: &Place, version: &str) {
    place.write("fake/version", version);
    let known = if version.starts_with('3') { OLD } else { NEW };
    place.write("fake/options", known.replace(' ', " arg (=1)\n"));
}

/// A model that COLMAP will find, of photos of these names.
pub fn piece(place: &Place, number: usize, names: &[String]) {
    let [width, height] = scene::SIZE;
    let model = format!("fake/models/{number}");
    let cameras = format!("1 SIMPLE_PINHOLE {width} {height} 60 32 24\n");
    let image = |(i, name): (usize, &String)| format!("{} 1 0 0 0 {i} 0 4 1 {name}\n\n", i + 1);
    let images: String = names.iter().enumerate().map(image).collect();
    place.write(&format!("{model}/cameras.txt"), cameras);
    place.write(&format!("{model}/images.txt"), images);
    place.write(
        &format!("{model}/points3D.txt"),
        "1 0 0 0 90 90 90 0.5\n2 1 0 0 9 9 9 0.5\n",
    );
}

/// The program in this place, which finds no program but the fakes.
pub fn command(place: &Place, arguments: &[&str]) -> Command {
    let mut command = place.command(arguments);
    command
        .env("PATH", place.path("bin"))
        .env("FAKE", place.path("fake"))
        .env("XDG_CACHE_HOME", place.path("cache"));
    command
}

pub fn run(place: &Place, arguments: &[&str]) -> Done {
    Done::of(command(place, arguments).output())
}

/// Runs it; it has to succeed.
pub fn succeed(place: &Place, arguments: &[&str]) -> Done {
    let done = run(place, arguments);
    assert_eq!(done.code, Some(0), "{arguments:?}: {done:?}");
    done
}

/// It ends with one line that has these words.
pub fn refused(place: &Place, arguments: &[&str], words: &[&str]) {
    let done = run(place, arguments);
    let line = done.stderr.lines().last().unwrap_or_default();
    assert_eq!(done.code, Some(1), "{arguments:?}: {done:?}");
    assert!(line.starts_with("error: ") && line.len() < 600, "{line}");
    for word in words {
        assert!(line.contains(word), "{arguments:?}: no {word:?} in {line}");
    }
}

/// Calls of programs since the last time, but for queries of version and help.
pub fn calls(place: &Place) -> Vec<String> {
    let log = fs::read_to_string(place.path("fake/log")).unwrap_or_default();
    let _ = fs::remove_file(place.path("fake/log"));
    let asked = |call: &&str| {
        !["help", "--help", "-version"]
            .iter()
            .any(|end| call.ends_with(end))
    };
    log.lines().filter(asked).map(str::to_owned).collect()
}

/// The commands of COLMAP that were called since the last time.
pub fn commands(place: &Place) -> Vec<String> {
    let calls = calls(place);
    let words = calls.iter().filter_map(|call| call.strip_prefix("colmap "));
    words
        .map(|words| words.split(' ').next().unwrap_or_default().to_owned())
        .collect()
}
