//! One viewpoint, drawn by every method.

use std::sync::Arc;

use super::{
    ColoredScene, EvalError, MeasuredTeacher,
    picture::{ab_of, to_picture},
};
use crate::{
    capture::Camera,
    chroma::{native_rgb, teacher::AbImage},
    raster::{Raster, RenderedImage, SceneRenderer},
    report::Method,
    splats::ShField,
};

/// Draws every method's picture.
pub struct Painter<'a> {
    renderer: SceneRenderer<'a>,
    has_native: bool,
    /// Methods that are RGB splats, in the order of their fields.
    rgb: Vec<Method>,
    teacher: Option<&'a mut MeasuredTeacher>,
}

/// A colored picture as a method makes it.
pub enum Layer {
    /// a and b, to be shown with the gray picture's lightness.
    Ab(RenderedImage),
    /// RGB in [0, 1], `[height, width]`.
    Rgb(Vec<[f32; 3]>),
}

/// A viewpoint.
pub struct Drawing {
    /// Camera of the viewpoint.
    pub camera: Camera,
    /// One channel, encoded sRGB.
    pub gray: RenderedImage,
    /// Each method's picture.
    pub layers: Vec<(Method, Layer)>,
}

impl<'a> Painter<'a> {
    /// A painter of the scene's own pictures, of RGB splats on its geometry, and of
    /// what a teacher makes of the gray pictures.
    pub fn new(
        raster: &Arc<Raster>,
        scene: &'a ColoredScene,
        rgb: &[(Method, &'a ShField)],
        teacher: Option<&'a mut MeasuredTeacher>,
    ) -> Result<Self, EvalError> {
        let dataset = &scene.dataset;
        let mut fields = vec![&scene.luma.sh];
        fields.extend(rgb.iter().map(|&(_, field)| field));
        fields.extend(&scene.chroma);
        Ok(Self {
            renderer: SceneRenderer::of(raster, &scene.luma, &fields, dataset.extent)?,
            has_native: scene.chroma.is_some(),
            rgb: rgb.iter().map(|(method, _)| *method).collect(),
            teacher,
        })
    }

    /// Draws what `camera` sees; `name` is for the teacher's errors.
    pub fn draw(&mut self, camera: &Camera, name: &str) -> Result<Drawing, EvalError> {
        let mut pictures = self.renderer.render(camera)?;
        // One picture a field: gray, RGB, and a/b last.
        let gray = pictures.remove(0);
        let mut layers = Vec::new();
        if self.has_native {
            layers.extend(pictures.pop().map(|ab| (Method::Native, Layer::Ab(ab))));
        }
        for (&method, picture) in self.rgb.iter().zip(&pictures) {
            layers.push((method, Layer::Rgb(picture.shown())));
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

    /// What the exported file shows `camera`, RGB in [0, 1], `[height, width]`.
    pub fn exported(&mut self, camera: &Camera) -> Result<Vec<[f32; 3]>, EvalError> {
        // Its field comes first after luma's.
        Ok(self.renderer.render(camera)?.swap_remove(1).shown())
    }

    /// The scene's median depth along the camera's z axis in world units, `[height,
    /// width]`; NaN where it is not opaque enough to have one.
    pub fn depth(&mut self, camera: &Camera) -> Result<Vec<f32>, EvalError> {
        Ok(self.renderer.depth(camera)?)
    }

    /// The teacher's answer for a photo.
    ///
    /// # Errors
    /// [`EvalError::Chroma`] when kept answers cannot be read.
    pub fn answer(&self, view: usize) -> Result<Option<AbImage>, EvalError> {
        match &self.teacher {
            Some(teacher) => teacher.answer(view),
            None => Ok(None),
        }
    }

    /// Returns true if the teacher has an answer for a photo.
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
    pub fn rgb(&self, gray: &RenderedImage) -> Vec<[f32; 3]> {
        match self {
            Self::Ab(picture) => native_rgb(gray, picture),
            Self::Rgb(rgb) => rgb.clone(),
        }
    }
}
