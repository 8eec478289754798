//! Exposure: gain and offset from the scene's luma to a photo's gray.

/// A photo shows `gain · luma + offset` of the scene's luma, both as encoded gray
/// in [0, 1], as far as black and white allow.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Exposure {
    /// Factor on luma, above 0.
    pub gain: f64,
    /// Added to that; 1 is white.
    pub offset: f64,
}

impl Exposure {
    /// The scene as it is.
    pub const NONE: Self = Self {
        gain: 1.0,
        offset: 0.0,
    };

    /// Gray of a photo for a luma of the scene, 0 to 1.
    pub fn shown(self, luma: f64) -> f64 {
        (self.gain * luma + self.offset).clamp(0.0, 1.0)
    }
}
