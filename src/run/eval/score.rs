//! Pictures of a view against its photo.

use super::{
    drawing::{Drawing, Layer, Painter, ab_of, gray_picture, to_picture},
    lpips::Lpips,
    subject::Subject,
};
use crate::{
    capture::Photo,
    chroma::teacher::AbImage,
    measure,
    report::{ColorError, LumaScore, Method, PictureScore, ViewScore, error_map},
    run::{
        RunError,
        scene::{gray_pixels, gray_to_rgb, rgb_pixels},
    },
};

/// A measured view.
pub(super) struct Scored {
    pub score: ViewScore,
    /// ΔE00 between the native and the exported picture.
    bake: Option<ColorError>,
    /// Width and height.
    pub size: [u32; 2],
    /// Pictures for the page.
    pub shots: Vec<Shot>,
}

/// A picture for the page.
pub(super) struct Shot {
    /// Part of its file's name.
    pub file: &'static str,
    /// What it shows.
    pub caption: &'static str,
    /// RGB in [0, 1], `[height, width]`.
    pub pixels: Vec<[f32; 3]>,
}

/// Methods on the page; the exported picture stands for the native one, and what that
/// costs is the bake's figure.
const SHOWN: [(Method, &str, &str); 4] = [
    (Method::Teacher, "teacher", "teacher"),
    (Method::Exported, "ours", "ours"),
    (Method::RgbSplats, "rgb-splats", "teacher, then RGB splats"),
    (Method::PerFrame, "per-frame", "luma, then teacher"),
];

impl Scored {
    /// Measures what was drawn, and the teacher's answer, against a photo.
    pub fn of(
        name: &str,
        photo: &Photo,
        drawing: &Drawing,
        answer: Option<&AbImage>,
        mut lpips: Option<&mut Lpips>,
    ) -> Result<Self, RunError> {
        let size = [photo.width, photo.height];
        let shape = size.map(|side| side as usize);
        let gray = gray_pixels(photo);
        let shown = rgb_pixels(photo);
        let drawn_gray = gray_to_rgb(&drawing.gray.pixels);
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
        let clamped: Vec<f32> = drawn_gray.iter().map(|rgb| rgb[0]).collect();
        let luma = LumaScore {
            psnr: measure::reported_psnr(&clamped, &gray),
            ssim: measure::ssim(shape[0], shape[1], &clamped, &gray),
            lpips: match &mut lpips {
                Some(lpips) => Some(lpips.distance(&drawn_gray, &gray_to_rgb(&gray), size)?),
                None => None,
            },
        };
        // Fidelity to a gray photo's colours is no figure.
        let truth = photo.rgb.as_ref().map(|_| &shown);
        let mut scores = Vec::new();
        let mut rendered = Vec::new();
        let mut score = |method: Method, rgb: Vec<[f32; 3]>, ab: &[[f32; 2]]| {
            scores.push(PictureScore {
                method,
                psnr: truth.map(|t| measure::reported_psnr(rgb.as_flattened(), t.as_flattened())),
                ssim: truth.map(|t| rgb_ssim(shape, &rgb, t)),
                delta_e: truth.map(|t| color_error(&rgb, t)),
                ab_error: truth.map(|t| measure::ab_error(ab, &ab_of(t))),
                colorfulness: measure::colorfulness(&rgb),
                colorfulness_absolute: measure::colorfulness_absolute(&rgb),
                lpips: match (&mut lpips, truth) {
                    (Some(lpips), Some(t)) => Some(lpips.distance(&rgb, t, size)?),
                    _ => None,
                },
            });
            rendered.push((method, rgb));
            Ok::<_, RunError>(())
        };
        for (method, layer) in &drawing.layers {
            score(*method, layer.rgb(&drawing.gray), &layer.ab())?;
        }
        if let Some(answer) = answer {
            let layer = Layer::Ab(to_picture(answer));
            score(Method::Teacher, layer.rgb(&gray_picture(photo)), &answer.ab)?;
        }
        let of = |method: Method| {
            rendered
                .iter()
                .find(|(m, _)| *m == method)
                .map(|(_, rgb)| rgb)
        };
        let bake = of(Method::Native)
            .zip(of(Method::Exported))
            .map(|(native, exported)| color_error(native, exported));
        for (method, file, caption) in SHOWN {
            if let Some(rgb) = of(method) {
                show(file, caption, rgb.clone());
            }
        }
        if let (Some(truth), Some(exported)) = (truth, of(Method::Exported)) {
            let wanted = ab_of(truth);
            let mut map = |file, caption, errors: &[f64]| show(file, caption, error_map(errors));
            map("delta-e", "ΔE00, ours", &measure::delta_e(exported, truth));
            map(
                "ab",
                "a/b error, ours",
                &distances(&ab_of(exported), &wanted),
            );
            if let Some(answer) = answer {
                let errors = distances(&answer.ab, &wanted);
                map("ab-teacher", "a/b error, teacher", &errors);
            }
        }
        scores.push(PictureScore {
            method: Method::Photo,
            psnr: None,
            ssim: None,
            delta_e: None,
            ab_error: None,
            colorfulness: measure::colorfulness(&shown),
            colorfulness_absolute: measure::colorfulness_absolute(&shown),
            lpips: None,
        });
        Ok(Self {
            score: ViewScore {
                name: name.to_owned(),
                luma,
                pictures: scores,
            },
            bake,
            size,
            shots,
        })
    }
}

