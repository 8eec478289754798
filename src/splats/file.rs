//! Splat files of every format: the one way in and out.

use std::{
    io::{ErrorKind, Read, Write},
    path::Path,
};

use glam::DVec3;

use super::{
    Format, ReadSplats, SplatError, Splats, WriteOptions, glb, ply,
    shared::{FormatFidelity, norm},
    sog, splat, spz, usda,
};
use crate::{disk, input};

impl WriteOptions {
    /// The comments of a `.ply`.
    pub fn comments(&self) -> Vec<String> {
        let mode = self.antialiased.then(|| ply::ANTIALIASED.to_owned());
        let offset = (self.offset != DVec3::ZERO).then(|| ply::offset_comment(self.offset));
        let generator = std::iter::once(self.generator.clone());
        generator.chain(mode).chain(offset).collect()
    }
}

/// Extensions of others that are neither read nor written, and how to come to one that is read.
const FOREIGN: [(&str, &str); 4] = [
    (
        "ksplat usd usdc usdz gltf lcc lcc2 rad json splatv spx zip csv html",
        CONVERT,
    ),
    (
        "ckpt pt pth npz npy safetensors pkl",
        "convert it to .ply with the program that trained it",
    ),
    (
        "obj las laz e57 pcd xyz pts stl fbx dae",
        "a point cloud or mesh has no Gaussians: give a trained scene as .ply",
    ),
    (
        "mp4 mov m4v mkv mxf avi webm jpg jpeg png tif tiff dpx exr",
        "`gs-chroma auto` makes a scene of films and photos",
    ),
];
const CONVERT: &str = "convert it to .ply, for example with splat-transform";

/// Reads a splat file, in the format that its name tells. Gaussians are in the file's own order
/// and axes.
///
/// # Errors
/// [`SplatError`] where its format is not read or it is damaged.
pub fn read_splats(path: &Path) -> Result<ReadSplats, SplatError> {
    is_splat_file(path)?;
    let bytes = || input::read(path).map_err(SplatError::io(path));
    match Format::of(path) {
        Some(Format::Splat) => splat::read(path, &bytes()?),
        Some(Format::Spz) => spz::read(path, &bytes()?),
        Some(Format::Sog) => sog::read(path, &bytes()?),
        // Which of the two it is its header tells.
        _ => ply::read_ply(path),
    }
}

/// Writes Gaussians as a splat file, in the format that its name tells, and gives what is
/// doubtful about the result. A field with one channel is written as gray RGB.
///
/// The file appears under its name when it is complete; one that was there is replaced. The same
/// Gaussians give the same bytes.
///
/// # Errors
/// [`SplatError`] where the name tells no format, a number is not finite, or the format's numbers
/// are too coarse for the scene.
pub fn write_splats(
    path: &Path,
    splats: &Splats,
    options: &WriteOptions,
) -> Result<Vec<String>, SplatError> {
    let format = Format::to_write(path)?;
    let mut doubts = Vec::new();
    let mut doubt = |what: &str| doubts.push(format!("{}: {what}", path.display()));
    if options.antialiased && !format.tells_antialiasing() {
        doubt(
            "the scene is to be drawn antialiased, which this format cannot say: viewers will draw it too bold from afar; any other format says it",
        );
    }
    if splats.sh.degree > 0 && !format.has_harmonics() {
        doubt(
            "this format has no harmonics: colors are the same from everywhere; any other format has them",
        );
    }
    if format == Format::Ply {
        ply::write_ply(path, splats, options.added, &options.comments())?;
        return Ok(doubts);
    }
    let splats = ready(path, splats, options.added)?;
    let mut fidelity = FormatFidelity {
        path,
        splats: &splats,
        doubts,
    };
    let bytes = match format {
        // The first is written already.
        Format::Ply | Format::CompressedPly => {
            ply::encode_compressed(&splats, options, &mut fidelity)
        }
        Format::Splat => splat::encode(&splats),
        Format::Spz => spz::encode(&splats, options, &mut fidelity)?,
        Format::Sog => sog::encode(&splats, options, &mut fidelity)?,
        Format::Glb => glb::encode(path, &splats, options)?,
        Format::Usda => usda::encode(&splats, options),
    };
    let doubts = fidelity.doubts;
    let mut file = disk::create(path).map_err(SplatError::io(path))?;
    file.write_all(&bytes).map_err(SplatError::io(path))?;
    file.persist(path).map_err(SplatError::io(path))?;
    Ok(doubts)
}

/// Gaussians that every format takes: RGB, finite numbers, unit quaternions.
fn ready(path: &Path, splats: &Splats, added: DVec3) -> Result<Splats, SplatError> {
    ply::check(path, splats, added)?;
    let moved = |mean: &[f32; 3]| {
        (DVec3::from(mean.map(f64::from)) + added)
            .as_vec3()
            .to_array()
    };
    let unit = |quaternion: &[f32; 4]| {
        let norm = norm(quaternion);
        quaternion.map(|value| (f64::from(value) / norm) as f32)
    };
    Ok(Splats {
        means: splats.means.iter().map(moved).collect(),
        quats: splats.quats.iter().map(unit).collect(),
        log_scales: splats.log_scales.clone(),
        opacity_logits: splats.opacity_logits.clone(),
        sh: splats.sh.to_rgb(),
    })
}

impl Format {
    /// The format to write a file in.
    ///
    /// # Errors
    /// [`SplatError::UnknownFormat`].
    pub fn to_write(path: &Path) -> Result<Self, SplatError> {
        Self::of(path).ok_or_else(|| SplatError::UnknownFormat {
            path: path.to_owned(),
        })
    }
}

/// True if a path is that of a readable splat file: named like one, or a `.ply` of another name.
///
/// # Errors
/// [`SplatError::OtherFormat`] where it is named like one that cannot, or is another file.
pub fn is_splat_file(path: &Path) -> Result<bool, SplatError> {
    let other = |extension: &str, remedy| SplatError::OtherFormat {
        path: path.to_path_buf(),
        format: extension.to_owned(),
        remedy,
    };
    // A folder may have any name.
    if path.is_dir() {
        return Ok(false);
    }
    if let Some(format) = Format::of(path) {
        return match format.is_read() {
            true => Ok(true),
            false => Err(other(format.extension(), CONVERT)),
        };
    }
    let extension = path.extension().unwrap_or_default();
    for (extensions, remedy) in FOREIGN {
        let known = (extensions.split(' ')).find(|known| extension.eq_ignore_ascii_case(known));
        if let Some(known) = known {
            return Err(other(&format!(".{known}"), remedy));
        }
    }
    let mut begin = [0; 3];
    match input::open(path).and_then(|mut file| file.read_exact(&mut begin)) {
        Ok(()) if begin == *b"ply" => Ok(true),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(error) if error.kind() != ErrorKind::UnexpectedEof => Err(SplatError::io(path)(error)),
        _ => Err(match extension.is_empty() {
            true => other("such", CONVERT),
            false => other(&format!(".{}", extension.display()), CONVERT),
        }),
    }
}
