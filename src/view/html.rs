//! The page as one file, with the scene in it: to be sent to someone, who opens it without
//! anything else.

use std::{io::Cursor, path::Path, sync::Arc};

use base64::{Engine, engine::general_purpose::STANDARD};
use image::{ImageEncoder, codecs::jpeg::JpegEncoder};
use serde_json::Value;

use super::{ViewerError, about, assets, overview, pack};
use crate::{
    capture::Camera,
    gpu::{Gpu, GpuError},
    raster::{Raster, RasterOptions, RenderedImage, SceneRenderer},
    report::to_image,
    run::{RunError, ViewedScene},
    splats::Splats,
    store::files,
    subject::SceneKind,
    tell::{Event, Observer, Stage},
};

/// Longer side of the picture that is there before the scene is, in pixels, and its quality.
const POSTER_SIDE: f64 = 1280.0;
const POSTER_QUALITY: u8 = 85;

/// Content security policy of a page in one file: it runs nothing but its own parts.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; worker-src blob:";

/// Statistics of the written file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Written {
    /// Number of Gaussians.
    pub splats: usize,
    /// Size of the file.
    pub bytes: usize,
}

/// Returns true if a path has the extension of an HTML file.
pub fn is_html(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default();
    ["html", "htm"]
        .iter()
        .any(|known| extension.eq_ignore_ascii_case(known))
}

/// Writes a scene, the colored one where there is one and `luma` is not wanted, as one file.
pub fn write_html(
    viewed: &ViewedScene,
    luma: bool,
    path: &Path,
    observe: &mut Observer<'_>,
) -> Result<Written, ViewerError> {
    let colored = viewed
        .scenes()
        .find(|kind| !luma || *kind == SceneKind::Luma);
    let kind = colored.ok_or_else(|| ViewerError::Nothing(viewed.name.clone()))?;
    let read = viewed.read(kind, observe)?;
    let (splats, drawn) = read.ok_or_else(|| ViewerError::Nothing(viewed.name.clone()))?;
    observe(Event::begins(Stage::Rendering));
    let (start, near) = match &viewed.dataset {
        Some(dataset) => {
            let first = about::first(dataset);
            let upright = dataset.capture.views[first].stance.upright;
            (dataset.cameras[first].turned(upright), viewed.near())
        }
        None => {
            let (camera, near) = overview(&splats);
            (camera, Some(near))
        }
    };
    let poster = poster(&splats, drawn, &start, near.unwrap_or_default())?;
    observe(Event::begins(Stage::Saving));
    let mut told = about::of_look(viewed, Some((&start, near)));
    told["scenes"] = Value::from(vec![kind.name()]);
    for absent in ["photos", "teacher"] {
        told[absent] = Value::Bool(false);
    }
    let packed = pack(&splats, drawn);
    let page = page(&told, kind.name(), &packed, &poster);
    files::make_folder_of(path)?;
    files::write(path, page.as_bytes())?;
    Ok(Written {
        splats: splats.len(),
        bytes: page.len(),
    })
}

/// The scene from where the page begins, as JPEG.
fn poster(
    splats: &Splats,
    drawn: RasterOptions,
    camera: &Camera,
    near: f64,
) -> Result<Vec<u8>, ViewerError> {
    let scale = POSTER_SIDE / f64::from(camera.width.max(camera.height));
    let side = |pixels: u32| ((scale * f64::from(pixels)).round() as u32).max(1);
    let camera = camera.resized(side(camera.width), side(camera.height));
    let gpu = Gpu::open().map_err(RunError::from)?;
    let drawing = || -> Result<RenderedImage, GpuError> {
        let raster = Arc::new(Raster::with(&gpu, drawn));
        let mut renderer = SceneRenderer::new(&raster, splats, &[&splats.sh], near)?;
        Ok(renderer.render(&camera)?.remove(0))
    };
    let picture = drawing().map_err(RunError::from)?;
    let image = to_image(picture.width, picture.height, &picture.shown());
    let mut bytes = Cursor::new(Vec::new());
    // Into memory, and of three channels: nothing of it can fail.
    let _ = JpegEncoder::new_with_quality(&mut bytes, POSTER_QUALITY).write_image(
        image.as_raw(),
        image.width(),
        image.height(),
        image::ExtendedColorType::Rgb8,
    );
    Ok(bytes.into_inner())
}

/// The page with everything in it.
fn page(about: &Value, kind: &str, packed: &[u8], poster: &[u8]) -> String {
    // Within a script nothing may look like the end of one.
    let about = about.to_string().replace('<', "\\u003c");
    let scene = STANDARD.encode(packed);
    let script = assets::script();
    let script = format!(
        "<script type=\"application/json\" id=\"scene-about\">{about}</script>\n<script type=\"text/plain\" id=\"scene-{kind}\">{scene}</script>\n<script type=\"module\">\n{script}</script>"
    );
    let poster = format!(
        "<img id=\"poster\" alt=\"The scene\" src=\"data:image/jpeg;base64,{}\">",
        STANDARD.encode(poster)
    );
    let policy = format!(
        "<meta charset=\"utf-8\">\n<meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">"
    );
    let style = format!("<style>\n{}</style>", assets::STYLE);
    let parts = [
        ("<meta charset=\"utf-8\">", policy),
        ("<link rel=\"stylesheet\" href=\"viewer.css\">", style),
        ("<img id=\"poster\" alt=\"\" hidden>", poster),
        (
            "<script type=\"module\" src=\"viewer.js\"></script>",
            script,
        ),
    ];
    let mut page = assets::PAGE.to_owned();
    for (place, part) in parts {
        page = page.replacen(place, &part, 1);
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_left_to_be_fetched() {
        let about = serde_json::json!({"name": "</script><script>alert(1)"});
        let page = page(&about, "color", b"packed", b"poster");
        assert!(!page.contains("viewer.css") && !page.contains("viewer.js\""));
        assert!(!page.contains("</script><script>alert"));
        assert!(page.contains("id=\"scene-color\">cGFja2Vk</script>"));
        assert!(page.contains("base64,cG9zdGVy\">"));
        assert!(page.contains("Content-Security-Policy"));
        assert_eq!(page.matches("id=\"poster\"").count(), 1);
        assert!(is_html(Path::new("a.HTML")) && !is_html(Path::new("a.ply")));
    }
}
