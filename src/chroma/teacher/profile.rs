//! Contract of a colorization network, as data.

use super::TeacherError;
use super::images::Filter;
use crate::{color::gray_to_lightness, input};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Largest input side that may be asked for; beyond it the shape is nonsense
/// and must not be allocated.
pub(super) const MAX_SIDE: u32 = 8192;

/// CIELAB a and b that an `output_range` or `hint_range` speaks of: that of
/// SIGGRAPH17's tanh, which no sRGB color exceeds.
const AB_LIMIT: f32 = 110.0;

/// The contract of one kind of network, and the fields of a manifest.
///
/// docs/guides/teachers.md explains every field to those who write one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Profile {
    /// Name for reports.
    pub name: String,
    /// Roles of the model's inputs, in their order.
    pub inputs: Vec<Role>,
    /// Meaning of the image's channels.
    pub image: ImageKind,
    /// Values of black and white, before `mean` and `std`.
    pub input_range: [f32; 2],
    /// Subtracted from each channel.
    pub mean: Vec<f32>,
    /// Divisor of each channel, after `mean`.
    pub std: Vec<f32>,
    /// Side of the input in pixels where the model leaves it open.
    pub size: u32,
    /// Divisor of open sides, in pixels.
    pub size_multiple: u32,
    /// Mapping from the photo's shape to the input's.
    pub resize: Resize,
    /// Resampling filter from the photo to the input.
    pub filter: Filter,
    /// In which order a picture's numbers stand.
    #[serde(default, skip_serializing_if = "Layout::is_planes")]
    pub layout: Layout,
    /// Name of the output that is the answer, where a model has several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub answer: Option<String>,
    /// Meaning of the answer's channels.
    pub output: OutputKind,
    /// Values of black and white, or of -110 and 110 in a, b.
    pub output_range: [f32; 2],
    /// Values of -110 and 110 in the hints' a, b.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hint_range: Option<[f32; 2]>,
    /// Standard deviation of the random code.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise_std: Option<f32>,
    /// The class that a model is asked with, where it takes one; none for 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub class: Option<u16>,
}

/// Role of a model's input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Role {
    /// The photo, `[1, channels, H, W]`.
    Image,
    /// Painted a, b, `[1, 2, H, W]`, 0 where nothing is painted.
    Hints,
    /// 1 where something is painted, else 0, `[1, 1, H, W]`.
    Mask,
    /// The number of a class: integers, all the same.
    Class,
    /// A random code: the same normally distributed numbers for each photo,
    /// of mean 0 and deviation `noise_std`.
    Noise,
    /// Something not to be used: all 0.
    Zeros,
}

/// Meaning of the channels of a network's image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum ImageKind {
    /// Three channels, each the encoded gray.
    GrayRgb,
    /// One channel, the encoded gray.
    Gray,
    /// One channel, CIELAB L*, which is not 100 times the encoded gray.
    Lightness,
}

/// Mapping from a photo's shape to the input's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Resize {
    /// To a square, whatever the aspect.
    Stretch,
    /// The shorter side is the size, the longer follows the aspect.
    ShortSide,
}

/// In which order the numbers of pictures stand, the network's and its answer's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Layout {
    /// Channel by channel, `[1, channels, H, W]`.
    #[default]
    Nchw,
    /// Pixel by pixel, `[1, H, W, channels]`.
    Nhwc,
}

/// Meaning of a network's answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum OutputKind {
    /// CIELAB a and b.
    Ab,
    /// Encoded sRGB, of which a and b are taken.
    Rgb,
}

impl Layout {
    fn is_planes(&self) -> bool {
        *self == Self::Nchw
    }

    /// A tensor's sides, `[batch, channels, height, width]`.
    pub fn sides(self, shape: [i64; 4]) -> [i64; 4] {
        let [batch, a, b, c] = shape;
        match self {
            Self::Nchw => shape,
            Self::Nhwc => [batch, c, a, b],
        }
    }

    /// The shape of a tensor with these sides.
    pub fn shape(self, [batch, channels, height, width]: [i64; 4]) -> [i64; 4] {
        match self {
            Self::Nchw => [batch, channels, height, width],
            Self::Nhwc => [batch, height, width, channels],
        }
    }

    /// Index of a value in one image of so many channels and pixels.
    pub fn index(self, channel: usize, pixel: usize, [channels, pixels]: [usize; 2]) -> usize {
        match self {
            Self::Nchw => channel * pixels + pixel,
            Self::Nhwc => pixel * channels + channel,
        }
    }
}

