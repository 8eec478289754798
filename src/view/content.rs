//! Content that is served: the page's files, scenes, photos.

use std::{
    io::Cursor,
    sync::{Arc, Mutex, PoisonError},
};

use image::{DynamicImage, GrayImage, ImageFormat, RgbImage, imageops};
use serde_json::Value;

use super::{
    ViewerError, about, assets, overview, pack,
    server::{Request, Response},
};
use crate::{
    capture::{Camera, Dataset, Orientation, Photo},
    hash::Hasher,
    run::{RunError, ViewedScene},
    subject::SceneKind,
    tell::Observer,
};

/// Longer side of the photos that the page shows, in pixels: what screens have.
const SIDE: u32 = 2048;

/// Content of a page.
pub trait Content: Send + Sync {
    /// All but scenes and pictures, see [`about`].
    fn about(&self) -> Result<Value, RunError>;

    /// A scene, [packed](pack); none where there is no such one.
    fn scene(&self, kind: SceneKind) -> Result<Option<Arc<Vec<u8>>>, RunError>;

    /// The gray photo of a view, as it was trained on.
    fn photo(&self, view: usize) -> Result<Option<GrayImage>, RunError>;

    /// The photo of a view in its teacher's colors.
    fn teacher(&self, view: usize) -> Result<Option<RgbImage>, RunError>;
}

/// The answer to a request. Paths are compared with those that there are, and never lead into a
/// folder.
pub fn answer(content: &dyn Content, request: &Request) -> Response {
    match request.path.as_str() {
        "/" => Response::asset("", assets::PAGE),
        path @ "/viewer.css" => Response::asset(path, assets::STYLE),
        path @ "/viewer.js" => Response::asset(path, &assets::script()),
        "/scene.json" => match content.about() {
            Ok(told) => tagged(told.to_string()),
            Err(error) => failed(&error),
        },
        "/scene/color" => scene(content, SceneKind::Color),
        "/scene/luma" => scene(content, SceneKind::Luma),
        path => {
            let numbered = |under: &str| path.strip_prefix(under)?.parse::<usize>().ok();
            if let Some(view) = numbered("/photo/") {
                let photo = content.photo(view);
                picture(photo.map(|found| found.map(DynamicImage::ImageLuma8)))
            } else if let Some(view) = numbered("/teacher/") {
                let photo = content.teacher(view);
                picture(photo.map(|found| found.map(DynamicImage::ImageRgb8)))
            } else {
                Response::not_found()
            }
        }
    }
}

/// JSON, with a tag by which the page knows whether it is another.
fn tagged(body: String) -> Response {
    let mut hash = Hasher::default();
    hash.update(body.as_bytes());
    Response {
        tag: Some(format!("\"{}\"", &hash.finish()[..16])),
        ..Response::ok("application/json", body)
    }
}

fn scene(content: &dyn Content, kind: SceneKind) -> Response {
    match content.scene(kind) {
        Ok(Some(body)) => Response {
            body,
            ..Response::ok("application/octet-stream", Vec::new())
        },
        Ok(None) => Response::not_found(),
        Err(error) => failed(&error),
    }
}

/// A picture as PNG, no larger than a screen.
fn picture(found: Result<Option<DynamicImage>, RunError>) -> Response {
    let image = match found {
        Ok(Some(image)) if image.width().max(image.height()) > SIDE => {
            image.resize(SIDE, SIDE, imageops::FilterType::Triangle)
        }
        Ok(Some(image)) => image,
        Ok(None) => return Response::not_found(),
        Err(error) => return failed(&error),
    };
    let mut bytes = Cursor::new(Vec::new());
    match image.write_to(&mut bytes, ImageFormat::Png) {
        Ok(()) => Response::ok("image/png", bytes.into_inner()),
        Err(error) => Response::refused("500 Internal Server Error", error.to_string()),
    }
}

fn failed(error: &RunError) -> Response {
    Response::refused("500 Internal Server Error", error.to_string())
}

/// A run or a splat file that stays as it is.
pub struct RunContent {
    viewed: Arc<ViewedScene>,
    /// The scenes by kind, packed when they are asked for the first time.
    packed: [Mutex<Option<Packed>>; 2],
}

/// A scene for the page.
#[derive(Clone)]
struct Packed {
    bytes: Arc<Vec<u8>>,
    /// Start camera where the run has none, and the nearest depth.
    overview: (Camera, f64),
}

impl RunContent {
    /// Content of a run, with the first of its scenes read.
    ///
    /// # Errors
    /// [`ViewerError::Nothing`] without a scene, and [`RunError`] of its file.
    pub fn new(viewed: ViewedScene, observe: &mut Observer<'_>) -> Result<Self, ViewerError> {
        let Some(first) = viewed.scenes().next() else {
            return Err(ViewerError::Nothing(viewed.name));
        };
        let content = Self::unread(Arc::new(viewed));
        content.packed(first, observe)?;
        Ok(content)
    }

    /// Content of a run, of whose scenes none is read yet.
    pub fn unread(viewed: Arc<ViewedScene>) -> Self {
        Self {
            viewed,
            packed: Default::default(),
        }
    }

    fn packed(
        &self,
        kind: SceneKind,
        observe: &mut Observer<'_>,
    ) -> Result<Option<Packed>, RunError> {
        let packed = self.packed[kind as usize].lock();
        let mut packed = packed.unwrap_or_else(PoisonError::into_inner);
        if packed.is_none() {
            let read = self.viewed.read(kind, observe)?;
            *packed = read.map(|(splats, drawn)| Packed {
                bytes: Arc::new(pack(&splats, drawn)),
                overview: overview(&splats),
            });
        }
        Ok(packed.clone())
    }
}

impl Content for RunContent {
    fn about(&self) -> Result<Value, RunError> {
        let start = match (&self.viewed.dataset, self.viewed.scenes().next()) {
            (None, Some(kind)) => self
                .packed(kind, &mut |_| {})?
                .map(|packed| packed.overview),
            _ => None,
        };
        let start = start.as_ref().map(|(camera, near)| (camera, Some(*near)));
        Ok(about::of_look(&self.viewed, start))
    }

    fn scene(&self, kind: SceneKind) -> Result<Option<Arc<Vec<u8>>>, RunError> {
        Ok(self.packed(kind, &mut |_| {})?.map(|packed| packed.bytes))
    }

    fn photo(&self, view: usize) -> Result<Option<GrayImage>, RunError> {
        let photo = self.viewed.photo(view)?;
        Ok(photo.and_then(|photo| gray(&photo, upright(self.viewed.dataset.as_deref(), view))))
    }

    fn teacher(&self, view: usize) -> Result<Option<RgbImage>, RunError> {
        let picture = self.viewed.teacher(view)?;
        let upright = upright(self.viewed.dataset.as_deref(), view);
        Ok(picture.map(|picture| upright.image(picture.into()).into_rgb8()))
    }
}

/// Orientation of a view's pictures, that of its camera.
pub(super) fn upright(dataset: Option<&Dataset>, view: usize) -> Orientation {
    let view = dataset.and_then(|dataset| dataset.capture.views.get(view));
    let upright = view.map(|view| view.stance.upright.without_mirrors());
    upright.unwrap_or_default()
}

/// A photo's gray as an image, turned.
pub(super) fn gray(photo: &Photo, upright: Orientation) -> Option<GrayImage> {
    let size = [photo.width, photo.height];
    let [width, height] = upright.size(size);
    GrayImage::from_raw(width, height, upright.turned(photo.gray.clone(), 1, size))
}
