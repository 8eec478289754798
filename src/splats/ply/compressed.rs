//! Compressed `.ply` files, as PlayCanvas' splat-transform, SuperSplat and others read them.
//!
//! Element `chunk` has a row for every 256 Gaussians with the bounds of their centers,
//! log-scales and colors (`min_x` … `max_b`, floats; colors were added later). A `vertex` is
//! four u32:
//!
//! | property | bits, from the highest |
//! |---|---|
//! | `packed_position` | x 11, y 10, z 11: shares of the chunk's bounds |
//! | `packed_rotation` | index 2 of the largest of w, x, y, z; the others 10 each, -√½ to √½ |
//! | `packed_scale` | x 11, y 10, z 11: shares of the chunk's bounds of the log-scales |
//! | `packed_color` | red, green, blue 8 each: shares of the chunk's bounds; opacity 8 |
//!
//! Colors are 0.5 + C0 times the constant coefficient. Element `sh`, if any, has a uchar for
//! every `f_rest_*`, in the order of the uncompressed layout: 0 is -4, 255 is 4, and others are
//! (byte + ½) / 32 - 4.
//!
//! Source: the writer and the reader of <https://github.com/playcanvas/splat-transform>.

use super::{
    CHANNELS, ReadSplats, SplatError, degree_of_rest_count,
    header::{HEADER, byte_size, decode, is_antialiased, offset},
    rest_count, sh_position,
};
use crate::input::excerpt;
use crate::splats::{
    Splats, WriteOptions, morton,
    quantize::{
        FLAT, between, level, logit, of_smallest_three, opacity_byte, share, smallest_three,
    },
    sh::{C0, coefficient_count},
    shared::{FormatFidelity, SplatBuilder},
};
use ply_rs_bw::ply::{ElementDef, Encoding, Header, PropertyType, ScalarType};
use std::collections::HashMap;
use std::io::BufRead;
use std::path::Path;

/// Gaussians of a chunk.
const CHUNK: usize = 256;

/// Bounds of a chunk, in the file's order.
const BOUNDS: [&str; 18] = [
    "min_x",
    "min_y",
    "min_z",
    "max_x",
    "max_y",
    "max_z",
    "min_scale_x",
    "min_scale_y",
    "min_scale_z",
    "max_scale_x",
    "max_scale_y",
    "max_scale_z",
    "min_r",
    "min_g",
    "min_b",
    "max_r",
    "max_g",
    "max_b",
];

const PACKED: [&str; 4] = [
    "packed_position",
    "packed_rotation",
    "packed_scale",
    "packed_color",
];

/// Bits of x, y and z, from the highest.
const PLACE_BITS: [u32; 3] = [11, 10, 11];

/// Bits of a component of a quaternion.
const ROTATION_BITS: u32 = 10;

/// Harmonics beyond are clipped.
const SH_LIMIT: f32 = 4.0;

/// Returns true if the header is that of a compressed file.
pub(super) fn is_compressed(header: &Header) -> bool {
    let vertex = header.elements.get("vertex");
    vertex.is_some_and(|vertex| vertex.properties.contains_key(PACKED[0]))
}