impl ImageKind {
    pub fn channels(self) -> usize {
        match self {
            Self::GrayRgb => 3,
            Self::Gray | Self::Lightness => 1,
        }
    }
}

impl OutputKind {
    pub fn channels(self) -> usize {
        match self {
            Self::Ab => 2,
            Self::Rgb => 3,
        }
    }
}

impl Profile {
    /// Reads a manifest.
    ///
    /// # Errors
    /// [`TeacherError::BadManifest`] for a field that is missing, unknown or
    /// makes no sense, [`TeacherError::Io`].
    pub fn read(path: &Path) -> Result<Self, TeacherError> {
        let text = input::read_to_string(path).map_err(TeacherError::io(path))?;
        Self::parse(&text).map_err(|reason| TeacherError::BadManifest {
            path: path.to_path_buf(),
            reason,
        })
    }

    /// Reads the text of a manifest, or says what is wrong with it.
    pub fn parse(text: &str) -> Result<Self, String> {
        let profile: Self = toml::from_str(text).map_err(|error| {
            let before = error
                .span()
                .map_or("", |span| &text[..span.start.min(text.len())]);
            // An error about the file as a whole has no line of its own.
            let line = match before.lines().count() {
                0 => String::new(),
                _ => format!("line {}: ", before.matches('\n').count() + 1),
            };
            format!("{line}{}", error.message().replace('\n', " "))
        })?;
        profile.check()?;
        Ok(profile)
    }

    /// Checks that the fields make sense; the error names the field and the reason.
    pub fn check(&self) -> Result<(), String> {
        let count = |role| self.inputs.iter().filter(|&&input| input == role).count();
        let ranges = [
            Some(self.input_range),
            Some(self.output_range),
            self.hint_range,
        ];
        let is_range = |[low, high]: [f32; 2]| low.is_finite() && high.is_finite() && low != high;
        let channels = self.image.channels();
        let deviations = self.std.iter().all(|std| std.is_finite() && *std != 0.0);
        let means = self.mean.iter().all(|mean| mean.is_finite());
        let wrong = if count(Role::Image) != 1 || count(Role::Hints) > 1 || count(Role::Mask) > 1 {
            "inputs: must name \"image\" once, \"hints\" and \"mask\" at most once"
        } else if !ranges.into_iter().flatten().all(is_range) {
            "input_range, output_range and hint_range: must be two different numbers"
        } else if self.mean.len() != channels || self.std.len() != channels || !means || !deviations
        {
            "mean and std: must be one number for each channel of image, std not 0"
        } else if !(1..=MAX_SIDE).contains(&self.size) {
            "size: must be 1 to 8192"
        } else if self.size_multiple == 0 || !self.size.is_multiple_of(self.size_multiple) {
            "size: must be a multiple of size_multiple, which must be at least 1"
        } else if self.hint_range.is_some() != (count(Role::Hints) == 1) {
            "hint_range: belongs with \"hints\" among the inputs, and only there"
        } else if self.noise_std.is_some() != (count(Role::Noise) > 0)
            || self
                .noise_std
                .is_some_and(|std| !(std.is_finite() && std >= 0.0))
        {
            "noise_std: must be a number from 0 on, belongs with \"noise\" among the inputs, and only there"
        } else if self.class.is_some() && !self.takes_class() {
            "class: belongs with \"class\" among the inputs, and only there"
        } else {
            return Ok(());
        };
        Err(wrong.to_owned())
    }

    pub fn takes_class(&self) -> bool {
        self.inputs.contains(&Role::Class)
    }

    /// Values of the input's channels for a gray from 0 to 1.
    pub fn image_value(&self, gray: f32, channel: usize) -> f32 {
        let value = match self.image {
            ImageKind::GrayRgb | ImageKind::Gray => gray,
            ImageKind::Lightness => gray_to_lightness(f64::from(gray)) as f32 / 100.0,
        };
        let [black, white] = self.input_range;
        (black + value * (white - black) - self.mean[channel]) / self.std[channel]
    }

    /// CIELAB a or b of a value of the output.
    pub fn ab(&self, value: f32) -> f32 {
        let [low, high] = self.output_range;
        (value - (low + high) / 2.0) * (2.0 * AB_LIMIT / (high - low))
    }

    /// Encoded sRGB from 0 to 1 of a value of the output.
    pub fn rgb(&self, value: f32) -> f32 {
        let [black, white] = self.output_range;
        ((value - black) / (white - black)).clamp(0.0, 1.0)
    }

