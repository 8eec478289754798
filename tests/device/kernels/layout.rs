//! Struct layouts and constants on which host and device must agree.

use std::{collections::BTreeMap, mem::offset_of};

use gs_chroma::{
    chroma::{
        ChromaLossWeights, Correction, CorrectionParameters, LabLossParameters, LbfgsParameters,
        RgbLossParameters, SUM_GROUPS, SUMS,
    },
    gpu::{STORAGE_BUFFERS, shaders},
    luma::{
        LumaLossParameters,
        densify::{DensifyParameters, Descent},
    },
    raster::{
        AdamParameters, Portion, Projected, SumLossParameters, TileListsMode, ViewUniform,
        constants, groups::Groups, scan::ScanParameters, sort::SortParameters,
    },
};
use naga::{
    AddressSpace, Expression, Handle, Literal, Module, TypeInner,
    front::wgsl,
    valid::{Capabilities, ValidationFlags, Validator},
};

use crate::kernels::oracle::{constants as oracle, lab_loss::RELATIVE_XYZ, luma_loss::window};

fn parse(name: &str, source: &str) -> Module {
    wgsl::parse_str(source).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Size and member offsets of every struct in a module.
fn structs(module: &Module) -> BTreeMap<String, (usize, Vec<(String, usize)>)> {
    let types = module.types.iter();
    types
        .filter_map(|(_, ty)| match (&ty.name, &ty.inner) {
            (Some(name), TypeInner::Struct { members, span }) => {
                let offsets = members.iter().map(|member| {
                    let name = member.name.clone().unwrap_or_default();
                    (name, member.offset as usize)
                });
                Some((name.clone(), (*span as usize, offsets.collect())))
            }
            _ => None,
        })
        .collect()
}

struct Twin {
    name: &'static str,
    size: usize,
    members: Vec<(&'static str, usize)>,
}

/// A Rust struct whose members have the names of its WGSL twin's.
macro_rules! twin {
    ($name:literal = $rust:ident { $($member:ident),* }) => {
        Twin {
            name: $name,
            size: size_of::<$rust>(),
            members: vec![$((stringify!($member), offset_of!($rust, $member))),*],
        }
    };
}

fn twins() -> Vec<Twin> {
    let mut view = twin!(
        "View" = ViewUniform {
            center_near,
            intrinsics,
            slope_limits,
            size,
            tiles,
            splat_count,
            sh_degree,
            instance_capacity,
            padding
        }
    );
    // Three rows there, one array of rows here.
    let rows = ["row0", "row1", "row2"]
        .into_iter()
        .zip((offset_of!(ViewUniform, rows)..).step_by(16));
    view.members.splice(0..0, rows);
    vec![
        view,
        twin!(
            "Projected" = Projected {
                mean,
                extent,
                conic_opacity
            }
        ),
        twin!(
            "ScanParameters" = ScanParameters {
                which,
                total_word,
                limit
            }
        ),
        twin!("SortParameters" = SortParameters { shift }),
        twin!("Groups" = Groups { counts, length }),
        twin!("TileListsMode" = TileListsMode { emit }),
        twin!("Portion" = Portion { first }),
        twin!(
            "LumaLossParameters" = LumaLossParameters {
                gain,
                offset,
                padding
            }
        ),
        twin!(
            "AdamParameters" = AdamParameters {
                splat_count,
                planes,
                correction1,
                correction2,
                trained,
                learning_rates
            }
        ),
        twin!(
            "SumLossParameters" = SumLossParameters {
                blocks,
                pixels,
                entry
            }
        ),
        twin!(
            "ChromaLossWeights" = ChromaLossWeights {
                coarser_size,
                teacher,
                agreement,
                decline,
                view_index,
                weighted,
                joint
            }
        ),
        twin!("RgbLossParameters" = RgbLossParameters { weighted }),
        twin!(
            "LabLossParameters" = LabLossParameters {
                coarser_size,
                lightness,
                squared,
                chroma,
                agreement,
                variation,
                weighted,
                pooled,
                in_rgb
            }
        ),
        twin!(
            "Correction" = Correction {
                gain,
                offset,
                padding
            }
        ),
        twin!(
            "CorrectionParameters" = CorrectionParameters {
                views,
                view_index,
                weighted,
                padding
            }
        ),
        twin!(
            "LbfgsParameters" = LbfgsParameters {
                length,
                splats,
                diagonals,
                blocks,
                ridge,
                diagonal_scale,
                constants,
                color,
                anchor,
                rest
            }
        ),
        twin!(
            "Descent" = Descent {
                offset,
                source,
                log_growth,
                survives,
                logit_step
            }
        ),
        twin!(
            "DensifyParameters" = DensifyParameters {
                old_count,
                new_count,
                planes
            }
        ),
    ]
}

#[test]
fn structs_have_the_layout_of_their_twins() {
    let twins = twins();
    let mut met = vec![0; twins.len()];
    for (file, source) in shaders::ALL {
        let structs = structs(&parse(file, source));
        for (twin, met) in twins.iter().zip(&mut met) {
            let Some((size, members)) = structs.get(twin.name) else {
                continue;
            };
            let members: Vec<_> = members
                .iter()
                .map(|(name, at)| (name.as_str(), *at))
                .collect();
            assert_eq!(
                (*size, members),
                (twin.size, twin.members.clone()),
                "{} in {file}",
                twin.name
            );
            *met += 1;
        }
    }
    for (twin, met) in twins.iter().zip(met) {
        assert!(met > 0, "no kernel has a struct {}", twin.name);
    }
}

/// The numbers in a constant expression, in order.
fn numbers(module: &Module, expression: Handle<Expression>) -> Vec<f64> {
    match &module.global_expressions[expression] {
        Expression::Literal(Literal::F32(value)) => vec![f64::from(*value)],
        Expression::Literal(Literal::U32(value)) => vec![f64::from(*value)],
        Expression::Compose { components, .. } => {
            let parts = components.iter();
            parts.flat_map(|&part| numbers(module, part)).collect()
        }
        Expression::Constant(constant) => numbers(module, module.constants[*constant].init),
        other => panic!("{other:?} is no constant of ours"),
    }
}

/// Every named constant of a module, those that may be overridden with their usual value.
fn constants_of(name: &str, source: &str) -> BTreeMap<String, Vec<f64>> {
    let module = parse(name, source);
    let constants = module.constants.iter();
    let constants = constants.map(|(_, constant)| (&constant.name, Some(constant.init)));
    let overrides = module.overrides.iter();
    let overrides = overrides.map(|(_, constant)| (&constant.name, constant.init));
    (constants.chain(overrides))
        .filter_map(|(name, init)| Some((name.clone()?, numbers(&module, init?))))
        .collect()
}

/// As an `f32` constant holds it.
fn narrow(value: f64) -> f64 {
    f64::from(value as f32)
}

#[test]
fn constants_are_those_of_the_crate() {
    use constants::*;
    let wgsl = constants_of(
        "constants",
        include_str!("../../../shaders/common/constants.wgsl"),
    );
    let index = |value: usize| value as f64;
    let expected = BTreeMap::from(
        [
            ("TILE_SIDE", f64::from(TILE_SIDE)),
            ("BLUR", f64::from(BLUR)),
            ("ALPHA_MAX", f64::from(ALPHA_MAX)),
            ("ALPHA_MIN", f64::from(ALPHA_MIN)),
            ("TRANSMITTANCE_MIN", f64::from(TRANSMITTANCE_MIN)),
            ("COLOR_MAX", f64::from(COLOR_MAX)),
            ("QUAT_NORM_MIN_SQ", f64::from(QUAT_NORM_MIN_SQ)),
            ("FRUSTUM_MARGIN", narrow(FRUSTUM_MARGIN)),
            ("PLANE_MEAN", index(PLANE_MEAN)),
            ("PLANE_QUAT", index(PLANE_QUAT)),
            ("PLANE_LOG_SCALE", index(PLANE_LOG_SCALE)),
            ("PLANE_OPACITY", index(PLANE_OPACITY)),
            ("GEOMETRY_PLANES", index(GEOMETRY_PLANES)),
            ("STAT_PULL", index(STAT_PULL)),
            ("STAT_VIEWS", index(STAT_VIEWS)),
            ("INVISIBLE", f64::from(u32::MAX)),
            ("STATUS_OVERFLOW", index(STATUS_OVERFLOW)),
            ("STATUS_VISIBLE", index(STATUS_VISIBLE)),
            ("STATUS_INSTANCES", index(STATUS_INSTANCES)),
            ("STATUS_NEEDED", index(STATUS_NEEDED)),
            ("STATUS_POISONED", index(STATUS_POISONED)),
            ("STATUS_STEPS", index(STATUS_STEPS)),
            ("STATUS_REFUSED", index(STATUS_WORDS - 1)),
        ]
        .map(|(name, value)| (name.to_owned(), vec![value])),
    );
    assert_eq!(wgsl, expected);
}

#[test]
fn constants_are_those_of_the_oracle() {
    let common = include_str!("../../../shaders/common/constants.wgsl");
    let harmonics = include_str!("../../../shaders/common/sh.wgsl");
    let playcanvas = include_str!("../../../shaders/common/playcanvas.wgsl");
    let files = [
        ("constants", common),
        ("sh", harmonics),
        ("playcanvas", playcanvas),
        ("luma_loss", shaders::LUMA_LOSS),
        ("luma_loss_window7", shaders::LUMA_LOSS_WINDOW7),
        ("luma_loss_window5", shaders::LUMA_LOSS_WINDOW5),
        ("chroma_loss", shaders::CHROMA_LOSS),
        ("rgb_loss", shaders::RGB_LOSS),
        ("lab_loss", shaders::LAB_LOSS),
        ("view_correction", shaders::VIEW_CORRECTION),
        ("adam", shaders::ADAM),
    ];
    let files = BTreeMap::from(files.map(|(name, source)| (name, constants_of(name, source))));
    let expected = [
        ("constants", "TILE_SIDE", vec![oracle::TILE as f64]),
        ("constants", "BLUR", vec![oracle::BLUR]),
        ("playcanvas", "BLUR", vec![oracle::PLAYCANVAS_BLUR]),
        ("playcanvas", "TAIL", vec![oracle::PLAYCANVAS_TAIL]),
        (
            "playcanvas",
            "RESCALE",
            vec![1.0 / (1.0 - oracle::PLAYCANVAS_TAIL)],
        ),
        ("constants", "ALPHA_MAX", vec![oracle::ALPHA_MAX]),
        ("constants", "ALPHA_MIN", vec![oracle::ALPHA_MIN]),
        ("constants", "COLOR_MAX", vec![oracle::COLOR_MAX]),
        (
            "constants",
            "TRANSMITTANCE_MIN",
            vec![oracle::TRANSMITTANCE_MIN],
        ),
        (
            "constants",
            "QUAT_NORM_MIN_SQ",
            vec![oracle::QUAT_NORM_MIN_SQ],
        ),
        ("constants", "FRUSTUM_MARGIN", vec![oracle::FRUSTUM_MARGIN]),
        ("sh", "SH_C0", vec![oracle::SH_C0]),
        ("sh", "SH_C1", vec![oracle::SH_C1]),
        ("sh", "SH_C2", oracle::SH_C2.to_vec()),
        ("sh", "SH_C3", oracle::SH_C3.to_vec()),
        (
            "luma_loss",
            "WINDOW",
            window(oracle::SSIM_WINDOW)[..6].to_vec(),
        ),
        ("luma_loss_window7", "WINDOW", window(7)[..4].to_vec()),
        ("luma_loss_window7", "RADIUS", vec![3.0]),
        ("luma_loss_window5", "WINDOW", window(5)[..3].to_vec()),
        ("luma_loss_window5", "RADIUS", vec![2.0]),
        (
            "luma_loss",
            "RADIUS",
            vec![(oracle::SSIM_WINDOW / 2) as f64],
        ),
        ("luma_loss", "C1", vec![oracle::SSIM_C1]),
        ("luma_loss", "C2", vec![oracle::SSIM_C2]),
        ("luma_loss", "SSIM_WEIGHT", vec![oracle::SSIM_WEIGHT]),
        ("luma_loss", "L1_WEIGHT", vec![1.0 - oracle::SSIM_WEIGHT]),
        ("chroma_loss", "SMOOTHING", vec![oracle::CHROMA_EPSILON]),
        ("rgb_loss", "SMOOTHING", vec![oracle::CHROMA_EPSILON]),
        ("lab_loss", "SMOOTHING", vec![oracle::CHROMA_EPSILON]),
        ("lab_loss", "TO_X", RELATIVE_XYZ[0].to_vec()),
        ("lab_loss", "TO_Y", RELATIVE_XYZ[1].to_vec()),
        ("lab_loss", "TO_Z", RELATIVE_XYZ[2].to_vec()),
        (
            "view_correction",
            "PRIOR_VARIANCE",
            vec![oracle::CORRECTION_PRIOR],
        ),
        (
            "view_correction",
            "GAIN_UNITS",
            vec![oracle::CORRECTION_GAIN_UNITS],
        ),
        ("view_correction", "NEAR", vec![oracle::CORRECTION_NEAR]),
        (
            "view_correction",
            "DETERMINANT_MIN",
            vec![oracle::CORRECTION_DETERMINANT_MIN],
        ),
        ("adam", "BETA1", vec![oracle::ADAM_BETA1]),
        ("adam", "BETA2", vec![oracle::ADAM_BETA2]),
        ("adam", "EPSILON", vec![oracle::ADAM_EPSILON]),
    ];
    for (file, name, values) in expected {
        let values: Vec<f64> = values.into_iter().map(narrow).collect();
        assert_eq!(
            files[file].get(name),
            Some(&values),
            "{name} of {file}.wgsl"
        );
    }
}

#[test]
fn sums_of_a_view_have_the_shape_that_the_host_makes_room_for() {
    let wgsl = constants_of("view_correction", shaders::VIEW_CORRECTION);
    assert_eq!(wgsl["SUM_GROUPS"], [SUM_GROUPS as f64]);
    assert_eq!(wgsl["SUMS"], [SUMS as f64]);
}

#[test]
fn no_kernel_binds_more_storage_than_is_asked_of_a_device() {
    let mut most = 0;
    for (name, source) in shaders::ALL {
        let module = parse(name, source);
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
        let info = validator.validate(&module).unwrap();
        for entry in 0..module.entry_points.len() {
            let bound = module.global_variables.iter().filter(|(handle, global)| {
                matches!(global.space, AddressSpace::Storage { .. })
                    && !info.get_entry_point(entry)[*handle].is_empty()
            });
            most = most.max(bound.count());
        }
    }
    assert_eq!(most, STORAGE_BUFFERS as usize);
}
