//! The photos that COLMAP and `fit` will see: names, sizes and what is wrong with them.

use std::{
    collections::{BTreeMap, BTreeSet},
    io,
    path::{Path, PathBuf},
};

use image::{ExtendedColorType, ImageEncoder, codecs::jpeg::JpegEncoder, codecs::png::PngEncoder};
use tiff::encoder::{TiffEncoder, colortype::Gray8};

use super::PrepareError;
use crate::{
    capture::{
        CaptureError, Depth, Header, Normalize, in_order, names::visit_files, percentiles,
        photo_header, plain_photo, plain_values,
    },
    disk,
    store::files,
};

/// Values sampled per photo to find the range of all.
const SAMPLED: usize = 4096;

/// Photos whose values fill less of the scale than this are stretched for COLMAP, which looks at
/// 8 bits.
const FULL_ENOUGH: f64 = 0.5;

/// Quality of JPEG files for COLMAP, of 100.
const QUALITY: u8 = 95;

/// Photos in a folder.
pub(super) struct Photos {
    /// By name below the folder, with `/` between parts.
    pub headers: BTreeMap<String, Header>,
    /// Files that are no photos, and why.
    pub others: Vec<(String, String)>,
}

impl Photos {
    /// Looks at all files below a folder.
    ///
    /// # Errors
    /// If a folder cannot be read.
    pub fn of(folder: &Path) -> Result<Self, PrepareError> {
        let mut found = BTreeMap::new();
        visit_files(folder, &mut |name, path| {
            found.insert(name, path);
        })
        .map_err(|(path, error)| files::at(&path)(error))?;
        let (mut headers, mut others) = (BTreeMap::new(), Vec::new());
        for (name, path) in found {
            if hidden(&name) {
                continue;
            }
            // A name with what is no UTF-8 is not the path's.
            match photo_header(&path) {
                Ok(header) if folder.join(&name).is_file() => {
                    headers.insert(name, header);
                }
                Ok(_) => others.push((name, "its name is no UTF-8; rename it".to_owned())),
                Err(error) => others.push((name, reason(&error))),
            }
        }
        Ok(Self { headers, others })
    }

    /// Names of folders with photos and the sizes of these.
    pub fn folders(&self) -> BTreeMap<&str, BTreeSet<[u32; 2]>> {
        let mut folders: BTreeMap<&str, BTreeSet<[u32; 2]>> = BTreeMap::new();
        for (name, header) in &self.headers {
            let folder = name.rsplit_once('/').map_or("", |(folder, _)| folder);
            folders.entry(folder).or_default().insert(header.size);
        }
        folders
    }

    /// Range of values to stretch for COLMAP, `[black, white]` as shares of white; `None` if it can
    /// read the photos themselves.
    ///
    /// # Errors
    /// If a photo cannot be read.
    pub fn stretch(&self, folder: &Path) -> Result<Option<[f64; 2]>, PrepareError> {
        let paths: Vec<PathBuf> = self.headers.keys().map(|name| folder.join(name)).collect();
        let mut all = Vec::new();
        in_order(
            &paths,
            |path| plain_values(path, SAMPLED),
            |_, values| {
                all.extend(values?);
                Ok::<_, CaptureError>(())
            },
        )?;
        let deep = self
            .headers
            .values()
            .any(|header| header.depth > Depth::Eight);
        let range = percentiles(&mut all);
        Ok(match deep {
            true => Some(range.unwrap_or([0.0, 1.0])),
            false => range.filter(|[low, high]| high - low < FULL_ENOUGH),
        })
    }
}

/// Returns true if a file or one of its folders is hidden, such as files that operating systems
/// add.
fn hidden(name: &str) -> bool {
    name.split('/').any(|part| part.starts_with('.')) || name.ends_with("Thumbs.db")
}

/// Reason of an error, without the file's path.
fn reason(error: &CaptureError) -> String {
    match error {
        CaptureError::Photo { reason, .. } => reason.clone(),
        CaptureError::Read { source, .. } => source.to_string(),
        other => other.to_string(),
    }
}

/// Links or copies photos to a folder, under their names.
///
/// # Errors
/// The system's.
pub(super) fn link_all<'a>(
    names: impl IntoIterator<Item = &'a str>,
    from: &Path,
    to: &Path,
) -> Result<(), PrepareError> {
    for name in names {
        let path = to.join(name);
        disk::make_folder(disk::folder_of(&path))
            .and_then(|()| disk::link(&from.join(name), &path))
            .map_err(files::at(&from.join(name)))?;
    }
    Ok(())
}

