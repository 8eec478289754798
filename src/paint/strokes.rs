//! Layers of all photos with what can be undone, kept in the run's folder.

use std::{collections::BTreeMap, io::Write, path::PathBuf};

use base64::{Engine, engine::general_purpose::STANDARD};
use image::{ExtendedColorType, RgbImage, RgbaImage};

use super::{
    layer::{Layer, Mask, Paint, Region, encoded},
    log::{Act, Log, Part},
    scene::PaintScene,
};
use crate::{
    disk::{self, Draft},
    input,
    store::{StoreError, files},
};

/// Strokes that can be undone.
const UNDONE: usize = 200;

/// What is laid over a layer.
pub enum Ink {
    /// sRGB.
    Color([u8; 3]),
    /// Pixels of a picture.
    Picture(RgbImage),
    /// Takes paint away.
    Nothing,
}

/// Paint on a photo.
pub struct Dab {
    pub photo: usize,
    pub mask: Mask,
    pub ink: Ink,
}

/// Part of a layer that a stroke changed, with what is to be there once it is undone, or done
/// again.
struct Changed {
    photo: usize,
    region: Region,
    pixels: RgbaImage,
}

/// All strokes on a run.
pub struct AllStrokes {
    /// Layers by photo.
    layers: BTreeMap<usize, Layer>,
    /// Changes, and the number of those that are not undone.
    changes: Vec<Vec<Changed>>,
    done: usize,
    pub log: Log,
}

impl AllStrokes {
    /// Those that the run's folder keeps.
    pub fn open(scene: &PaintScene) -> Self {
        disk::remove_drafts(&scene.folder.hints(), None);
        let kept = scene.photos.iter().enumerate().filter_map(|(k, photo)| {
            let bytes = input::read(&scene.folder.hint(&photo.name)).ok()?;
            Some((k, Layer::from_png(bytes, photo.size)?))
        });
        let layers = kept.collect();
        let mut log = Log::open(&scene.folder.paint_log());
        let done = std::mem::take(&mut log.done);
        // What comes before a change that cannot be undone cannot be either.
        let known = done.iter().rev().take(UNDONE);
        let known = known.map_while(|parts| changed(scene, parts));
        let mut changes: Vec<Vec<Changed>> = known.collect();
        changes.reverse();
        Self {
            layers,
            done: changes.len(),
            changes,
            log,
        }
    }

    /// Photos with strokes.
    pub fn painted(&self) -> impl Iterator<Item = usize> {
        self.layers.keys().copied()
    }

    /// Numbers of changes that can be undone and redone.
    pub fn depth(&self) -> [usize; 2] {
        [self.done, self.changes.len() - self.done]
    }

    /// The layer of a photo.
    pub fn layer(&self, photo: usize) -> Option<&Layer> {
        self.layers.get(&photo)
    }

    fn layer_of(&self, scene: &PaintScene, photo: usize) -> Layer {
        let layer = self.layers.get(&photo).cloned();
        layer.unwrap_or_else(|| Layer::new(scene.photos[photo].size))
    }

    /// Draws one stroke, on one photo or several, and keeps it.
    ///
    /// # Errors
    /// [`StoreError::File`] where it cannot be kept.
    pub fn draw(
        &mut self,
        scene: &PaintScene,
        paint: Paint,
        dabs: &[Dab],
    ) -> Result<(), StoreError> {
        let (mut change, mut parts, mut layers) = (Vec::new(), Vec::new(), Vec::new());
        for Dab { photo, mask, ink } in dabs {
            let mut layer = self.layer_of(scene, *photo);
            let pixels = layer.cut(mask.region);
            layer.lay(mask, &|x, y| match ink {
                Ink::Color(color) => Some(*color),
                Ink::Picture(picture) => picture.get_pixel_checked(x, y).map(|pixel| pixel.0),
                Ink::Nothing => None,
            });
            layers.push((*photo, layer));
            parts.push(Part {
                photo: scene.photos[*photo].name.clone(),
                region: mask.region,
                before: as_text(&pixels),
            });
            change.push(Changed {
                photo: *photo,
                region: mask.region,
                pixels,
            });
        }
        let (act, color) = match paint {
            Paint::Color(color) => (Act::Paint, Some(color)),
            Paint::Teacher => (Act::Keep, None),
            Paint::Nothing => (Act::Erase, None),
        };
        self.put(scene, layers, (act, color, parts))?;
        self.changes.truncate(self.done);
        self.changes.push(change);
        if self.changes.len() > UNDONE {
            self.changes.remove(0);
        }
        self.done = self.changes.len();
        Ok(())
    }

