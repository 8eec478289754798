//! Photos in color as the page shows them: at the size of their layers, upright.

use std::sync::{Arc, Mutex, PoisonError};

use image::ExtendedColorType;

use super::{layer::encoded, scene::PaintScene};
use crate::{
    capture::Original,
    frames::{Canvas, SceneDrawer, Strokes, WeightedColors, blend, finish},
    run::RunError,
    splats::ShField,
    store::StoreError,
};

/// Photos that are kept decoded, those looked at last.
const KEPT: usize = 6;

/// A photo at working size, and the teachers' a and b on it.
struct Prepared {
    canvas: Canvas,
    small: Original,
    taught: Option<Vec<[f32; 2]>>,
}

/// Colors of a photo.
#[derive(Clone, Copy)]
pub enum Colors<'a> {
    /// None.
    Gray,
    /// The teachers'.
    Taught,
    /// The scene's, joined with the teachers' as in finished frames, strokes over what it leaves
    /// open.
    Scene(&'a ShField),
    /// The same quickly: as the picture before, but for what the scene's colors have changed by.
    Guess(&'a ShField),
    /// The scene's alone.
    Plain(&'a ShField),
}

/// A photo's colors, and the scene's of which they were made.
struct Joined {
    photo: usize,
    seen: WeightedColors,
    ab: Vec<[f32; 2]>,
}

/// Pictures of a run's photos.
#[derive(Default)]
pub struct Pictures {
    prepared: Mutex<Vec<(usize, Arc<Prepared>)>>,
    last: Mutex<Option<Joined>>,
}

impl Pictures {
    /// A photo as PNG; none of the teachers' where there is no answer.
    pub fn png(
        &self,
        scene: &PaintScene,
        photo: usize,
        colors: Colors<'_>,
    ) -> Result<Option<Vec<u8>>, RunError> {
        let prepared = self.prepared(scene, photo)?;
        let Prepared {
            canvas,
            small,
            taught,
        } = &*prepared;
        let drawn = |chroma| {
            let fields = [chroma, &scene.believed];
            let (luma, extent) = (&scene.luma, scene.dataset.extent);
            let mut drawer = SceneDrawer::new(&scene.raster, luma, fields, extent)?;
            drawer.draw(&scene.views(photo), canvas)
        };
        let ab = match colors {
            Colors::Gray => vec![[0.0; 2]; canvas.len()],
            Colors::Taught => match taught {
                Some(taught) => taught.clone(),
                None => return Ok(None),
            },
            Colors::Plain(chroma) => drawn(chroma)?.ab,
            Colors::Scene(chroma) => self.joined(scene, &prepared, photo, drawn(chroma)?)?,
            Colors::Guess(chroma) => {
                let seen = drawn(chroma)?;
                match self.changed(photo, &seen) {
                    Some(ab) => ab,
                    None => self.joined(scene, &prepared, photo, seen)?,
                }
            }
        };
        let colored = finish(small, canvas, ab);
        let size = [colored.width, colored.height];
        let png = encoded(&colored.bytes(), size, ExtendedColorType::Rgb8, None);
        let failed = |reason| StoreError::file(scene.folder.path(), reason);
        Ok(Some(png.map_err(failed)?))
    }

    /// The scene's colors joined with the teachers', strokes over what they leave open.
    fn joined(
        &self,
        scene: &PaintScene,
        Prepared { canvas, taught, .. }: &Prepared,
        photo: usize,
        seen: WeightedColors,
    ) -> Result<Vec<[f32; 2]>, RunError> {
        let mut ab = blend(canvas, &seen, taught.as_deref(), None);
        let name = &scene.photos[photo].name;
        let paint = scene.hint(canvas.query(name), canvas.gray_image())?;
        if !paint.is_empty() {
            ab = Strokes::of(canvas, &seen, &paint, true).over(canvas, &seen, &ab);
        }
        let joined = Joined {
            photo,
            seen,
            ab: ab.clone(),
        };
        *self.last.lock().unwrap_or_else(PoisonError::into_inner) = Some(joined);
        Ok(ab)
    }

    /// The last picture's colors with what the scene's have changed by; none of another photo.
    fn changed(&self, photo: usize, seen: &WeightedColors) -> Option<Vec<[f32; 2]>> {
        let last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let last = last.as_ref().filter(|last| last.photo == photo)?;
        let changed = (0..seen.ab.len()).map(|i| {
            let by = |k: usize| seen.weight[i] * (seen.ab[i][k] - last.seen.ab[i][k]);
            [last.ab[i][0] + by(0), last.ab[i][1] + by(1)]
        });
        Some(changed.collect())
    }

    fn prepared(&self, scene: &PaintScene, photo: usize) -> Result<Arc<Prepared>, RunError> {
        let mut kept = self.prepared.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(place) = kept.iter().position(|(known, _)| *known == photo) {
            let found = kept.remove(place);
            kept.insert(0, found);
            return Ok(kept[0].1.clone());
        }
        let canvas = canvas(scene, photo)?;
        let taught = scene.teachers(|teachers| {
            teachers.color(canvas.query(&scene.photos[photo].name), canvas.gray_image())
        })?;
        let prepared = Prepared {
            small: Original {
                width: canvas.width,
                height: canvas.height,
                gray: canvas
                    .gray
                    .iter()
                    .map(|&gray| 257 * u16::from(gray))
                    .collect(),
                in_scene: None,
                deep: false,
                mask: None,
                stance: canvas.stance,
                exif: None,
            },
            taught: taught.map(|answer| answer.ab),
            canvas,
        };
        kept.insert(0, (photo, Arc::new(prepared)));
        kept.truncate(KEPT);
        Ok(kept[0].1.clone())
    }
}

/// A photo at working size.
fn canvas(scene: &PaintScene, photo: usize) -> Result<Canvas, RunError> {
    let seen = scene.views(photo);
    let range = scene.dataset.options.normalize;
    let original = scene.dataset.loader().original(seen[0].view, range)?;
    let size = SceneDrawer::size(&seen).unwrap_or_default();
    let mut canvas = Canvas::sized(&original, size);
    let trained = scene.dataset.photo(scene.photos[photo].views.start)?;
    let trained_size = [trained.width, trained.height];
    if seen[0].view.undistortion.is_none() && trained_size == [canvas.width, canvas.height] {
        // To the very photo that was trained on the teachers' answers are kept.
        canvas.gray.clone_from(&trained.gray);
    }
    Ok(canvas)
}

/// Share of a photo that the scene covers, 0 to 1: strokes there color the scene.
///
/// # Errors
/// [`RunError`] of the photo or the device.
pub fn covered(scene: &PaintScene, photo: usize) -> Result<f64, RunError> {
    let canvas = canvas(scene, photo)?;
    let fields = [&scene.believed; 2];
    let (luma, extent) = (&scene.luma, scene.dataset.extent);
    let mut drawer = SceneDrawer::new(&scene.raster, luma, fields, extent)?;
    let seen = drawer.draw(&scene.views(photo), &canvas)?;
    let sum: f64 = seen.weight.iter().map(|&weight| f64::from(weight)).sum();
    Ok(sum / seen.weight.len().max(1) as f64)
}
