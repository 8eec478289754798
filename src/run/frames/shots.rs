//! All photos of a capture in order, with a pose or without.

use std::{collections::BTreeMap, ops::Range, path::PathBuf};

use crate::{
    capture::{CaptureError, Dataset, FRAMES, Film, names::by_number},
    run::RunError,
    store::distinct,
};

/// A photo.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Shot {
    /// Its place among all.
    pub index: usize,
    /// Its path below the folder of photos, or of frames.
    pub name: String,
    /// Its file.
    pub path: PathBuf,
    /// Its views; none where it has no pose.
    pub views: Range<usize>,
    /// The path of its picture in color below a folder.
    pub output: String,
    /// Number of the film's frames that show it.
    pub repeats: usize,
}

/// The frames of the film, or else all photos by name, numbers in order. A film has `rate` frames
/// a second.
///
/// # Errors
/// [`StoreError::File`] where a frame is missing.
pub(super) fn shots_of(
    dataset: &Dataset,
    film: Option<&Film>,
    rate: [u32; 2],
) -> Result<Vec<Shot>, RunError> {
    let root = &dataset.capture.root;
    let mut views = BTreeMap::<&str, Range<usize>>::new();
    for (i, view) in dataset.capture.views.iter().enumerate() {
        let range = views.entry(&view.photo).or_insert(i..i);
        range.end = i + 1;
    }
    let (folder, names) = match film {
        Some(film) => (root.join(FRAMES), film.frames.clone()),
        None => {
            let mut names = dataset.capture.all_photos();
            names.extend(views.keys().map(|&name| name.to_owned()));
            names.sort_by(|a, b| by_number(a, b));
            names.dedup();
            (dataset.capture.photos.clone(), names)
        }
    };
    let plain: Vec<&str> = names.iter().map(String::as_str).collect();
    let outputs = distinct(&plain);
    let repeats = film.map_or_else(|| vec![1; names.len()], |film| film.repeats(rate));
    (names.iter().zip(outputs).zip(repeats).enumerate())
        .map(|(index, ((name, output), repeats))| {
            let range = views.get(name.as_str()).cloned().unwrap_or_default();
            // A name may be spelled otherwise on the disk.
            let path = match dataset.capture.views.get(range.start) {
                Some(view) if !range.is_empty() => view.image_path.clone(),
                _ => folder.join(name),
            };
            if film.is_some() && !path.is_file() {
                return Err(CaptureError::Read {
                    path,
                    source: std::io::ErrorKind::NotFound.into(),
                }
                .into());
            }
            Ok(Shot {
                index,
                name: name.clone(),
                path,
                views: range,
                output,
                repeats,
            })
        })
        .collect()
}
