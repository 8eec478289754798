//! `.glb` files: glTF 2.0 with `KHR_gaussian_splatting`, written only.
//!
//! Every attribute is an accessor of 32-bit floats into the one binary chunk: `POSITION`, and
//! under `KHR_gaussian_splatting:` `ROTATION` (x, y, z, w), `SCALE` (not logarithms), `OPACITY`
//! (0 to 1) and `SH_DEGREE_l_COEF_n` (red, green, blue). `COLOR_0` (bytes) is what programs show
//! that know no splats.
//!
//! glTF's y is up: the scene is turned about z by half a turn, as splat-transform does.
//!
//! Source: <https://github.com/KhronosGroup/glTF>, the specification of glTF 2.0 and
//! `extensions/2.0/Khronos/KHR_gaussian_splatting`.

use std::path::Path;

use serde_json::{Map, Value, json};

use super::{
    SplatError, Splats, WriteOptions, axes, quantize::opacity_byte, sh::coefficient_count,
    shared::CHANNELS, splat::shown_byte,
};

const EXTENSION: &str = "KHR_gaussian_splatting";

/// Component types of accessors.
const FLOAT: u32 = 5126;
const UNSIGNED_BYTE: u32 = 5121;

/// A buffer view of attributes of vertices.
const ARRAY_BUFFER: u32 = 34962;

/// A primitive of points.
const POINTS: u32 = 0;

/// The bytes of a file.
///
/// # Errors
/// [`SplatError::NotWritten`] where it would have more than 4 GiB.
pub(super) fn encode(
    path: &Path,
    splats: &Splats,
    options: &WriteOptions,
) -> Result<Vec<u8>, SplatError> {
    let splats = axes::turned(splats.clone(), axes::Y_UP);
    let mut parts = Parts::default();
    parts.floats("POSITION".to_owned(), "VEC3", splats.means.as_flattened());
    parts.bound(&splats.means);
    parts.colors(&splats);
    let name = |attribute: &str| format!("{EXTENSION}:{attribute}");
    let rotations: Vec<[f32; 4]> = (splats.quats.iter())
        .map(|&[w, x, y, z]| [x, y, z, w])
        .collect();
    parts.floats(name("ROTATION"), "VEC4", rotations.as_flattened());
    let scales: Vec<[f32; 3]> = (splats.log_scales.iter())
        .map(|scales| scales.map(f32::exp))
        .collect();
    parts.floats(name("SCALE"), "VEC3", scales.as_flattened());
    let opacities: Vec<f32> = splats.opacities().map(|opacity| opacity as f32).collect();
    parts.floats(name("OPACITY"), "SCALAR", &opacities);
    for k in 0..coefficient_count(splats.sh.degree) {
        let degree = k.isqrt();
        let attribute = format!("SH_DEGREE_{degree}_COEF_{}", k - degree * degree);
        let values: Vec<f32> = (0..splats.len())
            .flat_map(|index| &splats.sh.of(index)[k * CHANNELS..(k + 1) * CHANNELS])
            .copied()
            .collect();
        parts.floats(name(&attribute), "VEC3", &values);
    }

    let mut asset = json!({ "version": "2.0", "generator": options.generator });
    let mut extras = Map::new();
    if options.antialiased {
        extras.insert("SplatRenderMode".to_owned(), json!("mip"));
    }
    if options.offset != glam::DVec3::ZERO {
        extras.insert("offset".to_owned(), json!(options.offset.to_array()));
    }
    if !extras.is_empty() {
        asset["extras"] = extras.into();
    }
    let json = json!({
        "asset": asset,
        "extensionsUsed": [EXTENSION],
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{
            "mode": POINTS,
            "attributes": parts.attributes,
            "extensions": { EXTENSION: {
                "kernel": "ellipse",
                "colorSpace": "srgb_rec709_display",
                "projection": "perspective",
                "sortingMethod": "cameraDistance",
            } },
        }] }],
        "accessors": parts.accessors,
        "bufferViews": parts.views,
        "buffers": [{ "byteLength": parts.bytes.len() }],
    });
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let length = 12 + 8 + text.len() + 8 + parts.bytes.len();
    let too_many = |_| SplatError::NotWritten {
        path: path.to_owned(),
        reason: format!("{length} bytes are more than a .glb can have; write a .sog or a .spz"),
    };
    let length = u32::try_from(length).map_err(too_many)?;
    let mut bytes = b"glTF".to_vec();
    bytes.extend([2, length].map(u32::to_le_bytes).as_flattened());
    for (kind, chunk) in [(b"JSON", text), (b"BIN\0", parts.bytes)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    Ok(bytes)
}

/// The binary chunk and what it holds.
#[derive(Default)]
struct Parts {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    attributes: Map<String, Value>,
}

