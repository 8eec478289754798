//! Options of loading photos.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Options of loading a capture's photos. `report.json` keeps them, so that every later command
/// loads photos alike.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LoadOptions {
    /// Longer side that larger photos are scaled to, in pixels.
    ///
    /// `None` leaves them as they are.
    pub max_side: Option<u32>,
    /// True if every 8th view is held out.
    pub holdout: bool,
    /// Removal of lens distortion; `auto`: if visible.
    pub lens: Choice,
    /// Channel of color photos that becomes gray.
    pub channel: Channel,
    /// Encoding of the files; `auto`: floats linear, others sRGB.
    pub encoding: Encoding,
    /// Values that become black and white, in the files' unit; `null`: the full range.
    pub normalize: Normalize,
    /// Source of masks: `beside` the photos, their `alpha`, `off`, or a folder.
    pub masks: MaskSource,
    /// Use of masked pixels; `remove`: black.
    pub masked: MaskUse,
    /// True if photos that contradict the model are used.
    #[serde(default)]
    pub force: bool,
    /// Photos left out because they contradict the model.
    #[serde(default)]
    pub left_out: Vec<Rejected>,
    /// The photos of a part of the capture, where it is not all of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chosen: Option<Chosen>,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            max_side: None,
            holdout: true,
            lens: Choice::default(),
            channel: Channel::default(),
            encoding: Encoding::default(),
            normalize: Normalize::default(),
            masks: MaskSource::default(),
            masked: MaskUse::default(),
            force: false,
            left_out: Vec::new(),
            chosen: None,
        }
    }
}

/// Switch: on if the photos require it, always or never.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Choice {
    /// On if its effect can be seen.
    #[default]
    Auto,
    /// Wherever it has any effect.
    On,
    /// Distortion is kept.
    Off,
}

/// Something in the model that was left out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Rejected {
    /// The photo's name, or the points file's.
    pub name: String,
    /// Reason for which it was left out.
    pub reason: String,
}

/// Photos of a part of a capture, by their paths below `images/`; no other photo of it is used,
/// and no point that none of these shows.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Chosen {
    /// Those that are trained on.
    pub train: BTreeSet<String>,
    /// Those that are held out.
    pub test: BTreeSet<String>,
}

impl Chosen {
    /// Returns true if a photo is one of them.
    pub fn has(&self, photo: &str) -> bool {
        self.train.contains(photo) || self.test.contains(photo)
    }

    /// Number of photos.
    pub fn len(&self) -> usize {
        self.train.len() + self.test.len()
    }

    /// Returns true if there are no photos.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Channel of a color photo that becomes gray; a gray photo stays as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Channel {
    /// The gray with the same `L*`.
    #[default]
    Luma,
    /// Red. Infra-red cameras with a filter leave their signal in one channel.
    R,
    /// The green channel.
    G,
    /// The blue channel.
    B,
}

impl Channel {
    /// The samples of an R, G, B pixel that say something.
    pub(super) fn samples(self) -> std::ops::Range<usize> {
        match self {
            Self::Luma => 0..3,
            Self::R => 0..1,
            Self::G => 1..2,
            Self::B => 2..3,
        }
    }
}

/// Encoding of a file's values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Encoding {
    /// Linear light in files of floats, sRGB in all others.
    #[default]
    Auto,
    /// Encoded for display.
    Srgb,
    /// In proportion to the light, as a sensor counts it.
    Linear,
}

/// Range of the files' values, in their own unit, that becomes black to white; the same for all
/// photos of a capture, since changes from photo to photo flicker.
///
/// In JSON two numbers, or `null` for `Off`: what `Auto` comes to is known once the
/// photos have been seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(into = "Option<[f64; 2]>", from = "Option<[f64; 2]>")]
pub enum Normalize {
    /// `Off` for 8 bits and for photos that fill their range anyway, else from the
    /// 0.5th to the 99.5th percentile of all photos.
    #[default]
    Auto,
    /// 0 and 255, 65,535 or, of floats, 1.
    Off,
    /// These, the first below the second.
    Range([f64; 2]),
}

