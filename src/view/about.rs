//! Description of a scene for the page: cameras, figures, curves, the plan of effects.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::{
    capture::{Camera, Dataset, View},
    report::{EffectReport, Report},
    run::ViewedScene,
};

/// Points of a curve that are drawn, at most.
const POINTS: usize = 200;

/// Description of a run or a splat file for the page. Without cameras it begins at `start`, and
/// shows nothing nearer than the depth that comes with it.
pub fn of_look(viewed: &ViewedScene, start: Option<(&Camera, Option<f64>)>) -> Value {
    let scenes: Vec<&str> = viewed.scenes().map(|kind| kind.name()).collect();
    let stamps: BTreeMap<&str, u32> = scenes.iter().map(|&kind| (kind, 0)).collect();
    let report = viewed.report();
    json!({
        "name": viewed.name,
        "scenes": scenes,
        // They do not change.
        "stamps": stamps,
        "live": null,
        "near": viewed.near().or(start.and_then(|(_, near)| near)),
        "start": start.map(|(camera, _)| pose(camera)),
        "cameras": viewed.dataset.as_deref().map_or_else(Vec::new, |d| cameras(d, report)),
        "first": viewed.dataset.as_deref().map_or(0, first),
        "photos": viewed.dataset.is_some(),
        "teacher": viewed.has_teacher(),
        "figures": report.map_or_else(Vec::new, figures),
        "curves": {
            "psnr": report.map_or_else(Vec::new, psnr),
            "loss": thinned(&viewed.losses()),
        },
        "plan": report.map_or_else(Vec::new, |report| plan(&report.effects)),
    })
}

/// The view to begin with: a held-out one in the middle.
pub fn first(dataset: &Dataset) -> usize {
    let views = dataset.measured().1;
    views.get(views.len() / 2).copied().unwrap_or(0)
}

/// The cameras of all views at working size.
pub fn cameras(dataset: &Dataset, report: Option<&Report>) -> Vec<Value> {
    let measured = report.map_or(&[][..], |report| &report.luma.held_out_views);
    let psnr: BTreeMap<&str, f64> = (measured.iter())
        .map(|view| (view.name.as_str(), view.quality.psnr))
        .collect();
    let views = dataset.capture.views.iter().zip(&dataset.cameras);
    let of = |(k, (view, camera)): (usize, (&View, &Camera))| {
        let held_out = dataset.split.test.binary_search(&k).is_ok();
        // As the photo stands upright beside it.
        let mut told = pose(&camera.turned(view.stance.upright));
        told["name"] = json!(view.name);
        told["split"] = json!(if held_out { "test" } else { "train" });
        told["psnr"] = json!(psnr.get(view.name.as_str()));
        told
    };
    views.enumerate().map(of).collect()
}

/// A camera: its picture in pixels, and the rows that lead from the world to it.
fn pose(camera: &Camera) -> Value {
    json!({
        "width": camera.width,
        "height": camera.height,
        "fx": camera.fx,
        "fy": camera.fy,
        "cx": camera.cx,
        "cy": camera.cy,
        "rotation": camera.rotation.transpose().to_cols_array(),
        "translation": camera.translation.to_array(),
    })
}

/// Name and value of what is worth knowing of a run.
fn figures(report: &Report) -> Vec<[String; 2]> {
    let (luma, capture) = (&report.luma, &report.capture);
    let mut rows = Vec::new();
    let mut row = |name: &str, value: String| rows.push([name.to_owned(), value]);
    row("Gaussians", luma.splats.to_string());
    row(
        "Photos",
        format!("{} trained on, {} held out", capture.train, capture.test),
    );
    row("Preset", report.preset.to_string());
    row("Iterations", luma.iterations.to_string());
    if let Some(quality) = &luma.held_out {
        row("Gray scene", quality.in_words());
    }
    row("Training", format!("{:.0} s", luma.seconds.train));
    row("Device", report.device.name.clone());
    if let Some(chroma) = &report.chroma {
        let teachers = chroma
            .teachers
            .iter()
            .map(|teacher| teacher.info.name.as_str());
        row("Teacher", teachers.collect::<Vec<_>>().join(", "));
        row("Degree of a and b", chroma.settings.sh_degree.to_string());
        if let Some(error) = &chroma.pictures.delta_e {
            row(
                "From the teacher's colors",
                format!(
                    "ΔE00 {:.2} (mean, {} views)",
                    error.mean, chroma.measured_on
                ),
            );
        }
        row(
            "Colorfulness",
            format!("{:.1}", chroma.pictures.colorfulness),
        );
        row("Coloring", format!("{:.0} s", chroma.seconds.all));
    }
    rows
}

fn psnr(report: &Report) -> Vec<[f64; 2]> {
    let curve = report.luma.curve.iter();
    curve
        .map(|point| [point.iteration as f64, point.psnr])
        .collect()
}

/// So many rows that they can be drawn.
pub fn thinned(rows: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let step = rows.len().div_ceil(POINTS).max(1);
    rows.iter().step_by(step).copied().collect()
}

/// Decisions about the effects, and their evidence.
pub fn plan(effects: &[EffectReport]) -> Vec<Value> {
    let of = |effect: &EffectReport| {
        let why = match effect.evidence {
            Some(found) => format!("{found:.2} {}; threshold {}", effect.unit, effect.threshold),
            None => String::new(),
        };
        json!({ "effect": effect.name, "on": effect.on, "why": why })
    };
    effects.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_have_few_points() {
        let rows: Vec<[f64; 2]> = (0..1001).map(|k| [f64::from(k), 0.5]).collect();
        let few = thinned(&rows);
        assert!((100..=POINTS).contains(&few.len()), "{}", few.len());
        assert_eq!(few[1], rows[6]);
        assert_eq!(thinned(&rows[..3]), rows[..3]);
        assert!(thinned(&[]).is_empty());
    }
}
