//! Writing.

use std::io::{Cursor, Write};

use glam::DVec3;
use zip::{CompressionMethod, DateTime, ZipWriter, write::SimpleFileOptions};

use super::{
    codebook::{codebook, nearest},
    palette::palette,
    texture::{LONGEST_SIDE, Texture},
    *,
};
use crate::splats::{
    SplatError, Splats, WriteOptions, morton,
    quantize::{level, opacity_byte, share, smallest_three},
    shared::FormatFidelity,
};

/// Levels of a coordinate's logarithm.
const LEVELS: u32 = 65_535;

/// Least and greatest logarithm of the means' coordinates on each axis.
fn bounds(means: &[[f32; 3]]) -> [[f64; 3]; 2] {
    let bound = |pick: fn(f64, f64) -> f64| {
        [0, 1, 2].map(|axis| {
            let logarithms = means.iter().map(|mean| logarithm(mean[axis].into()));
            logarithms.reduce(pick).unwrap_or(0.0)
        })
    };
    [bound(f64::min), bound(f64::max)]
}

/// SH above degree 0 by a palette.
struct Rest {
    meta: Harmonics,
    /// Entries of the palette, one after the other.
    centroids: Texture,
    /// Entry of each Gaussian.
    labels: Vec<u16>,
}

fn palette_of_rest(splats: &Splats) -> Rest {
    let (count, degree) = (splats.len(), splats.sh.degree);
    let terms = coefficient_count(degree) - 1;
    let points: Vec<f32> = (0..count)
        .flat_map(|index| &splats.sh.of(index)[CHANNELS..])
        .copied()
        .collect();
    let palette = palette(&points, terms * CHANNELS, entries(count));
    let values: Vec<f32> = palette.entries.concat();
    let book = codebook(&values);
    let rows = palette.entries.len().div_ceil(ENTRIES_PER_ROW);
    let mut centroids = Texture::black(ENTRIES_PER_ROW * terms, rows);
    // Entries follow one another, across rows, too.
    for (pixel, values) in centroids.rgba.iter_mut().zip(values.chunks_exact(CHANNELS)) {
        for (channel, &value) in pixel.iter_mut().zip(values) {
            *channel = nearest(&book, value);
        }
    }
    Rest {
        meta: Harmonics {
            count: palette.entries.len(),
            bands: degree,
            codebook: book,
            files: ["shN_centroids.webp", "shN_labels.webp"].map(str::to_owned),
        },
        centroids,
        labels: palette.labels,
    }
}

