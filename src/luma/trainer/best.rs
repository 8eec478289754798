//! The best on the way, which a training goes back to when what came after was not worth
//! its time.

use super::{scores::Best, state::LumaTrainer};
use crate::gpu::GpuError;

impl LumaTrainer {
    /// Remembers the present set if none was better by the looks so far, the last of which
    /// was at it.
    pub(super) fn keep_best(&mut self, iteration: usize) -> Result<(), GpuError> {
        let Some(psnr) = self.watch.last().map(|look| look.psnr) else {
            return Ok(());
        };
        let best = self.watch.best.as_ref();
        if best.is_some_and(|best| best.psnr >= psnr) {
            return Ok(());
        }
        self.watch.best = Some(Best {
            iteration,
            psnr,
            model: self.model.snapshot(&self.gpu)?,
        });
        Ok(())
    }

    /// Puts the best set in the place of the present one, of `iteration`: that of the best,
    /// unless it is the present one.
    pub(super) fn back_to_best(&mut self, iteration: usize) -> Result<Option<usize>, GpuError> {
        let best = self.watch.best.take();
        let Some(best) = best.filter(|best| best.iteration < iteration) else {
            return Ok(None);
        };
        self.model.restore(&self.gpu, &best.model)?;
        self.renew(self.workspace()?.lists.capacity, best.iteration)?;
        self.watch.given_up = Some(iteration);
        Ok(Some(best.iteration))
    }
}
