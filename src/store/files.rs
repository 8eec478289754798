//! Files that are whole or not there.

use std::{
    fs,
    io::{self, BufWriter, Read, Write},
    path::{Path, PathBuf},
};

use image::{DynamicImage, ImageBuffer, ImageEncoder, RgbImage, codecs::png::PngEncoder};

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
    write(path, &marked(bytes.into_inner()))
}

/// Writes a photo in color as a PNG of its depth with the photo's EXIF, beside and renamed.
pub(crate) fn write_colored(path: &Path, mut colored: Colored) -> Result<(), StoreError> {
    let [width, height] = [colored.width, colored.height];
    let failed = |reason: String| StoreError::file(path, reason);
    let exif = colored.exif.take();
    let image = match colored.deep {
        true => ImageBuffer::from_raw(width, height, colored.rgb.into_flattened())
            .map(DynamicImage::ImageRgb16),
        false => RgbImage::from_raw(width, height, colored.bytes()).map(DynamicImage::ImageRgb8),
    };
    let image = image.ok_or_else(|| failed("its pixels do not fill it".to_owned()))?;
    let mut bytes = Vec::new();
    let mut encoder = PngEncoder::new(&mut bytes);
    let kept = exif.map_or(Ok(()), |exif| encoder.set_exif_metadata(exif));
    kept.map_err(|error| failed(error.to_string()))?;
    let written = image.write_with_encoder(encoder);
    written.map_err(|error| failed(error.to_string()))?;
    write(path, &marked(bytes))
}

/// PNG: the signature and the header, which come before all else.
const PNG_HEADER: usize = 8 + 25;

/// PNG's keyword for the program that made a picture, and its value, as text chunks have them.
const MADE_HERE: &[u8] = b"tEXtSoftware\0gs-chroma";

/// A PNG that says which program made it.
fn marked(mut png: Vec<u8>) -> Vec<u8> {
    let length = (MADE_HERE.len() - 4) as u32;
    let mut sum = flate2::Crc::new();
    sum.update(MADE_HERE);
    let chunk = [
        &length.to_be_bytes()[..],
        MADE_HERE,
        &sum.sum().to_be_bytes(),
    ]
    .concat();
    png.splice(PNG_HEADER..PNG_HEADER, chunk);
    png
}

/// True if this program made the picture.
fn is_ours(path: &Path) -> bool {
    let mut begin = [0; PNG_HEADER + 4 + MADE_HERE.len()];
    let read = input::open(path).and_then(|mut file| file.read_exact(&mut begin));
    read.is_ok() && begin.ends_with(MADE_HERE)
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
                || is_ours(&path))
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
