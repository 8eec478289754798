//! Places of the studio's page.

use std::{sync::Arc, time::Duration};

use serde_json::json;

use super::{Studio, request::StudioRequest, shelf};
use crate::view::{Request, Response, assets::STUDIO};

/// How long a page waits for news.
const NEWS_WITHIN: Duration = Duration::from_secs(20);

/// A studio as a page.
pub struct StudioContent(pub Arc<Studio>);

impl StudioContent {
    /// The answer to a request. What a page learns of jobs takes its secret, too: the addresses of
    /// pages that may write are in it.
    pub fn answer(&self, request: &Request) -> Response {
        let names = ["/", "/studio.js", "/studio.css"];
        if let Some(file) = names.iter().position(|name| *name == request.path) {
            return Response::asset(names[file], STUDIO[file]);
        }
        let found = match (&request.posted, request.path.as_str()) {
            (Some(body), "/do") => Some(self.take(body)),
            (Some(body), "/news") => {
                let version = serde_json::from_slice(body).unwrap_or_default();
                let told = self.0.told(version, NEWS_WITHIN).to_string();
                Some(Response::ok("application/json", told))
            }
            (None, path) => self.show(path),
            _ => None,
        };
        found.unwrap_or_else(Response::not_found)
    }

    fn take(&self, body: &[u8]) -> Response {
        let bad = |why: String| Response::refused("400 Bad Request", why);
        match serde_json::from_slice::<StudioRequest>(body) {
            Err(error) => bad(error.to_string()),
            Ok(request) => match self.0.take(request) {
                Ok(()) => Response::ok("application/json", json!({}).to_string()),
                Err(error) => bad(error.to_string()),
            },
        }
    }

    /// Pictures and files of runs.
    fn show(&self, path: &str) -> Option<Response> {
        let folder = self.0.folder();
        let mut parts = path.strip_prefix('/')?.split('/');
        let (what, id, last) = (parts.next()?, parts.next()?, parts.next()?);
        match (what, last.parse::<u64>().ok()?, parts.next()) {
            // The number is that of the version, and makes it another address.
            ("picture", _, None) => {
                let png = shelf::picture(folder, id)?;
                Some(Response::ok("image/png", png))
            }
            ("file", place, None) => {
                let bytes = shelf::file(folder, id, place as usize)?;
                Some(Response::ok("application/octet-stream", bytes))
            }
            _ => None,
        }
    }
}
