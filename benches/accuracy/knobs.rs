//! The knobs and the values that are measured.

use gs_chroma::{low_level::oracle, luma::Numerics};

/// One value of one knob, as `fit --numerics KEY=VALUE` takes it; nothing is the default.
#[derive(Clone, Copy, Debug)]
pub struct Knob {
    pub key: &'static str,
    pub value: &'static str,
}

/// Settings of the oracle against which cut-offs are measured: a Gaussian that shows less than this
/// does not change the eighth digit, even if there are thousands.
pub const NOTHING_LEFT_OUT: oracle::numerics::Numerics = oracle::numerics::Numerics {
    alpha_min: 1e-12,
    transmittance_min: 0.0,
    depth_bits: 32,
    ..oracle::numerics::Numerics::DEFAULT
};

const fn knob(key: &'static str, value: &'static str) -> Knob {
    Knob { key, value }
}

/// Moves every knob to where it costs little.
const TOGETHER: &str =
    "alpha-min=0.008,transmittance-min=0.001,depth-bits=16,storage=half,ssim-window=7,adam=lazy";

/// Knobs measured, the default first. The second is the default but for rounding: a difference from
/// the default no larger than its own is no effect of a knob.
pub const KNOBS: [Knob; 17] = [
    knob("default", ""),
    knob("alpha-min", "0.003922"),
    knob("alpha-min", "0.00001"),
    knob("alpha-min", "0.001"),
    knob("alpha-min", "0.008"),
    knob("alpha-min", "0.016"),
    knob("transmittance-min", "0"),
    knob("transmittance-min", "0.001"),
    knob("transmittance-min", "0.01"),
    knob("transmittance-min", "0.05"),
    knob("depth-bits", "24"),
    knob("depth-bits", "16"),
    knob("storage", "half"),
    knob("ssim-window", "7"),
    knob("ssim-window", "5"),
    knob("adam", "lazy"),
    knob("together", TOGETHER),
];

impl Knob {
    /// Numerics with this value.
    ///
    /// # Panics
    /// Never for [`KNOBS`].
    pub fn numerics(&self) -> Numerics {
        let text = match self.key {
            "default" => return Numerics::default(),
            "together" => self.value.to_owned(),
            key => format!("{key}={}", self.value),
        };
        text.parse().expect("a value that fit takes")
    }
}
