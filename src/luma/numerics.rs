//! Accuracy of training that may be traded for time: `fit --numerics`.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::raster::RasterNumerics;

/// Numerical accuracy of stage 1's training. Measuring, rendering and writing afterwards use the
/// default, as viewers do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default)]
pub struct Numerics {
    /// Accuracy of the rasterizer and of Adam's steps.
    #[serde(flatten)]
    pub raster: RasterNumerics,
    /// Side of SSIM's window in the loss, in pixels.
    pub ssim_window: SsimWindow,
}

/// Pixels along a side of SSIM's window, a Gaussian of σ = 1.5 cut off there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(into = "u32", try_from = "u32")]
pub enum SsimWindow {
    /// As Wang et al. 2004.
    #[default]
    Eleven,
    /// Up to two deviations: 95 % of the weight along a row.
    Seven,
    /// Up to 1.3 deviations: 82 % of the weight along a row.
    Five,
}

impl From<SsimWindow> for u32 {
    fn from(window: SsimWindow) -> Self {
        match window {
            SsimWindow::Eleven => 11,
            SsimWindow::Seven => 7,
            SsimWindow::Five => 5,
        }
    }
}

impl TryFrom<u32> for SsimWindow {
    type Error = String;

    fn try_from(side: u32) -> Result<Self, String> {
        [Self::Eleven, Self::Seven, Self::Five]
            .into_iter()
            .find(|&window| u32::from(window) == side)
            .ok_or_else(|| format!("SSIM has no window of {side} pixels: 11, 7 or 5"))
    }
}

/// The keys with their values, for messages.
const KEYS: &str = "alpha-min=0.00001..0.1, transmittance-min=0..0.5, depth-bits=32|24|16, \
    storage=full|half, ssim-window=11|7|5, adam=exact|lazy";

impl FromStr for Numerics {
    type Err = String;

    /// Reads `KEY=VALUE[,KEY=VALUE…]`; what is not named keeps its default. An error names all
    /// keys and values that there are.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut numerics = Self::default();
        for pair in text.split(',') {
            let taken = pair.split_once('=').and_then(|(key, value)| {
                let raster = &mut numerics.raster;
                match key.trim() {
                    // Antialiased gradients grow with one over it.
                    "alpha-min" => raster.alpha_min = number(value, 1e-5, 0.1)?,
                    "transmittance-min" => raster.transmittance_min = number(value, 0.0, 0.5)?,
                    "depth-bits" => {
                        let named = |bits: &u32| bits.to_string() == value.trim();
                        raster.depth_bits = [32, 24, 16].into_iter().find(named)?;
                    }
                    "storage" => raster.storage = serde_plain::from_str(value.trim()).ok()?,
                    "ssim-window" => {
                        numerics.ssim_window =
                            SsimWindow::try_from(value.trim().parse::<u32>().ok()?).ok()?;
                    }
                    "adam" => raster.adam = serde_plain::from_str(value.trim()).ok()?,
                    _ => return None,
                }
                Some(())
            });
            taken.ok_or_else(|| format!("{pair:?} is none of {KEYS}"))?;
        }
        Ok(numerics)
    }
}

fn number(text: &str, low: f64, high: f64) -> Option<f64> {
    let value = text.trim().parse().ok()?;
    (low..=high).contains(&value).then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        for text in [
            "alpha-min=0.015",
            "transmittance-min=0",
            "depth-bits=16",
            "storage=half",
            "ssim-window=5",
            "adam=lazy",
            "alpha-min=0.00001,transmittance-min=0.01,depth-bits=24,storage=half,ssim-window=7,adam=lazy",
        ] {
            let numerics: Numerics = text.parse().unwrap();
            assert_ne!(numerics, Numerics::default(), "{text}");
            let json = serde_json::to_string(&numerics).unwrap();
            assert_eq!(
                serde_json::from_str::<Numerics>(&json).unwrap(),
                numerics,
                "{json}"
            );
        }
    }

    #[test]
    fn defaults_may_be_named_and_reports_may_lack_keys() {
        let named = "depth-bits=32,storage=full,ssim-window=11,adam=exact";
        assert_eq!(named.parse(), Ok(Numerics::default()));
        let old: Numerics = serde_json::from_str(r#"{ "storage": "half" }"#).unwrap();
        assert_eq!("storage=half".parse(), Ok(old));
    }

    #[test]
    fn what_is_wrong_is_named_with_all_that_there_is() {
        for wrong in [
            "",
            "alpha-min",
            "alpha-min=",
            "alpha-min=0",
            "alpha-min=nan",
            "alpha-min=0.2",
            "transmittance-min=-1",
            "transmittance-min=0.6",
            "depth-bits=8",
            "storage=quarter",
            "ssim-window=9",
            "adam=slow",
            "adam=lazy,",
            "speed=11",
        ] {
            let message = wrong.parse::<Numerics>().unwrap_err();
            assert!(
                message.contains("is none of") && message.contains(KEYS),
                "{message}"
            );
        }
    }
}
