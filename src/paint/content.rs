//! Places of the page that are for painting.

use std::{sync::Arc, time::Duration};

use image::{ExtendedColorType, GrayImage, RgbImage, imageops};
use serde_json::{Value, json};

use super::{
    command::Choices,
    free_view::ViewStroke,
    layer::encoded,
    log::Act,
    pictures::{Colors, covered},
    session::{PaintSession, Stroke},
};
use crate::{
    run::RunError,
    subject::SceneKind,
    view::{
        Content, Request, Response, RunContent, answer,
        assets::{PAINT, PAINT_NAMES},
        pack,
    },
};

/// How long a page waits for news.
const NEWS_WITHIN: Duration = Duration::from_secs(20);

/// Height of the filmstrip's pictures, in pixels: for dense screens.
const THUMB: f32 = 120.0;

/// A run that is painted on, as a page.
pub struct PaintContent {
    run: RunContent,
    session: Arc<PaintSession>,
}

impl PaintContent {
    /// The page of a session.
    pub fn new(session: Arc<PaintSession>) -> Self {
        let run = RunContent::unread(session.scene.viewed.clone());
        Self { run, session }
    }

    /// The answer to a request.
    pub fn answer(&self, request: &Request) -> Response {
        let Some(place) = request.path.strip_prefix("/paint/") else {
            return answer(self, request);
        };
        if let Some(file) = PAINT_NAMES.iter().position(|name| *name == place) {
            return Response::asset(place, PAINT[file]);
        }
        let found = match &request.posted {
            Some(body) => self.take(place, body),
            None => self.show(place),
        };
        found.unwrap_or_else(|error| {
            Response::refused("500 Internal Server Error", error.to_string())
        })
    }

    /// Does what a page asks to be done.
    fn take(&self, place: &str, body: &[u8]) -> Result<Response, RunError> {
        let session = &self.session;
        let refused = || {
            Ok(Response::refused(
                "400 Bad Request",
                "this cannot be drawn or chosen",
            ))
        };
        let photos = session.scene.photos.len();
        match place {
            "stroke" => match serde_json::from_slice::<Stroke>(body) {
                Ok(stroke) if stroke.points.is_sound() && stroke.photo < photos => {
                    session.draw(&stroke)?;
                }
                _ => return refused(),
            },
            "view-stroke" => match serde_json::from_slice::<ViewStroke>(body) {
                Ok(stroke) if stroke.is_sound() => {
                    let photos = session.draw_in_view(&stroke)?;
                    let body = json!({ "photos": photos }).to_string();
                    return Ok(Response::ok("application/json", body));
                }
                _ => return refused(),
            },
            "choices" => match serde_json::from_slice::<Choices>(body) {
                Ok(choices) if choices.are_sound() => session.choose(choices),
                _ => return refused(),
            },
            "undo" => session.turn(Act::Undo)?,
            "redo" => session.turn(Act::Redo)?,
            "save" => session.save(),
            "doubt" => session.look(),
            _ => return Ok(Response::not_found()),
        }
        Ok(Response::ok("application/json", "{}"))
    }

    fn show(&self, place: &str) -> Result<Response, RunError> {
        let session = &self.session;
        let bytes = |bytes| Response::ok("application/octet-stream", bytes);
        let (what, number) = place.split_once('/').unwrap_or((place, ""));
        match (what, number) {
            ("colors", "") => return Ok(bytes(self.colors(false))),
            ("colors", "doubt") => return Ok(bytes(self.colors(true))),
            _ => {}
        }
        let Ok(number) = number.parse::<u64>() else {
            return Ok(Response::not_found());
        };
        if what == "news" {
            let told = session.told(number, NEWS_WITHIN).to_string();
            return Ok(Response::ok("application/json", told));
        }
        let photo = usize::try_from(number).ok();
        let Some(photo) = photo.filter(|&photo| photo < session.scene.photos.len()) else {
            return Ok(Response::not_found());
        };
        if what == "cover" {
            let share = json!(covered(&session.scene, photo)?).to_string();
            return Ok(Response::ok("application/json", share));
        }
        let png = match what {
            "photo" => Some(session.now(photo)?.to_vec()),
            "before" => session.before(photo)?,
            "gray" => session.picture(photo, Colors::Gray)?,
            "teacher" => session.picture(photo, Colors::Taught)?,
            "doubt" => session.doubted(photo)?,
            "layer" => session.layer(photo),
            "thumb" => self.thumb(photo)?,
            _ => None,
        };
        Ok(match png {
            Some(png) => Response::ok("image/png", png),
            None => Response::not_found(),
        })
    }

    /// A small gray picture.
    fn thumb(&self, photo: usize) -> Result<Option<Vec<u8>>, RunError> {
        let view = self.session.scene.photos[photo].views.start;
        let Some(gray) = self.run.photo(view)? else {
            return Ok(None);
        };
        let scale = THUMB / gray.height() as f32;
        let width = ((gray.width() as f32 * scale) as u32).max(1);
        let small = imageops::thumbnail(&gray, width, THUMB as u32);
        let size = small.dimensions().into();
        Ok(encoded(&small, size, ExtendedColorType::L8, None).ok())
    }

    fn packed(&self, doubt: bool) -> Vec<u8> {
        let drawn = self.session.scene.report.luma.settings.raster_options();
        pack(&self.session.splats(doubt), drawn)
    }

    /// Harmonics of all Gaussians, the last part of the packed scene.
    fn colors(&self, doubt: bool) -> Vec<u8> {
        let mut packed = self.packed(doubt);
        let word = |at: usize| {
            packed.get(at..at + 4).map_or(0, |word| {
                u32::from_le_bytes([word[0], word[1], word[2], word[3]]) as usize
            })
        };
        let [count, degree, channels] = [8, 12, 16].map(word);
        let colors = 2 * count * (degree + 1) * (degree + 1) * channels;
        packed.split_off(packed.len().saturating_sub(colors))
    }
}

impl Content for PaintContent {
    fn about(&self) -> Result<Value, RunError> {
        let mut about = self.run.about()?;
        let photos = self.session.scene.photos.iter().map(|photo| {
            let [width, height] = photo.size;
            json!({
                "name": photo.name,
                "width": width,
                "height": height,
                "camera": photo.views.start,
            })
        });
        about["paint"] = json!({ "photos": photos.collect::<Vec<_>>() });
        about["scenes"] = json!(["color", "luma"]);
        about["stamps"] = json!({ "color": 0, "luma": 0 });
        Ok(about)
    }

    fn scene(&self, kind: SceneKind) -> Result<Option<Arc<Vec<u8>>>, RunError> {
        match kind {
            SceneKind::Color => Ok(Some(Arc::new(self.packed(false)))),
            SceneKind::Luma => self.run.scene(kind),
        }
    }

    fn photo(&self, view: usize) -> Result<Option<GrayImage>, RunError> {
        self.run.photo(view)
    }

    fn teacher(&self, view: usize) -> Result<Option<RgbImage>, RunError> {
        self.run.teacher(view)
    }
}
