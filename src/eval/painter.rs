//! One viewpoint, drawn by every method.

use std::{path::PathBuf, sync::Arc};

use super::{
    ColoredScene, EvalError, MeasuredTeacher,
    path_frames::read_frame,
    picture::{ab_of, to_picture},
};
use crate::{
    capture::Camera,
    chroma::{native_rgb, teacher::AbImage},
    raster::{Raster, RenderedImage, SceneRenderer},
    report::Method,
    splats::{ShField, Splats},
};

/// Draws every method's picture.
pub struct Painter<'a> {
    renderer: SceneRenderer<'a>,
    /// Methods that are harmonics on the scene's geometry, in the order of their fields.
    fields: Vec<Method>,
    splats: Vec<(Method, SceneRenderer<'a>)>,
    frames: Vec<(Method, &'a [PathBuf])>,
    teacher: Option<&'a mut MeasuredTeacher>,
}

/// Source of a method's pictures.
pub enum Source<'a> {
    /// Harmonics of RGB, or of a and b, on the scene's geometry.
    Field(&'a ShField),
    /// Splats with a geometry of their own, and what draws them.
    Splats(&'a Splats, Arc<Raster>),
    /// Files of the path's frames, in its order, and of nothing else.
    Frames(&'a [PathBuf]),
}

/// A colored picture as a method makes it.
pub enum Layer {
    /// a and b, to be shown with the gray picture's lightness.
    Ab(RenderedImage),
    /// RGB in [0, 1], `[height, width]`.
    Rgb(Vec<[f32; 3]>),
}

/// A method and a and b of its picture, `[height, width]`.
pub type MethodAb = (Method, Vec<[f32; 2]>);

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
    /// A painter of the gray scene, of what methods make of it, and of what a teacher makes of the
    /// gray pictures.
    pub fn new(
        raster: &Arc<Raster>,
        scene: &'a ColoredScene,
        sources: impl IntoIterator<Item = (Method, Source<'a>)>,
        teacher: Option<&'a mut MeasuredTeacher>,
    ) -> Result<Self, EvalError> {
        let extent = scene.dataset.extent;
        let mut drawn = vec![&scene.luma.sh];
        let (mut fields, mut splats, mut frames) = (Vec::new(), Vec::new(), Vec::new());
        for (method, source) in sources {
            match source {
                Source::Field(field) => {
                    drawn.push(field);
                    fields.push(method);
                }
                Source::Splats(own, raster) => {
                    let renderer = SceneRenderer::of(&raster, own, &[&own.sh], extent)?;
                    splats.push((method, renderer));
                }
                Source::Frames(files) => frames.push((method, files)),
            }
        }
        Ok(Self {
            renderer: SceneRenderer::of(raster, &scene.luma, &drawn, extent)?,
            fields,
            splats,
            frames,
            teacher,
        })
    }

    /// Draws what `camera` sees; `name` is for the teacher's errors.
    pub fn draw(&mut self, camera: &Camera, name: &str) -> Result<Drawing, EvalError> {
        let mut pictures = self.renderer.render(camera)?;
        let gray = pictures.remove(0);
        let mut layers: Vec<(Method, Layer)> = (self.fields.iter().cloned())
            .zip(pictures.into_iter().map(Layer::of))
            .collect();
        for (method, renderer) in &mut self.splats {
            let pictures = renderer.render(camera)?.into_iter();
            layers.extend(pictures.map(|picture| (method.clone(), Layer::of(picture))));
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

    /// Draws a frame of the path, by its index.
    pub fn draw_frame(&mut self, camera: &Camera, index: usize) -> Result<Drawing, EvalError> {
        let mut drawing = self.draw(camera, &format!("frame {index}"))?;
        for (method, files) in &self.frames {
            let layer = Layer::Rgb(read_frame(&files[index], camera)?);
            drawing.layers.push((method.clone(), layer));
        }
        Ok(drawing)
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
    pub fn layer(&self, method: &Method) -> Option<&Layer> {
        let found = self.layers.iter().find(|(m, _)| m == method);
        found.map(|(_, layer)| layer)
    }
}

impl Layer {
    fn of(picture: RenderedImage) -> Self {
        match picture.channels {
            2 => Self::Ab(picture),
            _ => Self::Rgb(picture.shown()),
        }
    }

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
