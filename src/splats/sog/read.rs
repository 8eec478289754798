//! Reading.

use std::{
    io::{Cursor, Read},
    path::Path,
};

use glam::DVec3;
use zip::ZipArchive;

use super::{texture::Texture, *};
use crate::input::excerpt;
use crate::splats::{
    ReadSplats, SplatError,
    quantize::{between, logit, of_smallest_three},
    sh::MAX_DEGREE,
    shared::{SplatBuilder, check_count, memory},
};

/// Longest `meta.json` that is read: codebooks take some 20 KiB.
const MOST_META: usize = 1 << 20;

/// Bytes of a Gaussian's pixels in all textures.
const TEXTURES: usize = 6 * 4;

/// Entries of a codebook.
const ENTRIES: usize = 256;

/// Pixels that a texture may have beyond its Gaussians: four times as many, for who likes powers
/// of two, and some for small scenes.
const SPARE: [usize; 2] = [4, 1 << 16];

/// Reads a file.
///
/// # Errors
/// [`SplatError::Damaged`] with the part of the file.
pub(in crate::splats) fn read(path: &Path, bytes: &[u8]) -> Result<ReadSplats, SplatError> {
    let archive = ZipArchive::new(Cursor::new(bytes))
        .map_err(|error| SplatError::damaged(path, "zip archive", error.to_string()))?;
    let mut source = SogFiles { path, archive };
    let meta = source.file(META, META, MOST_META)?;
    let meta: Meta = serde_json::from_slice(&meta)
        .map_err(|error| SplatError::damaged(path, META, excerpt(&error.to_string())))?;
    if meta.version != VERSION {
        let reason = format!("version {} is not read, only {VERSION}", meta.version);
        return Err(SplatError::damaged(path, META, reason));
    }
    let bands = meta.sh_n.as_ref().map_or(0, |harmonics| harmonics.bands);
    let each = memory(bands.min(MAX_DEGREE)) + TEXTURES * SPARE[0];
    check_count(path, meta.count, each, bytes.len())?;
    for book in [&meta.scales.codebook, &meta.sh0.codebook] {
        check_book(path, book)?;
    }
    let most = meta.count.saturating_mul(SPARE[0]).saturating_add(SPARE[1]);
    let pixels = [meta.count, most];
    let [low, high] = [0, 1].map(|k| source.texture("means", &meta.means.files[k], pixels));
    let (low, high) = (low?, high?);
    let scales = source.texture("scales", &meta.scales.files[0], pixels)?;
    let quats = source.texture("quats", &meta.quats.files[0], pixels)?;
    let colors = source.texture("sh0", &meta.sh0.files[0], pixels)?;
    let harmonics = match &meta.sh_n {
        Some(harmonics) => Some(source.harmonics(harmonics, pixels)?),
        None => None,
    };
    let degree = meta.sh_n.as_ref().map_or(0, |harmonics| harmonics.bands);

    let mut gathered = SplatBuilder::new(meta.count, degree);
    let mut coefficients = vec![0.0; coefficient_count(degree) * CHANNELS];
    for index in 0..meta.count {
        let mean = [0, 1, 2].map(|axis| {
            let level = u16::from_le_bytes([low.rgba[index][axis], high.rgba[index][axis]]);
            let share = f64::from(level) / f64::from(u16::MAX);
            coordinate(between(meta.means.mins[axis], meta.means.maxs[axis], share)) as f32
        });
        let [a, b, c, largest] = quats.rgba[index];
        let quaternion = match largest.checked_sub(QUATERNION) {
            Some(largest) => {
                let small = [a, b, c].map(|byte| f64::from(byte) / 255.0 * 2.0 - 1.0);
                of_smallest_three(largest.into(), small)
            }
            None => {
                let reason = format!("alpha {largest} of pixel {index} is below {QUATERNION}");
                return Err(SplatError::damaged(path, "quats", reason));
            }
        };
        let [red, green, blue, opacity] = colors.rgba[index];
        let (constant, above) = coefficients.split_at_mut(CHANNELS);
        constant.copy_from_slice(&[red, green, blue].map(|k| meta.sh0.codebook[usize::from(k)]));
        if let Some(Palette { labels, values }) = &harmonics {
            let [l, h, ..] = labels.rgba[index];
            let entry = usize::from(u16::from_le_bytes([l, h])) * above.len();
            let values = values.get(entry..entry + above.len()).ok_or_else(|| {
                let reason = format!("label of pixel {index} is beyond the palette");
                SplatError::damaged(path, "shN", reason)
            })?;
            above.copy_from_slice(values);
        }
        let [x, y, z, _] = scales.rgba[index];
        gathered.push(
            mean,
            quaternion,
            [x, y, z].map(|k| meta.scales.codebook[usize::from(k)]),
            logit(f64::from(opacity) / 255.0),
            &coefficients,
        );
    }
    Ok(ReadSplats {
        antialiased: meta.antialias || meta.model.as_deref() == Some(ANTIALIASED),
        offset: (meta.asset.offset.map(DVec3::from))
            .filter(|offset| offset.is_finite())
            .unwrap_or_default(),
        ..gathered.finish()
    })
}

