//! Pictures of a view against its photo.

use super::{
    ColoredScene, Drawing, EvalError, Layer, Lpips, Observer, Painter, Progress, Reference, Task,
    picture::{ab_of, gray_picture, to_picture},
};
use crate::{
    chroma::teacher::AbImage,
    color::gray_from_rgb,
    measure,
    report::{ColorError, LumaScore, Method, PictureScore, ViewScore, error_map},
};

/// A measured view.
pub struct Scored {
    /// The figures.
    pub score: ViewScore,
    /// ΔE00 between the native and the exported picture.
    bake: Option<ColorError>,
    /// Width and height.
    pub size: [u32; 2],
    /// Pictures for the page.
    pub shots: Vec<Shot>,
}

/// A picture for the page.
pub struct Shot {
    /// Part of its file's name.
    pub file: &'static str,
    pub caption: &'static str,
    /// RGB in [0, 1], `[height, width]`.
    pub pixels: Vec<[f32; 3]>,
}

/// Methods on the page, and part of their files' names; the exported picture stands for the
/// native one, and what that costs is the bake's figure.
const SHOWN: [(Method, &str); 8] = [
    (Method::Teacher, "teacher"),
    (Method::Exported, "ours"),
    (Method::RgbSplats, "rgb-splats"),
    (Method::ChromadistillPaper, "chromadistill-paper"),
    (Method::ChromadistillOneScale, "chromadistill-one-scale"),
    (Method::ChromadistillCode, "chromadistill-code"),
    (Method::ChromadistillRgb, "chromadistill-rgb"),
    (Method::PerFrame, "per-frame"),
];

impl Scored {
    /// Measures what was drawn, and the teacher's answer, against a photo: what was drawn
    /// as the photo would show it.
    pub fn of(
        name: &str,
        reference: Reference<'_>,
        drawing: &Drawing,
        answer: Option<&AbImage>,
        mut lpips: Option<&mut Lpips>,
    ) -> Result<Self, EvalError> {
        let photo = reference.photo;
        let size = [photo.width, photo.height];
        let shown = photo.rgb_values();
        let luma_shown = reference.luma_shown(&drawing.gray.pixels);
        let drawn_gray = rgb_of(&luma_shown);
        let mut shots = Vec::new();
        let mut show = |file, caption, pixels| {
            shots.push(Shot {
                file,
                caption,
                pixels,
            })
        };
        show("photo", "photo", shown.clone());
        show("luma", "luma", drawn_gray.clone());
        let luma = luma_score(reference, drawing, &luma_shown, lpips.as_deref_mut())?;
        // Fidelity to a gray photo's colors is no figure.
        let truth = reference.rgb();
        let truth = truth.as_deref();
        let mut scores = Vec::new();
        let mut rendered = Vec::new();
        let mut score = |method: Method, rgb: Vec<[f32; 3]>, ab: &[[f32; 2]]| {
            let counted = reference.counted(&rgb);
            let wanted = truth.map(|truth| reference.counted(truth));
            let wanted = wanted.as_deref();
            let gray = gray_of(&rgb);
            scores.push(PictureScore {
                method,
                psnr: wanted
                    .map(|t| measure::reported_psnr(counted.as_flattened(), t.as_flattened())),
                ssim: truth.map(|t| rgb_ssim(reference, &rgb, t)),
                delta_e: truth.map(|t| reference.color_error(&rgb, t)),
                ab_error: wanted.map(|t| measure::ab_error(&reference.counted(ab), &ab_of(t))),
                colorfulness: measure::colorfulness(&counted),
                diversity: measure::color_diversity(&reference.counted(ab)),
                gray_psnr: reference.luma_quality(&gray).psnr,
                sharpness: reference.sharpness(&gray),
                lpips: match (&mut lpips, truth) {
                    (Some(lpips), Some(t)) => {
                        Some(lpips.distance(&reference.patched(&rgb, t), t, size)?)
                    }
                    _ => None,
                },
            });
            rendered.push((method, rgb));
            Ok::<_, EvalError>(())
        };
        for (method, layer) in &drawing.layers {
            let rgb = reference.shown(&layer.rgb(&drawing.gray));
            score(*method, rgb, &layer.ab())?;
        }
        if let Some(answer) = answer {
            let layer = Layer::Ab(to_picture(answer));
            score(Method::Teacher, layer.rgb(&gray_picture(photo)), &answer.ab)?;
        }
        let of = |method: Method| {
            let found = rendered.iter().find(|(m, _)| *m == method);
            found.map(|(_, rgb)| rgb)
        };
        for (method, file) in SHOWN {
            if let Some(rgb) = of(method) {
                show(file, method.name(), rgb.clone());
            }
        }
        if let (Some(truth), Some(exported)) = (truth, of(Method::Exported)) {
            for (file, caption, errors) in error_maps(drawing, answer, exported, truth) {
                // Pixels that do not count have no error.
                let none = vec![0.0; errors.len()];
                show(file, caption, error_map(&reference.patched(&errors, &none)));
            }
        }
        scores.push(PictureScore {
            method: Method::Photo,
            psnr: None,
            ssim: None,
            delta_e: None,
            ab_error: None,
            colorfulness: reference.colorfulness(&shown),
            diversity: measure::color_diversity(&reference.counted(&ab_of(&shown))),
            gray_psnr: measure::IDENTICAL_PSNR,
            sharpness: luma.photo_sharpness,
            lpips: None,
        });
        Ok(Self {
            score: ViewScore {
                name: name.to_owned(),
                luma,
                pictures: scores,
            },
            bake: bake(drawing),
            size,
            shots,
        })
    }
}

