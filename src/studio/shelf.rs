//! The runs in a folder, and the files that they have made.

use std::{
    fs,
    path::{Path, PathBuf},
    time::{SystemTime, UNIX_EPOCH},
};

use image::ImageFormat;
use serde_json::{Value, json};

use super::{error::StudioError, kept::kept};
use crate::{
    capture::decode_image,
    hash::Hasher,
    input,
    store::{RunFolder, files},
};

/// Folder of new runs, and that of what is exported.
pub const RUNS: &str = "runs";
const EXPORTS: &str = "exports";

/// Bytes of a file that is handed out, at most: it is read whole.
const MOST_BYTES: u64 = 1 << 30;

/// Height of pictures, in pixels.
const HEIGHT: u32 = 360;

/// Extensions of pictures that are shown, and of files that are handed out.
const PICTURES: [&str; 6] = ["png", "jpg", "jpeg", "tif", "tiff", "webp"];
const FILES: [&str; 9] = [
    "ply", "spz", "sog", "html", "mp4", "mov", "mkv", "mxf", "glb",
];

/// A run, or the folder of a job that has made none yet.
pub struct Shelved {
    pub path: PathBuf,
    run: RunFolder,
}

impl Shelved {
    fn at(path: PathBuf) -> Option<Self> {
        let run = RunFolder::find(Some(&path)).ok()?;
        (run.report().is_file() || kept(&path).is_some()).then_some(Self { path, run })
    }

    /// Its name in the page's requests.
    fn id(&self) -> String {
        let mut hash = Hasher::default();
        hash.update(self.path.as_os_str().as_encoded_bytes());
        hash.finish()[..16].to_owned()
    }

    /// Name of its folder.
    fn name(&self) -> String {
        let name = self.path.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    }

    /// Folder of what is exported of it.
    fn exports(&self, folder: &Path) -> PathBuf {
        folder.join(EXPORTS).join(self.name())
    }

    /// Words of a command that writes a result of it there, named like the run.
    pub fn export_words(
        &self,
        command: &str,
        folder: &Path,
        end: &str,
    ) -> Result<Vec<String>, StudioError> {
        let output = self.exports(folder).join(self.name() + end);
        files::make_folder_of(&output)?;
        let [run, output] = [&self.path, &output].map(|path| path.to_string_lossy().into_owned());
        Ok(vec![command.to_owned(), run, "-o".to_owned(), output])
    }

    /// The picture that shows best how far it is.
    fn picture(&self) -> Option<PathBuf> {
        let sheet = self.run.contact_sheet();
        middle_picture(&self.path.join("colored"))
            .or_else(|| sheet.is_file().then_some(sheet))
            .or_else(|| middle_picture(&self.path.join("house/images")))
    }

    /// Files that can be taken away. A link may lead elsewhere.
    fn files(&self, folder: &Path) -> Vec<PathBuf> {
        let found = entries(&self.path)
            .into_iter()
            .chain(entries(&self.exports(folder)));
        found
            .filter(|path| has(path, &FILES))
            .filter(|path| {
                let data = fs::symlink_metadata(path);
                data.is_ok_and(|data| data.is_file() && data.len() <= MOST_BYTES)
            })
            .collect()
    }

    fn told(&self, folder: &Path) -> Value {
        let there = |path: PathBuf| path.is_file();
        let files = self.files(folder).into_iter().map(|path| {
            let name = path
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned();
            json!({ "name": name, "bytes": fs::metadata(&path).map_or(0, |data| data.len()) })
        });
        json!({
            "id": self.id(),
            "name": self.name(),
            "path": self.path,
            "gray": there(self.run.luma()),
            "colored": there(self.run.color()),
            "resumes": kept(&self.path).is_some(),
            "picture": self.picture().map(|path| stamp(&path)),
            "files": files.collect::<Vec<_>>(),
            "film": there(self.path.join("house/film.json")),
        })
    }
}

fn has(path: &Path, known: &[&str]) -> bool {
    let extension = path.extension().unwrap_or_default();
    known
        .iter()
        .any(|known| extension.eq_ignore_ascii_case(known))
}

/// What lies in a folder, by name.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let found = fs::read_dir(folder).into_iter().flatten();
    let mut found: Vec<PathBuf> = found.filter_map(|entry| Some(entry.ok()?.path())).collect();
    found.sort();
    found
}

fn middle_picture(folder: &Path) -> Option<PathBuf> {
    let mut found = entries(folder);
    found.retain(|path| has(path, &PICTURES));
    found.get(found.len() / 2).cloned()
}

/// Milliseconds since 1970 at which a file was written.
fn stamp(path: &Path) -> u64 {
    let written = fs::metadata(path).and_then(|data| data.modified());
    let since = written
        .unwrap_or(SystemTime::UNIX_EPOCH)
        .duration_since(UNIX_EPOCH);
    since.map_or(0, |since| since.as_millis() as u64)
}

/// The runs of a studio's folder: in it and in `runs/`, the newest first.
fn shelved(folder: &Path) -> Vec<Shelved> {
    let places = entries(folder)
        .into_iter()
        .chain(entries(&folder.join(RUNS)));
    // A link leads elsewhere.
    let own = places.filter(|path| path.is_dir() && !path.is_symlink());
    let mut runs: Vec<Shelved> = own.filter_map(Shelved::at).collect();
    runs.sort_by_key(|run| std::cmp::Reverse(stamp(&run.path)));
    runs
}

/// The runs for the page.
pub fn runs(folder: &Path) -> Vec<Value> {
    shelved(folder).iter().map(|run| run.told(folder)).collect()
}

/// The run of an id.
pub fn find(folder: &Path, id: &str) -> Option<Shelved> {
    shelved(folder).into_iter().find(|run| run.id() == id)
}

/// A small PNG of a run's picture.
pub fn picture(folder: &Path, id: &str) -> Option<Vec<u8>> {
    let bytes = input::read(&find(folder, id)?.picture()?).ok()?;
    let found = decode_image(bytes).ok()?;
    let image = found.orientation.image(found.image);
    let width = (f64::from(image.width()) * f64::from(HEIGHT) / f64::from(image.height())) as u32;
    let small = match image.height() > HEIGHT {
        true => image.thumbnail(width.max(1), HEIGHT),
        false => image,
    };
    let mut png = std::io::Cursor::new(Vec::new());
    small.to_rgb8().write_to(&mut png, ImageFormat::Png).ok()?;
    Some(png.into_inner())
}

/// The bytes of one of a run's files, by its place in the list.
pub fn file(folder: &Path, id: &str, place: usize) -> Option<Vec<u8>> {
    let run = find(folder, id)?;
    input::read(run.files(folder).get(place)?).ok()
}
