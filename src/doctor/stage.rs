//! One view of one scene with all its buffers: what a kernel case runs on.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use crate::{
    capture::Camera,
    compare::narrow,
    gpu::{Buffer, GpuError, Recorder},
    oracle::{
        numerics::{self as oracle, Numerics},
        scene::Scene,
        view::View,
    },
    raster::{
        AdjointScratch, COLOR_FIGURES, ChromaAdjoint, ChromaSums, ColorKind, Falloff, Field,
        Geometry, Layer, Lists, LumaAdjoint, Outcome, Projected, Raster, RasterNumerics,
        RasterOptions, Status, ViewUniform, constants::*,
    },
    splats::{ShField, Splats},
};

/// The oracle's view as a camera.
pub fn camera(view: &View) -> Camera {
    Camera {
        width: view.width as u32,
        height: view.height as u32,
        fx: view.fx,
        fy: view.fy,
        cx: view.cx,
        cy: view.cy,
        rotation: DMat3::from_cols_array_2d(&view.rotation).transpose(),
        translation: DVec3::from_array(view.translation),
    }
}

/// The oracle's scene as splats; its values are exact in `f32`.
pub fn splats<const C: usize>(scene: &Scene<f64, C>) -> Splats {
    fn rows<const K: usize>(rows: &[[f64; K]]) -> Vec<[f32; K]> {
        rows.iter().map(|row| row.map(|v| v as f32)).collect()
    }
    Splats {
        means: rows(&scene.means),
        quats: rows(&scene.quats),
        log_scales: rows(&scene.log_scales),
        opacity_logits: narrow(&scene.opacity_logits),
        sh: ShField {
            degree: scene.degree as u32,
            channels: C,
            coefficients: narrow(scene.sh.as_flattened()),
        },
    }
}

/// The rasterizer that leaves out what the oracle does.
pub fn cutting(raster: &Arc<Raster>, numerics: &Numerics) -> Arc<Raster> {
    raster.computing(RasterNumerics {
        alpha_min: numerics.alpha_min,
        transmittance_min: numerics.transmittance_min,
        depth_bits: numerics.depth_bits,
        ..raster.numerics()
    })
}

/// One scene before one camera, with all its buffers.
pub struct Stage {
    /// The view, which may be changed between two pictures.
    pub view: ViewUniform,
    /// Projection and tile lists.
    pub lists: Lists,
    /// Shading and blending.
    pub layer: Layer,
    raster: Arc<Raster>,
    count: usize,
    adjoint: Adjoint,
}

enum Adjoint {
    /// With the field's gradient.
    Luma(LumaAdjoint, Buffer<f32>),
    Color {
        adjoint: ChromaAdjoint,
        image_gradient: Buffer<f32>,
        gradient: Buffer<f32>,
        diagonal: Buffer<f32>,
    },
}

impl Stage {
    /// A stage with room for every Gaussian in every tile.
    pub fn new(raster: &Arc<Raster>, splats: &Splats, view: &View) -> Result<Self, GpuError> {
        let [columns, rows] =
            [view.width, view.height].map(|side| side.div_ceil(TILE_SIDE as usize));
        Self::with_capacity(raster, splats, view, splats.len() * columns * rows)
    }

