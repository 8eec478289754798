//! The rasterizer with other cut-offs, fewer bits of depth and gradient records at half
//! the size, each against the oracle that leaves out the same.

use std::sync::Arc;

use super::{blend, gradient};
use crate::{
    compare::{FlipBounds, narrow, widen},
    doctor::{
        measured::{Allowance, Groups, Row, Sample, add, by_quantity},
        stage::{Stage, cutting, splats},
    },
    gpu::{Buffer, GpuError, Recorder},
    oracle::{
        constants::ALPHA_MAX,
        numerics::{Numerics, upper_half},
        scene::Scene,
        view::View,
    },
    raster::{
        Field, Geometry, Layer, Lists, LumaAdjoint, Outcome, Raster, RasterNumerics, Storage,
    },
};

/// Figures of luma's gradient record.
const FIGURES: usize = 8;

/// Numerics that `doctor` tries: each knob on either side of its usual value where it has two.
pub const CUTS: [Numerics; 5] = [
    Numerics {
        alpha_min: 1.0 / 64.0,
        ..Numerics::DEFAULT
    },
    Numerics {
        alpha_min: 1e-5,
        ..Numerics::DEFAULT
    },
    Numerics {
        transmittance_min: 0.01,
        ..Numerics::DEFAULT
    },
    Numerics {
        transmittance_min: 0.0,
        ..Numerics::DEFAULT
    },
    Numerics {
        depth_bits: 16,
        ..Numerics::DEFAULT
    },
];

/// Worst errors seen of the gradient of a group of parameters, in the groups' order: of
/// the whole, relative, and of an element.
const CUT_SEEN: [[f64; 2]; 6] = [
    [3.16e-6, 2.14e-5],
    [4.88e-6, 6.10e-6],
    [1.70e-6, 2.69e-6],
    [5.13e-6, 9.0e-7],
    [1.97e-6, 2.22e-6],
    [5.72e-7, 2.34e-5],
];

/// The same with records at half the size.
const HALF_SEEN: [[f64; 2]; 6] = [
    [8.10e-3, 0.0336],
    [1.27e-2, 0.0210],
    [2.88e-3, 0.0095],
    [2.09e-3, 0.0013],
    [2.44e-3, 0.0035],
    [1.64e-3, 0.0035],
];

type Scenes = Vec<(Scene<f64, 1>, View)>;

/// The scenes with these cuts.
fn cut(scenes: Scenes, numerics: Numerics) -> Scenes {
    (scenes.into_iter())
        .map(|(scene, view)| (scene, View { numerics, ..view }))
        .collect()
}

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let allowed = Allowance::of(&raster.gpu);
    let mut rows = Vec::new();
    let mut pictures = Vec::new();
    for numerics in CUTS {
        let raster = &cutting(raster, &numerics);
        let scenes = cut(blend::scenes(), numerics);
        pictures.extend(blend::pictures::<1>(raster, scenes)?);
    }
    rows.push(Row::picture(
        "blend",
        "luma, other cut-offs and depth bits",
        FlipBounds {
            rest: allowed.relative(1.27e-6, 1.0),
            // What the last contribution shows that a transmittance at its floor lets through.
            jump: allowed.relative(0.01 / (1.0 - ALPHA_MAX), 1.0),
            cap: 0.01,
        },
        &pictures,
    ));
    let mut groups = Groups::new();
    for numerics in CUTS {
        let raster = &cutting(raster, &numerics);
        let scenes = cut(gradient::scenes(false), numerics);
        for (name, samples) in gradient::measure(raster, &scenes, gradient::of_luma)? {
            add(&mut groups, name, samples);
        }
    }
    let kernel = "luma adjoint, other cut-offs and depth bits";
    rows.extend(allowed.groups(kernel, &CUT_SEEN, groups));
    let half = raster.computing(RasterNumerics {
        storage: Storage::Half,
        ..raster.numerics()
    });
    let groups = gradient::measure(&half, &gradient::scenes(false), gradient::of_luma)?;
    rows.extend(allowed.groups("luma adjoint, half storage", &HALF_SEEN, groups));
    let [records, sums] = halves(raster, &half)?;
    let kernel = "blend_backward, half storage";
    rows.push(Row::exact(kernel, "records", &records));
    let kernel = "sum_instances, half storage";
    rows.push(allowed.values(kernel, "sums of the records", [3.4e-8, 1.0], &sums));
    Ok(rows)
}

