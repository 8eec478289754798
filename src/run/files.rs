//! Files that are whole or not there.

use std::{
    io::{self, BufWriter, Write},
    path::Path,
};

use image::{DynamicImage, ImageBuffer, RgbImage};

use super::RunError;
use crate::{
    disk::{self, folder_of},
    frames::Colored,
    input,
    splats::Format,
};

/// Turns a system error into one that names the path.
pub(crate) fn at(path: &Path) -> impl FnOnce(std::io::Error) -> RunError {
    let path = path.to_owned();
    move |error| RunError::File {
        path,
        reason: error.to_string(),
    }
}

/// Writes beside and renames.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), RunError> {
    write_by(path, |to| to.write_all(bytes))
}

/// Lets `fill` write beside, and renames what is on the disk.
pub(super) fn write_by<T>(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<T>,
) -> Result<T, RunError> {
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
pub(super) fn write_png(path: &Path, image: &RgbImage) -> Result<(), RunError> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, image::ImageFormat::Png)
        .map_err(|error| RunError::File {
            path: path.to_owned(),
            reason: error.to_string(),
        })?;
    write(path, bytes.get_ref())
}

/// Writes a photo in color as a PNG of its depth, beside and renamed.
pub(super) fn write_colored(path: &Path, colored: Colored) -> Result<(), RunError> {
    let [width, height] = [colored.width, colored.height];
    let failed = |reason: String| RunError::File {
        path: path.to_owned(),
        reason,
    };
    let image = match colored.deep {
        true => ImageBuffer::from_raw(width, height, colored.rgb.into_flattened())
            .map(DynamicImage::ImageRgb16),
        false => RgbImage::from_raw(width, height, colored.bytes()).map(DynamicImage::ImageRgb8),
    };
    let image = image.ok_or_else(|| failed("its pixels do not fill it".to_owned()))?;
    let mut bytes = std::io::Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, image::ImageFormat::Png)
        .map_err(|error| failed(error.to_string()))?;
    write(path, bytes.get_ref())
}

/// Makes a folder and those above it, and tries whether it can be written to:
/// better now than after hours of work.
pub(crate) fn make_folder(path: &Path) -> Result<(), RunError> {
    let refused = |reason: String| RunError::File {
        path: path.to_owned(),
        reason,
    };
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

fn no_folder(path: &Path) -> Result<(), RunError> {
    if path.is_dir() {
        return Err(RunError::File {
            path: path.to_owned(),
            reason: "is a folder; name a file such as scene.ply".to_owned(),
        });
    }
    Ok(())
}

/// The format that a splat file's name tells, where no folder has this name.
pub(super) fn format_of(path: &Path) -> Result<Format, RunError> {
    no_folder(path)?;
    Ok(Format::to_write(path)?)
}

/// Makes the folder that a file will be written to, see [`make_folder`].
pub(crate) fn make_folder_of(path: &Path) -> Result<(), RunError> {
    no_folder(path)?;
    make_folder(folder_of(path))
}

/// What makes a folder a page that may be replaced.
pub(crate) const PAGE: &str = "index.html";

/// Refuses a folder that `eval` would not replace.
pub(super) fn check_page(folder: &Path) -> Result<(), RunError> {
    if folder.exists() && !folder.join(PAGE).is_file() {
        return Err(RunError::File {
            path: folder.to_owned(),
            reason: format!("is in the way: no page ({PAGE} is missing); move it elsewhere"),
        });
    }
    Ok(())
}

/// The largest resident memory of this process so far, in bytes.
pub(super) fn peak_host_memory() -> Option<u64> {
    let status = input::read_to_string(Path::new("/proc/self/status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}
