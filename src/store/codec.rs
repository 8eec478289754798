//! Codecs of photos in color: what a film or a picture is written with.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::StoreError;
use crate::{archive::NumberedName, capture::Signal};

/// Extensions of films.
const FILMS: [&str; 5] = ["mp4", "mov", "mkv", "m4v", "mxf"];

/// The extension in lower case; empty where there is none.
pub(super) fn extension(path: &Path) -> String {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    extension.to_ascii_lowercase()
}

/// Returns true if a path names a film and not a folder.
pub fn is_film(path: &Path) -> bool {
    FILMS.contains(&&*extension(path)) && !path.is_dir()
}

/// Codec of a film, or of pictures in a folder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Codec {
    /// 8 bits, for looking at.
    #[default]
    H264,
    /// RGB without loss, of the source's depth.
    Ffv1,
    /// ProRes 422 HQ.
    Prores,
    /// ProRes 4444.
    Prores4444,
    /// DNxHR HQX.
    Dnxhr,
    /// 8 bits, or 16 if the photo has more.
    Png,
    /// 16 bits.
    Tiff,
    /// OpenEXR, linear light in 16-bit floats.
    Exr,
    /// 10 bits.
    Dpx,
}

/// Values of a pixel as an encoder gets them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pixels {
    /// 8-bit RGB.
    Bytes,
    /// RGB in 16 bits, rounded to so many.
    Rgb(u32),
    /// Y′, Cb and Cr of BT.709 in 10 bits, limited range.
    Yuv,
}

impl Codec {
    /// Extensions of films that take it; none of pictures.
    fn films(self) -> &'static [&'static str] {
        match self {
            Self::H264 => &["mp4", "m4v", "mov", "mkv"],
            Self::Ffv1 => &["mkv"],
            Self::Prores | Self::Prores4444 => &["mov", "mkv"],
            Self::Dnxhr => &["mxf", "mov"],
            Self::Png | Self::Tiff | Self::Exr | Self::Dpx => &[],
        }
    }

    /// Extension of a film that is named by nobody; `None` of pictures.
    pub fn film_extension(self) -> Option<&'static str> {
        self.films().first().copied()
    }

    /// Extension of a picture.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Tiff => "tif",
            Self::Exr => "exr",
            Self::Dpx => "dpx",
            _ => "png",
        }
    }

    /// The codec that is asked for, if the output takes it; by default the source's kind: of more
    /// than 8 bits FFV1 in .mkv and ProRes in .mov, and numbered pictures as they were.
    ///
    /// # Errors
    /// [`StoreError::File`] where the output does not take it.
    pub fn of(
        output: &Path,
        asked: Option<Self>,
        signal: Option<&Signal>,
    ) -> Result<Self, StoreError> {
        let extension = is_film(output).then(|| extension(output));
        let deep = signal.is_some_and(|signal| signal.bits > 8);
        let chosen = asked.unwrap_or(match extension.as_deref() {
            Some("mxf") => Self::Dnxhr,
            Some("mkv") if deep => Self::Ffv1,
            Some("mov") if deep => Self::Prores,
            Some(_) => Self::H264,
            None => Self::of_pictures(signal),
        });
        let takes = chosen.films();
        let why = match &extension {
            Some(extension) if takes.contains(&&**extension) => return Ok(chosen),
            None if takes.is_empty() => return Ok(chosen),
            _ if takes.is_empty() => "goes into a folder".to_owned(),
            _ => format!("goes into a film .{}", takes.join(" or .")),
        };
        let name = serde_plain::to_string(&chosen).unwrap_or_default();
        Err(StoreError::file(output, format!("{name} {why}; name one")))
    }

    fn of_pictures(signal: Option<&Signal>) -> Self {
        let names = signal.and_then(|signal| signal.names.as_deref());
        let extension = names
            .and_then(NumberedName::parse)
            .map(|name| name.extension());
        match extension.as_deref() {
            Some("dpx") => Self::Dpx,
            Some("exr") => Self::Exr,
            Some("tif" | "tiff") => Self::Tiff,
            _ => Self::Png,
        }
    }

    /// What its encoder gets of a source with so many bits.
    pub(crate) fn pixels(self, bits: u32) -> Pixels {
        match (self, bits) {
            (Self::Prores | Self::Prores4444 | Self::Dnxhr, _) => Pixels::Yuv,
            (_, ..=8) => Pixels::Bytes,
            (Self::Ffv1, 9..=10) => Pixels::Rgb(10),
            (Self::Ffv1, 11..=12) => Pixels::Rgb(12),
            _ => Pixels::Rgb(16),
        }
    }
}