/// Scratch memory after an adjoint.
struct ScratchValues {
    /// By emission slot.
    records: Vec<u32>,
    /// By Gaussian.
    gradients: Vec<f32>,
}

fn left(
    raster: &Raster,
    stage: &Stage,
    scene: &Scene<f64, 1>,
    upstream: &[f32],
) -> Result<ScratchValues, GpuError> {
    let gpu = &raster.gpu;
    let splats = splats(scene);
    let geometry = Geometry::upload(gpu, &splats)?;
    let field = Field::upload(gpu, &splats.sh)?;
    let (pixels, tiles) = (stage.view.pixel_count(), stage.view.tile_count());
    let lists = Lists::new(raster, &geometry, tiles, stage.lists.capacity)?;
    let layer = Layer::new(raster, &geometry, &lists, &field, pixels, tiles)?;
    let field_gradient = Buffer::zeros(gpu, "field gradient", field.planes.len())?;
    let outcome = Outcome::Gradient(&field_gradient);
    let adjoint = LumaAdjoint::new(raster, &geometry, &lists, &field, &layer, &outcome)?;
    adjoint.image_gradient.write(gpu, upstream);
    let mut recorder = Recorder::new(gpu);
    lists.set_view(gpu, &stage.view);
    lists.record(raster, &mut recorder);
    layer.record(raster, &mut recorder);
    adjoint.record(raster, &mut recorder);
    recorder.submit();
    Ok(ScratchValues {
        records: adjoint.scratch().partials.read(gpu)?,
        gradients: adjoint.scratch().gradients.read(gpu)?,
    })
}

/// Records at half the size against those in full, rounded; and their sums.
fn halves(raster: &Arc<Raster>, half: &Arc<Raster>) -> Result<[Vec<Sample>; 2], GpuError> {
    let gpu = &raster.gpu;
    let scenes = gradient::scenes::<1>(false);
    by_quantity((0..).zip(scenes).map(|(seed, (scene, view))| {
        let upstream = narrow(gradient::upstream(seed, &scene, &view).as_flattened());
        let stage = Stage::new(raster, &splats(&scene), &view)?;
        stage.forward()?;
        let instances = stage.status()?.instances;
        let full = left(raster, &stage, &scene, &upstream)?;
        let halved = left(half, &stage, &scene, &upstream)?;
        let expected: Vec<f64> = (full.records[..instances * FIGURES].iter())
            .map(|&word| upper_half(f64::from(f32::from_bits(word))))
            .collect();
        let actual: Vec<f64> = (halved.records[..instances * FIGURES / 2].iter())
            .flat_map(|word| [word << 16, word & 0xffff_0000])
            .map(|bits| f64::from(f32::from_bits(bits)))
            .collect();
        let (order, offsets) = (
            stage.lists.order().read(gpu)?,
            stage.lists.offsets.read(gpu)?,
        );
        let projected = stage.lists.projected.read(gpu)?;
        let visible = stage.status()?.visible;
        let (mut given, mut wanted) = (Vec::new(), Vec::new());
        for rank in 0..visible {
            let i = order[rank] as usize;
            let begin = offsets[rank] as usize;
            let end = offsets.get(rank + 1).filter(|_| rank + 1 < visible);
            let end = end.map_or(instances, |&end| end as usize);
            let mut m = [0.0; FIGURES];
            for record in actual[begin * FIGURES..end * FIGURES].chunks_exact(FIGURES) {
                (m.iter_mut().zip(record)).for_each(|(sum, figure)| *sum += figure);
            }
            let [a, b, c, opacity] = projected[i].conic_opacity.map(f64::from);
            wanted.extend([-(a * m[1] + b * m[2]), -(b * m[1] + c * m[2])]);
            wanted.extend([0.5 * m[3], m[4], 0.5 * m[5], -m[0] / opacity, m[6], m[7]]);
            given.extend(&halved.gradients[i * FIGURES..(i + 1) * FIGURES]);
        }
        Ok([
            Sample::new(actual, expected),
            Sample::new(widen(&given), wanted),
        ])
    }))
}
