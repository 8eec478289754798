//! Pictures of a view against its photo.

use std::collections::BTreeSet;

use super::{
    ColoredScene, Drawing, EvalError, Layer, Lpips, MethodAb, Observer, Painter, Progress,
    Reference, Task,
    picture::{ab_of, as_photo, gray_picture, to_picture},
};
use crate::{
    capture::Exposure,
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
    pub file: String,
    pub caption: String,
    /// RGB in [0, 1], `[height, width]`.
    pub pixels: Vec<[f32; 3]>,
}

impl Shot {
    fn new(file: &str, caption: &str, pixels: Vec<[f32; 3]>) -> Self {
        Self {
            file: file.to_owned(),
            caption: caption.to_owned(),
            pixels,
        }
    }

    /// A method's picture.
    pub fn of(method: &Method, pixels: Vec<[f32; 3]>) -> Self {
        Self::new(&method.file_stem(), method.name(), pixels)
    }
}

impl Drawing {
    /// Pictures for people, RGB in [0, 1]: the gray one and each method's. The exported one stands
    /// for the native one: what that costs is the bake's figure.
    pub fn pictures(&self) -> Vec<(Method, Vec<[f32; 3]>)> {
        let layers = self.layers.iter();
        let layers = layers.filter(|(method, _)| *method != Method::Native);
        let layers = layers.map(|(method, layer)| (method.clone(), layer.rgb(&self.gray)));
        let luma = (Method::Luma, self.gray.shown());
        [luma].into_iter().chain(layers).collect()
    }

    /// Scores of each method's picture against the gray one in 8 bits, and its a/b.
    pub fn scores(&self) -> Vec<(PictureScore, MethodAb)> {
        let reference = Reference {
            photo: &as_photo(&self.gray),
            exposure: Exposure::NONE,
        };
        let score = |(method, layer): &(Method, Layer)| {
            let ab = layer.ab();
            let scored = score(reference, method, &layer.rgb(&self.gray), &ab);
            (scored, (method.clone(), ab))
        };
        self.layers.iter().map(score).collect()
    }
}

