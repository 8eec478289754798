//! Quality of a colored scene, as `colorize` reports it.

use std::sync::Arc;

use super::{
    EvalError, Observer, Progress, Reference, Task,
    picture::{gray_picture, to_picture},
    score::{mean, mean_error},
};
use crate::{
    capture::{Dataset, Exposure},
    chroma::{Supervision, native_rgb},
    measure,
    raster::{Raster, SceneRenderer},
    report::{ColorError, ColorQuality, ColorView, Row, to_image},
    splats::{ShField, Splats},
};

/// Views on the contact sheet, and how many of these may be painted ones.
const SHEET_ROWS: usize = 4;
const PAINTED_ROWS: usize = 2;

/// Columns of the contact sheet of a colored scene, left to right.
pub const COLUMNS: [&str; 4] = ["photo", "gray scene", "teacher", "colored scene"];

/// Pictures of the measured views and their scores.
pub struct Measured {
    /// The exported file against the native pictures, mean over the views.
    pub bake: ColorError,
    pub views: Vec<ColorView>,
    /// Some of them, for the contact sheet.
    pub rows: Vec<Row>,
}

impl Measured {
    /// Draws and measures the held-out views, or those that color was learned from where none is
    /// left: `luma` with `chroma` against `baked`, and that against the photos.
    pub fn of(
        raster: &Arc<Raster>,
        dataset: &Dataset,
        exposures: &[Exposure],
        [luma, baked]: [&Splats; 2],
        (chroma, streams): (&ShField, bool),
        supervision: &Supervision,
        observe: &mut Observer<'_>,
    ) -> Result<Self, EvalError> {
        let fields = [&luma.sh, chroma, &baked.sh];
        let mut renderer = match streams {
            true => SceneRenderer::on_host(raster, luma, &fields, dataset.extent),
            false => SceneRenderer::of(raster, luma, &fields, dataset.extent)?,
        };
        let (mut errors, mut views, mut rows) = (Vec::new(), Vec::new(), Vec::new());
        let measured = supervision.measured(&dataset.split).1;
        let painted = supervision
            .views
            .iter()
            .filter(|&&view| supervision.is_painted(view));
        let mut on_sheet: Vec<usize> = painted.copied().take(PAINTED_ROWS).collect();
        let others = measured.iter().filter(|view| !on_sheet.contains(view));
        let room = SHEET_ROWS - on_sheet.len();
        let others: Vec<usize> = others.copied().take(room).collect();
        on_sheet.extend(others);
        let mut drawn: Vec<usize> = measured.iter().chain(&on_sheet).copied().collect();
        drawn.sort_unstable();
        drawn.dedup();
        let mut done = 0;
        dataset.visit_colors(&drawn, |i, photo| {
            observe(Progress {
                task: Task::Measure,
                done,
                total: drawn.len(),
                name: &dataset.capture.views[i].name,
            });
            done += 1;
            let (photo, camera) = (&photo, &dataset.cameras[i]);
            let exposure = exposures[i];
            let reference = Reference { photo, exposure };
            let pictures = renderer.render(camera)?;
            let native = native_rgb(&pictures[0], &pictures[1]);
            let exported = pictures[2].shown();
            let measures = measured.contains(&i);
            if measures {
                errors.push(ColorError::from(measure::mean_delta_e(&native, &exported)));
            }
            let taught = supervision.shown(i)?;
            let taught = taught.map(|ab| native_rgb(&gray_picture(photo), &to_picture(&ab)));
            if measures && reference.measures() {
                let shown = reference.shown(&exported);
                let colorful = |rgb: &Vec<[f32; 3]>| reference.colorfulness(rgb);
                views.push(ColorView {
                    name: dataset.capture.views[i].name.clone(),
                    quality: ColorQuality {
                        delta_e: (reference.rgb())
                            .map(|truth| reference.color_error(&shown, &truth)),
                        colorfulness: colorful(&shown),
                        teacher_colorfulness: taught.as_ref().map(colorful),
                    },
                });
            }
            if on_sheet.contains(&i) {
                let (width, height) = (camera.width, camera.height);
                let bytes = |pixels: &Vec<[f32; 3]>| to_image(width, height, pixels);
                let row = Row {
                    width,
                    height,
                    caption: caption(dataset, supervision, i),
                    pictures: vec![
                        Some(bytes(&photo.rgb_values())),
                        Some(bytes(&pictures[0].shown())),
                        taught.as_ref().map(bytes),
                        Some(bytes(&exported)),
                    ],
                };
                rows.push(row.turned(dataset.capture.views[i].stance.upright));
            }
            Ok::<_, EvalError>(())
        })?;
        Ok(Self {
            bake: mean_error(errors.into_iter().map(Some)).unwrap_or(ColorError {
                mean: f64::NAN,
                percentile_95: f64::NAN,
            }),
            views,
            rows,
        })
    }

    /// The mean over the views.
    pub fn mean(&self) -> ColorQuality {
        let all = || self.views.iter().map(|view| &view.quality);
        ColorQuality {
            delta_e: mean_error(all().map(|quality| quality.delta_e)),
            colorfulness: mean(all().map(|quality| Some(quality.colorfulness))).unwrap_or(0.0),
            teacher_colorfulness: mean(all().map(|quality| quality.teacher_colorfulness)),
        }
    }
}

/// A view's name, and what it was to the colors.
fn caption(dataset: &Dataset, supervision: &Supervision, view: usize) -> String {
    let name = &dataset.capture.views[view].name;
    let role = match (
        supervision.is_painted(view),
        supervision.views.contains(&view),
    ) {
        (true, _) => " (painted: colors are learned from it)",
        (false, true) => "",
        (false, false) => " (held out: no color is learned from it)",
    };
    format!("{name}{role}")
}
