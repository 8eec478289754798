//! Names of photos, and which file of another folder belongs to which photo.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use unicode_normalization::UnicodeNormalization;

use super::{error::AmbiguousNames, options::Rejected, view::View};

/// Extensions of pictures; what follows a dot otherwise is part of a name.
const EXTENSIONS: [&str; 9] = [
    "jpg", "jpeg", "jpe", "png", "tif", "tiff", "bmp", "webp", "dng",
];

/// File extensions of photos.
const PHOTOS: [&str; 5] = ["jpg", "jpeg", "png", "tif", "tiff"];

/// A name without the extension of a picture, if it has one.
pub fn stem(name: &str) -> &str {
    match name.rsplit_once('.') {
        Some((stem, extension))
            if !(stem.is_empty() || stem.ends_with('/')) && is_one_of(extension, &EXTENSIONS) =>
        {
            stem
        }
        _ => name,
    }
}

/// Returns true if an extension is one of these, in letters of either case.
pub(super) fn is_one_of(extension: &str, known: &[&str]) -> bool {
    known
        .iter()
        .any(|known| extension.eq_ignore_ascii_case(known))
}

/// The one spelling of a name: file systems and programs differ in whether an accent is a
/// character of its own. Without `.` between slashes.
pub(super) fn composed(name: &str) -> String {
    let parts = name.split('/').filter(|part| !matches!(*part, "" | "."));
    let parts: Vec<&str> = parts.collect();
    parts.join("/").nfc().collect()
}

/// The order of names in which digits count as numbers, `IMG_2` before `IMG_10`: that in which
/// photos were taken. Of those with the same numbers, the plain order.
pub fn by_number(a: &str, b: &str) -> Ordering {
    let digits = |text: &[u8]| text.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let (mut x, mut y) = (a.as_bytes(), b.as_bytes());
    while let ([p, ..], [q, ..]) = (x, y) {
        let (m, n) = (digits(x), digits(y));
        let order = if m > 0 && n > 0 {
            let number = |run: &[u8]| {
                run.iter()
                    .position(|&digit| digit != b'0')
                    .unwrap_or(run.len())
            };
            let [u, v] = [&x[number(&x[..m])..m], &y[number(&y[..n])..n]];
            (u.len(), u).cmp(&(v.len(), v))
        } else {
            p.cmp(q)
        };
        if order.is_ne() {
            return order;
        }
        (x, y) = (&x[m.max(1)..], &y[n.max(1)..]);
    }
    x.len().cmp(&y.len()).then(a.cmp(b))
}

/// Hands every file below a folder to `found`: its path below the folder, with `/` between
/// parts, and where it lies. A linked folder is not followed, for it may lead in a circle.
///
/// # Errors
/// That of the first folder that cannot be read.
pub fn visit_files(
    folder: &Path,
    found: &mut dyn FnMut(String, PathBuf),
) -> Result<(), (PathBuf, std::io::Error)> {
    let mut folders = vec![(folder.to_path_buf(), String::new())];
    while let Some((current, below)) = folders.pop() {
        let failed = |error| (current.clone(), error);
        for entry in fs::read_dir(&current).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let path = entry.path();
            let name = format!("{below}{}", entry.file_name().to_string_lossy());
            let kind = entry.file_type().map_err(|error| (path.clone(), error))?;
            if kind.is_dir() {
                folders.push((path, name + "/"));
            } else if path.is_file() {
                found(name, path);
            }
        }
    }
    Ok(())
}

/// The paths of photos below `images/`, as far as it can be read.
pub fn photos_in(images: &Path) -> Vec<String> {
    let mut photos = Vec::new();
    let _ = visit_files(images, &mut |name, path| {
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        if is_one_of(&extension, &PHOTOS) {
            photos.push(name);
        }
    });
    photos
}

/// Every name that a file for a photo or a view of a capture may go by.
pub fn known<'a>(views: &'a [View], rejected: &'a [Rejected]) -> impl Iterator<Item = &'a str> {
    let of_views = |view: &'a View| [view.photo.as_str(), view.name.as_str()];
    let rejected = rejected.iter().map(|photo| photo.name.as_str());
    views.iter().flat_map(of_views).chain(rejected)
}

