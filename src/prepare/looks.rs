//! How a film's pictures are to be looked at: tags of its colors, and its projection.

use serde_json::Value;

use super::{PrepareError, PrepareOptions};
use crate::programs::{FFMPEG, Program};

/// Transfers of films for usual screens. What is not tagged passes for one.
const USUAL: [&str; 11] = [
    "unknown",
    "reserved",
    "bt709",
    "gamma22",
    "gamma28",
    "smpte170m",
    "smpte240m",
    "bt1361e",
    "iec61966-2-1",
    "iec61966-2-4",
    "bt2020-10",
];

/// The lens of whole spheres, and the one that is taken unless another is asked for.
const SPHERE: &str = "EQUIRECTANGULAR";
const USUAL_LENS: &str = "SIMPLE_RADIAL";

/// What tags say.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Looks {
    /// Its transfer, where that is none for usual screens.
    transfer: Option<String>,
    /// Whether its primaries are those of wide gamut.
    wide: bool,
    /// Whether it does not tell its primaries or its matrix.
    untold: bool,
    /// Whether FFmpeg can map its tones.
    mapped: bool,
    /// Its projection, where that is no plane.
    projection: Option<String>,
}

impl Looks {
    /// Of a stream, as `ffprobe` describes it.
    pub fn of(stream: &Value) -> Self {
        let transfer = stream["color_transfer"].as_str();
        let beside = || stream["side_data_list"].as_array().into_iter().flatten();
        let dolby = beside().any(|data| data["dv_profile"] == 5);
        let transfer = transfer.filter(|name| !USUAL.contains(name) && *name != "bt2020-12");
        let projection = beside().find_map(|data| data["projection"].as_str());
        Self {
            transfer: match dolby {
                true => Some("Dolby Vision 5".to_owned()),
                false => transfer.map(str::to_owned),
            },
            wide: stream["color_primaries"] == "bt2020",
            untold: ["color_primaries", "color_space"]
                .iter()
                .any(|tag| matches!(stream[*tag].as_str(), None | Some("unknown"))),
            mapped: false,
            projection: projection
                .filter(|name| *name != "rectilinear")
                .map(str::to_owned),
        }
    }

    /// Whether it is HDR of a transfer whose tones can be mapped.
    fn is_hdr(&self) -> bool {
        matches!(self.transfer.as_deref(), Some("smpte2084" | "arib-std-b67"))
    }

    /// Looks whether FFmpeg can map its tones; what is to be told: a note, or else a warning.
    ///
    /// # Errors
    /// [`ProgramError`].
    pub fn settle(&mut self) -> Result<Option<Result<String, String>>, PrepareError> {
        if self.transfer.is_none() && !self.wide {
            return Ok(None);
        }
        let filters = Program::new(FFMPEG)
            .args(["-hide_banner", "-filters"])
            .ask()?;
        let has = |filter: &str| filters.split_whitespace().any(|word| word == filter);
        let known = self.is_hdr() || self.transfer.is_none();
        self.mapped = known && has("zscale") && has("tonemap");
        let Some(transfer) = &self.transfer else {
            return Ok(None);
        };
        Ok(Some(match (self.is_hdr(), self.mapped) {
            (true, true) => Ok(format!(
                "the film is HDR ({transfer}): mapping its tones to SDR"
            )),
            (true, false) => Err(format!(
                "the film is HDR ({transfer}), and this ffmpeg has no zscale to map its tones: grays and colors will be wrong; install a full FFmpeg, or make an SDR film of it first"
            )),
            _ => Err(format!(
                "the film's transfer is {transfer}, which is taken for that of usual screens: grays and colors may be wrong; make a film of bt709 of it first"
            )),
        }))
    }

    /// FFmpeg's filters that make it SDR of BT.709.
    pub fn filters(&self) -> Vec<&'static str> {
        let mut filters = Vec::new();
        if !self.mapped {
            return filters;
        }
        if self.untold {
            filters.push("setparams=color_primaries=bt2020:colorspace=bt2020nc");
        }
        if self.is_hdr() {
            // White of SDR has 203 cd/m² there (ITU-R BT.2408).
            filters.push("zscale=t=linear:npl=203,format=gbrpf32le,zscale=p=bt709");
            filters.push("tonemap=mobius:param=0.7:desat=0");
        }
        filters.push("zscale=p=bt709:t=bt709:m=bt709:r=full,format=yuv444p16le");
        filters
    }

    /// COLMAP's camera model for it, and what is to be noted.
    ///
    /// # Errors
    /// A reason where no lens fits its projection and none was asked for.
    pub fn lens(&self, options: &PrepareOptions) -> Result<(String, Option<String>), String> {
        match self.projection.as_deref() {
            Some("equirectangular") if options.lens == USUAL_LENS => Ok((
                SPHERE.to_owned(),
                Some(format!("the film is spherical: using --lens {SPHERE}")),
            )),
            Some(other) if options.lens == USUAL_LENS && other != "equirectangular" => {
                Err(format!(
                    "is spherical ({other}), which no lens is chosen for; make it equirectangular first (ffmpeg's filter v360), or name its --lens"
                ))
            }
            _ => Ok((options.lens.clone(), None)),
        }
    }
}
