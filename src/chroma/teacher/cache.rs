//! Answers of a network on disk, so that each photo is colored once.

use super::plausible::AB_MOST;
use super::{AbImage, GrayImage, TeacherError};
use crate::{disk, hash::Hasher, input, npy};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Part of every key; counts up when the meaning of an answer changes.
const FORMAT_VERSION: u32 = 3;

/// A folder of answers: `<key>.npy`, f32 `[2, h, w]`, a then b in CIELAB units
/// at the network's own resolution.
pub(super) struct Cache {
    folder: PathBuf,
}

impl Cache {
    /// Creates the folder where it is missing.
    pub fn open(folder: &Path) -> Result<Self, TeacherError> {
        disk::make_folder(folder).map_err(TeacherError::io(folder))?;
        Ok(Self {
            folder: folder.to_path_buf(),
        })
    }

    fn path(&self, key: &str) -> PathBuf {
        self.folder.join(format!("{key}.npy"))
    }

    /// The answer to a key; none where there is none or it is damaged.
    pub fn load(&self, key: &str) -> Option<AbImage> {
        decode(&input::read(&self.path(key)).ok()?)
    }

    /// Keeps an answer. The file appears when it is complete.
    pub fn store(&self, key: &str, image: &AbImage) -> Result<(), TeacherError> {
        let path = self.path(key);
        let stored = || -> io::Result<()> {
            let mut file = disk::create(&path)?;
            file.write_all(&encode(image))?;
            file.persist(&path)
        };
        stored().map_err(TeacherError::io(&path))
    }
}

/// Inputs that determine an answer: the photo, the model and its settings.
#[derive(Clone, Copy)]
pub(super) struct Question<'a> {
    pub photo: GrayImage<'a>,
    /// SHA-256 of the model's file.
    pub model: &'a str,
    /// Device that it ran on: processors round differently.
    pub device: &'a str,
    /// The profile in full.
    pub profile: &'a str,
    /// Width and height of the network's input.
    pub input: [u32; 2],
    /// Hints as the network receives them.
    pub hints: Option<&'a [[f32; 3]]>,
}

/// The key of a question's answer.
pub(super) fn key(question: &Question<'_>) -> String {
    let (photo, [width, height]) = (&question.photo, question.input);
    let mut hash = Hasher::default();
    let asked = format!(
        "gs-chroma teacher answer {FORMAT_VERSION}\n{}\n{}\n{}\n{width}x{height}\n{}x{}\n{}\n",
        question.model,
        question.device,
        question.profile,
        photo.width,
        photo.height,
        question.hints.is_some(),
    );
    hash.update(asked.as_bytes());
    hash.update(photo.pixels);
    for value in question.hints.unwrap_or_default().as_flattened() {
        hash.update(&value.to_le_bytes());
    }
    hash.finish()
}

fn encode(image: &AbImage) -> Vec<u8> {
    let shape = [2, image.height as usize, image.width as usize];
    let planes = (0..2).flat_map(|channel| image.ab.iter().map(move |ab| ab[channel]));
    npy::encode(&shape, planes)
}

/// Reads what [`encode`] writes; anything else is damage.
fn decode(bytes: &[u8]) -> Option<AbImage> {
    let (shape, values) = npy::decode(bytes).ok()?;
    let &[2, height, width] = shape.as_slice() else {
        return None;
    };
    let (a, b) = values.split_at(values.len() / 2);
    let image = AbImage {
        width: u32::try_from(width).ok()?,
        height: u32::try_from(height).ok()?,
        ab: a.iter().zip(b).map(|(&a, &b)| [a, b]).collect(),
    };
    // Not-a-numbers are not.
    let possible = values.iter().all(|value| value.abs() <= AB_MOST);
    (!values.is_empty() && possible).then_some(image)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn image() -> AbImage {
        AbImage {
            width: 3,
            height: 2,
            ab: (0..6).map(|i| [i as f32, -0.5 * i as f32]).collect(),
        }
    }

    #[test]
    fn answers_are_npy_files_that_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::open(&folder.path().join("a/b")).unwrap();
        assert_eq!(cache.load("key"), None);
        cache.store("key", &image()).unwrap();
        assert_eq!(cache.load("key"), Some(image()));
        assert_eq!(cache.load("other"), None);

        let bytes = fs::read(folder.path().join("a/b/key.npy")).unwrap();
        let file = npyz::NpyFile::new(&bytes[..]).unwrap();
        assert_eq!(file.shape(), [2, 2, 3]);
        let values: Vec<f32> = file.into_vec().unwrap();
        assert_eq!(values[..6], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(values[6..], [0.0, -0.5, -1.0, -1.5, -2.0, -2.5]);
    }

    #[test]
    fn damaged_answers_are_no_answers() {
        let good = encode(&image());
        let header = good.len() - 48;
        assert_eq!(decode(&good), Some(image()));
        for length in 0..good.len() {
            assert_eq!(decode(&good[..length]), None, "{length}");
        }
        for position in 0..header {
            let mut bad = good.clone();
            bad[position] ^= 1;
            assert_eq!(decode(&bad), None, "{position}");
        }
        let mut longer = good.clone();
        longer.push(0);
        assert_eq!(decode(&longer), None);
        for impossible in [f32::INFINITY, f32::NAN, -257.0, 1e30] {
            let mut bad = good.clone();
            bad[header..header + 4].copy_from_slice(&impossible.to_le_bytes());
            assert_eq!(decode(&bad), None);
        }
        let lie =
            String::from_utf8_lossy(&good[..header]).replace("2, 3", "4294967295, 4294967295");
        assert_eq!(decode(lie.as_bytes()), None);
    }

    #[test]
    fn keys_change_with_everything_that_matters() {
        let photo = |width, height, pixels| GrayImage {
            width,
            height,
            pixels,
        };
        let base = Question {
            photo: photo(2, 1, &[1, 2]),
            model: "m",
            device: "cpu",
            profile: "p",
            input: [8, 8],
            hints: None,
        };
        let asked = |change: &dyn Fn(&mut Question<'static>)| {
            let mut question = base;
            change(&mut question);
            key(&question)
        };
        let keys = [
            key(&base),
            asked(&|q| q.photo = photo(2, 1, &[1, 3])),
            asked(&|q| q.photo = photo(1, 2, &[1, 2])),
            asked(&|q| q.model = "n"),
            asked(&|q| q.device = "cuda"),
            asked(&|q| q.profile = "q"),
            asked(&|q| q.input = [8, 16]),
            asked(&|q| q.hints = Some(&[[0.0; 3]])),
            asked(&|q| q.hints = Some(&[[1.0; 3]])),
        ];
        for (i, key) in keys.iter().enumerate() {
            assert_eq!(key.len(), 64);
            assert!(!keys[..i].contains(key), "{i}");
        }
        assert_eq!(keys[0], key(&base));
    }
}