/// Finds photos whose names are spelled otherwise on the disk than in the model.
pub(super) fn find_spelled(views: &mut [View], images: &Path) {
    if views.iter().all(|view| view.image_path.is_file()) {
        return;
    }
    let mut paths = BTreeMap::new();
    // What is not found is told where photos are missed.
    let _ = visit_files(images, &mut |name, path| {
        paths.entry(composed(&name)).or_insert(path);
    });
    for view in views.iter_mut().filter(|view| !view.image_path.is_file()) {
        if let Some(path) = paths.get(&composed(&view.photo)) {
            view.image_path.clone_from(path);
        }
    }
}

/// Pictures in a folder that belong to photos by their names: a picture to the photo of the
/// same path, with the extension of a picture behind it or without, and else to the only photo
/// of the same path but for the extension.
#[derive(Clone, Debug, Default)]
pub struct NamedFiles {
    /// Paths of the files, by their paths below the folder.
    files: BTreeMap<String, PathBuf>,
    /// Files by their path without extension.
    files_of: BTreeMap<String, Vec<String>>,
    photos: BTreeSet<String>,
    /// Photos by their path without extension.
    photos_of: BTreeMap<String, Vec<String>>,
}

impl NamedFiles {
    /// Adds a file by its path below the folder.
    pub fn insert(&mut self, name: &str, path: PathBuf) {
        let name = composed(name);
        let of_stem = self.files_of.entry(stem(&name).to_owned()).or_default();
        of_stem.push(name.clone());
        self.files.insert(name, path);
    }

    /// Returns true if there are no files.
    pub fn is_empty(&self) -> bool {
        self.files.is_empty()
    }