impl Pixels {
    /// FFmpeg's name of the pixel format.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bytes => "rgb24",
            Self::Rgb(_) => "rgb48",
            Self::Yuv => "yuv444p10",
        }
    }

    /// The bytes of `rgb` in 65,535ths, in this machine's order.
    pub fn bytes(self, rgb: &[[u16; 3]]) -> Vec<u8> {
        match self {
            Self::Bytes => {
                let byte = |&value: &u16| ((u32::from(value) + 128) / 257) as u8;
                rgb.as_flattened().iter().map(byte).collect()
            }
            Self::Rgb(bits) => {
                // FFmpeg takes the highest bits.
                let white = (1_u32 << bits) - 1;
                let rounded = |&value: &u16| {
                    let value = (u32::from(value) * white + 32_767) / 65_535;
                    (value << (16 - bits) | value >> (2 * bits - 16)) as u16
                };
                let values: Vec<u16> = rgb.as_flattened().iter().map(rounded).collect();
                bytemuck::cast_slice(&values).to_vec()
            }
            Self::Yuv => {
                let mut planes = vec![0_u16; 3 * rgb.len()];
                for (i, pixel) in rgb.iter().enumerate() {
                    let [r, g, b] = pixel.map(|value| f64::from(value) / 65_535.0);
                    let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
                    let chroma = [(b - y) / 1.8556, (r - y) / 1.5748];
                    let values = [
                        64.0 + 876.0 * y,
                        512.0 + 896.0 * chroma[0],
                        512.0 + 896.0 * chroma[1],
                    ];
                    for (plane, value) in values.into_iter().enumerate() {
                        planes[plane * rgb.len() + i] = value.round() as u16;
                    }
                }
                bytemuck::cast_slice(&planes).to_vec()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signal(bits: u32, names: Option<&str>) -> Signal {
        Signal {
            bits,
            pixel_format: String::new(),
            transfer: None,
            dpx_transfer: None,
            field_order: None,
            pixel_aspect: [1, 1],
            timecode: None,
            names: names.map(str::to_owned),
            first: 1,
        }
    }

    #[test]
    fn the_source_decides_where_nobody_asks() {
        for (output, bits, names, expected) in [
            ("a.mp4", 10, None, Codec::H264),
            ("a.mov", 8, None, Codec::H264),
            ("a.MOV", 10, None, Codec::Prores),
            ("a.mkv", 12, None, Codec::Ffv1),
            ("a.mxf", 8, None, Codec::Dnxhr),
            ("a", 10, None, Codec::Png),
            ("a", 10, Some("a%04d.dpx"), Codec::Dpx),
            ("a", 16, Some("%d.TIF"), Codec::Tiff),
            ("a", 16, Some("a%04d.exr"), Codec::Exr),
        ] {
            let found = Codec::of(Path::new(output), None, Some(&signal(bits, names)));
            assert_eq!(found.expect(output), expected, "{output}");
        }
        assert_eq!(
            Codec::of(Path::new("a.mov"), None, None).expect("one"),
            Codec::H264
        );
        for (output, asked, word) in [
            ("a.mp4", Codec::Ffv1, "ffv1 goes into a film .mkv"),
            ("a.mov", Codec::Dpx, "dpx goes into a folder"),
            ("a", Codec::Prores, "prores goes into a film .mov or .mkv"),
        ] {
            let error = Codec::of(Path::new(output), Some(asked), None).expect_err(word);
            assert!(error.to_string().contains(word), "{error}");
        }
    }

    #[test]
    fn values_are_rounded() {
        let rgb = [[0, 32_768, 65_535]];
        assert_eq!(Pixels::Bytes.bytes(&rgb), [0, 128, 255]);
        let words = |pixels: Pixels| bytemuck::pod_collect_to_vec::<u8, u16>(&pixels.bytes(&rgb));
        assert_eq!(words(Pixels::Rgb(16)), rgb[0]);
        assert_eq!(words(Pixels::Rgb(10)), [0, 512 << 6 | 512 >> 4, 65_535]);
        // 64 + 876 (0.7152 / 2 + 0.0722), and so on.
        assert_eq!(words(Pixels::Yuv), [441, 787, 267]);
    }
}
