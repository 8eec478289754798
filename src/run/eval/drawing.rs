//! One viewpoint, drawn by every method.

use std::sync::Arc;

use super::{subject::Subject, teacher::EvalTeacher};
use crate::{
    capture::{Camera, Photo},
    chroma::{native_rgb, teacher::AbImage},
    color::srgb_to_lab,
    measure::DepthSteps,
    raster::{Picture, Raster, Renderer},
    report::Method,
    run::{
        RunError,
        scene::{gray_pixels, renderer, shown_rgb},
    },
    splats::ShField,
};

/// Draws every method's picture.
pub(super) struct Painter<'a> {
    raster: Arc<Raster>,
    subject: &'a Subject,
    renderer: Renderer,
    has_native: bool,
    /// Methods that are RGB splats, in the order of their fields.
    rgb: Vec<Method>,
    teacher: Option<&'a mut EvalTeacher>,
}

/// A coloured picture as a method makes it.
pub(super) enum Layer {
    /// a and b, to be shown with the gray picture's lightness.
    Ab(Picture),
    /// RGB in [0, 1], `[height, width]`.
    Rgb(Vec<[f32; 3]>),
}

/// A viewpoint.
pub(super) struct Drawing {
    pub camera: Camera,
    /// One channel, encoded sRGB.
    pub gray: Picture,
    pub layers: Vec<(Method, Layer)>,
}

impl<'a> Painter<'a> {
    /// A painter of the subject's own pictures, of RGB splats on its geometry, and of
    /// what a teacher makes of the gray pictures.
    pub fn new(
        raster: &Arc<Raster>,
        subject: &'a Subject,
        rgb: &[(Method, &ShField)],
        teacher: Option<&'a mut EvalTeacher>,
    ) -> Result<Self, RunError> {
        let dataset = &subject.dataset;
        let mut fields = vec![&subject.luma.sh];
        fields.extend(rgb.iter().map(|(_, field)| field));
        fields.extend(&subject.chroma);
        Ok(Self {
            raster: raster.clone(),
            subject,
            renderer: renderer(dataset, raster, &subject.luma, &fields)?,
            has_native: subject.chroma.is_some(),
            rgb: rgb.iter().map(|(method, _)| *method).collect(),
            teacher,
        })
    }

    /// Draws what `camera` sees; `name` is for the teacher's errors.
    pub fn draw(&mut self, camera: &Camera, name: &str) -> Result<Drawing, RunError> {
        let mut pictures = self.renderer.render(camera)?.into_iter();
        let mut next = || pictures.next().expect("a picture for every field");
        let gray = next();
        let mut layers = Vec::new();
        for &method in &self.rgb {
            layers.push((method, Layer::Rgb(shown_rgb(&next().pixels))));
        }
        if self.has_native {
            layers.insert(0, (Method::Native, Layer::Ab(next())));
        }
        if let Some(teacher) = &mut self.teacher
            && let Some(answer) = teacher.color_frame(name, &gray)?
        {
            layers.push((Method::PerFrame, Layer::Ab(to_picture(&answer))));
        }
        Ok(Drawing {
            camera: camera.clone(),
            gray,
            layers,
        })
    }

    /// The scene's median depth along the camera's z axis in world units, `[height,
    /// width]`; NaN where it is not opaque enough to have one.
    pub fn depth(&self, camera: &Camera) -> Result<Vec<f32>, RunError> {
        let steps = DepthSteps::new(&self.subject.luma, camera);
        let fields: Vec<&ShField> = steps.fields.iter().collect();
        let luma = &self.subject.luma;
        let renderer = renderer(&self.subject.dataset, &self.raster, luma, &fields)?;
        // Zeros and ones can be drawn.
        let mut renderer = renderer.with_one_list();
        let pixels = camera.width as usize * camera.height as usize;
        Ok(steps.median(&renderer.render(camera)?, pixels))
    }

    /// The teacher's answer for a photo.
    pub fn answer(&self, view: usize) -> Result<Option<AbImage>, RunError> {
        match &self.teacher {
            Some(teacher) => teacher.answer(view),
            None => Ok(None),
        }
    }

    /// Whether the teacher has an answer for a photo.
    pub fn answers(&self, view: usize) -> bool {
        (self.teacher.as_ref()).is_some_and(|teacher| teacher.answers(view))
    }

    /// Name, kind and identity of the teacher.
    pub fn teacher(&self) -> Option<serde_json::Value> {
        Some(self.teacher.as_ref()?.info.clone())
    }
}

impl Drawing {
    /// A method's picture, where there is one.
    pub fn layer(&self, method: Method) -> Option<&Layer> {
        let found = self.layers.iter().find(|(m, _)| *m == method);
        found.map(|(_, layer)| layer)
    }
}

impl Layer {
    /// a and b of each pixel, `[height, width]`.
    pub fn ab(&self) -> Vec<[f32; 2]> {
        match self {
            Self::Ab(picture) => picture.pixels.as_chunks().0.to_vec(),
            Self::Rgb(rgb) => ab_of(rgb),
        }
    }

    /// RGB in [0, 1] of each pixel, with the lightness of `gray` where the layer has none.
    pub fn rgb(&self, gray: &Picture) -> Vec<[f32; 3]> {
        match self {
            Self::Ab(picture) => native_rgb(gray, picture),
            Self::Rgb(rgb) => rgb.clone(),
        }
    }
}

/// CIELAB a and b of RGB in [0, 1].
pub(super) fn ab_of(rgb: &[[f32; 3]]) -> Vec<[f32; 2]> {
    let ab = |rgb: &[f32; 3]| {
        let [_, a, b] = srgb_to_lab(rgb.map(f64::from));
        [a as f32, b as f32]
    };
    rgb.iter().map(ab).collect()
}

/// A photo's gray as a picture of one channel.
pub(super) fn gray_picture(photo: &Photo) -> Picture {
    Picture {
        width: photo.width,
        height: photo.height,
        channels: 1,
        pixels: gray_pixels(photo),
    }
}

/// A teacher's answer as a picture of two channels.
pub(super) fn to_picture(answer: &AbImage) -> Picture {
    Picture {
        width: answer.width,
        height: answer.height,
        channels: 2,
        pixels: answer.ab.as_flattened().to_vec(),
    }
}
