//! Options about photos, of every command that reads a capture anew.

use clap::Args;

use super::{
    headings::{EXPERT, MASKS, QUALITY},
    values::one_of,
};
use crate::capture::{Channel, Encoding, LoadOptions, MaskSource, MaskUse, Normalize};

const CHANNELS: &[(Channel, &str)] = &[
    (Channel::Luma, "Lightness: the gray with the same `L*`"),
    (
        Channel::R,
        "Red, where some infra-red cameras have their signal",
    ),
    (Channel::G, "Green"),
    (Channel::B, "Blue"),
];

const ENCODINGS: &[(Encoding, &str)] = &[
    (Encoding::Auto, "Floats are linear light, all others sRGB"),
    (Encoding::Srgb, "Encoded for display"),
    (
        Encoding::Linear,
        "Linear: proportional to the light, as sensors count",
    ),
];

const MASK_USES: &[(MaskUse, &str)] = &[
    (MaskUse::Ignore, "They do not count; anything may be there"),
    (
        MaskUse::Remove,
        "They are trained as empty: the object is cut out before black",
    ),
];

/// What is taken from photos.
#[derive(Args, Clone)]
pub(super) struct PhotoArguments {
    /// Photos' longer side in pixels [default: the preset's].
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(16..), help_heading = QUALITY)]
    max_side: Option<u32>,
    /// Train on all views; by default every 8th is held out for measuring.
    #[arg(long, help_heading = EXPERT)]
    no_holdout: bool,
    /// Channel of color photos that becomes gray.
    #[arg(long, value_parser = one_of(CHANNELS), default_value = "luma", help_heading = MASKS)]
    channel: Channel,
    /// Encoding of the photos' values.
    #[arg(long, value_parser = one_of(ENCODINGS), default_value = "auto", help_heading = MASKS, hide_short_help = true)]
    encoding: Encoding,
    /// Values that become black and white, in the files' units.
    ///
    /// auto: if less than half of the range is used, or floats leave 0 to 1, the 0.5th and 99.5th
    /// percentile of all photos.
    #[arg(
        long,
        help_heading = MASKS,
        hide_short_help = true,
        value_name = "auto|off|LOW,HIGH",
        default_value = "auto",
        allow_hyphen_values = true
    )]
    normalize: Normalize,
    /// Masked pixels: ignored, or trained as empty (black).
    #[arg(long, value_parser = one_of(MASK_USES), default_value = "ignore", help_heading = MASKS, hide_short_help = true)]
    masked: MaskUse,
}

/// Options of loading photos.
#[derive(Args, Clone)]
pub(super) struct Photos {
    #[command(flatten)]
    photos: PhotoArguments,
    /// Folder of masks, black where nothing counts [default: masks/, else alpha].
    ///
    /// By default beside images/. The mask of the photo b.jpg is b.jpg.png or b.png. alpha takes
    /// the photos' transparency.
    #[arg(long, value_name = "DIR|alpha|off", help_heading = MASKS)]
    masks: Option<String>,
    /// Use all photos, even if they contradict their poses or COLMAP's points.
    #[arg(long, help_heading = EXPERT)]
    force: bool,
}

impl PhotoArguments {
    /// Options with masks by default.
    pub(super) fn options(self) -> LoadOptions {
        LoadOptions {
            max_side: self.max_side,
            holdout: !self.no_holdout,
            channel: self.channel,
            encoding: self.encoding,
            normalize: self.normalize,
            masked: self.masked,
            ..LoadOptions::default()
        }
    }
}

impl Photos {
    pub(super) fn options(self) -> LoadOptions {
        LoadOptions {
            masks: self
                .masks
                .map_or_else(MaskSource::default, MaskSource::from),
            force: self.force,
            ..self.photos.options()
        }
    }
}
