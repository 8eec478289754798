//! Pictures of a film as its file has them: depth, pixels, time code.

use serde_json::Value;

use crate::{
    archive::{NumberedName, dpx},
    capture::Signal,
    programs::Pictures,
};

/// The signal of a stream of pictures, as `ffprobe` describes it and all of its file.
pub(super) fn signal_of(stream: &Value, all: &Value) -> Signal {
    let tag = |name: &str| {
        let tag = stream[name].as_str().filter(|tag| *tag != "unknown");
        tag.map(str::to_owned)
    };
    let format = stream["pix_fmt"].as_str().unwrap_or_default();
    let aspect = tag("sample_aspect_ratio")
        .unwrap_or_default()
        .replace(':', "/");
    let streams = all["streams"].as_array().into_iter().flatten();
    let timecode = |of: &Value| {
        let tags = of["tags"].as_object().into_iter().flatten();
        let mut codes = tags.filter(|(key, _)| key.eq_ignore_ascii_case("timecode"));
        codes.find_map(|(_, code)| Some(code.as_str()?.to_owned()))
    };
    let mut places = [stream, &all["format"]].into_iter().chain(streams);
    Signal {
        bits: bits(format, stream["bits_per_raw_sample"].as_str()),
        pixel_format: format.to_owned(),
        transfer: tag("color_transfer"),
        dpx_transfer: None,
        field_order: tag("field_order"),
        pixel_aspect: ratio(&aspect).unwrap_or([1, 1]),
        timecode: places.find_map(timecode),
        names: None,
        first: 0,
    }
}

impl Signal {
    /// Takes what numbered pictures tell.
    pub(super) fn know(&mut self, pictures: &Pictures) {
        self.names = Some(pictures.names.clone());
        self.first = pictures.first;
        let name = NumberedName::parse(&pictures.names);
        let path = name.map(|name| pictures.folder.join(name.name(pictures.first)));
        if let Some(header) = path.and_then(|path| dpx::header(&path)) {
            self.timecode = header.timecode;
            self.dpx_transfer = header.transfer;
        }
    }

    /// FFmpeg's filters that leave the lightness of more than 8 bits in 16 bits, exact to a
    /// fiftieth of a 10-bit value; its own conversion misses up to 3 (version 5.1). `None` where
    /// that is exact.
    pub(super) fn lightness(&self, full_range: bool) -> Option<String> {
        let format = &*self.pixel_format;
        let is = |kinds: &[&str]| kinds.iter().any(|kind| format.contains(kind));
        if self.bits <= 8 || is(&["gray", "xyz", "ya16"]) {
            return None;
        }
        if is(&["rgb", "gbr", "bgr"]) {
            let float = if format.contains("f32") {
                "format=gbrp16le,"
            } else {
                ""
            };
            return Some(format!("{float}format=rgb48le"));
        }
        let [black, white] = match full_range {
            true => [0, ((1 << self.bits) - 1) << (16 - self.bits)],
            false => [16 << 8, 235 << 8],
        }
        .map(|value: u32| f64::from(value) / f64::from(u16::MAX));
        let levels = ["r", "g", "b"].map(|c| format!("{c}imin={black:.7}:{c}imax={white:.7}"));
        Some(format!(
            "format=yuv444p16le,extractplanes=y,mergeplanes=0x000000:gbrp16le,colorlevels={},extractplanes=g",
            levels.join(":")
        ))
    }
}

/// A positive ratio, such as `24000/1001`.
pub(super) fn ratio(text: &str) -> Option<[u32; 2]> {
    let (numerator, denominator) = text.split_once('/')?;
    let ratio = [numerator.parse().ok()?, denominator.parse().ok()?];
    (!ratio.contains(&0)).then_some(ratio)
}

/// Bits of a channel, 8 to 16, by the pixel format and what the codec says of its samples.
fn bits(format: &str, raw: Option<&str>) -> u32 {
    let within = |text: &str| text.parse().ok().filter(|bits| (9..=16).contains(bits));
    if !is_deep(format) {
        return 8;
    }
    let name = format.trim_end_matches(['l', 'b', 'e']);
    let digits = name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    raw.and_then(within)
        .or(within(&name[digits..]))
        .unwrap_or(16)
}

/// Returns true if a pixel format has more than 8 bits a channel: these name their byte order, as
/// do some that pack less than 8 into 16.
fn is_deep(format: &str) -> bool {
    let packed = ["rgb565", "bgr565", "rgb555", "bgr555", "rgb444", "bgr444"];
    (format.ends_with("le") || format.ends_with("be"))
        && !packed.iter().any(|packed| format.starts_with(packed))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths() {
        for deep in ["yuv420p10le", "p010le", "gray12be", "gbrp10le", "rgb48le"] {
            assert!(is_deep(deep), "{deep}");
        }
        for eight in [
            "yuv420p", "nv12", "yuv410p", "gray", "rgb24", "rgb565le", "pal8", "",
        ] {
            assert!(!is_deep(eight), "{eight}");
        }
    }

    #[test]
    fn bits_of_formats() {
        for (format, raw, expected) in [
            ("yuv420p", Some("8"), 8),
            ("gbrp10le", None, 10),
            ("p010le", None, 10),
            ("yuv422p12le", Some("12"), 12),
            ("rgb48le", Some("12"), 12),
            ("gray16be", None, 16),
            ("gbrpf32le", None, 16),
        ] {
            assert_eq!(bits(format, raw), expected, "{format}");
        }
    }
}