    /// A stage with room for so many tile-list entries, antialiased if the view is, that
    /// leaves out what the view says.
    pub fn with_capacity(
        raster: &Arc<Raster>,
        splats: &Splats,
        view: &View,
        capacity: usize,
    ) -> Result<Self, GpuError> {
        let raster = raster.drawing(RasterOptions {
            antialiased: view.antialiased,
            falloff: match view.numerics.falloff {
                oracle::Falloff::Gaussian => Falloff::Gaussian,
                oracle::Falloff::PlayCanvas => Falloff::PlayCanvas,
            },
        });
        let raster = cutting(&raster, &view.numerics);
        let (gpu, near) = (&raster.gpu, view.near);
        let degree = splats.sh.degree;
        let view = ViewUniform::new(&camera(view), near, splats.len(), degree);
        let (pixels, tiles) = (view.pixel_count(), view.tile_count());
        let geometry = Geometry::upload(gpu, splats)?;
        let field = Field::upload(gpu, &splats.sh)?;
        let lists = Lists::new(&raster, &geometry, tiles, capacity)?;
        let layer = Layer::new(&raster, &geometry, &lists, &field, pixels, tiles)?;
        let gradient = Buffer::zeros(gpu, "field gradient", field.planes.len())?;
        let adjoint = match field.kind {
            ColorKind::Luma => {
                let outcome = Outcome::Gradient(&gradient);
                let adjoint =
                    LumaAdjoint::new(&raster, &geometry, &lists, &field, &layer, &outcome)?;
                Adjoint::Luma(adjoint, gradient)
            }
            ColorKind::Chroma | ColorKind::Rgb => {
                let image_gradient = Buffer::zeros(gpu, "image gradient", COLOR_FIGURES * pixels)?;
                let scratch = AdjointScratch::color(gpu, splats.len(), capacity)?;
                let planes = COLOR_FIGURES - field.kind.channels();
                let diagonal = Buffer::zeros(gpu, "diagonal", planes * splats.len())?;
                let sums = ChromaSums {
                    gradient: &gradient,
                    diagonal: &diagonal,
                };
                let image = &image_gradient;
                let adjoint =
                    ChromaAdjoint::new(&raster, &geometry, &lists, &layer, image, scratch, sums);
                Adjoint::Color {
                    adjoint,
                    image_gradient,
                    gradient,
                    diagonal,
                }
            }
        };
        Ok(Self {
            view,
            lists,
            layer,
            raster,
            count: splats.len(),
            adjoint,
        })
    }

    fn record(&self) -> Recorder {
        let gpu = &self.raster.gpu;
        let mut recorder = Recorder::new(gpu);
        self.lists.set_view(gpu, &self.view);
        self.lists.record(&self.raster, &mut recorder);
        self.layer.record(&self.raster, &mut recorder);
        recorder
    }

    /// Draws, and gives the picture `[pixels, channels]`.
    pub fn forward(&self) -> Result<Vec<f32>, GpuError> {
        self.record().submit();
        self.image()
    }

    /// Draws, and differentiates `Σ upstream · picture`; `upstream` is
    /// `[pixels, channels]`. Of a/b and RGB its first channels stand for the curvatures too.
    pub fn backward(&self, upstream: &[f64]) -> Result<Gradient, GpuError> {
        self.backward_onto(upstream, &[])
    }

    /// The same, of a/b and RGB added to these values of the field's gradient.
    pub fn backward_onto(&self, upstream: &[f64], before: &[f32]) -> Result<Gradient, GpuError> {
        let gpu = &self.raster.gpu;
        let mut recorder = self.record();
        Ok(match &self.adjoint {
            Adjoint::Luma(adjoint, gradient) => {
                adjoint.image_gradient.write(gpu, &narrow(upstream));
                adjoint.record(&self.raster, &mut recorder);
                recorder.submit();
                Gradient {
                    count: self.count,
                    geometry: adjoint.geometry_gradient.read(gpu)?,
                    statistics: adjoint.statistics.read(gpu)?,
                    field: gradient.read(gpu)?,
                    diagonal: Vec::new(),
                }
            }
            Adjoint::Color {
                adjoint,
                image_gradient,
                gradient,
                diagonal,
            } => {
                let channels = self.layer.kind.channels();
                let figures = (upstream.chunks_exact(channels))
                    .flat_map(|of_pixel| of_pixel.iter().chain(of_pixel).take(COLOR_FIGURES));
                let figures: Vec<f64> = figures.copied().collect();
                image_gradient.write(gpu, &narrow(&figures));
                gradient.write(gpu, &vec![0.0; gradient.len()]);
                gradient.write(gpu, before);
                diagonal.write(gpu, &vec![0.0; diagonal.len()]);
                adjoint.record(&self.raster, &mut recorder);
                recorder.submit();
                Gradient {
                    count: self.count,
                    geometry: Vec::new(),
                    statistics: Vec::new(),
                    field: gradient.read(gpu)?,
                    diagonal: diagonal.read(gpu)?,
                }
            }
        })
    }

