//! The values in a file of a photo or a mask, and what the file announces of them.

use std::fmt;
use std::io::{BufRead, Seek};

use super::orientation::Orientation;

/// The most a decoded file may take, in bytes: 178 million 8-bit RGB pixels, more
/// than any camera's, and little enough to fail with words instead of by force.
pub(super) const LARGEST_FILE: u64 = 512 << 20;

/// Precision of a file's brightness values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Depth {
    /// Whole numbers from 0 to 255.
    Eight,
    /// Whole numbers from 0 to 65,535.
    Sixteen,
    /// IEEE floats.
    Float,
}

impl Depth {
    /// The value of white where nobody says another.
    pub fn white(self) -> f64 {
        match self {
            Self::Eight => f64::from(u8::MAX),
            Self::Sixteen => f64::from(u16::MAX),
            Self::Float => 1.0,
        }
    }
}

impl fmt::Display for Depth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Eight => "8 bits",
            Self::Sixteen => "16 bits",
            Self::Float => "floats",
        })
    }
}

/// Header of an image file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Header {
    /// Width and height in pixels.
    pub size: [u32; 2],
    pub depth: Depth,
    /// 1 gray, 2 gray and alpha, 3 RGB, 4 RGB and alpha.
    pub channels: usize,
    /// True if the file stores palette indices; the palette's colors are read.
    pub indexed: bool,
    /// Transform that makes it upright.
    pub orientation: Orientation,
}

impl Header {
    /// Returns true if the last channel is alpha.
    pub fn has_alpha(&self) -> bool {
        self.channels.is_multiple_of(2)
    }
}

/// Values as they stand in the file.
pub(super) enum Samples {
    Eight(Vec<u8>),
    Sixteen(Vec<u16>),
    Float(Vec<f32>),
}

/// Source of a file's bytes.
pub(super) trait Bytes: BufRead + Seek {}
impl<T: BufRead + Seek> Bytes for T {}
