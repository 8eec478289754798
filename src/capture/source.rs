//! Where the photos and poses of a capture are: in a COLMAP folder, or beside `transforms.json`.

use std::{
    fs,
    io::Read,
    path::{Path, PathBuf},
};

use super::{
    Chosen, colmap,
    error::CaptureError,
    transforms::{self, Scene, Source},
};
use crate::input;

/// Folder of the photos in a COLMAP folder.
pub const IMAGES: &str = "images";

/// Folders of photos, the largest first; nerfstudio and others put smaller copies beside them.
const PHOTOS: [&str; 4] = [IMAGES, "images_2", "images_4", "images_8"];

/// Files of other programs: extension, a word at their beginning, the program, and its menu that
/// exports COLMAP's model.
const FOREIGN: [[&str; 4]; 3] = [
    [
        "xml",
        "<chunk",
        "Metashape",
        "File > Export > Export Cameras, Colmap (*.txt), from 2.2 on",
    ],
    [
        "xmp",
        "xcr:",
        "RealityScan",
        "Alignment > Export > Registration, COLMAP",
    ],
    [
        "csv",
        "#name,x,y",
        "RealityScan",
        "Alignment > Export > Registration, COLMAP",
    ],
];

/// Reads the model of a folder; one of COLMAP's before `transforms.json`, for it knows which photo
/// shows which point.
pub(super) fn read(dir: &Path, chosen: Option<&Chosen>) -> Result<Source, CaptureError> {
    if !dir.is_dir() {
        return Err(CaptureError::NoFolder { dir: dir.into() });
    }
    if lists_photos(dir) {
        return transforms::read(dir, chosen);
    }
    let photos = colmap_photos(dir);
    if !is_capture(dir) {
        refuse_foreign(&[dir, &photos])?;
    }
    if !photos.is_dir() {
        return Err(CaptureError::NoImagesFolder { dir: dir.into() });
    }
    Ok(Source {
        model: colmap::read(dir, chosen)?,
        photos,
        missing: Vec::new(),
        split: None,
    })
}

/// Returns true if a folder has photos with poses, as far as names tell.
pub fn is_capture(dir: &Path) -> bool {
    colmap::folder(dir).is_ok() && colmap_photos(dir).is_dir() || lists_photos(dir)
}

/// Returns true if a folder's photos are those that `transforms.json` lists.
pub(super) fn lists_photos(dir: &Path) -> bool {
    colmap::folder(dir).is_err() && !transforms::files(dir).is_empty()
}

/// Folder that the names of a capture's photos are relative to.
pub fn photo_folder(dir: &Path) -> PathBuf {
    let listed = lists_photos(dir).then(|| Scene::read(dir).ok()).flatten();
    listed.map_or_else(|| colmap_photos(dir), |scene| scene.photos)
}

/// Photos and files of poses, which no command may write over, or their folders.
pub fn originals(dir: &Path) -> Vec<PathBuf> {
    let mut all = vec![colmap_photos(dir), dir.join("sparse"), dir.join("colmap")];
    all.extend(transforms::files(dir));
    if lists_photos(dir)
        && let Ok(scene) = Scene::read(dir)
    {
        all.extend(scene.points.map(|(path, _)| path));
        all.extend(scene.frames.into_iter().map(|frame| frame.path));
    }
    all
}

fn colmap_photos(dir: &Path) -> PathBuf {
    let mut folders = PHOTOS.map(|name| dir.join(name)).into_iter();
    folders
        .find(|folder| folder.is_dir())
        .unwrap_or_else(|| dir.join(IMAGES))
}

fn refuse_foreign(folders: &[&Path]) -> Result<(), CaptureError> {
    let entries = folders.iter().filter_map(|dir| fs::read_dir(dir).ok());
    for path in entries.flatten().flatten().map(|entry| entry.path()) {
        let extension = path.extension().unwrap_or_default();
        let known = FOREIGN
            .into_iter()
            .find(|[known, ..]| extension.eq_ignore_ascii_case(known));
        let Some([_, word, program, export]) = known else {
            continue;
        };
        let mut bytes = Vec::new();
        let read = input::open(&path).and_then(|file| file.take(4096).read_to_end(&mut bytes));
        if read.is_ok()
            && String::from_utf8_lossy(&bytes)
                .to_ascii_lowercase()
                .contains(word)
        {
            return Err(CaptureError::OtherProgram {
                path,
                program,
                export,
            });
        }
    }
    Ok(())
}