    /// The picture last drawn.
    pub fn image(&self) -> Result<Vec<f32>, GpuError> {
        let pixels = self.view.pixel_count();
        self.layer.read_image(&self.raster.gpu, pixels)
    }

    /// Counts of the device since the last reset.
    pub fn status(&self) -> Result<Status, GpuError> {
        self.lists.status(&self.raster.gpu)
    }

    /// The projection of each Gaussian, none where it is not visible.
    pub fn projected(&self) -> Result<Vec<Option<Projected>>, GpuError> {
        let gpu = &self.raster.gpu;
        let ranks = self.lists.ranks.read(gpu)?;
        let projected = self.lists.projected.read(gpu)?;
        Ok((ranks.into_iter().zip(projected))
            .map(|(rank, projected)| (rank != u32::MAX).then_some(projected))
            .collect())
    }

    /// The Gaussians of each tile in the order in which they are blended.
    pub fn tiles(&self) -> Result<Vec<Vec<usize>>, GpuError> {
        let gpu = &self.raster.gpu;
        let (slots, starts) = (self.lists.slots().read(gpu)?, self.lists.starts.read(gpu)?);
        let splats = self.lists.instance_splats.read(gpu)?;
        Ok((starts.windows(2))
            .map(|span| &slots[span[0] as usize..span[1] as usize])
            .map(|slots| slots.iter().map(|&s| splats[s as usize] as usize).collect())
            .collect())
    }
}

/// Gradient that the adjoint writes, as planes.
#[derive(PartialEq)]
pub struct Gradient {
    count: usize,
    /// `[11, N]`; empty for a/b and RGB.
    pub geometry: Vec<f32>,
    /// `[2, N]`; empty for a/b and RGB.
    pub statistics: Vec<f32>,
    /// `[(degree + 1)², channels, N]`.
    pub field: Vec<f32>,
    /// Sums of curvatures, `[4 - channels, N]`; empty for luma.
    pub diagonal: Vec<f32>,
}

impl Gradient {
    /// Gradient of `count` Gaussians, geometry and field as planes, and no statistics.
    pub fn of_planes(count: usize, geometry: Vec<f32>, field: Vec<f32>) -> Self {
        Self {
            count,
            geometry,
            statistics: Vec::new(),
            field,
            diagonal: Vec::new(),
        }
    }

    /// The groups of parameters with their names, each `[N, …]` as the oracle
    /// has it; a/b and RGB have the last one only.
    pub fn groups(&self) -> Vec<(&'static str, Vec<f64>)> {
        let field_planes = self.field.len() / self.count;
        let mut groups = Vec::new();
        if !self.geometry.is_empty() {
            for (name, first, end) in [
                ("means", PLANE_MEAN, PLANE_QUAT),
                ("quats", PLANE_QUAT, PLANE_LOG_SCALE),
                ("log_scales", PLANE_LOG_SCALE, PLANE_OPACITY),
                ("opacity_logits", PLANE_OPACITY, GEOMETRY_PLANES),
            ] {
                groups.push((name, self.rows(&self.geometry, first..end)));
            }
        }
        groups.push(("sh", self.rows(&self.field, 0..field_planes)));
        groups
    }

    fn rows(&self, planes: &[f32], span: std::ops::Range<usize>) -> Vec<f64> {
        (0..self.count)
            .flat_map(|i| span.clone().map(move |plane| (plane, i)))
            .map(|(plane, i)| f64::from(planes[plane * self.count + i]))
            .collect()
    }

    /// All planes without those of Gaussian `index`, as bits.
    pub fn bits_without(&self, index: Option<usize>) -> Vec<u32> {
        let planes = [
            &self.geometry,
            &self.statistics,
            &self.field,
            &self.diagonal,
        ];
        (planes
            .into_iter()
            .flat_map(|planes| planes.iter().enumerate()))
        .filter(|(at, _)| Some(at % self.count) != index)
        .map(|(_, value)| value.to_bits())
        .collect()
    }
}
