//! What is known about colorization networks: their inputs, their outputs and
//! what the numbers mean.

use super::images::Filter;
use ort::session::Session;
use ort::value::{Outlet, TensorElementType, ValueType};

/// One kind of network. New kinds are new rows of [`PROFILES`].
#[derive(Debug, PartialEq)]
pub(super) struct Profile {
    /// Name for reports.
    pub name: &'static str,
    /// Usual names of input and output; they decide between profiles whose
    /// shapes both fit, a model with other names is accepted too.
    pub names: [&'static str; 2],
    /// Channels of the input, `[1, channels, H, W]` of f32: each is the gray
    /// value (3 stand for R, G and B).
    pub input_channels: i64,
    /// What a white pixel is in the input; black is 0.
    pub white: f32,
    /// How a photo larger than the input is made smaller.
    pub shrinking: Filter,
    /// Channels of the output, `[1, channels, h, w]` of f32: a and b.
    pub output_channels: i64,
    /// Factor from the output to CIELAB units.
    pub output_scale: f32,
    /// Side of the input where the model leaves it open.
    pub default_side: u32,
}

/// All networks that can be teachers.
pub(super) static PROFILES: &[Profile] = &[
    // Kang et al., ICCV 2023. The photo is stretched to a square; the
    // normalisation by ImageNet's mean and deviation is part of the model.
    Profile {
        name: "DDColor",
        names: ["input", "output"],
        input_channels: 3,
        white: 1.0,
        shrinking: Filter::Bilinear,
        output_channels: 2,
        output_scale: 1.0,
        default_side: 512,
    },
];

/// Largest input side that a model may ask for; beyond it the shape is nonsense
/// and must not be allocated.
const MAX_SIDE: i64 = 8192;

/// Sides of an image tensor `[1, channels, H, W]` of f32, -1 where left open;
/// none where `outlet` is no such tensor.
fn image_sides(outlet: &Outlet, channels: i64) -> Option<[i64; 2]> {
    let ValueType::Tensor {
        ty: TensorElementType::Float32,
        shape,
        ..
    } = outlet.dtype()
    else {
        return None;
    };
    let [batch, c, height, width] = shape[..] else {
        return None;
    };
    let fits = |side: i64, expected: i64| side == expected || side == -1;
    (fits(batch, 1) && fits(c, channels)).then_some([width, height])
}

/// The profile that describes a model, with the width and height of its input.
///
/// Both the number of tensors and their shapes must fit. None where no profile
/// does.
pub(super) fn choose(session: &Session) -> Option<(&'static Profile, [u32; 2])> {
    let ([input], [output]) = (session.inputs(), session.outputs()) else {
        return None;
    };
    let fitting = PROFILES.iter().filter_map(|profile| {
        let sides = image_sides(input, profile.input_channels)?;
        image_sides(output, profile.output_channels)?;
        let side = |side: i64| match side {
            -1 => Some(profile.default_side),
            1..=MAX_SIDE => u32::try_from(side).ok(),
            _ => None,
        };
        Some((profile, [side(sides[0])?, side(sides[1])?]))
    });
    fitting.min_by_key(|(profile, _)| profile.names != [input.name(), output.name()])
}

/// Inputs and outputs of a model, in words.
pub(super) fn describe_model(session: &Session) -> String {
    let all = |outlets: &[Outlet]| {
        let words = outlets.iter().map(|outlet| match outlet.dtype() {
            ValueType::Tensor { ty, shape, .. } => {
                format!("{} {ty:?} {}", outlet.name(), shape_in_words(shape))
            }
            other => format!("{} ({other:?})", outlet.name()),
        });
        words.collect::<Vec<_>>().join(", ")
    };
    let (inputs, outputs) = (all(session.inputs()), all(session.outputs()));
    format!("inputs {inputs} and outputs {outputs}")
}

fn shape_in_words(shape: &[i64]) -> String {
    let side = |&side: &i64| match side {
        -1 => "?".to_string(),
        side => side.to_string(),
    };
    let sides: Vec<_> = shape.iter().map(side).collect();
    format!("[{}]", sides.join(","))
}

/// What the profiles accept, in words.
pub(super) fn describe_accepted() -> String {
    let words = PROFILES.iter().map(|p| {
        format!(
            "{} ({} Float32 [1,{},H,W] to {} Float32 [1,{},h,w])",
            p.name, p.names[0], p.input_channels, p.names[1], p.output_channels
        )
    });
    words.collect::<Vec<_>>().join("; ")
}