/// The bytes of a file. Gaussians are put in an order in which neighbors are neighbors.
///
/// # Errors
/// [`SplatError`] where steps of 16 bits are too coarse for the scene, or Gaussians too many.
pub(in crate::splats) fn encode(
    splats: &Splats,
    options: &WriteOptions,
    fidelity: &mut FormatFidelity<'_>,
) -> Result<Vec<u8>, SplatError> {
    let (count, degree) = (splats.len(), splats.sh.degree);
    let size = Texture::for_splats(count);
    if size.width.max(size.height) > LONGEST_SIDE {
        return Err(SplatError::NotWritten {
            path: fidelity.path.to_owned(),
            reason: format!("{count} Gaussians do not fit into a picture of {LONGEST_SIDE} pixels"),
        });
    }
    let [mins, maxs] = bounds(&splats.means);
    fidelity.steps(|mean| {
        let steps = [0, 1, 2].map(|axis| {
            let step = (maxs[axis] - mins[axis]) / f64::from(LEVELS);
            step * (1.0 + f64::from(mean[axis].abs()))
        });
        steps.into_iter().fold(0.0, f64::max)
    })?;

    let order: Vec<usize> = (morton::order(&splats.means).into_iter())
        .map(|index| index as usize)
        .collect();
    let mut files = Files::default();
    let texture = |pixel: &dyn Fn(usize) -> [u8; 4]| {
        let mut texture = Texture::for_splats(count);
        for (place, &index) in texture.rgba.iter_mut().zip(&order) {
            *place = pixel(index);
        }
        texture
    };
    let place = |index: usize| {
        [0, 1, 2].map(|axis| {
            let logarithm = logarithm(splats.means[index][axis].into());
            level(share(logarithm, mins[axis], maxs[axis]), LEVELS).to_le_bytes()
        })
    };
    for (name, byte) in [("means_l.webp", 0), ("means_u.webp", 1)] {
        files.add(
            name,
            &texture(&|index| {
                let [x, y, z] = place(index).map(|bytes| bytes[byte]);
                [x, y, z, u8::MAX]
            }),
        );
    }
    let scales = codebook(splats.log_scales.as_flattened());
    files.add(
        "scales.webp",
        &texture(&|index| {
            let [x, y, z] = splats.log_scales[index].map(|scale| nearest(&scales, scale));
            [x, y, z, u8::MAX]
        }),
    );
    files.add(
        "quats.webp",
        &texture(&|index| {
            let (largest, small) = smallest_three(splats.quats[index]);
            let [a, b, c] = small.map(|value| level((value + 1.0) / 2.0, 255) as u8);
            [a, b, c, QUATERNION + largest as u8]
        }),
    );
    let constant = |index: usize| &splats.sh.of(index)[..CHANNELS];
    let all: Vec<f32> = (0..count).flat_map(constant).copied().collect();
    let colors = codebook(&all);
    files.add(
        "sh0.webp",
        &texture(&|index| {
            let [r, g, b] = [0, 1, 2].map(|c| nearest(&colors, constant(index)[c]));
            [r, g, b, opacity_byte(splats.opacity_logits[index])]
        }),
    );
    let sh_n = (degree > 0 && count > 0).then(|| {
        let rest = palette_of_rest(splats);
        files.add("shN_centroids.webp", &rest.centroids);
        files.add(
            "shN_labels.webp",
            &texture(&|index| {
                let [low, high] = rest.labels[index].to_le_bytes();
                [low, high, 0, u8::MAX]
            }),
        );
        rest.meta
    });
    let meta = Meta {
        version: VERSION,
        asset: Asset {
            generator: options.generator.clone(),
            offset: (options.offset != DVec3::ZERO).then(|| options.offset.to_array()),
        },
        count,
        antialias: options.antialiased,
        model: options.antialiased.then(|| ANTIALIASED.to_owned()),
        means: Means {
            mins,
            maxs,
            files: ["means_l.webp", "means_u.webp"].map(str::to_owned),
        },
        scales: Coded {
            codebook: scales,
            files: ["scales.webp".to_owned()],
        },
        quats: Plain {
            files: ["quats.webp".to_owned()],
        },
        sh0: Coded {
            codebook: colors,
            files: ["sh0.webp".to_owned()],
        },
        sh_n,
    };
    let archive = files.archive(&meta).map_err(std::io::Error::other);
    archive.map_err(SplatError::io(fidelity.path))
}

/// Entries of the palette for so many Gaussians: as splat-transform has it, the highest power of
/// two that is not above their number, and no more than 16 bits tell apart.
fn entries(count: usize) -> usize {
    (1 << count.max(1).ilog2()).min(MOST_ENTRIES)
}

/// The files of the archive.
#[derive(Default)]
struct Files(Vec<(&'static str, Result<Vec<u8>, String>)>);

impl Files {
    fn add(&mut self, name: &'static str, texture: &Texture) {
        self.0.push((name, texture.encode()));
    }

    /// An archive without compression, since its files are compressed, and without times.
    fn archive(self, meta: &Meta) -> Result<Vec<u8>, String> {
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(DateTime::default());
        let meta = serde_json::to_vec(meta).map_err(|error| error.to_string());
        for (name, bytes) in [(META, meta)].into_iter().chain(self.0) {
            let bytes = bytes?;
            archive
                .start_file(name, options)
                .map_err(|error| error.to_string())?;
            archive
                .write_all(&bytes)
                .map_err(|error| error.to_string())?;
        }
        let file = archive.finish().map_err(|error| error.to_string())?;
        Ok(file.into_inner())
    }
}