/// Writes gray copies of 8 bits of photos, these shares of white being black and white, under
/// their names and in their formats.
///
/// # Errors
/// If a photo cannot be read, and the system's.
pub(super) fn stretch_all(
    photos: &Photos,
    from: &Path,
    to: &Path,
    [low, high]: [f64; 2],
    told: &mut dyn FnMut(usize),
) -> Result<(), PrepareError> {
    let names: Vec<(&String, &Header)> = photos.headers.iter().collect();
    let mut done = 0;
    in_order(
        &names,
        |(name, header)| {
            let white = header.depth.white();
            let range = Normalize::Range([low * white, high * white]);
            plain_photo(&from.join(name), range)
        },
        |(name, _), photo| {
            let photo = photo?;
            let path = to.join(name);
            let size = [photo.width, photo.height];
            let bytes = encoded(name, size, &photo.gray).map_err(files::at(&path))?;
            disk::make_folder(disk::folder_of(&path)).map_err(files::at(&path))?;
            files::write(&path, &bytes)?;
            done += 1;
            told(done);
            Ok::<_, PrepareError>(())
        },
    )
}

/// A gray picture in the format that its name says: COLMAP goes by that.
fn encoded(name: &str, [width, height]: [u32; 2], gray: &[u8]) -> io::Result<Vec<u8>> {
    let extension = name
        .rsplit('.')
        .next()
        .unwrap_or_default()
        .to_ascii_lowercase();
    let mut bytes = io::Cursor::new(Vec::new());
    match extension.as_str() {
        "jpg" | "jpeg" => JpegEncoder::new_with_quality(&mut bytes, QUALITY)
            .write_image(gray, width, height, ExtendedColorType::L8)
            .map_err(io::Error::other)?,
        "tif" | "tiff" => TiffEncoder::new(&mut bytes)
            .and_then(|mut file| file.write_image::<Gray8>(width, height, gray))
            .map_err(io::Error::other)?,
        _ => return png(gray, [width, height]),
    }
    Ok(bytes.into_inner())
}

/// A gray PNG.
///
/// # Errors
/// The encoder's.
pub(super) fn png(gray: &[u8], [width, height]: [u32; 2]) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(gray, width, height, ExtendedColorType::L8)
        .map_err(io::Error::other)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(files: &[(&str, Vec<u8>)]) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        for (name, bytes) in files {
            let path = dir.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, bytes).unwrap();
        }
        dir
    }

    #[test]
    fn photos_are_told_from_other_files() {
        let photo = |side: usize| png(&vec![9; side * 4], [side as u32, 4]).unwrap();
        let dir = folder(&[
            ("b.png", photo(8)),
            ("left/a.png", photo(6)),
            ("left/b.PNG", photo(6)),
            (".hidden/c.png", photo(8)),
            (".DS_Store", vec![1]),
            ("notes.txt", b"notes".to_vec()),
        ]);
        let photos = Photos::of(dir.path()).unwrap();
        let names: Vec<&str> = photos.headers.keys().map(String::as_str).collect();
        assert_eq!(names, ["b.png", "left/a.png", "left/b.PNG"]);
        let others: Vec<&str> = photos.others.iter().map(|(name, _)| &**name).collect();
        assert_eq!(others, ["notes.txt"]);
        let folders = photos.folders();
        assert_eq!(folders[""], BTreeSet::from([[8, 4]]));
        assert_eq!(folders["left"], BTreeSet::from([[6, 4]]));
    }

    #[test]
    fn dark_and_deep_photos_are_stretched() {
        let ramp = |most: usize| {
            png(
                &(0..400).map(|i| (i % most) as u8).collect::<Vec<_>>(),
                [20, 20],
            )
            .unwrap()
        };
        let dir = folder(&[("a.png", ramp(250))]);
        let photos = Photos::of(dir.path()).unwrap();
        assert_eq!(photos.stretch(dir.path()).unwrap(), None);

        let to = tempfile::tempdir().unwrap();
        for name in ["dark.png", "dark.jpg", "dark.tif"] {
            let gray: Vec<u8> = (0..400).map(|i| (i / 4) as u8).collect();
            let dir = folder(&[(name, encoded(name, [20, 20], &gray).unwrap())]);
            let photos = Photos::of(dir.path()).unwrap();
            let range = photos.stretch(dir.path()).unwrap().expect("dark");
            assert!(
                range[0] < 0.02 && (0.35..0.42).contains(&range[1]),
                "{range:?}"
            );
            stretch_all(&photos, dir.path(), to.path(), range, &mut |_| {}).unwrap();
            let bright = plain_photo(&to.path().join(name), Normalize::Off).unwrap();
            let [least, most] = [bright.gray.iter().min(), bright.gray.iter().max()];
            assert!(*least.unwrap() < 8 && *most.unwrap() > 247, "{name}");
        }
        // 16 bits that fill their range have to become 8 all the same.
        let deep =
            image::ImageBuffer::from_fn(20, 20, |x, y| image::Luma([((x + 20 * y) * 160) as u16]));
        let dir = tempfile::tempdir().unwrap();
        deep.save(dir.path().join("deep.png")).unwrap();
        let photos = Photos::of(dir.path()).unwrap();
        let [low, high] = photos.stretch(dir.path()).unwrap().expect("16 bits");
        assert!(low < 0.02 && (0.9..0.99).contains(&high), "{low} {high}");
    }
}
