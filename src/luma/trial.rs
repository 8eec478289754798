//! Short trainings that tell what the evidence leaves open: one with none of the effects in
//! question, and one with each of them, measured on views that were held back.

use std::{ops::ControlFlow, sync::Arc};

use super::{
    LumaError, LumaSettings, LumaTrainer, PlannedViews, TrainingView, start::placed_splats,
};
use crate::{
    capture::{Camera, Dataset},
    effects::{Effect, Evidence, Overrules, Plan, Room, Trials},
    measure,
    raster::{Raster, Renderer},
};

/// Share of the run's work that all trainings of a trial may take, by iterations times pixels.
const WORK: f64 = 0.15;

/// Iterations of a trial: with 150 there is no scene yet that could fit one way or the other, and
/// more than 1,500 would keep users waiting for what few iterations tell.
const ITERATIONS: [usize; 2] = [400, 1_500];

/// Longer side of its photos at most and at least, where the work allows that much.
const SIDES: [u32; 2] = [400, 80];

/// Its cap on Gaussians, at least.
const LEAST_SPLATS: usize = 1_500;

/// Photos at most, so many of which are held back: both ends of the capture and some between, for
/// wrong effects show there first.
const MAX_VIEWS: usize = 36;
const HELD_BACK: usize = 6;

/// Rounds of a trial, each with a seed of its own; the others only where the first leaves a gain
/// within [`NOISE`] of what counts.
const ROUNDS: usize = 3;

/// How near a gain may be to what counts, in dB, to be asked for again with another seed. At 160
/// pixels a seed moves the PSNR of `banana-object` by 0.35 dB and the gain of its exposures by 0.1;
/// smaller trials are noisier.
const NOISE: f64 = 0.3;

/// How far a trial is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrialProgress {
    /// Iterations done, of all trainings.
    pub done: usize,
    /// Iterations in all; fewer if the first seed tells.
    pub total: usize,
    /// The effect that the present training has and the one it is compared with has not; `None`
    /// in the latter.
    pub effect: Option<Effect>,
}

/// The plan of a capture for a run with `settings`, after a trial on the device that `raster`
/// gives where it needs one.
///
/// # Errors
/// Those of `raster`, and [`LumaError`] of a photo or of the device.
pub fn planned<E: From<LumaError>>(
    dataset: &Arc<Dataset>,
    evidence: &Evidence,
    settings: &LumaSettings,
    overrules: &Overrules,
    raster: impl FnOnce() -> Result<Arc<Raster>, E>,
    observe: &mut dyn FnMut(TrialProgress) -> ControlFlow<()>,
) -> Result<Plan, E> {
    let room = settings.room();
    let plan = evidence.decide(room, overrules, &Trials::new());
    let open = plan.open(room);
    if open.is_empty() {
        return Ok(plan);
    }
    let arms = arms(evidence, room, overrules, &open);
    let Some(size) = Size::of(dataset, settings, arms.len()) else {
        return Ok(plan);
    };
    let trial = Trial {
        dataset,
        evidence,
        raster: raster()?,
        size,
        total: size.iterations * arms.len() * size.rounds,
    };
    let gains = trial.gains(&arms, observe)?;
    Ok(evidence.decide(room, overrules, &gains))
}

/// A plan to compare: without any of the effects in question, or with one of them.
struct Arm {
    effect: Option<Effect>,
    plan: Plan,
}

fn arms(evidence: &Evidence, room: Room, overrules: &Overrules, open: &[Effect]) -> Vec<Arm> {
    let only = |effect: Option<Effect>| {
        let others = open.iter().filter(|&&other| Some(other) != effect);
        let mut overrules = overrules.clone();
        overrules.without.extend(others);
        Arm {
            effect,
            plan: evidence.decide(room, &overrules, &Trials::new()),
        }
    };
    let with = open.iter().map(|&effect| only(Some(effect)));
    std::iter::once(only(None)).chain(with).collect()
}

