//! What the points look like, small, for the page.

use std::path::{Path, PathBuf};

use image::{DynamicImage, RgbImage, codecs::jpeg::JpegEncoder};

use crate::{
    capture::{Capture, Loader, View, decode_image, split},
    input,
    run::{RunFolder, picture_names},
};

use super::{
    report::{Pictures, PointStage, Tradeoff},
    space::base_name,
};

/// The folder in a point's with its pictures of the held-out views.
pub(super) const FOLDER: &str = "views";

/// Longer side of a picture on the page, in pixels.
const SIDE: u32 = 360;

/// JPEG quality.
const QUALITY: u8 = 85;

/// Pictures of the first held-out view, each read once. A picture that cannot be made
/// is missing, which is no reason to stop.
pub(super) struct Album {
    /// `points/` of the sweep.
    points: PathBuf,
    capture: Capture,
    pictures: Pictures,
    /// The path of the view's picture below a point's folder of pictures.
    file: String,
}

impl Album {
    /// Of the sweep in `folder`.
    pub fn new(folder: &Path, capture: Capture) -> Self {
        Self {
            points: folder.join(super::POINTS),
            capture,
            pictures: Pictures::default(),
            file: String::new(),
        }
    }

    /// The pictures of all points.
    pub fn of(&mut self, sweep: &Tradeoff) -> &Pictures {
        // Cut as the base's photos were.
        let base = RunFolder::at(&self.points.join(base_name(PointStage::Luma)));
        if self.pictures.photo.is_none()
            && let Ok(report) = base.read_report()
        {
            let load = report.capture.load;
            if let Ok(capture) =
                Capture::load_with(Path::new(&report.capture.path), &load.capture())
            {
                self.capture = capture;
            }
            let first = split(&self.capture.views, load.holdout)
                .test
                .first()
                .copied();
            if let Some(i) = first {
                let view = &self.capture.views[i];
                self.file = picture_names(&self.capture.views).swap_remove(i);
                self.pictures.view = view.name.clone();
                self.pictures.photo = photo(&Loader::new(load), view);
            }
        }
        for point in &sweep.points {
            if !self.pictures.points.contains_key(&point.name)
                && let Some(jpeg) = self.picture(&point.name)
            {
                self.pictures.points.insert(point.name.clone(), jpeg);
            }
        }
        &self.pictures
    }

    fn picture(&self, name: &str) -> Option<Vec<u8>> {
        let file = self.points.join(name).join(FOLDER).join(&self.file);
        small(decode_image(input::read(&file).ok()?).ok()?.image)
    }
}

fn photo(loader: &Loader, view: &View) -> Option<Vec<u8>> {
    let (photo, _) = loader.load(view).ok()?;
    let (_, stance) = loader.standing(view).ok()?;
    let bytes = match &photo.rgb {
        Some(rgb) => rgb.concat(),
        None => photo.gray.iter().flat_map(|&gray| [gray; 3]).collect(),
    };
    let image = RgbImage::from_raw(photo.width, photo.height, bytes)?;
    small(stance.upright.image(image.into()))
}

/// A small JPEG.
fn small(image: DynamicImage) -> Option<Vec<u8>> {
    let image = match image.width().max(image.height()) > SIDE {
        true => image.thumbnail(SIDE, SIDE),
        false => image,
    };
    let mut bytes = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut bytes, QUALITY);
    image.to_rgb8().write_with_encoder(encoder).ok()?;
    Some(bytes)
}