impl From<Normalize> for Option<[f64; 2]> {
    fn from(normalize: Normalize) -> Self {
        match normalize {
            Normalize::Range(range) => Some(range),
            Normalize::Auto | Normalize::Off => None,
        }
    }
}

impl From<Option<[f64; 2]>> for Normalize {
    fn from(range: Option<[f64; 2]>) -> Self {
        range.map_or(Self::Off, Self::Range)
    }
}

impl FromStr for Normalize {
    type Err = String;

    /// `auto`, `off` or `LOW,HIGH`.
    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.trim().parse().ok().filter(|v: &f64| v.is_finite());
        match text {
            "auto" => Ok(Self::Auto),
            "off" => Ok(Self::Off),
            _ => match text.split_once(',').map(|(a, b)| (number(a), number(b))) {
                Some((Some(low), Some(high))) if low < high => Ok(Self::Range([low, high])),
                _ => Err("must be auto, off or two numbers, the lower first: LOW,HIGH".into()),
            },
        }
    }
}

/// Source of masks: for `images/a/b.jpg` the file `a/b.jpg.png` or `a/b.png`.
///
/// In JSON `beside`, `alpha`, `off` or the folder.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(into = "String", from = "String")]
pub enum MaskSource {
    /// In `masks/` beside `images/`, if it is there, and else in the photos' transparency, if
    /// they have any.
    #[default]
    ImageMetadata,
    /// In the photos' transparency.
    Alpha,
    /// No masks.
    Off,
    /// In this folder.
    Folder(PathBuf),
}

impl From<MaskSource> for String {
    fn from(source: MaskSource) -> Self {
        match source {
            MaskSource::ImageMetadata => "beside".to_owned(),
            MaskSource::Alpha => "alpha".to_owned(),
            MaskSource::Off => "off".to_owned(),
            MaskSource::Folder(path) => path.display().to_string(),
        }
    }
}

impl From<String> for MaskSource {
    fn from(text: String) -> Self {
        match text.as_str() {
            "beside" => Self::ImageMetadata,
            "alpha" => Self::Alpha,
            "off" => Self::Off,
            _ => Self::Folder(text.into()),
        }
    }
}

/// Meaning of black mask pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum MaskUse {
    /// Anything: the photo does not say.
    #[default]
    Ignore,
    /// Nothing: what the mask leaves stands before black.
    Remove,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read() {
        assert_eq!("auto".parse(), Ok(Normalize::Auto));
        assert_eq!("off".parse(), Ok(Normalize::Off));
        let range = Normalize::Range([-10.0, 25.5]);
        assert_eq!("-10,25.5".parse(), Ok(range));
        assert_eq!("-10, 25.5".parse(), Ok(range));
        for text in ["", "1", "1,1", "2,1", "0,nan", "0,inf", "0,1,2", "on"] {
            let error = text.parse::<Normalize>().unwrap_err();
            assert!(error.contains("LOW,HIGH"), "{text:?}: {error}");
        }
    }

    #[test]
    fn reports_keep_every_option() {
        let options = LoadOptions {
            max_side: Some(640),
            holdout: false,
            lens: Choice::Off,
            channel: Channel::R,
            encoding: Encoding::Linear,
            normalize: Normalize::Range([0.125, 20.0]),
            masks: MaskSource::Folder("/photos/masks".into()),
            masked: MaskUse::Remove,
            force: true,
            left_out: vec![Rejected {
                name: "a.png".into(),
                reason: "turned".into(),
            }],
            chosen: None,
        };
        let text = serde_json::to_string(&options).unwrap();
        assert_eq!(
            text,
            r#"{"max_side":640,"holdout":false,"lens":"off","channel":"r","encoding":"linear","normalize":[0.125,20.0],"masks":"/photos/masks","masked":"remove","force":true,"left_out":[{"name":"a.png","reason":"turned"}]}"#
        );
        assert_eq!(serde_json::from_str::<LoadOptions>(&text).unwrap(), options);
        // Runs of before have neither.
        let (older, _) = text.split_once(r#","force""#).unwrap();
        let read: LoadOptions = serde_json::from_str(&(older.to_owned() + "}")).unwrap();
        assert!(!read.force && read.left_out.is_empty());
    }
}
