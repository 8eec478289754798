//! Short trainings that tell what the evidence leaves open: one with none of the effects in
//! question, and one with each of them, measured on views that were held back.

use std::{
    collections::{HashMap, hash_map::Entry},
    ops::ControlFlow,
    sync::Arc,
};

use super::{
    LumaError, LumaSettings, LumaTrainer, PlannedViews, TrainingView,
    start::{placed_splats, surroundings},
};
use crate::{
    capture::Dataset,
    effects::{Effect, Evidence, Overrules, Plan, Trials},
    measure,
    raster::{Raster, RasterOptions, SceneRenderer, plain},
    splats::Splats,
};

/// Share of the run's time that all trainings of a trial may take.
const SHARE: f64 = 0.15;

/// Fixed cost of an iteration, in pixels: small dispatches wait for each other.
const BESIDE_PIXELS_ON_A_CPU: f64 = 9_000.0;
const BESIDE_PIXELS_ON_A_GPU: f64 = 730_000.0;

/// Photos are halved further where that takes no more than this share of the time.
const WORTH_HALVING: f64 = 0.75;

/// Iterations of a trial: with 250 there is no scene yet that could fit one way or the other, and
/// more than 1,500 would keep users waiting for what few iterations tell.
const ITERATIONS: [usize; 2] = [300, 1_500];

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

/// Distance of a gain from its threshold within which another seed is tried, in dB. At 160 pixels a
/// seed moves the PSNR of `banana-object` by 0.35 dB and the gain of its exposures by 0.1; smaller
/// trials are noisier.
const NOISE: f64 = 0.3;

/// Progress of a trial.
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
    let open = evidence.open(&plan);
    if open.is_empty() {
        return Ok(plan.confirmed());
    }
    let Some(photo) = largest_photo(dataset) else {
        return Ok(plan.confirmed());
    };
    let raster = raster()?;
    let beside = match raster.gpu.is_software() {
        true => BESIDE_PIXELS_ON_A_CPU,
        false => BESIDE_PIXELS_ON_A_GPU,
    };
    // Of as many as there is time for; the evidence decides about the others.
    let sized = (1..=open.len()).rev().find_map(|asked| {
        let size = Size::within(photo, settings, 1 + asked, beside)?;
        Some((&open[..asked], size))
    });
    let Some((asked, size)) = sized else {
        return Ok(plan.confirmed());
    };
    let arms = arms(&plan, asked);
    let trial = Trial {
        dataset,
        evidence,
        raster,
        size,
        surround: settings.surround,
        total: size.iterations * arms.len() * size.rounds,
    };
    let gains = trial.gains(&arms, observe)?;
    Ok(evidence.decide(room, overrules, &gains).confirmed())
}

/// A plan to compare: without any of the effects in question, or with one of them.
struct Arm {
    effect: Option<Effect>,
    plan: Plan,
}

/// `asked` of the effects of a plan, none and one at a time; all else as planned.
fn arms(plan: &Plan, asked: &[Effect]) -> Vec<Arm> {
    let only = |effect: Option<Effect>| {
        let others = asked.iter().filter(|&&other| Some(other) != effect);
        Arm {
            effect,
            plan: others.fold(plan.clone(), |plan, &other| plan.without(other)),
        }
    };
    let with = asked.iter().map(|&effect| only(Some(effect)));
    std::iter::once(only(None)).chain(with).collect()
}

/// Size of each training of a trial.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Size {
    iterations: usize,
    /// Number of times that photos are halved.
    halvings: u32,
    max_splats: usize,
    rounds: usize,
}

impl Size {
    /// The largest that keeps `trainings` on photos of such width and height within [`SHARE`];
    /// `None` where even the shortest take longer. An iteration costs as much as its pixels and
    /// `beside` more.
    fn within(
        photo: [u32; 2],
        settings: &LumaSettings,
        trainings: usize,
        beside: f64,
    ) -> Option<Self> {
        let [fewest, most] = ITERATIONS;
        let run = settings.iterations as f64;
        let wanted = (settings.iterations / 2).clamp(fewest, most);
        let share = |halvings: u32| share(photo, halvings, beside);
        let time = |halvings: u32, rounds: usize| {
            wanted as f64 / run * share(halvings) * (trainings * rounds) as f64
        };
        let side = photo[0].max(photo[1]);
        let [largest, smallest] = SIDES;
        let mut halvings = 1;
        while side >> halvings > largest
            || (time(halvings, ROUNDS) > SHARE
                && share(halvings + 1) <= WORTH_HALVING * share(halvings)
                && side >> (halvings + 1) >= smallest)
        {
            halvings += 1;
        }
        let fits = |rounds: &usize| time(halvings, *rounds) <= SHARE;
        let rounds = (1..=ROUNDS).rev().find(fits).unwrap_or(1);
        let room = SHARE * run / (share(halvings) * (trainings * rounds) as f64);
        (room >= fewest as f64).then(|| Self {
            iterations: wanted.min(room as usize),
            halvings,
            max_splats: (settings.max_splats >> (2 * halvings)).max(LEAST_SPLATS),
            rounds,
        })
    }
}

/// Cost of an iteration on photos halved so often, as share of one of the run.
fn share([width, height]: [u32; 2], halvings: u32, beside: f64) -> f64 {
    let pixels = f64::from(width) * f64::from(height);
    (pixels * 0.25_f64.powi(halvings as i32) + beside) / (pixels + beside)
}

