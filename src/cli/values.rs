//! Parsers of option values.

use std::{
    path::{Path, PathBuf},
    str::FromStr,
};

use clap::{
    builder::{PathBufValueParser, PossibleValue, PossibleValuesParser, TypedValueParser},
    value_parser,
};
use serde::Serialize;

use crate::{run::Preset, store::is_film};

/// The presets with their help.
pub(super) const PRESETS: &[(Preset, &str)] = &[
    (
        Preset::Draft,
        "A look at photos and poses: 700 iterations, 12,000 Gaussians, 400 px, no SH",
    ),
    (
        Preset::Balanced,
        "Everyday use on a GPU: 3,500 iterations, 2,000,000 Gaussians, 1,600 px; stops early below 0.3 dB",
    ),
    (
        Preset::Paper,
        "The last tenths of a dB: 15,000 iterations, 3,000,000 Gaussians, full size; stops early below 0.1 dB",
    ),
];

/// One of these, by the name that it has in reports; each with its help.
pub(super) fn one_of<T>(
    choices: &'static [(T, &'static str)],
) -> impl TypedValueParser<Value = T> + use<T>
where
    T: Copy + Serialize + Send + Sync + 'static,
{
    // Choices are enums without contents: serializing them cannot fail.
    let name_of = move |value: &T| serde_plain::to_string(value).unwrap_or_default();
    let values = choices
        .iter()
        .map(|(value, help)| PossibleValue::new(name_of(value)).help(*help));
    PossibleValuesParser::new(values).try_map(move |text| {
        let chosen = choices.iter().find(|(value, _)| name_of(value) == text);
        chosen.map(|(value, _)| *value).ok_or("no such choice")
    })
}

/// `on` or `off`.
pub(super) fn switch() -> impl TypedValueParser<Value = bool> {
    PossibleValuesParser::new(["on", "off"]).map(|word| word == "on")
}

/// Extensions of films, pictures, archives, splats and other files, which are no part of a
/// folder's name.
const FILES: &str = " 3gp 7z asf avi avif bmp bz2 csv divx dng dpx dv exr flac flv gif glb gltf gz \
    heic heif html j2k jp2 jpeg jpg json jxl ksplat m2ts m2v m4v mkv mov mp3 mp4 mpeg mpg mts mxf \
    npy npz obj ogg ogv onnx pdf pgm ply png pnm ppm psd rar sog splat spz svg tar tga tgz tif \
    tiff toml ts txt usda usdz vob wav webm webp wmv xz y4m zip zst ";

/// A folder to write, which may be there; a new one is not named like a file.
pub(super) fn folder() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| match is_named_like_a_file(&path) {
        true => Err("named like a file: name a folder"),
        false => Ok(path),
    })
}

/// A folder to write, as [`folder`] has it, or a film.
pub(super) fn folder_or_film() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(
        |path| match is_named_like_a_file(&path) && !is_film(&path) {
            true => Err("no film: name it .mp4, .mov, .m4v, .mkv or .mxf, or name a folder"),
            false => Ok(path),
        },
    )
}

fn is_named_like_a_file(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let extension = extension.to_ascii_lowercase();
    FILES
        .split(' ')
        .any(|known| !known.is_empty() && known == extension)
        && !path.exists()
}

/// A finite number above 0.
pub(super) fn positive<T>(text: &str) -> Result<T, String>
where
    T: FromStr + Copy + Into<f64>,
{
    let number = text.parse().ok();
    let number = number.filter(|&number: &T| number.into() > 0.0 && number.into().is_finite());
    number.ok_or_else(|| "must be a number above 0".to_owned())
}

/// A number from 0 to 1.
pub(super) fn share<T>(text: &str) -> Result<T, String>
where
    T: FromStr + Copy + Into<f64>,
{
    let number = text.parse().ok();
    let number = number.filter(|&number: &T| (0.0..=1.0).contains(&number.into()));
    number.ok_or_else(|| "must be a number from 0 to 1".to_owned())
}

/// Mebibytes, at least one, in bytes.
pub(super) fn mebibytes() -> impl TypedValueParser<Value = u64> {
    value_parser!(u32)
        .range(1..)
        .map(|mib| u64::from(mib) << 20)
}

/// `NAME=PATH`; the name stands in tables and files.
pub(super) fn named(text: &str) -> Result<(String, PathBuf), String> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    match text.split_once('=').unwrap_or_default() {
        (name, path) if !name.is_empty() && !path.is_empty() && name.chars().all(is_plain) => {
            Ok((name.to_owned(), path.into()))
        }
        _ => Err("give a name of letters, digits, - _ . and a path: film=colored/".to_owned()),
    }
}

/// Frames a second: numerator and denominator, both positive.
#[derive(Clone, Copy)]
pub(super) struct Rate(pub [u32; 2]);

/// Frames a second, whole or as a fraction.
pub(super) fn rate(text: &str) -> Result<Rate, String> {
    let (frames, seconds) = text.split_once('/').unwrap_or((text, "1"));
    let number = |text: &str| text.trim().parse().ok().filter(|&n: &u32| n > 0);
    match (number(frames), number(seconds)) {
        (Some(frames), Some(seconds)) => Ok(Rate([frames, seconds])),
        _ => Err("no rate: 24, 25 or 30000/1001".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_not_named_like_files() {
        for name in [
            "a.avi",
            "a/b.WEBM",
            "pictures.zip",
            "a.tif",
            "house.ply",
            "a.mp4",
        ] {
            assert!(is_named_like_a_file(Path::new(name)), "{name}");
        }
        for name in [
            "house.v2",
            "runs/house",
            "2024.05.01",
            ".",
            "..",
            "zip",
            ".png",
            "a.zip/b",
        ] {
            assert!(!is_named_like_a_file(Path::new(name)), "{name}");
        }
        // A folder that is there is one.
        let place = tempfile::tempdir().expect("a folder");
        let folder = place.path().join("colored.avi");
        assert!(is_named_like_a_file(&folder));
        std::fs::create_dir(&folder).expect("a folder");
        assert!(!is_named_like_a_file(&folder));
    }

    #[test]
    fn numbers_have_bounds() {
        assert_eq!(positive("0.5"), Ok(0.5_f32));
        for text in ["0", "-1", "inf", "nan", "", "1 s"] {
            assert!(positive::<f64>(text).is_err(), "{text}");
        }
        assert_eq!([share("0"), share("1.0")], [Ok(0.0_f64), Ok(1.0)]);
        for text in ["-0.1", "1.1", "nan", "half"] {
            assert!(share::<f64>(text).is_err(), "{text}");
        }
    }

    #[test]
    fn choices_are_read_by_their_names_in_reports() {
        let command = clap::Command::new("program")
            .arg(clap::Arg::new("preset").value_parser(one_of(PRESETS)));
        for preset in Preset::ALL {
            let read = command
                .clone()
                .get_matches_from(["program", &preset.to_string()]);
            assert_eq!(read.get_one("preset"), Some(&preset));
        }
        let refused = command.try_get_matches_from(["program", "drafty"]);
        let message = refused.map(|_| ()).unwrap_err().to_string();
        assert!(message.contains("draft, balanced, paper"), "{message}");
    }
}