/// Distance of each pixel's colours in the a, b plane.
fn distances(ab: &[[f32; 2]], wanted: &[[f32; 2]]) -> Vec<f64> {
    let apart = |(p, q): (&[f32; 2], &[f32; 2])| f64::from((p[0] - q[0]).hypot(p[1] - q[1]));
    ab.iter().zip(wanted).map(apart).collect()
}

fn rgb_ssim([width, height]: [usize; 2], a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let channel = |pixels: &[[f32; 3]], c: usize| pixels.iter().map(|p| p[c]).collect::<Vec<_>>();
    let of = |c| measure::ssim(width, height, &channel(a, c), &channel(b, c));
    (of(0) + of(1) + of(2)) / 3.0
}

fn color_error(a: &[[f32; 3]], b: &[[f32; 3]]) -> ColorError {
    let error = measure::mean_delta_e(a, b);
    ColorError {
        mean: error.mean,
        percentile_95: error.percentile_95,
    }
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
pub(super) fn mean_luma(views: &[Scored]) -> LumaScore {
    let lumas = || views.iter().map(|view| &view.score.luma);
    LumaScore {
        psnr: mean(lumas().map(|l| Some(l.psnr))).unwrap_or(f64::NAN),
        ssim: mean(lumas().map(|l| Some(l.ssim))).unwrap_or(f64::NAN),
        lpips: mean(lumas().map(|l| l.lpips)),
    }
}

/// Mean colourfulness of the teacher's pictures of all photos.
pub(super) fn teacher_colorfulness(painter: &Painter<'_>, subject: &Subject) -> Option<f64> {
    let photos = subject.scene.photos.iter().enumerate();
    mean(photos.map(|(i, (photo, _))| {
        let layer = Layer::Ab(to_picture(painter.answer(i)?));
        Some(measure::colorfulness(&layer.rgb(&gray_picture(photo))))
    }))
}

/// Mean over the views of what the export costs.
pub(super) fn mean_bake(views: &[Scored]) -> Option<ColorError> {
    mean_error(views.iter().map(|view| view.bake))
}

/// Each method's mean over the views that have it.
pub(super) fn mean_pictures(views: &[Scored]) -> Vec<PictureScore> {
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
                colorfulness_absolute: mean(own().map(|s| Some(s.colorfulness_absolute)))
                    .unwrap_or(f64::NAN),
                lpips: mean(own().map(|s| s.lpips)),
            }
        })
        .collect()
}