/// A method's picture, as the photo would show it, against the photo.
fn score(
    reference: Reference<'_>,
    method: &Method,
    rgb: &[[f32; 3]],
    ab: &[[f32; 2]],
) -> PictureScore {
    // Fidelity to a gray photo's colors is no figure.
    let truth = reference.rgb();
    let truth = truth.as_deref();
    let (counted, ab) = (reference.counted(rgb), reference.counted(ab));
    let wanted = truth.map(|truth| reference.counted(truth));
    let wanted = wanted.as_deref();
    let gray = gray_of(rgb);
    PictureScore {
        method: method.clone(),
        psnr: wanted.map(|t| measure::reported_psnr(counted.as_flattened(), t.as_flattened())),
        ssim: truth.map(|t| rgb_ssim(reference, rgb, t)),
        delta_e: truth.map(|t| reference.color_error(rgb, t)),
        ab_error: wanted.map(|t| measure::ab_error(&ab, &ab_of(t))),
        colorfulness: measure::colorfulness(&counted),
        diversity: measure::color_diversity(&ab),
        gray_psnr: reference.gray_psnr(&gray),
        sharpness: reference.sharpness(&gray),
        lpips: None,
    }
}

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
        let photo_rgb = photo.rgb_values();
        let luma_shown = reference.luma_shown(&drawing.gray.pixels);
        let mut shots = vec![
            Shot::of(&Method::Photo, photo_rgb.clone()),
            Shot::of(&Method::Luma, rgb_of(&luma_shown)),
        ];
        let luma = luma_score(reference, drawing, &luma_shown, lpips.as_deref_mut())?;
        let layers = drawing.layers.iter().map(|(method, layer)| {
            let rgb = reference.shown(&layer.rgb(&drawing.gray));
            (method.clone(), rgb, layer.ab())
        });
        let taught = answer.map(|answer| {
            let layer = Layer::Ab(to_picture(answer));
            (
                Method::Teacher,
                layer.rgb(&gray_picture(photo)),
                answer.ab.clone(),
            )
        });
        let mut pictures: Vec<_> = layers.chain(taught).collect();
        pictures.sort_by(|(a, ..), (b, ..)| a.cmp(b));
        let of = |method: &Method| {
            let mut all = pictures.iter();
            Some(&all.find(|(own, ..)| own == method)?.1)
        };
        // Where photos are gray, the teacher's colors are the only ones.
        let truth = reference.rgb();
        let wanted = truth.as_ref().or(of(&Method::Teacher));
        let mut scores = Vec::new();
        for (method, rgb, ab) in &pictures {
            let mut own = score(reference, method, rgb, ab);
            if let (Some(lpips), Some(wanted)) = (lpips.as_deref_mut(), wanted)
                && !std::ptr::eq(wanted, rgb)
            {
                own.lpips = Some(lpips.distance(&reference.patched(rgb, wanted), wanted, size)?);
            }
            scores.push(own);
            if *method != Method::Native {
                shots.push(Shot::of(method, rgb.clone()));
            }
        }
        if let (Some(truth), Some(exported)) = (&truth, of(&Method::Exported)) {
            for (file, caption, errors) in error_maps(drawing, answer, exported, truth) {
                // Pixels that do not count have no error.
                let none = vec![0.0; errors.len()];
                let map = error_map(&reference.patched(&errors, &none));
                shots.push(Shot::new(file, caption, map));
            }
        }
        scores.push(PictureScore {
            method: Method::Photo,
            psnr: None,
            ssim: None,
            delta_e: None,
            ab_error: None,
            colorfulness: reference.colorfulness(&photo_rgb),
            diversity: measure::color_diversity(&reference.counted(&ab_of(&photo_rgb))),
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
    let ab = drawing.layer(&Method::Exported).map(Layer::ab);
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
    let (native, exported) = (of(&Method::Native)?, of(&Method::Exported)?);
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
pub(super) fn mean(values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let values: Vec<f64> = values.flatten().collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

pub(super) fn mean_error(
    errors: impl Iterator<Item = Option<ColorError>> + Clone,
) -> Option<ColorError> {
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

/// Mean colorfulness of the exported file's and of the teacher's pictures of all photos. A teacher
/// that colors one photo more strongly than the next is not met in a few of them.
pub fn strengths(
    painter: &mut Painter<'_>,
    scene: &ColoredScene,
    observe: &mut Observer<'_>,
) -> Result<[Option<f64>; 2], EvalError> {
    let (mut ours, mut teachers, mut done) = (Vec::new(), Vec::new(), 0);
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
            if reference.measures() {
                let shown = painter.exported(&scene.dataset.cameras[view])?;
                ours.push(Some(reference.colorfulness(&reference.shown(&shown))));
                let taught = layer.rgb(&gray_picture(photo));
                teachers.push(Some(reference.colorfulness(&taught)));
            }
        }
        Ok::<_, EvalError>(())
    })?;
    Ok([ours, teachers].map(|values| mean(values.into_iter())))
}

/// Mean over the views of what the export costs.
pub fn mean_bake(views: &[Scored]) -> Option<ColorError> {
    mean_error(views.iter().map(|view| view.bake))
}

/// Each method's mean over the pictures that have it.
pub fn mean_pictures<'a>(all: impl Iterator<Item = &'a PictureScore> + Clone) -> Vec<PictureScore> {
    let methods: BTreeSet<&Method> = all.clone().map(|score| &score.method).collect();
    let of = |method: &Method| {
        let own = || all.clone().filter(|score| score.method == *method);
        let each = |value: fn(&PictureScore) -> f64| {
            mean(own().map(|score| Some(value(score)))).unwrap_or(f64::NAN)
        };
        PictureScore {
            method: method.clone(),
            psnr: mean(own().map(|s| s.psnr)),
            ssim: mean(own().map(|s| s.ssim)),
            delta_e: mean_error(own().map(|s| s.delta_e)),
            ab_error: mean(own().map(|s| s.ab_error)),
            colorfulness: each(|s| s.colorfulness),
            diversity: each(|s| s.diversity),
            gray_psnr: each(|s| s.gray_psnr),
            sharpness: each(|s| s.sharpness),
            lpips: mean(own().map(|s| s.lpips)),
        }
    };
    methods.into_iter().map(of).collect()
}