    /// Says which photos there are, so that a file of one is not taken for another's.
    pub fn know<'a>(&mut self, photos: impl IntoIterator<Item = &'a str>) {
        for photo in photos.into_iter().map(composed) {
            if !self.photos.contains(&photo) {
                let of_stem = self.photos_of.entry(stem(&photo).to_owned()).or_default();
                of_stem.push(photo.clone());
                self.photos.insert(photo);
            }
        }
    }

    /// The file that belongs to a photo, if there is one.
    pub fn of(&self, photo: &str) -> Result<Option<&Path>, AmbiguousNames> {
        let photo = composed(photo);
        let found = match self.exact(&photo)? {
            Some(file) => Some(file),
            None => self.by_stem(&photo)?,
        };
        Ok(found.map(|file| self.files[file].as_path()))
    }

    /// Files that belong to none of the known photos, sorted.
    pub fn strays(&self) -> Vec<&str> {
        let used: BTreeSet<&Path> = (self.photos.iter())
            .filter_map(|photo| self.of(photo).ok().flatten())
            .collect();
        (self.files.iter())
            .filter(|(_, path)| !used.contains(path.as_path()))
            .map(|(name, _)| name.as_str())
            .collect()
    }

    /// The file with the photo's full name, with or without an extension behind it.
    fn exact(&self, photo: &str) -> Result<Option<&str>, AmbiguousNames> {
        let with_extension = self.files_of.get(photo).into_iter().flatten();
        let with_extension = with_extension
            .map(String::as_str)
            .filter(|file| *file != photo && !self.photos.contains(*file));
        let same = self.files.get_key_value(photo);
        Ok(self
            .only(with_extension)?
            .or(same.map(|(file, _)| file.as_str())))
    }

    fn by_stem(&self, photo: &str) -> Result<Option<&str>, AmbiguousNames> {
        let stem_of_photo = stem(photo);
        let free = self.files_of.get(stem_of_photo).into_iter().flatten();
        let free = free
            .map(String::as_str)
            .filter(|file| !(self.photos.contains(*file) || self.photos.contains(stem(file))));
        let Some(file) = self.only(free)? else {
            return Ok(None);
        };
        let rivals = self.photos_of.get(stem_of_photo).into_iter().flatten();
        let mut rivals =
            rivals.filter(|rival| *rival != photo && !matches!(self.exact(rival), Ok(Some(_))));
        match rivals.next() {
            Some(rival) => {
                let mut photos = [photo.to_owned(), rival.clone()];
                photos.sort();
                Err(AmbiguousNames::Photos(self.files[file].clone(), photos))
            }
            None => Ok(Some(file)),
        }
    }

    /// The only one of some files.
    fn only<'a>(
        &self,
        mut files: impl Iterator<Item = &'a str>,
    ) -> Result<Option<&'a str>, AmbiguousNames> {
        match (files.next(), files.next()) {
            (Some(first), Some(second)) => {
                let mut both = [first, second].map(|file| self.files[file].clone());
                both.sort();
                Err(AmbiguousNames::Files(both))
            }
            (first, _) => Ok(first),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(files: &[&str], photos: &[&str]) -> NamedFiles {
        let mut named = NamedFiles::default();
        for file in files {
            named.insert(file, PathBuf::from(file));
        }
        named.know(photos.iter().copied());
        named
    }

    fn found(files: &[&str], photos: &[&str]) -> Vec<Option<String>> {
        let named = named(files, photos);
        let of = |photo: &&str| {
            let path = named.of(photo).expect("clear");
            path.map(|path| path.to_string_lossy().into_owned())
        };
        photos.iter().map(of).collect()
    }

    #[test]
    fn only_extensions_of_pictures_are_no_part_of_a_name() {
        for (name, expected) in [
            ("a/b.jpg", "a/b"),
            ("a.b.TIFF", "a.b"),
            ("frame_2.4", "frame_2.4"),
            ("x.y/a", "x.y/a"),
            ("a/.png", "a/.png"),
            (".png", ".png"),
            ("", ""),
        ] {
            assert_eq!(stem(name), expected);
        }
    }

    #[test]
    fn digits_count_as_numbers() {
        let long = format!("a{}", "9".repeat(60));
        let sorted = [
            "IMG_1.png",
            "IMG_002.png",
            "IMG_2.png",
            "IMG_10.png",
            "IMG_10b.png",
            "a9/2",
            "a10/1",
            &long,
            "b",
            "b0",
            "bc",
        ];
        for (i, a) in sorted.iter().enumerate() {
            for (j, b) in sorted.iter().enumerate() {
                assert_eq!(by_number(a, b), i.cmp(&j), "{a} {b}");
            }
        }
    }

    #[test]
    fn the_full_name_goes_before_the_stem() {
        let photos = [
            "shot0.jpg",
            "shot0.png",
            "one.tif",
            "frame_2.4",
            "frame_2.5",
        ];
        let files = ["shot0.png", "one.jpg", "frame_2.4.png"];
        let some = |name: &str| Some(name.to_owned());
        let expected = [None, some(files[0]), some(files[1]), some(files[2]), None];
        assert_eq!(found(&files, &photos), expected);
        // As COLMAP names masks, and as photos are named.
        assert_eq!(
            found(&["a.jpg.png", "a.png"], &["a.jpg"]),
            [some("a.jpg.png")]
        );
        let same = ["a.jpg", "a.png", "a.jpg.png"];
        assert_eq!(found(&same, &same), same.map(some));
    }

    #[test]
    fn what_could_belong_to_two_is_ambiguous() {
        let two = ["a/b.jpg", "a/b.tif"];
        let file = named(&["a/b.png"], &two);
        let expected = AmbiguousNames::Photos("a/b.png".into(), two.map(str::to_owned));
        for photo in two {
            assert_eq!(file.of(photo), Err(expected.clone()));
        }
        // What one of them has for itself leaves the other.
        let both = found(&["a/b.png", "a/b.tif"], &two);
        assert_eq!(both, ["a/b.png", "a/b.tif"].map(|name| Some(name.into())));
        let files = named(&["v.png", "v.jpeg"], &["v.jpg"]);
        let expected = AmbiguousNames::Files(["v.jpeg".into(), "v.png".into()]);
        assert_eq!(files.of("v.jpg"), Err(expected));
    }

    #[test]
    fn accents_may_be_characters_of_their_own() {
        let photo = "Gr\u{f6}\u{df}e.jpg";
        let files = named(&["Gro\u{308}\u{df}e.png"], &[photo]);
        assert!(files.of(photo).expect("clear").is_some());
        assert_eq!(files.strays(), [""; 0]);
    }

    #[test]
    fn strays_belong_to_no_photo() {
        let files = named(&["a.jpg.png", "b_mask.png", "c.png"], &["a.jpg", "b.jpg"]);
        assert_eq!(files.strays(), ["b_mask.png", "c.png"]);
    }
}
