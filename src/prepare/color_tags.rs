//! Color tags and projection of a film.

use serde_json::Value;

use super::PrepareError;
use crate::{
    programs::{FFMPEG, Program},
    tell::{Event, Observer},
};

/// Transfers of HDR, and those of other films that usual screens do not show.
const HDR: [&str; 2] = ["smpte2084", "arib-std-b67"];
const ODD: [&str; 5] = ["linear", "log", "log100", "log316", "smpte428"];

/// The lens of whole spheres, and the one that is taken unless another is asked for.
const SPHERE: &str = "EQUIRECTANGULAR";
const USUAL: &str = "SIMPLE_RADIAL";

/// Color and projection by a stream's tags; missing tags stand for the usual values.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ColorTags {
    transfer: String,
    /// True if its primaries are wide-gamut (BT.2020).
    wide: bool,
    /// True if it has tags for both its primaries and its matrix.
    told: bool,
    projection: Option<String>,
}

impl ColorTags {
    /// Reads the tags of a stream, as `ffprobe` describes it.
    pub fn of(stream: &Value) -> Self {
        let tag = |name: &str| stream[name].as_str().unwrap_or("unknown");
        let mut beside = stream["side_data_list"].as_array().into_iter().flatten();
        let projection = beside.find_map(|data| data["projection"].as_str());
        Self {
            transfer: tag("color_transfer").to_owned(),
            wide: tag("color_primaries") == "bt2020",
            told: ["color_primaries", "color_space"]
                .iter()
                .all(|name| tag(name) != "unknown"),
            projection: projection.map(str::to_owned),
        }
    }

    /// FFmpeg's filters that make it SDR of BT.709, as far as this FFmpeg can.
    ///
    /// # Errors
    /// [`ProgramError`].
    pub fn filters(&self, observe: &mut Observer<'_>) -> Result<Vec<&'static str>, PrepareError> {
        let transfer = &*self.transfer;
        let hdr = HDR.contains(&transfer);
        if ODD.contains(&transfer) {
            observe(Event::Warning(format!(
                "the film's transfer is {transfer}, which is taken for that of usual screens: grays and colors may be wrong; make a film of BT.709 of it first"
            )));
        }
        let mut filters = Vec::new();
        if ODD.contains(&transfer) || !(hdr || self.wide) {
            return Ok(filters);
        }
        let known = Program::new(FFMPEG)
            .args(["-hide_banner", "-filters"])
            .ask()?;
        let known = |filter: &str| known.split_whitespace().any(|word| word == filter);
        let mapped = known("zscale") && known("tonemap");
        match (hdr, mapped) {
            (true, true) => observe(Event::Note(format!(
                "the film is HDR ({transfer}): mapping its tones to SDR"
            ))),
            (true, false) => observe(Event::Warning(format!(
                "the film is HDR ({transfer}), and this ffmpeg has no zscale to map its tones: grays and colors will be wrong; install a full FFmpeg, or make an SDR film of it first"
            ))),
            _ => {}
        }
        if mapped && !self.told {
            filters.push("setparams=color_primaries=bt2020:colorspace=bt2020nc");
        }
        if mapped && hdr {
            // White of SDR has 203 cd/m² there (ITU-R BT.2408).
            filters.push("zscale=t=linear:npl=203,format=gbrpf32le,zscale=p=bt709");
            filters.push("tonemap=mobius:param=0.7:desat=0");
        }
        if mapped {
            filters.push("zscale=p=bt709:t=bt709:m=bt709:r=full,format=yuv444p16le");
        }
        Ok(filters)
    }

    /// COLMAP's camera model for it, unless one is asked for.
    pub fn lens(&self, asked: &str, observe: &mut Observer<'_>) -> String {
        match self.projection.as_deref() {
            Some("equirectangular") if asked == USUAL => {
                observe(Event::Note(format!(
                    "the film is spherical: using the lens {SPHERE}"
                )));
                return SPHERE.to_owned();
            }
            None | Some("rectilinear" | "equirectangular") => {}
            Some(other) if asked == USUAL => observe(Event::Warning(format!(
                "the film is spherical ({other}): make it equirectangular first (ffmpeg's filter v360), or name its lens"
            ))),
            Some(_) => {}
        }
        asked.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_sphere_has_its_lens() {
        for (projection, asked, lens, told) in [
            ("equirectangular", USUAL, SPHERE, 1),
            ("equirectangular", "OPENCV", "OPENCV", 0),
            ("cubemap", USUAL, USUAL, 1),
            ("rectilinear", USUAL, USUAL, 0),
        ] {
            let color_tags = ColorTags::of(&json!({"side_data_list": [
                {"side_data_type": "Display Matrix", "rotation": 90},
                {"side_data_type": "Spherical Mapping", "projection": projection},
            ]}));
            let mut events = 0;
            assert_eq!(color_tags.lens(asked, &mut |_| events += 1), lens);
            assert_eq!(events, told, "{projection}");
        }
    }
}
