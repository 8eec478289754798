//! `info`.

use std::{cell::RefCell, path::Path};

use serde_json::{Value, json};

use super::RunError;
use crate::{
    capture::{Camera, Capture, Headers, LoadOptions, Loader, Normalize, Rejected},
    splats::{is_splat_file, read_splats},
    store::{RunFolder, StoreError},
    subject::{
        SubjectError,
        scene::tell_skipped,
        sound::{check_model, tell_headers, tell_masks, tell_unplaced},
    },
    tell::{Event, Observer, keeping},
};

/// Contents of a run folder, splat file or COLMAP folder as JSON, and doubts about the last.
///
/// # Errors
/// [`RunError`] when it is none of them or damaged.
pub fn info(path: &Path, observe: &mut Observer<'_>) -> Result<Value, RunError> {
    if is_splat_file(path)? {
        return splat_info(path, observe);
    }
    // Without an extension it is meant for a folder.
    if path.extension().is_some() && !path.exists() {
        return Err(StoreError::file(path, "no such file or folder").into());
    }
    let folder = RunFolder::find(Some(path))?;
    if folder.report().exists() {
        let report = folder.parse_report()?;
        if let Err(error) = folder.check_files(&report) {
            observe(Event::Warning(error.to_string()));
        }
        return Ok(serde_json::to_value(report).unwrap_or_default());
    }
    colmap_info(path, observe)
}

/// Contents of a COLMAP folder as JSON; no photo is decoded.
fn colmap_info(path: &Path, observe: &mut Observer<'_>) -> Result<Value, RunError> {
    let warnings = RefCell::default();
    let mut observe = keeping(&warnings, observe);
    let capture = Capture::load(path)?;
    for doubt in &capture.doubts {
        observe(Event::Warning(doubt.clone()));
    }
    for Rejected { name, reason } in &capture.rejected {
        observe(Event::Warning(format!("left out {name}: {reason}")));
    }
    let sizes: Vec<_> = capture
        .views
        .iter()
        .map(|view| [view.camera.width, view.camera.height])
        .collect();
    let views = &capture.views;
    let options = LoadOptions {
        normalize: Normalize::Off,
        ..LoadOptions::default()
    };
    let loader = Loader::open(&capture, &options)?;
    let masked = loader.masked_views(views);
    let headers = Headers::read(views)?;
    tell_unplaced(&capture, &mut observe)?;
    tell_headers(&headers, &mut observe);
    tell_masks(loader.masked(), &mut observe);
    // What size they will be worked on is the preset's to say.
    let cameras: Vec<Camera> = views.iter().map(|view| view.camera.clone()).collect();
    let forced = true;
    let model = check_model(&capture, &cameras, forced, &mut observe)?;
    for Rejected { name, reason } in &model.photos {
        observe(Event::Warning(format!("{name}: {reason}")));
    }
    Ok(json!({
        "kind": "COLMAP folder",
        "photos": headers.kinds,
        "masked_views": masked,
        "views": capture.views.len(),
        "points": capture.points.len(),
        "rejected": capture.rejected.iter().map(|r| format!("{}: {}", r.name, r.reason)).collect::<Vec<_>>(),
        "largest_photo": sizes.iter().max_by_key(|&&[w, h]| u64::from(w) * u64::from(h)),
        "extent": capture.extent(),
        "offset": capture.offset.to_array(),
        // In pixels of the model's cameras; infinite is null.
        "reprojection_error": model.reprojection_error,
        "warnings": warnings.take(),
    }))
}

fn splat_info(path: &Path, observe: &mut Observer<'_>) -> Result<Value, RunError> {
    let warnings = RefCell::default();
    let read = read_splats(path)?;
    tell_skipped(path, &read, &mut keeping(&warnings, observe));
    let splats = &read.splats;
    if splats.is_empty() {
        return Err(SubjectError::NoSplats(path.to_owned()).into());
    }
    let bound = |pick: fn(f32, f32) -> f32, start: f32| -> [f32; 3] {
        std::array::from_fn(|axis| {
            splats
                .means
                .iter()
                .fold(start, |bound, mean| pick(bound, mean[axis]))
        })
    };
    Ok(json!({
        "kind": "splat file",
        "splats": splats.len(),
        "skipped": read.skipped,
        "sh_degree": splats.sh.degree,
        "antialiased": read.antialiased,
        // Subtracted from the coordinates.
        "offset": read.offset.to_array(),
        // Half an 8-bit step: what no viewer shows as a color.
        "gray": splats.is_gray(0.5 / 255.0),
        "lowest": bound(f32::min, f32::INFINITY),
        "highest": bound(f32::max, f32::NEG_INFINITY),
        "warnings": warnings.take(),
    }))
}