/// How large the trainings are.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Size {
    iterations: usize,
    /// How often photos are halved.
    halvings: u32,
    max_splats: usize,
    rounds: usize,
}

impl Size {
    /// The largest that keeps `trainings` within [`WORK`]; `None` where there are too few photos
    /// to hold one back.
    fn of(dataset: &Dataset, settings: &LumaSettings, trainings: usize) -> Option<Self> {
        let train = &dataset.split.train;
        if train.len() < 4 {
            return None;
        }
        let cameras = train.iter().map(|&view| &dataset.cameras[view]);
        let side = cameras.map(longer_side).max()?;
        Some(Self::within(side, settings, trainings))
    }

    fn within(side: u32, settings: &LumaSettings, trainings: usize) -> Self {
        let [least, most] = ITERATIONS;
        let iterations = (settings.iterations / 2).clamp(least, most);
        let work = |halvings: u32, rounds: usize| {
            let each = iterations as f64 / settings.iterations as f64 / 4_f64.powi(halvings as i32);
            each * (trainings * rounds) as f64
        };
        let [largest, smallest] = SIDES;
        let mut halvings = 1;
        while side >> halvings > largest
            || (work(halvings, ROUNDS) > WORK && side >> (halvings + 1) >= smallest)
        {
            halvings += 1;
        }
        let fits = |rounds: &usize| work(halvings, *rounds) <= WORK;
        Self {
            iterations,
            halvings,
            max_splats: (settings.max_splats >> (2 * halvings)).max(LEAST_SPLATS),
            rounds: (1..=ROUNDS).rev().find(fits).unwrap_or(1),
        }
    }
}

fn longer_side(camera: &Camera) -> u32 {
    camera.width.max(camera.height)
}

/// What all trainings of a trial share.
struct Trial<'a> {
    dataset: &'a Arc<Dataset>,
    evidence: &'a Evidence,
    raster: Arc<Raster>,
    size: Size,
    total: usize,
}

impl Trial<'_> {
    /// What each effect gains, in dB of corrected PSNR on the views held back, the mean over the
    /// seeds.
    fn gains(
        &self,
        arms: &[Arm],
        observe: &mut dyn FnMut(TrialProgress) -> ControlFlow<()>,
    ) -> Result<Trials, LumaError> {
        let mut sums = vec![0.0; arms.len()];
        let mut trainings = 0;
        let mut found = Trials::new();
        for round in 1..=self.size.rounds {
            for (arm, sum) in arms.iter().zip(&mut sums) {
                *sum += self.psnr(arm, round as u64 - 1, &mut |iteration| {
                    observe(TrialProgress {
                        done: trainings * self.size.iterations + iteration,
                        total: self.total,
                        effect: arm.effect,
                    })
                })?;
                trainings += 1;
            }
            let gains = arms.iter().zip(&sums);
            found = gains
                .filter_map(|(arm, sum)| Some((arm.effect?, (sum - sums[0]) / round as f64)))
                .collect();
            let tells =
                |(effect, gain): (&Effect, &f64)| (gain - effect.trial_gain()).abs() > NOISE;
            if found.iter().all(tells) {
                break;
            }
        }
        Ok(found)
    }

    /// Mean corrected PSNR of the views held back, of a training with an arm's effects.
    fn psnr(
        &self,
        arm: &Arm,
        seed: u64,
        observe: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<f64, LumaError> {
        if observe(0).is_break() {
            return Err(LumaError::Cancelled);
        }
        let views = PlannedViews::new(self.dataset.clone(), self.evidence, &arm.plan);
        let [trained, held_back] = chosen(&self.dataset.split.train).map(|chosen| {
            let small = |view: usize| Ok(self.small(views.of(view)?));
            chosen
                .into_iter()
                .map(small)
                .collect::<Result<Vec<_>, LumaError>>()
        });
        let settings = LumaSettings {
            max_splats: self.size.max_splats,
            // As long as a short training itself.
            fill_gaps: false,
            seed,
            ..LumaSettings::new(self.size.iterations).planned(&arm.plan)
        };
        let extent = self.dataset.extent;
        let start = placed_splats(self.dataset, self.evidence, &settings, 0)?;
        let drawn = self.raster.drawing(settings.raster_options());
        let mut trainer =
            LumaTrainer::new(self.raster.clone(), settings, extent, &start, trained?)?;
        trainer.train_while(&mut |progress| observe(progress.iteration))?;
        let splats = trainer.splats()?;
        let mut renderer = Renderer::of(&drawn, &splats, &[&splats.sh], extent)?;
        let (mut sum, mut count) = (0.0, 0.0);
        for view in held_back? {
            let picture = renderer.render(&view.camera)?.remove(0);
            if let Some(psnr) = corrected(&view, &picture.pixels) {
                sum += psnr;
                count += 1.0;
            }
        }
        Ok(sum / f64::max(count, 1.0))
    }

    fn small(&self, view: TrainingView) -> TrainingView {
        (0..self.size.halvings).fold(view, |view, _| view.halved())
    }
}