    /// Value of a painted a or b among the hints.
    pub fn hint(&self, value: f32) -> f32 {
        let [low, high] = self.hint_range.unwrap_or([-AB_LIMIT, AB_LIMIT]);
        (low + high) / 2.0 + value * (high - low) / (2.0 * AB_LIMIT)
    }

    /// Width and height at which the network sees a photo; `fixed` are the
    /// model's own and `size` stands for [`Self::size`].
    pub fn input_size(&self, photo: [u32; 2], fixed: [Option<u32>; 2], size: u32) -> [u32; 2] {
        let [short, multiple] = [photo[0].min(photo[1]).max(1), self.size_multiple];
        let side = |axis: usize| match self.resize {
            Resize::Stretch => size,
            Resize::ShortSide => {
                // Rounded up, as BigColor's own program does.
                let whole = u64::from(photo[axis].max(1)) * u64::from(size);
                let steps = whole.div_ceil(u64::from(short) * u64::from(multiple));
                u32::try_from(steps)
                    .map_or(MAX_SIDE, |steps| steps.min(MAX_SIDE / multiple) * multiple)
            }
        };
        std::array::from_fn(|axis| fixed[axis].unwrap_or_else(|| side(axis)))
    }

    /// The profile as a manifest.
    pub fn to_toml(&self) -> String {
        // Plain fields: serializing them cannot fail.
        toml::to_string(self).unwrap_or_default()
    }

    /// The profile in full, for a cache's keys.
    pub fn identity(&self) -> String {
        // Plain fields: serializing them cannot fail.
        serde_json::to_string(self).unwrap_or_default()
    }
}

/// A profile that the program brings along.
pub(super) struct BuiltIn {
    /// Names for `--teacher-profile`; several where networks share a contract.
    pub names: &'static [&'static str],
    /// Its manifest.
    text: &'static str,
    /// Usual names of the model's inputs and outputs; none where they are names
    /// that every exporter gives, and tell nothing.
    pub tensors: &'static [&'static str],
    /// Side of the input over that of the output.
    pub stride: u32,
}

/// All of them.
pub(super) static BUILT_IN: &[BuiltIn] = &[
    BuiltIn {
        names: &["ddcolor"],
        text: include_str!("profiles/ddcolor.toml"),
        tensors: &["input", "output"],
        stride: 1,
    },
    BuiltIn {
        names: &["siggraph17", "eccv16"],
        text: include_str!("profiles/siggraph17.toml"),
        tensors: &["input", "output"],
        stride: 1,
    },
    BuiltIn {
        names: &["siggraph17-full"],
        text: include_str!("profiles/siggraph17-full.toml"),
        tensors: &["input_A", "input_B", "mask_B", "output"],
        stride: 1,
    },
    BuiltIn {
        names: &["caffe-v2"],
        text: include_str!("profiles/caffe-v2.toml"),
        tensors: &["data_l", "class8_ab"],
        stride: 4,
    },
    BuiltIn {
        names: &["bigcolor"],
        text: include_str!("profiles/bigcolor.toml"),
        tensors: &[],
        stride: 1,
    },
    BuiltIn {
        names: &["deoldify"],
        text: include_str!("profiles/deoldify.toml"),
        tensors: &[],
        stride: 1,
    },
    BuiltIn {
        names: &["deoldify-browser"],
        text: include_str!("profiles/deoldify-browser.toml"),
        tensors: &[],
        stride: 1,
    },
];

impl BuiltIn {
    /// Its contract; a test reads them all.
    pub fn profile(&self) -> Result<Profile, TeacherError> {
        Profile::parse(self.text).map_err(|reason| TeacherError::BadManifest {
            path: self.names[0].into(),
            reason,
        })
    }
}

/// The profile of this name, or that of the manifest at this path.
pub(super) fn named(name: &str) -> Result<Profile, TeacherError> {
    let path = Path::new(name);
    if path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("toml"))
    {
        return Profile::read(path);
    }
    let is_it = |built_in: &&BuiltIn| built_in.names.iter().any(|n| n.eq_ignore_ascii_case(name));
    match BUILT_IN.iter().find(is_it) {
        Some(found) => found.profile(),
        None => Err(TeacherError::UnknownProfile {
            name: name.to_owned(),
            known: BUILT_IN
                .iter()
                .flat_map(|b| b.names)
                .copied()
                .collect::<Vec<_>>()
                .join(", "),
        }),
    }
}

#[cfg(test)]
#[path = "profile_tests.rs"]
mod tests;
