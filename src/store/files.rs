//! Files that are whole or not there.

use std::{
    fs,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use image::RgbImage;

use super::{
    codec::Codec,
    formats::{self, FrameFacts},
};
use crate::{
    disk::{self, folder_of, trust},
    frames::Colored,
    input,
    splats::Format,
    store::StoreError,
};

/// Turns a system error into one that names the path.
pub(crate) fn at(path: &Path) -> impl FnOnce(std::io::Error) -> StoreError {
    let path = path.to_owned();
    move |error| StoreError::file(&path, error.to_string())
}

/// Writes beside and renames.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    write_by(path, |to| to.write_all(bytes))
}

/// Lets `fill` write beside, and renames what is on the disk.
pub(crate) fn write_by<T>(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<T>,
) -> Result<T, StoreError> {
    let filled = || {
        let mut file = disk::create(path)?;
        let mut to = BufWriter::new(&mut file);
        let made = fill(&mut to)?;
        to.flush()?;
        drop(to);
        file.persist(path)?;
        Ok(made)
    };
    filled().map_err(at(path))
}

/// Writes a PNG beside and renames.
pub(crate) fn write_png(path: &Path, image: &RgbImage) -> Result<(), StoreError> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, image::ImageFormat::Png)
        .map_err(|error| StoreError::file(path, error.to_string()))?;
    write(path, &formats::marked(bytes.into_inner()))
}

/// Writes a photo in color beside and renames: a PNG of its depth with the photo's EXIF, or what the
/// codec has.
pub(crate) fn write_colored(
    path: &Path,
    colored: Colored,
    codec: Codec,
    facts: FrameFacts,
) -> Result<(), StoreError> {
    let bytes = formats::encode(colored, codec, facts);
    write(
        path,
        &bytes.map_err(|reason| StoreError::file(path, reason))?,
    )
}

/// Files that systems put into folders by themselves.
pub(crate) const OF_SYSTEMS: [&str; 3] = [".DS_Store", "Thumbs.db", "desktop.ini"];

/// Makes a folder for pictures, see [`make_folder`]. It may hold earlier ones of this program.
///
/// # Errors
/// [`StoreError::File`] where it holds anything else, which pictures would be mixed with or
/// replace.
pub(crate) fn make_pictures_folder(path: &Path) -> Result<(), StoreError> {
    make_folder(path)?;
    if let Some(other) = other_file(path) {
        return Err(not_empty(path, &other));
    }
    disk::remove_drafts(path, None);
    Ok(())
}

/// A file in a folder or below it that this program has not made as a picture.
fn other_file(folder: &Path) -> Option<PathBuf> {
    let mut folders = vec![folder.to_owned()];
    while let Some(current) = folders.pop() {
        for entry in fs::read_dir(&current).into_iter().flatten().flatten() {
            let (path, name) = (entry.path(), entry.file_name());
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                folders.push(path);
            } else if !(OF_SYSTEMS.iter().any(|known| name == *known)
                || disk::is_draft(&name.to_string_lossy(), None)
                || formats::is_ours(&path))
            {
                return Some(path);
            }
        }
    }
    None
}

/// Makes a folder for files of several kinds, see [`make_folder`]. It is new or empty but for what
/// `may` be there before; or this program has begun it, which `begun` tell: names of its files.
///
/// # Errors
/// [`StoreError::File`] where it holds something else.
pub(crate) fn make_own_folder(path: &Path, begun: &[&str], may: &[&str]) -> Result<(), StoreError> {
    make_folder(path)?;
    let entries = fs::read_dir(path).into_iter().flatten().flatten();
    let names: Vec<String> = entries
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    let is_known = |name: &&String| {
        name.starts_with('.') || may.contains(&&***name) || OF_SYSTEMS.contains(&&***name)
    };
    match names.iter().find(|name| !is_known(name)) {
        Some(other) if !names.iter().any(|name| begun.contains(&&**name)) => {
            Err(not_empty(path, &path.join(other)))
        }
        _ => Ok(()),
    }
}

fn not_empty(folder: &Path, other: &Path) -> StoreError {
    StoreError::file(
        folder,
        format!(
            "holds files that this command did not write, such as {}; name a new or an empty folder with -o",
            other.strip_prefix(folder).unwrap_or(other).display()
        ),
    )
}

/// Makes a folder and those above it, and tries whether it can be written to:
/// better now than after hours of work.
pub(crate) fn make_folder(path: &Path) -> Result<(), StoreError> {
    let refused = |reason: String| StoreError::file(path, reason);
    if path.is_file() {
        return Err(refused("is a file; name a folder".to_owned()));
    }
    disk::make_folder(path).map_err(at(path))?;
    match disk::try_folder(path) {
        Ok(()) => Ok(()),
        Err(error) => Err(refused(format!(
            "cannot be written to ({error}); choose another folder with -o"
        ))),
    }
}

fn no_folder(path: &Path) -> Result<(), StoreError> {
    if path.is_dir() {
        return Err(StoreError::file(
            path,
            "is a folder; name a file such as scene.ply",
        ));
    }
    Ok(())
}

/// The format that a splat file's name tells, where no folder has this name.
pub(crate) fn format_of(path: &Path) -> Result<Format, StoreError> {
    no_folder(path)?;
    check_no_original(path)?;
    Ok(Format::to_write(path)?)
}

/// Makes the folder that a file will be written to, see [`make_folder`].
pub(crate) fn make_folder_of(path: &Path) -> Result<(), StoreError> {
    no_folder(path)?;
    check_no_original(path)?;
    make_folder(folder_of(path))?;
    disk::remove_drafts(folder_of(path), Some(path));
    Ok(())
}

/// Refuses a file for a command's output that is one of its originals.
pub(crate) fn check_no_original(path: &Path) -> Result<(), StoreError> {
    trust::check_no_original(path).map_err(at(path))
}

/// File that marks a folder as a replaceable page.
pub(crate) const PAGE: &str = "index.html";

/// Refuses a folder that `eval` would not replace.
pub(crate) fn check_page(folder: &Path) -> Result<(), StoreError> {
    if folder.exists() && !folder.join(PAGE).is_file() {
        return Err(StoreError::file(
            folder,
            format!("is in the way: no page ({PAGE} is missing); move it elsewhere"),
        ));
    }
    Ok(())
}

/// The largest resident memory of this process so far, in bytes.
pub(crate) fn peak_host_memory() -> Option<u64> {
    Some(input::kib(Path::new("/proc/self/status"), "VmHWM:")? * 1024)
}