/// Luma of a view against its photo.
fn luma_score(
    reference: Reference<'_>,
    drawing: &Drawing,
    shown: &[f32],
    lpips: Option<&mut Lpips>,
) -> Result<LumaScore, EvalError> {
    let (photo, wanted) = (reference.photo, reference.gray());
    let quality = reference.luma_quality(&drawing.gray.pixels);
    let distance = |lpips: &mut Lpips| {
        let [drawn, wanted] = [rgb_of(shown), rgb_of(&wanted)];
        let drawn = reference.patched(&drawn, &wanted);
        lpips.distance(&drawn, &wanted, [photo.width, photo.height])
    };
    Ok(LumaScore {
        psnr: quality.psnr,
        corrected_psnr: quality.corrected_psnr,
        plain_psnr: None,
        ssim: quality.ssim,
        sharpness: reference.sharpness(shown),
        photo_sharpness: reference.sharpness(&wanted),
        lpips: lpips.map(distance).transpose()?,
    })
}

/// Color errors of each pixel, by file and caption.
fn error_maps(
    drawing: &Drawing,
    answer: Option<&AbImage>,
    exported: &[[f32; 3]],
    truth: &[[f32; 3]],
) -> Vec<(&'static str, &'static str, Vec<f64>)> {
    let wanted = ab_of(truth);
    let ab = drawing.layer(Method::Exported).map(Layer::ab);
    let ours = ab.map(|ab| ("ab", "a/b error, ours", distances(&ab, &wanted)));
    let teacher = answer.map(|answer| {
        let errors = distances(&answer.ab, &wanted);
        ("ab-teacher", "a/b error, teacher", errors)
    });
    let delta_e = ("delta-e", "ΔE00, ours", measure::delta_e(exported, truth));
    [Some(delta_e), ours, teacher]
        .into_iter()
        .flatten()
        .collect()
}

/// Gray as RGB.
fn rgb_of(gray: &[f32]) -> Vec<[f32; 3]> {
    gray.iter().map(|&v| [v; 3]).collect()
}

/// The gray with the lightness of each color.
fn gray_of(rgb: &[[f32; 3]]) -> Vec<f32> {
    let gray = |rgb: &[f32; 3]| gray_from_rgb(rgb.map(f64::from)) as f32;
    rgb.iter().map(gray).collect()
}

/// Color error of the export, under the scene's own exposure.
fn bake(drawing: &Drawing) -> Option<ColorError> {
    let of = |method| Some(drawing.layer(method)?.rgb(&drawing.gray));
    let (native, exported) = (of(Method::Native)?, of(Method::Exported)?);
    Some(measure::mean_delta_e(&native, &exported).into())
}

/// Distance of each pixel's colors in the a, b plane.
fn distances(ab: &[[f32; 2]], wanted: &[[f32; 2]]) -> Vec<f64> {
    let apart = |(p, q): (&[f32; 2], &[f32; 2])| f64::from((p[0] - q[0]).hypot(p[1] - q[1]));
    ab.iter().zip(wanted).map(apart).collect()
}

