//! Options of the rasterizer.

/// Color space of a field's channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorKind {
    /// sRGB-encoded gray.
    Luma,
    /// CIELAB a and b.
    Chroma,
    /// sRGB-encoded red, green and blue.
    Rgb,
}

impl ColorKind {
    /// The kind with so many channels, if there is one.
    pub fn of_channels(channels: usize) -> Option<Self> {
        match channels {
            1 => Some(Self::Luma),
            2 => Some(Self::Chroma),
            3 => Some(Self::Rgb),
            _ => None,
        }
    }

    /// Channels of one color.
    pub fn channels(self) -> usize {
        match self {
            Self::Luma => 1,
            Self::Chroma => 2,
            Self::Rgb => 3,
        }
    }

    /// Floats between two colors in a device array (`vec3f` is aligned to 16 bytes).
    pub fn stride(self) -> usize {
        match self {
            Self::Luma => 1,
            Self::Chroma => 2,
            Self::Rgb => 4,
        }
    }
}

/// Effects of image formation that the rasterizer is compiled with. Those that are off are not in
/// the kernels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RasterOptions {
    /// A Gaussian's opacity falls by what the blur of
    /// [`BLUR`](super::constants::BLUR) px² spreads it (Mip-Splatting, Yu et al. 2024): its size
    /// in pixels does not change how much it shows.
    pub antialiased: bool,
    /// Falloff of opacity.
    pub falloff: Falloff,
}

/// Falloff of a Gaussian's opacity towards its border.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Falloff {
    /// As a Gaussian, to where it is no longer seen (Kerbl et al. 2023).
    #[default]
    Gaussian,
    /// As PlayCanvas' engine has it: less than a Gaussian by e⁻⁴, divided by what is left of 1,
    /// ended at √8 deviations, and blurred by [`PLAYCANVAS_BLUR`](super::constants::PLAYCANVAS_BLUR)
    /// px² only. It is not antialiased. Of layers and adjoints only RGB's know it.
    PlayCanvas,
}
