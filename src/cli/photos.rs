//! Options about photos, of every command that reads a capture anew.

use clap::Args;

use super::values::one_of;
use crate::capture::{Channel, Encoding, LoadOptions, MaskSource, MaskUse, Normalize};

const CHANNELS: &[(Channel, &str)] = &[
    (Channel::Luma, "The gray with the same `L*`"),
    (
        Channel::R,
        "Red. Infra-red cameras with a filter leave their signal in one channel",
    ),
    (Channel::G, "Green"),
    (Channel::B, "Blue"),
];

const ENCODINGS: &[(Encoding, &str)] = &[
    (
        Encoding::Auto,
        "Linear light in files of floats, sRGB in all others",
    ),
    (Encoding::Srgb, "Encoded for display"),
    (
        Encoding::Linear,
        "In proportion to the light, as a sensor counts it",
    ),
];

const MASK_USES: &[(MaskUse, &str)] = &[
    (MaskUse::Ignore, "Anything: the photo does not say"),
    (
        MaskUse::Remove,
        "Nothing: what the mask leaves stands before black",
    ),
];

/// How photos are loaded.
#[derive(Args)]
pub(super) struct Photos {
    /// Scale photos down until their longer side has this many pixels.
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(16..))]
    max_side: Option<u32>,
    /// Train on all views; by default every 8th is held out to measure with.
    #[arg(long)]
    no_holdout: bool,
    /// What of a color photo becomes gray: an infra-red camera may have its signal in one channel.
    #[arg(long, value_parser = one_of(CHANNELS), default_value = "luma")]
    channel: Channel,
    /// What the files' values are; auto: linear light in floats, sRGB in all others.
    #[arg(long, value_parser = one_of(ENCODINGS), default_value = "auto")]
    encoding: Encoding,
    /// Which of the files' values become black and white, of all photos alike; auto: of more than
    /// 8 bits, where the range is not used, the 0.5th and 99.5th percentile of all photos.
    #[arg(
        long,
        value_name = "auto|off|LOW,HIGH",
        default_value = "auto",
        allow_hyphen_values = true
    )]
    normalize: Normalize,
    /// Folder of masks, b.jpg.png or b.png for the photo b.jpg, black where nothing counts; or
    /// alpha for the photos' transparency [default: masks/ beside images/, if it is there, and
    /// else alpha].
    #[arg(long, value_name = "DIR|alpha|off")]
    masks: Option<String>,
    /// What is where a mask is black: anything, or nothing.
    #[arg(long, value_parser = one_of(MASK_USES), default_value = "ignore")]
    masked: MaskUse,
    /// Go on with all photos where they, their poses and COLMAP's points contradict each other.
    #[arg(long)]
    force: bool,
}

impl Photos {
    pub(super) fn options(self) -> LoadOptions {
        LoadOptions {
            max_side: self.max_side,
            holdout: !self.no_holdout,
            channel: self.channel,
            encoding: self.encoding,
            normalize: self.normalize,
            masks: self
                .masks
                .map_or_else(MaskSource::default, MaskSource::from),
            masked: self.masked,
            force: self.force,
            ..LoadOptions::default()
        }
    }
}