fn check_book(path: &Path, book: &[f32]) -> Result<(), SplatError> {
    match book.len() {
        ENTRIES => Ok(()),
        other => {
            let reason = format!("a codebook has {other} entries, not {ENTRIES}");
            Err(SplatError::damaged(path, META, reason))
        }
    }
}

/// The palette, and which entry each Gaussian has.
struct Palette {
    labels: Texture,
    /// `[entries, terms, 3]`.
    values: Vec<f32>,
}

struct SogFiles<'a> {
    path: &'a Path,
    archive: ZipArchive<Cursor<&'a [u8]>>,
}

impl SogFiles<'_> {
    /// A file of the archive, of at most so many bytes.
    fn file(&mut self, part: &'static str, name: &str, most: usize) -> Result<Vec<u8>, SplatError> {
        let path = self.path;
        let wrong = |reason: String| SplatError::damaged(path, part, reason);
        // No name that is in use is so long.
        let name = &*excerpt(name);
        let file =
            (self.archive.by_name(name)).map_err(|error| wrong(format!("{name}: {error}")))?;
        let mut bytes = Vec::new();
        (file.take(most as u64 + 1).read_to_end(&mut bytes))
            .map_err(|error| wrong(format!("{name}: {error}")))?;
        match bytes.len() > most {
            true => Err(wrong(format!("{name} has more than {most} bytes"))),
            false => Ok(bytes),
        }
    }

    /// A texture with at least and at most so many pixels.
    fn texture(
        &mut self,
        part: &'static str,
        name: &str,
        pixels: [usize; 2],
    ) -> Result<Texture, SplatError> {
        // A picture that is not compressed has four bytes a pixel.
        let most = pixels[1].saturating_mul(4).saturating_add(1 << 16);
        let file = self.file(part, name, most)?;
        Texture::decode(&file, pixels)
            .map_err(|reason| SplatError::damaged(self.path, part, format!("{name}: {reason}")))
    }

    fn harmonics(
        &mut self,
        harmonics: &Harmonics,
        pixels: [usize; 2],
    ) -> Result<Palette, SplatError> {
        let path = self.path;
        let wrong = |reason: String| Err(SplatError::damaged(path, "shN", reason));
        let Harmonics { count, bands, .. } = *harmonics;
        if !(1..=MAX_DEGREE).contains(&bands) || count > MOST_ENTRIES {
            return wrong(format!("{count} entries of {bands} bands"));
        }
        check_book(path, &harmonics.codebook)?;
        let [centroids, labels] = &harmonics.files;
        let terms = coefficient_count(bands) - 1;
        let (width, rows) = (ENTRIES_PER_ROW * terms, count.div_ceil(ENTRIES_PER_ROW));
        let palette = [width * rows, width * rows.saturating_mul(2) + SPARE[1]];
        let centroids = self.texture("shN", centroids, palette)?;
        if centroids.width != width {
            return wrong(format!("{} is not {width} wide", harmonics.files[0]));
        }
        let values = centroids.rgba[..count * terms]
            .iter()
            .flat_map(|&[r, g, b, _]| [r, g, b].map(|k| harmonics.codebook[usize::from(k)]));
        Ok(Palette {
            values: values.collect(),
            labels: self.texture("shN", labels, pixels)?,
        })
    }
}
