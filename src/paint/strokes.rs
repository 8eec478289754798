//! Layers of all photos with what can be undone, kept in the run's folder.

use std::collections::BTreeMap;

use image::RgbaImage;

use super::{
    layer::{Layer, Region, Stroke},
    log::{Act, Log},
    scene::PaintScene,
};
use crate::{
    disk, input,
    store::{StoreError, files},
};

/// Strokes that can be undone.
const UNDONE: usize = 200;

/// A change of a layer.
struct Change {
    photo: usize,
    region: Region,
    /// Pixels before and after.
    pixels: [RgbaImage; 2],
}

/// All strokes on a run.
pub struct AllStrokes {
    /// Layers by photo.
    layers: BTreeMap<usize, Layer>,
    /// Changes of this session, and the number of those that are not undone.
    changes: Vec<Change>,
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
        Self {
            layers: kept.collect(),
            changes: Vec::new(),
            done: 0,
            log: Log::open(&scene.folder.paint_log()),
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

    /// Draws a stroke and keeps it; returns false where it lies outside.
    ///
    /// # Errors
    /// [`StoreError::File`] where it cannot be kept; it is not drawn then.
    pub fn draw(&mut self, scene: &PaintScene, stroke: &Stroke) -> Result<bool, StoreError> {
        let photo = stroke.photo;
        let before = self.layers.get(&photo).cloned();
        let before = before.unwrap_or_else(|| Layer::new(scene.photos[photo].size));
        let mut layer = before.clone();
        let Some(region) = layer.draw(stroke) else {
            return Ok(false);
        };
        let change = Change {
            photo,
            region,
            pixels: [before.cut(region), layer.cut(region)],
        };
        self.put(scene, photo, layer)?;
        self.changes.truncate(self.done);
        self.changes.push(change);
        if self.changes.len() > UNDONE {
            self.changes.remove(0);
        }
        self.done = self.changes.len();
        let act = stroke.color.map_or(Act::Erase, |_| Act::Paint);
        let name = &scene.photos[photo].name;
        self.log.add(act, name, stroke.color, region)?;
        Ok(true)
    }

    /// Takes the last change back, or does it again; the photo that it is on.
    ///
    /// # Errors
    /// As [`AllStrokes::draw`].
    pub fn turn(&mut self, scene: &PaintScene, act: Act) -> Result<Option<usize>, StoreError> {
        let (at, side) = match act {
            Act::Undo => (self.done.checked_sub(1), 0),
            _ => (Some(self.done), 1),
        };
        let Some((at, change)) = at.and_then(|at| Some((at, self.changes.get(at)?))) else {
            return Ok(None);
        };
        let (photo, region) = (change.photo, change.region);
        let size = scene.photos[photo].size;
        let mut layer = self.layers.get(&photo).cloned();
        let mut layer = layer.take().unwrap_or_else(|| Layer::new(size));
        layer.put(region, &change.pixels[side]);
        self.put(scene, photo, layer)?;
        self.done = at + side;
        let name = &scene.photos[photo].name;
        self.log.add(act, name, None, region)?;
        Ok(Some(photo))
    }

    /// Keeps a layer on the disk; an empty one has no file.
    fn put(&mut self, scene: &PaintScene, photo: usize, layer: Layer) -> Result<(), StoreError> {
        let place = &scene.photos[photo];
        let path = scene.folder.hint(&place.name);
        if layer.is_empty() {
            disk::remove(&path).map_err(files::at(&path))?;
            self.layers.remove(&photo);
            return Ok(());
        }
        let png = layer.to_png(place.of_file);
        let png = png.map_err(|reason| StoreError::file(&path, reason))?;
        disk::make_folder(disk::folder_of(&path)).map_err(files::at(&path))?;
        files::write(&path, &png)?;
        self.layers.insert(photo, layer);
        Ok(())
    }
}
