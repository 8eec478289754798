//! Views made from a camera's photos.

use std::path::Path;
use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};

use super::lens::{Cut, IMPERCEPTIBLE, Lens, Undistortion};
use super::{Choice, LoadOptions, Observation, SensorOrientation, View};

/// The views that every photo of a camera becomes.
pub(super) struct Arrangement {
    lens: Arc<Lens>,
    /// At least one.
    cuts: Vec<Cut>,
    /// True if photos are resampled.
    undistorts: bool,
    /// Largest displacement by the lens, in pixels at working size.
    pub displacement: f64,
}

impl Arrangement {
    /// # Errors
    /// In words, if the lens is to be taken out and cannot be.
    pub fn new(lens: Lens, options: &LoadOptions) -> Result<Self, String> {
        let longer = lens.width.max(lens.height);
        let working = options.max_side.unwrap_or(longer).min(longer);
        let displacement = lens.displacement() * f64::from(working) / f64::from(longer);
        let undistorts = match options.lens {
            Choice::Auto => displacement > IMPERCEPTIBLE,
            Choice::On => displacement > 0.0,
            Choice::Off => false,
        };
        let cuts = if undistorts {
            lens.cuts()?
        } else {
            vec![lens.as_pinhole()]
        };
        Ok(Self {
            lens: Arc::new(lens),
            cuts,
            undistorts,
            displacement,
        })
    }

    /// The views of a photo with this world-to-camera pose.
    pub fn views(
        &self,
        name: &str,
        image_path: &Path,
        rotation: DMat3,
        translation: DVec3,
    ) -> impl Iterator<Item = View> {
        self.cuts.iter().map(move |cut| {
            let mut camera = cut.camera.clone();
            camera.rotation = cut.rotation * rotation;
            camera.translation = cut.rotation * translation;
            View {
                name: cut.face.map_or(name.into(), |face| face_name(name, face)),
                photo: name.into(),
                image_path: image_path.into(),
                camera,
                undistortion: self.undistorts.then(|| Undistortion {
                    lens: self.lens.clone(),
                    rotation: cut.rotation,
                }),
                stance: SensorOrientation::default(),
            }
        })
    }

    /// Moves an observation from the photo to the view that shows it, `first` being
    /// the index of the photo's first view; false where none does.
    pub fn place(&self, seen: &mut Observation, first: usize) -> bool {
        if !self.undistorts {
            seen.view = first;
            return true;
        }
        let Some(ray) = self.lens.ray(DVec2::from(seen.pixel)) else {
            return false;
        };
        for (view, cut) in (first..).zip(&self.cuts) {
            if let Some(pixel) = cut.pixel(ray) {
                *seen = Observation { view, pixel };
                return true;
            }
        }
        false
    }
}

/// A face's name: the photo's with `@` and the face before the extension, which a
/// dot in the last part of the path begins.
fn face_name(photo: &str, face: &str) -> String {
    let file = photo.rfind('/').map_or(0, |slash| slash + 1);
    let dot = photo[file..].rfind('.').filter(|&dot| dot > 0);
    let (stem, extension) = photo.split_at(dot.map_or(photo.len(), |dot| file + dot));
    format!("{stem}@{face}{extension}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_are_named_before_the_extension() {
        assert_eq!(face_name("a.jpg", "front"), "a@front.jpg");
        assert_eq!(face_name("x.y/a b.c.jpg", "up"), "x.y/a b.c@up.jpg");
        assert_eq!(face_name("x.y/a", "left"), "x.y/a@left");
        assert_eq!(face_name(".a", "left"), ".a@left");
    }
}
