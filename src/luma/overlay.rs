//! Settings in the place of a preset's.

use serde::{Deserialize, Serialize};

use super::{DensifyRules, LumaSettings, Numerics};

/// Settings of stage 1 in the place of those of a preset or a time limit; `None` leaves them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LumaOverlay {
    /// All of them; those below come over these.
    pub settings: Option<LumaSettings>,
    /// Iterations.
    pub iterations: Option<usize>,
    /// Early stopping, in dB; 0 for none.
    pub stop_when_flat: Option<f64>,
    /// Rules of densification.
    pub rules: Option<DensifyRules>,
    /// Gaussians at most.
    pub max_splats: Option<usize>,
    /// A shell of gray around the scene.
    pub surround: Option<bool>,
    /// Gaussians where photos match and COLMAP has no points.
    pub fill_gaps: Option<bool>,
    /// Photos come to the device one by one.
    pub stream_photos: Option<bool>,
    /// Bytes of the device.
    pub memory_limit: Option<u64>,
    /// Numerics of training.
    pub numerics: Option<Numerics>,
    /// Seed of every random choice.
    pub seed: Option<u64>,
    /// Factor of the learning rates.
    pub haste: Option<f64>,
}

impl LumaOverlay {
    /// Puts them in the place of what is there.
    pub fn apply(&self, settings: &mut LumaSettings) {
        fn put<T: Clone>(value: &Option<T>, place: &mut T) {
            if let Some(value) = value {
                place.clone_from(value);
            }
        }
        put(&self.settings, settings);
        put(&self.iterations, &mut settings.iterations);
        if let Some(rules) = self.rules {
            *settings = settings.clone().by(rules);
        }
        put(&self.max_splats, &mut settings.max_splats);
        put(&self.surround, &mut settings.surround);
        put(&self.fill_gaps, &mut settings.fill_gaps);
        put(&self.stream_photos, &mut settings.stream_photos);
        put(&self.numerics, &mut settings.numerics);
        put(&self.seed, &mut settings.seed);
        settings.memory_limit = self.memory_limit.or(settings.memory_limit);
        if let Some(gain) = self.stop_when_flat {
            settings.stop_when_flat = (gain > 0.0).then_some(gain);
        }
        if let Some(haste) = self.haste {
            settings.rates = settings.rates.times(haste);
        }
    }

    /// These where they are given, and others where not.
    #[must_use]
    pub fn over(self, under: Self) -> Self {
        if self.settings.is_some() {
            return self;
        }
        Self {
            settings: under.settings,
            iterations: self.iterations.or(under.iterations),
            stop_when_flat: self.stop_when_flat.or(under.stop_when_flat),
            rules: self.rules.or(under.rules),
            max_splats: self.max_splats.or(under.max_splats),
            surround: self.surround.or(under.surround),
            fill_gaps: self.fill_gaps.or(under.fill_gaps),
            stream_photos: self.stream_photos.or(under.stream_photos),
            memory_limit: self.memory_limit.or(under.memory_limit),
            numerics: self.numerics.or(under.numerics),
            seed: self.seed.or(under.seed),
            haste: self.haste.or(under.haste),
        }
    }
}