/// Width and height of the largest photo to train on; `None` where they are too few to hold one
/// back.
fn largest_photo(dataset: &Dataset) -> Option<[u32; 2]> {
    let train = &dataset.split.train;
    let sizes = train.iter().map(|&view| {
        let camera = &dataset.cameras[view];
        [camera.width, camera.height]
    });
    sizes
        .max_by_key(|size| size.map(u64::from).iter().product::<u64>())
        .filter(|_| train.len() >= 4)
}

/// Parameters that all trainings of a trial share.
struct Trial<'a> {
    dataset: &'a Arc<Dataset>,
    evidence: &'a Evidence,
    raster: Arc<Raster>,
    size: Size,
    /// True if a shell surrounds the scene.
    surround: bool,
    total: usize,
}

impl Trial<'_> {
    /// Gain of each effect, in dB of corrected PSNR on the held-out views, averaged over the seeds.
    fn gains(
        &self,
        arms: &[Arm],
        observe: &mut dyn FnMut(TrialProgress) -> ControlFlow<()>,
    ) -> Result<Trials, LumaError> {
        // The same in every round: one look at the photos without a background, one with it.
        let mut shells = HashMap::new();
        for arm in arms {
            let settings = self.settings(arm, 0);
            if let Entry::Vacant(none) = shells.entry(settings.background) {
                none.insert(surroundings(self.dataset, self.evidence, &settings)?);
            }
        }
        let mut sums = vec![0.0; arms.len()];
        let mut trainings = 0;
        let mut found = Trials::new();
        for round in 1..=self.size.rounds {
            for (arm, sum) in arms.iter().zip(&mut sums) {
                let settings = self.settings(arm, round as u64 - 1);
                let shell = &shells[&settings.background];
                *sum += self.psnr(arm, settings, shell, &mut |iteration| {
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

    /// Those of a training with an arm's effects.
    fn settings(&self, arm: &Arm, seed: u64) -> LumaSettings {
        LumaSettings {
            max_splats: self.size.max_splats,
            // As long as a short training itself.
            fill_gaps: false,
            surround: self.surround,
            seed,
            ..LumaSettings::new(self.size.iterations).planned(&arm.plan)
        }
    }

    /// Mean corrected PSNR of the views held back, of a training with an arm's effects and a shell
    /// around the scene, as a viewer without antialiasing draws its file.
    fn psnr(
        &self,
        arm: &Arm,
        settings: LumaSettings,
        shell: &Splats,
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
        let extent = self.dataset.extent;
        let start = placed_splats(self.dataset, self.evidence, &settings, shell.len())?;
        let trained = trained?;
        let cameras = trained
            .iter()
            .map(|view| view.camera.clone())
            .collect::<Vec<_>>();
        let antialiased = settings.raster_options().antialiased;
        let mut trainer = LumaTrainer::new(self.raster.clone(), settings, extent, &start, trained)?;
        trainer.surround(shell.clone());
        trainer.train_while(&mut |progress| observe(progress.iteration))?;
        let mut splats = trainer.splats()?;
        if antialiased {
            splats = plain(&splats, &cameras, extent);
        }
        let drawn = self.raster.drawing(RasterOptions::default());
        let mut renderer = SceneRenderer::of(&drawn, &splats, &[&splats.sh], extent)?;
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

/// Training views of a trial, and its held-out views.
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
    let (ours, truth) = view.compared(picture, |luma| luma.clamp(0.0, 1.0));
    (!ours.is_empty()).then(|| measure::corrected_psnr(&ours, &truth))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CPU: f64 = BESIDE_PIXELS_ON_A_CPU;
    const GPU: f64 = BESIDE_PIXELS_ON_A_GPU;

    #[test]
    fn a_trial_takes_no_more_than_its_share() {
        let runs = [
            ([400, 267], 700, 12_000),
            ([1_600, 1_200], 3_500, 2_000_000),
            ([4_000, 3_000], 15_000, 3_000_000),
            ([640, 480], 200, 500),
        ];
        for (photo, iterations, splats) in runs {
            let settings = LumaSettings {
                max_splats: splats,
                ..LumaSettings::new(iterations)
            };
            for (trainings, beside) in (2..=5).flat_map(|k| [(k, CPU), (k, GPU)]) {
                let Some(size) = Size::within(photo, &settings, trainings, beside) else {
                    continue;
                };
                let share = share(photo, size.halvings, beside);
                let time =
                    (size.iterations * trainings * size.rounds) as f64 / iterations as f64 * share;
                assert!(time <= SHARE, "{photo:?} {trainings}: {size:?} {time}");
                assert!(size.rounds >= 1 && size.iterations >= ITERATIONS[0]);
                assert!(photo[0] >> size.halvings >= SIDES[1]);
            }
        }
    }

    #[test]
    fn presets_have_time_for_a_trial_and_the_shortest_runs_have_not() {
        let time = |photo, iterations, beside| {
            Size::within(photo, &LumaSettings::new(iterations), 2, beside).is_some()
        };
        assert!(time([400, 267], 700, CPU) && time([640, 480], 3_500, GPU));
        assert!(!time([200, 150], 500, CPU) && !time([320, 240], 1_500, GPU));
    }

    /// Photos stay as large as they may be if few pixels cost as much as many.
    #[test]
    fn photos_shrink_only_where_that_saves_time() {
        let settings = LumaSettings::new(3_500);
        let size = |beside| Size::within([640, 480], &settings, 2, beside).expect("time");
        assert!(size(CPU).halvings > size(GPU).halvings);
        assert!(size(CPU).iterations > size(GPU).iterations);
        assert_eq!(size(GPU).halvings, 1);
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