impl Parts {
    fn floats(&mut self, name: String, kind: &str, values: &[f32]) {
        let width = match kind {
            "SCALAR" => 1,
            "VEC3" => 3,
            _ => 4,
        };
        let bytes = values.iter().flat_map(|value| value.to_le_bytes());
        let accessor = json!({
            "componentType": FLOAT,
            "count": values.len() / width,
            "type": kind,
        });
        self.add(name, bytes, accessor);
    }

    /// Color and opacity of each Gaussian for programs that do not support splats.
    fn colors(&mut self, splats: &Splats) {
        let bytes = (0..splats.len()).flat_map(|index| {
            let constant = &splats.sh.of(index)[..CHANNELS];
            let [red, green, blue] = [0, 1, 2].map(|c| shown_byte(constant[c]));
            [red, green, blue, opacity_byte(splats.opacity_logits[index])]
        });
        let accessor = json!({
            "componentType": UNSIGNED_BYTE,
            "normalized": true,
            "count": splats.len(),
            "type": "VEC4",
        });
        self.add("COLOR_0".to_owned(), bytes, accessor);
    }

    /// Adds an accessor; all have a multiple of four bytes.
    fn add(&mut self, name: String, bytes: impl Iterator<Item = u8>, mut accessor: Value) {
        let begin = self.bytes.len();
        self.bytes.extend(bytes);
        self.views.push(json!({
            "buffer": 0,
            "byteOffset": begin,
            "byteLength": self.bytes.len() - begin,
            "target": ARRAY_BUFFER,
        }));
        accessor["bufferView"] = json!(self.views.len() - 1);
        self.attributes.insert(name, json!(self.accessors.len()));
        self.accessors.push(accessor);
    }

    /// Bounds of the last accessor, which are a must for positions.
    fn bound(&mut self, means: &[[f32; 3]]) {
        let bound = |pick: fn(f32, f32) -> f32| {
            [0, 1, 2].map(|axis| means.iter().map(|mean| mean[axis]).reduce(pick))
        };
        if let (Some(last), false) = (self.accessors.last_mut(), means.is_empty()) {
            last["min"] = json!(bound(f32::min));
            last["max"] = json!(bound(f32::max));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::splats::fixtures::scattered;

    #[test]
    fn the_container_is_as_the_specification_says() {
        let splats = scattered(5, 1);
        let options = WriteOptions {
            antialiased: true,
            ..WriteOptions::default()
        };
        let bytes = encode(Path::new("a.glb"), &splats, &options).unwrap();
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!((word(0), word(4)), (0x4654_6c67, 2));
        assert_eq!(word(8) as usize, bytes.len());
        let text_bytes = word(12) as usize;
        assert_eq!((text_bytes % 4, word(16)), (0, 0x4e4f_534a));
        let json: Value = serde_json::from_slice(&bytes[20..20 + text_bytes]).unwrap();
        let binary = 20 + text_bytes;
        assert_eq!(word(binary + 4), 0x004e_4942);
        assert_eq!(word(binary) as usize, bytes.len() - binary - 8);
        assert_eq!(json["buffers"][0]["byteLength"], word(binary));
        assert_eq!(json["asset"]["extras"]["SplatRenderMode"], "mip");

        let floats = |name: &str, width: usize| -> Vec<f32> {
            let index = &json["meshes"][0]["primitives"][0]["attributes"][name];
            let accessor = &json["accessors"][index.as_u64().expect(name) as usize];
            assert_eq!(
                (&accessor["componentType"], &accessor["count"]),
                (&json!(5126), &json!(5))
            );
            let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
            let at = binary + 8 + view["byteOffset"].as_u64().unwrap() as usize;
            assert_eq!(view["byteLength"], 5 * 4 * width);
            bytes[at..at + 5 * 4 * width]
                .chunks_exact(4)
                .map(|four| f32::from_le_bytes(four.try_into().unwrap()))
                .collect()
        };
        let [x, y, z] = splats.means[0];
        assert_eq!(floats("POSITION", 3)[..3], [-x, -y, z]);
        let [w, i, j, k] = splats.quats[0];
        let rotation = floats("KHR_gaussian_splatting:ROTATION", 4);
        assert_eq!(rotation[..4], [-j, i, w, -k]);
        let scales = floats("KHR_gaussian_splatting:SCALE", 3);
        assert_eq!(scales[2], splats.log_scales[0][2].exp());
        let opacity = floats("KHR_gaussian_splatting:OPACITY", 1)[0];
        assert!((opacity - 1.0 / (1.0 + (-splats.opacity_logits[0]).exp())).abs() < 1e-6);
        // Of degree 1 in the order y, z, x: half a turn about z changes the first and the last.
        for (coefficient, sign) in [(0, -1.0), (1, 1.0), (2, -1.0)] {
            let name = format!("KHR_gaussian_splatting:SH_DEGREE_1_COEF_{coefficient}");
            let before = splats.sh.of(0)[3 * (coefficient + 1)];
            assert_eq!(floats(&name, 3)[0], sign * before);
        }
    }
}
