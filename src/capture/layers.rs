//! Parts of photos that show something other than the trained scene.

use std::{
    io,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use super::CaptureError;
use crate::disk::Scratch;

/// Steps of a gray level in which pictures are kept: those of up to twice white fit into 16 bits.
const STEPS: f32 = 64.0;

/// A picture for each of some views, to be taken off its photo: what is left is what the rest of
/// the scene shows. They are kept on disk, for photos are many.
#[derive(Debug)]
pub struct Layers {
    folder: PathBuf,
    file: Mutex<Scratch>,
    /// Offset of each view's image in the file, in bytes.
    places: Vec<Option<u64>>,
}

impl Layers {
    /// None yet, for so many views; their file will be in `folder`.
    ///
    /// # Errors
    /// [`CaptureError::Write`].
    pub fn new(folder: &Path, views: usize) -> Result<Self, CaptureError> {
        let file = Scratch::new(folder).map_err(unwritten(folder))?;
        Ok(Self {
            folder: folder.to_owned(),
            file: Mutex::new(file),
            places: vec![None; views],
        })
    }

    /// Keeps a view's picture: luma, 1 is white, `[height, width]`.
    ///
    /// # Errors
    /// [`CaptureError::Write`].
    pub fn put(&mut self, view: usize, picture: &[f32]) -> Result<(), CaptureError> {
        let steps = |luma: &f32| ((luma * 255.0 * STEPS).round() as i16).to_le_bytes();
        let bytes: Vec<u8> = picture.iter().flat_map(steps).collect();
        let file = self.file.get_mut().unwrap_or_else(PoisonError::into_inner);
        let place = file.append(&bytes).map_err(unwritten(&self.folder))?;
        self.places[view] = Some(place);
        Ok(())
    }

    /// Takes a view's picture off its photo, which has as many pixels.
    pub(super) fn take_off(&self, view: usize, gray: &mut [u8]) -> Result<(), CaptureError> {
        let Some(place) = self.places[view] else {
            return Ok(());
        };
        let mut bytes = vec![0; 2 * gray.len()];
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let read = file.read_at(place, &mut bytes);
        drop(file);
        read.map_err(CaptureError::read(&self.folder))?;
        for (gray, bytes) in gray.iter_mut().zip(bytes.as_chunks::<2>().0) {
            let level = f32::from(i16::from_le_bytes(*bytes)) / STEPS;
            *gray = (f32::from(*gray) - level).round() as u8;
        }
        Ok(())
    }
}

fn unwritten(path: &Path) -> impl Fn(io::Error) -> CaptureError {
    |source| CaptureError::Write {
        path: path.to_owned(),
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_put_is_taken_off() {
        let folder = tempfile::tempdir().unwrap();
        let mut layers = Layers::new(folder.path(), 3).unwrap();
        layers.put(2, &[0.1, 0.0, 1.5]).unwrap();
        layers.put(0, &[-0.2, 0.4, 2.5 / 255.0]).unwrap();
        let left = |view, mut photo: [u8; 3]| {
            layers.take_off(view, &mut photo).unwrap();
            photo
        };
        assert_eq!(left(0, [100, 100, 100]), [151, 0, 98]);
        assert_eq!(left(1, [1, 2, 3]), [1, 2, 3]);
        assert_eq!(left(2, [100, 250, 255]), [75, 250, 0]);
        assert_eq!(left(0, [250, 250, 0]), [255, 148, 0]);
    }
}