fn rgb_ssim(reference: Reference<'_>, shown: &[[f32; 3]], truth: &[[f32; 3]]) -> f64 {
    let channel = |pixels: &[[f32; 3]], c: usize| pixels.iter().map(|p| p[c]).collect::<Vec<_>>();
    let of = |c| reference.ssim(&channel(shown, c), &channel(truth, c));
    (of(0) + of(1) + of(2)) / 3.0
}

/// The mean of those that are there.
fn mean(values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let values: Vec<f64> = values.flatten().collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn mean_error(errors: impl Iterator<Item = Option<ColorError>> + Clone) -> Option<ColorError> {
    Some(ColorError {
        mean: mean(errors.clone().map(|e| Some(e?.mean)))?,
        percentile_95: mean(errors.map(|e| Some(e?.percentile_95)))?,
    })
}

/// Mean over the views; at least one is measured.
pub fn mean_luma(views: &[Scored]) -> LumaScore {
    let lumas = || views.iter().map(|view| &view.score.luma);
    LumaScore {
        psnr: mean(lumas().map(|l| Some(l.psnr))).unwrap_or(f64::NAN),
        corrected_psnr: mean(lumas().map(|l| l.corrected_psnr)),
        plain_psnr: None,
        ssim: mean(lumas().map(|l| Some(l.ssim))).unwrap_or(f64::NAN),
        sharpness: mean(lumas().map(|l| Some(l.sharpness))).unwrap_or(f64::NAN),
        photo_sharpness: mean(lumas().map(|l| Some(l.photo_sharpness))).unwrap_or(f64::NAN),
        lpips: mean(lumas().map(|l| l.lpips)),
    }
}

/// Mean colorfulness of the teacher's pictures of all photos.
pub fn teacher_colorfulness(
    painter: &Painter<'_>,
    scene: &ColoredScene,
    observe: &mut Observer<'_>,
) -> Result<Option<f64>, EvalError> {
    let (mut values, mut done) = (Vec::new(), 0);
    let views: Vec<usize> = (0..scene.dataset.cameras.len())
        .filter(|&view| painter.answers(view))
        .collect();
    scene.dataset.visit(&views, |view, photo| {
        observe(Progress {
            task: Task::Strength,
            done,
            total: views.len(),
            name: &scene.dataset.capture.views[view].name,
        });
        done += 1;
        if let Some(answer) = painter.answer(view)? {
            let layer = Layer::Ab(to_picture(&answer));
            let reference = scene.reference(view, photo);
            let measures = reference.measures();
            values.push(measures.then(|| reference.colorfulness(&layer.rgb(&gray_picture(photo)))));
        }
        Ok::<_, EvalError>(())
    })?;
    Ok(mean(values.into_iter()))
}

/// Mean over the views of what the export costs.
pub fn mean_bake(views: &[Scored]) -> Option<ColorError> {
    mean_error(views.iter().map(|view| view.bake))
}

/// Each method's mean over the views that have it.
pub fn mean_pictures(views: &[Scored]) -> Vec<PictureScore> {
    let all = || views.iter().flat_map(|view| &view.score.pictures);
    let mut methods: Vec<Method> = all().map(|score| score.method).collect();
    methods.sort();
    methods.dedup();
    methods
        .into_iter()
        .map(|method| {
            let own = || all().filter(move |score| score.method == method);
            PictureScore {
                method,
                psnr: mean(own().map(|s| s.psnr)),
                ssim: mean(own().map(|s| s.ssim)),
                delta_e: mean_error(own().map(|s| s.delta_e)),
                ab_error: mean(own().map(|s| s.ab_error)),
                colorfulness: mean(own().map(|s| Some(s.colorfulness))).unwrap_or(f64::NAN),
                diversity: mean(own().map(|s| Some(s.diversity))).unwrap_or(f64::NAN),
                gray_psnr: mean(own().map(|s| Some(s.gray_psnr))).unwrap_or(f64::NAN),
                sharpness: mean(own().map(|s| Some(s.sharpness))).unwrap_or(f64::NAN),
                lpips: mean(own().map(|s| s.lpips)),
            }
        })
        .collect()
}