/// Which of the training views a trial trains on, and which it holds back.
fn chosen(train: &[usize]) -> [Vec<usize>; 2] {
    let count = train.len().min(MAX_VIEWS);
    let views: Vec<usize> = (0..count).map(|k| train[k * train.len() / count]).collect();
    let held_back = (count / HELD_BACK).max(2);
    let held_back: Vec<usize> = (0..held_back)
        .map(|k| views[k * (count - 1) / (held_back - 1)])
        .collect();
    let trained = views.into_iter().filter(|view| !held_back.contains(view));
    [trained.collect(), held_back]
}

/// PSNR of a picture after the photo's gain and offset, where anything counts.
fn corrected(view: &TrainingView, picture: &[f32]) -> Option<f64> {
    let counts = |pixel: &usize| (view.mask.as_ref()).is_none_or(|mask| mask[*pixel] >= 128);
    let (ours, truth): (Vec<f32>, Vec<f32>) = (0..view.gray.len())
        .filter(counts)
        .map(|pixel| {
            (
                picture[pixel].clamp(0.0, 1.0),
                f32::from(view.gray[pixel]) / 255.0,
            )
        })
        .unzip();
    (!ours.is_empty()).then(|| measure::corrected_psnr(&ours, &truth))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trial_takes_no_more_than_its_share() {
        for (side, iterations, splats) in [
            (400, 700, 12_000),
            (1_600, 3_500, 2_000_000),
            (4_000, 15_000, 3_000_000),
            (640, 200, 500),
        ] {
            for trainings in 2..=5 {
                let settings = LumaSettings {
                    max_splats: splats,
                    ..LumaSettings::new(iterations)
                };
                let size = Size::within(side, &settings, trainings);
                let work = (size.iterations * trainings * size.rounds) as f64
                    / iterations as f64
                    / 4_f64.powi(size.halvings as i32);
                assert!(size.rounds >= 1 && side >> size.halvings >= SIDES[1]);
                // But for the smallest there is.
                let smallest = size.rounds == 1 && side >> (size.halvings + 1) < SIDES[1];
                assert!(
                    work <= WORK || smallest,
                    "{side} {iterations} {trainings}: {size:?} {work}"
                );
            }
        }
    }

    #[test]
    fn both_ends_and_some_between_are_held_back() {
        let train: Vec<usize> = (0..100).collect();
        let [trained, held_back] = chosen(&train);
        assert_eq!(trained.len() + held_back.len(), MAX_VIEWS);
        assert_eq!((held_back.len(), held_back[0]), (6, 0));
        assert_eq!(held_back.last(), Some(&97));
        let [trained, held_back] = chosen(&[2, 3, 5, 7]);
        assert_eq!((trained, held_back), (vec![3, 5], vec![2, 7]));
    }
}
