//! `.usda` files: OpenUSD as text, a `ParticleField3DGaussianSplat`, written only.
//!
//! Attributes: `positions`, `orientations` (w, x, y, z), `scales` (not logarithms), `opacities`
//! (0 to 1), `radiance:sphericalHarmonicsDegree` and `…Coefficients`, of which a Gaussian has
//! (degree + 1)² (red, green, blue) in a row. Y is up: the scene is turned about z by half a turn.
//!
//! Source: the schema `usdVol` of OpenUSD 26.03, <https://openusd.org/release/api/>.

use std::fmt::{Display, Write};

use glam::DVec3;

use super::{Splats, WriteOptions, axes, sh::coefficient_count, shared::CHANNELS};

/// Values on a line.
const PER_LINE: usize = 8;

/// Three standard deviations are seen of a Gaussian.
const SEEN: f32 = 3.0;

/// The text of a file.
pub(super) fn encode(splats: &Splats, options: &WriteOptions) -> Vec<u8> {
    let splats = axes::turned(splats.clone(), axes::Y_UP);
    let quoted = |text: &str| text.replace(['"', '\\', '\n', '\r'], " ");
    let mut told = String::new();
    // Writing to a string cannot fail.
    if options.antialiased {
        let _ = writeln!(told, "        string SplatRenderMode = \"mip\"");
    }
    if options.offset != DVec3::ZERO {
        let [x, y, z] = options.offset.to_array();
        let _ = writeln!(told, "        double3 offset = ({x}, {y}, {z})");
    }
    if !told.is_empty() {
        told = format!("    customLayerData = {{\n{told}    }}\n");
    }
    let mut text = format!(
        "#usda 1.0\n(\n    \"{}\"\n{told}    defaultPrim = \"Splats\"\n    upAxis = \"Y\"\n)\n\ndef ParticleField3DGaussianSplat \"Splats\"\n{{\n",
        quoted(&options.generator)
    );
    list(
        &mut text,
        "float3[] extent",
        extent(&splats).iter().map(tuple),
    );
    list(
        &mut text,
        "point3f[] positions",
        splats.means.iter().map(tuple),
    );
    list(
        &mut text,
        "quatf[] orientations",
        splats.quats.iter().map(tuple),
    );
    let scales = splats.log_scales.iter().map(|scales| scales.map(f32::exp));
    list(
        &mut text,
        "float3[] scales",
        scales.map(|scales| tuple(&scales)),
    );
    let opacities = splats.opacities().map(|opacity| opacity as f32);
    list(&mut text, "float[] opacities", opacities);
    let degree = splats.sh.degree;
    let _ = writeln!(
        text,
        "    uniform int radiance:sphericalHarmonicsDegree = {degree}"
    );
    let coefficients = splats.sh.coefficients.as_chunks::<CHANNELS>().0;
    list(
        &mut text,
        "float3[] radiance:sphericalHarmonicsCoefficients",
        coefficients.iter().map(tuple),
    );
    // Renderers need not ask how many belong to one.
    let terms = coefficient_count(degree);
    text.truncate(text.trim_end().len());
    let _ = writeln!(
        text,
        " (\n        elementSize = {terms}\n        interpolation = \"vertex\"\n    )"
    );
    text += "    uniform token projectionModeHint = \"perspective\"\n    uniform token sortingModeHint = \"cameraDistance\"\n}\n";
    text.into_bytes()
}

/// Writes an attribute that is a list.
fn list(text: &mut String, name: &str, values: impl Iterator<Item = impl Display>) {
    let _ = write!(text, "    {name} = [");
    for (index, value) in values.enumerate() {
        let before = match index {
            0 => "",
            _ if index % PER_LINE == 0 => ",\n        ",
            _ => ", ",
        };
        let _ = write!(text, "{before}{value}");
    }
    *text += "]\n";
}

fn tuple<const N: usize>(values: &[f32; N]) -> String {
    format!("({})", values.map(|value| value.to_string()).join(", "))
}

/// A box around all that is seen.
fn extent(splats: &Splats) -> [[f32; 3]; 2] {
    let mut extent = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
    for (mean, scales) in splats.means.iter().zip(&splats.log_scales) {
        let longest = scales.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let radius = SEEN * longest.exp();
        for axis in 0..3 {
            extent[0][axis] = extent[0][axis].min(mean[axis] - radius);
            extent[1][axis] = extent[1][axis].max(mean[axis] + radius);
        }
    }
    match splats.is_empty() {
        true => [[0.0; 3]; 2],
        false => extent,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::splats::fixtures::scattered;

    #[test]
    fn every_number_is_there() {
        let splats = scattered(20, 2);
        let options = WriteOptions {
            generator: "a \"program\"".to_owned(),
            antialiased: true,
            offset: DVec3::new(1.5, 0.0, -2e7),
            ..WriteOptions::default()
        };
        let text = String::from_utf8(encode(&splats, &options)).unwrap();
        assert!(
            text.starts_with("#usda 1.0\n(\n    \"a  program \"\n"),
            "{text}"
        );
        for line in [
            "        string SplatRenderMode = \"mip\"",
            "        double3 offset = (1.5, 0, -20000000)",
            "    upAxis = \"Y\"",
            "    uniform int radiance:sphericalHarmonicsDegree = 2",
            "        elementSize = 9",
        ] {
            assert!(text.lines().any(|found| found == line), "{line}: {text}");
        }
        let values = |name: &str| -> Vec<f32> {
            let (_, rest) = text.split_once(&format!("{name} = [")).expect(name);
            let (values, _) = rest.split_once(']').expect("an end");
            let words = values.split(|c: char| "(),".contains(c) || c.is_whitespace());
            let words = words.filter(|word| !word.is_empty());
            words.map(|word| word.parse().expect("a number")).collect()
        };
        let turned = axes::turned(splats.clone(), axes::Y_UP);
        assert_eq!(values("point3f[] positions"), turned.means.as_flattened());
        assert_eq!(values("quatf[] orientations"), turned.quats.as_flattened());
        let coefficients = values("float3[] radiance:sphericalHarmonicsCoefficients");
        assert_eq!(coefficients, turned.sh.coefficients);
        assert_eq!(values("float[] opacities").len(), 20);
        let scales = values("float3[] scales");
        assert_eq!(scales[0], splats.log_scales[0][0].exp());
        let box_of = values("float3[] extent");
        assert!(turned.means.iter().all(|mean| {
            (0..3).all(|axis| mean[axis] > box_of[axis] && mean[axis] < box_of[3 + axis])
        }));
    }
}