    /// Takes the last change back, or does it again; the photos that it is on.
    ///
    /// # Errors
    /// As [`AllStrokes::draw`].
    pub fn turn(&mut self, scene: &PaintScene, act: Act) -> Result<Vec<usize>, StoreError> {
        let at = match act {
            Act::Undo => self.done.checked_sub(1),
            _ => Some(self.done),
        };
        let Some(at) = at.filter(|&at| at < self.changes.len()) else {
            return Ok(Vec::new());
        };
        let (mut layers, mut before) = (Vec::new(), Vec::new());
        for Changed {
            photo,
            region,
            pixels,
        } in &self.changes[at]
        {
            let mut layer = self.layer_of(scene, *photo);
            before.push(layer.cut(*region));
            layer.put(*region, pixels);
            layers.push((*photo, layer));
        }
        let photos = layers.iter().map(|(photo, _)| *photo).collect();
        self.put(scene, layers, (act, None, Vec::new()))?;
        for (changed, before) in self.changes[at].iter_mut().zip(before) {
            changed.pixels = before;
        }
        self.done = at + usize::from(act != Act::Undo);
        Ok(photos)
    }

    /// Keeps layers and a line of the log on the disk, all or none.
    fn put(
        &mut self,
        scene: &PaintScene,
        layers: Vec<(usize, Layer)>,
        (act, color, parts): (Act, Option<[u8; 3]>, Vec<Part>),
    ) -> Result<(), StoreError> {
        // What takes room is there before anything is in its place.
        let drafts = layers
            .iter()
            .map(|(photo, layer)| draft(scene, *photo, layer));
        let drafts = drafts.collect::<Result<Vec<_>, _>>()?;
        self.log.add(act, color, parts)?;
        for (k, file) in drafts.into_iter().enumerate() {
            if let Err(error) = place(file) {
                for (photo, _) in &layers[..k] {
                    let _ = draft(scene, *photo, &self.layer_of(scene, *photo)).and_then(place);
                }
                let back = if act == Act::Undo {
                    Act::Redo
                } else {
                    Act::Undo
                };
                let _ = self.log.add(back, None, Vec::new());
                return Err(error);
            }
        }
        for (photo, layer) in layers {
            match layer.is_empty() {
                true => self.layers.remove(&photo),
                false => self.layers.insert(photo, layer),
            };
        }
        Ok(())
    }
}

/// A layer's file, beside its place; an empty one has none.
fn draft(
    scene: &PaintScene,
    photo: usize,
    layer: &Layer,
) -> Result<(PathBuf, Option<Draft>), StoreError> {
    let of_photo = &scene.photos[photo];
    let path = scene.folder.hint(&of_photo.name);
    if layer.is_empty() {
        return Ok((path, None));
    }
    let png = layer.to_png(of_photo.of_file);
    let png = png.map_err(|reason| StoreError::file(&path, reason))?;
    let write = || {
        disk::make_folder(disk::folder_of(&path))?;
        let mut draft = disk::create(&path)?;
        draft.write_all(&png)?;
        Ok(draft)
    };
    let draft = write().map_err(files::at(&path))?;
    Ok((path, Some(draft)))
}

/// Puts a layer's file into its place.
fn place((path, draft): (PathBuf, Option<Draft>)) -> Result<(), StoreError> {
    let placed = match draft {
        Some(draft) => draft.persist(&path),
        None => disk::remove(&path),
    };
    placed.map_err(files::at(&path))
}

/// Pixels as the log keeps them; none where nothing is painted.
fn as_text(pixels: &RgbaImage) -> Option<String> {
    let painted = pixels.pixels().any(|pixel| pixel.0[3] > 0);
    let size = pixels.dimensions().into();
    let png = painted.then(|| encoded(pixels, size, ExtendedColorType::Rgba8, None));
    Some(STANDARD.encode(png?.ok()?))
}

/// The change of a line of the log; none where it is of other photos or sizes.
fn changed(scene: &PaintScene, parts: &[Part]) -> Option<Vec<Changed>> {
    let of = |part: &Part| {
        let photo = scene
            .photos
            .iter()
            .position(|photo| photo.name == part.photo)?;
        let [left, top, width, height] = part.region;
        let [within, below] = scene.photos[photo].size;
        let inside = left.checked_add(width)? <= within && top.checked_add(height)? <= below;
        let pixels = match &part.before {
            _ if !inside => return None,
            Some(text) => Layer::from_png(STANDARD.decode(text).ok()?, [width, height])?.0,
            None => RgbaImage::new(width, height),
        };
        Some(Changed {
            photo,
            region: part.region,
            pixels,
        })
    };
    let parts = (!parts.is_empty()).then_some(parts)?;
    parts.iter().map(of).collect()
}