/// Reads what follows the header.
///
/// # Errors
/// [`SplatError`] where a property is missing or the file is shorter than its header says.
pub(super) fn read(
    path: &Path,
    header: &Header,
    file: &mut impl BufRead,
) -> Result<ReadSplats, SplatError> {
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(SplatError::io(path))?;
    let mut rest = &bytes[..];
    let mut tables = Vec::new();
    for element in header.elements.values() {
        tables.push(Table::cut(path, header.encoding, element, &mut rest)?);
    }
    let table = |name: &str| tables.iter().find(|table| table.element.name == name);
    let missing = |property: &str| SplatError::missing(path, property);
    let chunks = table("chunk").ok_or_else(|| missing(BOUNDS[0]))?;
    let vertices = table("vertex").ok_or_else(|| missing(PACKED[0]))?;
    if chunks.element.count < vertices.element.count.div_ceil(CHUNK) {
        return Err(chunks.truncated());
    }
    let packed: Vec<&Column> = (PACKED.iter())
        .map(|name| vertices.column(name))
        .collect::<Result<_, _>>()?;
    // Old files have no bounds of colors: these lie in [0, 1].
    let has_colors = chunks.element.properties.contains_key(BOUNDS[12]);
    let bounds: Vec<&Column> = (BOUNDS[..if has_colors { 18 } else { 12 }].iter())
        .map(|name| chunks.column(name))
        .collect::<Result<_, _>>()?;

    let harmonics = table("sh");
    let rest_columns = harmonics.map_or(0, |table| table.element.properties.len());
    let degree = degree_of_rest_count(rest_columns).ok_or_else(|| SplatError::RestCount {
        path: path.to_owned(),
        count: rest_columns,
    })?;
    let rest_columns: Vec<&Column> = match harmonics {
        Some(table) if table.element.count < vertices.element.count => {
            return Err(table.truncated());
        }
        Some(table) => (0..rest_count(degree))
            .map(|i| table.column(&format!("f_rest_{i}")))
            .collect::<Result<_, _>>()?,
        None => Vec::new(),
    };

    let mut gathered = SplatBuilder::new(vertices.element.count, degree);
    let mut low_high = [[0.0; 3], [1.0; 3]].as_flattened().repeat(3);
    let mut coefficients = vec![0.0; coefficient_count(degree) * CHANNELS];
    for index in 0..vertices.element.count {
        if index % CHUNK == 0 {
            for (value, bound) in low_high.iter_mut().zip(&bounds) {
                *value = chunks.number(index / CHUNK, bound);
            }
        }
        let [place, turn, size, color] =
            [0, 1, 2, 3].map(|k| vertices.number(index, packed[k]) as u32);
        let place = unpack(place, PLACE_BITS, &low_high[..6]);
        let size = unpack(size, PLACE_BITS, &low_high[6..12]);
        let shown = unpack(color >> 8, [8; 3], &low_high[12..]);
        for channel in 0..CHANNELS {
            coefficients[channel] = ((shown[channel] - 0.5) / C0) as f32;
        }
        for (k, terms) in (1..coefficient_count(degree)).map(|k| (k, k * CHANNELS)) {
            for channel in 0..CHANNELS {
                let column = rest_columns[sh_position(degree, k, channel) - CHANNELS];
                let byte = harmonics.map_or(0.0, |table| table.number(index, column));
                coefficients[terms + channel] = of_sh_byte(byte);
            }
        }
        gathered.push(
            place.map(|value| value as f32),
            unpack_rotation(turn),
            size.map(|value| value as f32),
            logit(f64::from(color & 0xff) / 255.0),
            &coefficients,
        );
    }
    Ok(ReadSplats {
        antialiased: is_antialiased(&header.comments),
        offset: offset(&header.comments),
        surplus: match rest.iter().all(u8::is_ascii_whitespace) {
            true => 0,
            false => rest.len() as u64,
        },
        ..gathered.finish()
    })
}

/// The rows of an element.
struct Table<'a> {
    path: &'a Path,
    element: &'a ElementDef,
    big_endian: bool,
    columns: HashMap<&'a str, Column>,
    stride: usize,
    bytes: &'a [u8],
}

/// Byte offset of a number within a row, and its type.
struct Column {
    at: usize,
    kind: ScalarType,
}

impl<'a> Table<'a> {
    /// Cuts the rows off `rest`.
    fn cut(
        path: &'a Path,
        encoding: Encoding,
        element: &'a ElementDef,
        rest: &mut &'a [u8],
    ) -> Result<Self, SplatError> {
        let header = |reason: String| SplatError::damaged(path, HEADER, reason);
        if encoding == Encoding::Ascii {
            return Err(header("a compressed file is never text".to_owned()));
        }
        let (mut columns, mut stride) = (HashMap::new(), 0);
        for property in element.properties.values() {
            let PropertyType::Scalar(kind) = &property.data_type else {
                let name = excerpt(&property.name);
                return Err(header(format!("property \"{name}\" is a list")));
            };
            let (at, kind) = (stride, kind.clone());
            stride += byte_size(&kind);
            columns.insert(&*property.name, Column { at, kind });
        }
        let length = element.count.checked_mul(stride);
        let cut = length.and_then(|length| rest.split_at_checked(length));
        let (bytes, behind) = cut.ok_or_else(|| SplatError::truncated(path, element))?;
        *rest = behind;
        Ok(Self {
            path,
            element,
            big_endian: encoding == Encoding::BinaryBigEndian,
            columns,
            stride,
            bytes,
        })
    }

    fn truncated(&self) -> SplatError {
        SplatError::truncated(self.path, self.element)
    }

    fn column(&self, name: &str) -> Result<&Column, SplatError> {
        let missing = || SplatError::missing(self.path, name);
        self.columns.get(name).ok_or_else(missing)
    }

    fn number(&self, row: usize, column: &Column) -> f64 {
        let at = row * self.stride + column.at;
        decode(&column.kind, self.big_endian, &self.bytes[at..])
    }
}

/// Three shares of `bounds`, low ones before high ones.
fn unpack(word: u32, bits: [u32; 3], bounds: &[f64]) -> [f64; 3] {
    let shifts = [bits[1] + bits[2], bits[2], 0];
    [0, 1, 2].map(|k| {
        let highest = (1 << bits[k]) - 1;
        let share = f64::from(word >> shifts[k] & highest) / f64::from(highest);
        between(bounds[k], bounds[3 + k], share)
    })
}

fn unpack_rotation(word: u32) -> [f32; 4] {
    let highest = (1 << ROTATION_BITS) - 1;
    let small = [2, 1, 0].map(|k| {
        let level = word >> (k * ROTATION_BITS) & highest;
        f64::from(level) / f64::from(highest) * 2.0 - 1.0
    });
    of_smallest_three((word >> (3 * ROTATION_BITS)) as usize, small)
}

