//! Learning rates and degree of the harmonics at an iteration.

use super::state::LumaTrainer;
use crate::{raster::constants::*, splats::sh};

impl LumaTrainer {
    /// Learning rate of the means at `iteration`, in world units.
    fn means_rate(&self, iteration: usize) -> f64 {
        let rates = &self.settings.rates;
        rates.means_at(self.schedule.share_over(iteration), self.extent)
    }

    /// Degree of the harmonics in use at `iteration`.
    pub(super) fn degree_at(&self, iteration: usize) -> u32 {
        self.schedule.degree_at(iteration, self.settings.sh_degree)
    }

    pub(super) fn geometry_rates(&self, iteration: usize) -> [f32; GEOMETRY_PLANES] {
        let rates = &self.settings.rates;
        let settling = self.schedule.settling(iteration);
        std::array::from_fn(|plane| {
            (settling
                * match plane {
                    PLANE_MEAN..PLANE_QUAT => self.means_rate(iteration),
                    PLANE_QUAT..PLANE_LOG_SCALE => rates.quats,
                    PLANE_LOG_SCALE..PLANE_OPACITY => rates.log_scales,
                    _ => rates.opacity_logits,
                }) as f32
        })
    }

    pub(super) fn field_rates(&self, iteration: usize) -> Vec<f32> {
        let rates = &self.settings.rates;
        let settling = self.schedule.settling(iteration);
        let rest = (settling * rates.sh_rest) as f32;
        let mut planes = vec![rest; sh::coefficient_count(self.model.field.degree)];
        planes[0] = (settling * rates.sh_constant) as f32;
        planes
    }
}
