//! Pictures of scenes.

use std::sync::Arc;

use gs_chroma::{
    capture,
    raster::{Raster, RasterOptions, RenderedImage, SceneRenderer, constants::NEAR_SHARE},
    trajectory::ball_of_splats,
};
use numpy::PyArrayDyn;
use pyo3::{
    exceptions::{PyTypeError, PyValueError},
    prelude::*,
};

use crate::{
    arrays::of_shape, camera::Camera, colorize::Colored, device::gpu, error::python,
    fit::LumaScene, settings::within, splats::Splats,
};

/// Share of the Gaussians whose radius stands for the extent of a scene without photos.
const MOST: f64 = 0.9;

/// A picture of a scene: gray `[height, width]`, RGB `[height, width, 3]`, both sRGB in 0 to 1, or
/// CIELAB a and b `[height, width, 2]`; float32.
///
/// Nothing nearer than `near`, in world units, is shown; by default a hundredth of the extent.
#[pyfunction]
#[pyo3(signature = (scene, camera, *, near=None))]
pub fn render<'py>(
    py: Python<'py>,
    scene: &Bound<'py, PyAny>,
    camera: &Camera,
    near: Option<f64>,
) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let (splats, extent) = shown(scene)?;
    if splats.splats.is_empty() {
        return Err(PyValueError::new_err("scene: there is no Gaussian"));
    }
    if let Some(near) = near {
        within("near", near, [f64::MIN_POSITIVE, f64::MAX])?;
    }
    let picture = py.detach(|| {
        let extent = || extent.unwrap_or_else(|| ball_of_splats(&splats.splats, MOST).1);
        let near = near.unwrap_or_else(|| NEAR_SHARE * extent());
        drawn(&splats, &camera.0, near)
    })?;
    let size = [picture.height as usize, picture.width as usize];
    match picture.channels {
        1 => of_shape(py, picture.pixels, &size),
        channels => of_shape(py, picture.pixels, &[size[0], size[1], channels]),
    }
}

/// The Gaussians of a scene, and its extent where photos tell it.
fn shown(scene: &Bound<'_, PyAny>) -> PyResult<(Splats, Option<f64>)> {
    if let Ok(scene) = scene.cast::<LumaScene>() {
        return Ok((scene.get().splats(), Some(scene.get().scene.extent)));
    }
    if let Ok(scene) = scene.cast::<Colored>() {
        return Ok((scene.get().splats(), Some(scene.get().dataset.extent)));
    }
    match scene.cast::<Splats>() {
        Ok(splats) => Ok((splats.get().clone(), None)),
        Err(_) => Err(PyTypeError::new_err(
            "scene: Splats, a LumaScene or Colored",
        )),
    }
}

fn drawn(splats: &Splats, camera: &capture::Camera, near: f64) -> PyResult<RenderedImage> {
    let options = RasterOptions {
        antialiased: splats.antialiased,
        ..RasterOptions::default()
    };
    let raster = Arc::new(Raster::with(&gpu()?, options));
    let Splats { splats, .. } = splats;
    let renderer = SceneRenderer::new(&raster, splats, &[&splats.sh], near);
    let mut pictures = python(renderer.and_then(|mut renderer| renderer.render(camera)))?;
    let mut picture = pictures.swap_remove(0);
    if picture.channels != 2 {
        // As viewers show it.
        let pixels = picture.pixels.iter_mut();
        pixels.for_each(|value| *value = value.clamp(0.0, 1.0));
    }
    Ok(picture)
}