fn of_sh_byte(byte: f64) -> f32 {
    let limit = f64::from(SH_LIMIT);
    match byte {
        255.0 => SH_LIMIT,
        0.0 => -SH_LIMIT,
        byte => ((byte + 0.5) / 256.0 * 2.0 * limit - limit) as f32,
    }
}

fn sh_byte(value: f32) -> u8 {
    let share = (f64::from(value) / f64::from(SH_LIMIT) + 1.0) / 2.0;
    (share * 256.0).floor().clamp(0.0, 255.0) as u8
}

/// The bytes of a compressed `.ply`. Gaussians are put in an order in which those of a chunk lie
/// close together.
pub(in crate::splats) fn encode(
    splats: &Splats,
    options: &WriteOptions,
    fidelity: &mut FormatFidelity<'_>,
) -> Vec<u8> {
    fidelity.harmonics(false, [-SH_LIMIT, SH_LIMIT]);
    let (count, degree) = (splats.len(), splats.sh.degree);
    let order = morton::order(&splats.means);
    let mut bytes = header(count, degree, &options.comments()).into_bytes();
    let chunks: Vec<_> = (order.chunks(CHUNK))
        .map(|chunk| (chunk, bounds_of(splats, chunk)))
        .collect();
    for (_, bounds) in &chunks {
        bytes.extend(bounds.as_flattened().iter().flat_map(|b| b.to_le_bytes()));
    }
    for (chunk, bounds) in &chunks {
        for &index in *chunk {
            let index = index as usize;
            let [place, size, shown] = values(splats, index);
            let color = pack(shown, [8; 3], &bounds[4..]) << 8
                | u32::from(opacity_byte(splats.opacity_logits[index]));
            let words = [
                pack(place, PLACE_BITS, &bounds[..2]),
                pack_rotation(splats.quats[index]),
                pack(size, PLACE_BITS, &bounds[2..4]),
                color,
            ];
            bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
        }
    }
    for &index in &order {
        let coefficients = splats.sh.of(index as usize);
        let mut row = vec![0; rest_count(degree)];
        for k in 1..coefficient_count(degree) {
            for channel in 0..CHANNELS {
                let at = sh_position(degree, k, channel) - CHANNELS;
                row[at] = sh_byte(coefficients[k * CHANNELS + channel]);
            }
        }
        bytes.extend(row);
    }
    bytes
}

fn header(count: usize, degree: u32, comments: &[String]) -> String {
    let lines = |kind: &str, names: &[&str]| -> String {
        let line = |name: &&str| format!("property {kind} {name}\n");
        names.iter().map(line).collect()
    };
    let comments: String = (comments.iter())
        .map(|comment| format!("comment {comment}\n"))
        .collect();
    let rest: String = (0..rest_count(degree))
        .map(|i| format!("property uchar f_rest_{i}\n"))
        .collect();
    let sh = match degree {
        0 => String::new(),
        _ => format!("element sh {count}\n{rest}"),
    };
    format!(
        "ply\nformat binary_little_endian 1.0\n{comments}element chunk {}\n{}element vertex {count}\n{}{sh}end_header\n",
        count.div_ceil(CHUNK),
        lines("float", &BOUNDS),
        lines("uint", &PACKED),
    )
}

/// Center, log-scales and colors as shown.
fn values(splats: &Splats, index: usize) -> [[f32; 3]; 3] {
    let constant = &splats.sh.of(index)[..CHANNELS];
    let shown = [0, 1, 2].map(|c| (0.5 + C0 * f64::from(constant[c])) as f32);
    // What is thinner is flat, and would only make the chunk's other scales coarse.
    let size = splats.log_scales[index].map(|scale| scale.max(FLAT));
    [splats.means[index], size, shown]
}

/// The lowest and the highest of each of [`values`], `[6, 3]`.
fn bounds_of(splats: &Splats, chunk: &[u32]) -> [[f32; 3]; 6] {
    let mut bounds = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]].repeat(3);
    for &index in chunk {
        for (kind, value) in values(splats, index as usize).iter().enumerate() {
            for axis in 0..3 {
                let [low, high] = [2 * kind, 2 * kind + 1];
                bounds[low][axis] = bounds[low][axis].min(value[axis]);
                bounds[high][axis] = bounds[high][axis].max(value[axis]);
            }
        }
    }
    [0, 1, 2, 3, 4, 5].map(|k| bounds[k])
}

/// Three values as shares of the low and the high bounds.
fn pack(values: [f32; 3], bits: [u32; 3], bounds: &[[f32; 3]]) -> u32 {
    (0..3).fold(0, |word, k| {
        let share = share(values[k].into(), bounds[0][k].into(), bounds[1][k].into());
        word << bits[k] | level(share, (1 << bits[k]) - 1)
    })
}

fn pack_rotation(quaternion: [f32; 4]) -> u32 {
    let (largest, small) = smallest_three(quaternion);
    small.iter().fold(largest as u32, |word, value| {
        let share = (value + 1.0) / 2.0;
        word << ROTATION_BITS | level(share, (1 << ROTATION_BITS) - 1)
    })
}
