//! Chroma that follows strokes while somebody paints: what `colorize` finds for the same strokes,
//! but from the colors before.

use std::{
    collections::BTreeSet,
    ops::ControlFlow,
    sync::{Arc, atomic::AtomicBool},
};

use super::{
    ChromaError, ChromaSettings, Correction, FrozenField, FrozenViews, IrlsSolver, MemoryBudget,
    Supervision, Targets, Task,
    field::Colors,
    fill_unseen,
    strokes::{Claims, StrokeWeights, laid_over, shaded_at, whole_or_none},
    teacher::HintImage,
};
use crate::{
    capture::{Camera, Dataset, Photo, downscale},
    color::gray_to_lightness,
    raster::{ColorKind, Raster, RenderedImage},
    splats::{ShField, Splats, sh},
};

/// Rounds of a solve at most, and the mean change of the colors, in CIELAB units, that ends it.
const ROUNDS: usize = 4;
const SETTLED: f64 = 0.15;

/// A share of the views below which those that a stroke changes are solved for alone first.
const FEW: f64 = 0.5;

/// Pixels that decide a Gaussian's color in the map of doubt.
const DECIDED: f32 = 4.0;

/// Mean residuals, in CIELAB units: what teachers are off anyway, and what is doubted as much as what
/// no view shows.
const DOUBTED: [f32; 2] = [6.0, 18.0];

/// a and b of what is doubted wholly: orange.
const TINT: [f32; 2] = [45.0, 60.0];

/// A scene whose strokes change.
pub struct Repainter<'a> {
    dataset: &'a Dataset,
    luma: &'a Splats,
    supervision: &'a Supervision,
    settings: ChromaSettings,
    /// All views of the dataset, in its order, of so many pixels at most.
    frozen: FrozenViews,
    cameras: Vec<Camera>,
    claims: Claims,
    /// Claims that `chroma` knows.
    weights: StrokeWeights,
    /// Views with strokes.
    painted: BTreeSet<usize>,
    targets: Targets,
    /// Each view's place among these.
    target_of: Vec<Option<usize>>,
    /// Views whose targets are those of other claims.
    stale: BTreeSet<usize>,
    /// Colors without strokes, the last ones, and these with what no view shows filled in.
    unpainted: ShField,
    chroma: ShField,
    shown: ShField,
    corrections: Vec<Correction>,
    /// True until colors are known from which to go on.
    cold: bool,
}

impl<'a> Repainter<'a> {
    /// A repainter of `luma`, which has the colors `chroma` by these teachers, none of whom sees
    /// strokes; without them the first solve takes long. Settings are those of least squares. Photos
    /// of more than `pixels` are looked at smaller.
    ///
    /// # Errors
    /// [`ChromaError`] of the device or of the file that targets wait in.
    pub fn new(
        raster: &Arc<Raster>,
        dataset: &'a Dataset,
        luma: &'a Splats,
        supervision: &'a Supervision,
        (settings, pixels): (&ChromaSettings, usize),
        chroma: Option<ShField>,
    ) -> Result<Self, ChromaError> {
        let smaller = |camera: &Camera| {
            let [width, height] = [camera.width, camera.height].map(f64::from);
            let scale = (pixels as f64 / (width * height)).sqrt().min(1.0);
            let size = [width, height].map(|side| ((scale * side).round() as u32).max(1));
            camera.resized(size[0], size[1])
        };
        let cameras: Vec<Camera> = dataset.cameras.iter().map(smaller).collect();
        let room = MemoryBudget {
            limit: settings.memory_limit,
            color: ColorKind::Chroma,
            sh_degree: settings.sh_degree,
            weighted: true,
            streams: true,
        };
        let views = dataset.cameras.len();
        let frozen = FrozenViews::new(raster, luma, dataset.extent, &cameras, 1, room)?;
        let claims = Claims::new(frozen.primitives());
        let cold = chroma.is_none();
        let gray = || ShField::zeros(luma.len(), settings.sh_degree, 2);
        let chroma = chroma.unwrap_or_else(gray);
        Ok(Self {
            frozen,
            cameras,
            weights: claims.weights(),
            claims,
            dataset,
            luma,
            supervision,
            settings: settings.clone(),
            painted: BTreeSet::new(),
            targets: Targets::new(1),
            target_of: vec![None; views],
            stale: supervision.views.iter().copied().collect(),
            unpainted: chroma.clone(),
            shown: chroma.clone(),
            chroma,
            corrections: vec![Correction::NONE; views],
            cold,
        })
    }

    /// Takes the strokes on a view, in the place of those before, and moves what they claim to
    /// their color: a guess at what [`Repainter::solve`] will find.
    ///
    /// # Errors
    /// [`ChromaError`] of the photo or the device.
    pub fn paint(&mut self, view: usize, paint: &HintImage) -> Result<(), ChromaError> {
        let photo = self.photo(view)?;
        let paint = &paint.resized(photo.width, photo.height);
        self.claims
            .paint(&self.frozen, [view, view], &photo, paint)?;
        match paint.is_empty() {
            true => self.painted.remove(&view),
            false => self.painted.insert(view),
        };
        let weights = self.claims.weights();
        let changed: Vec<usize> = (0..self.luma.len())
            .filter(|&i| weights.of(i) != self.weights.of(i))
            .collect();
        for &i in &changed {
            self.guess(i, weights.of(i));
        }
        self.weights = weights;
        let seeing = (0..self.dataset.cameras.len()).filter(|&view| self.may_see(view, &changed));
        let seeing: Vec<usize> = seeing.collect();
        self.stale.extend(seeing);
        self.stale.insert(view);
        Ok(())
    }

    /// A photo as large as it is looked at.
    fn photo(&self, view: usize) -> Result<Photo, ChromaError> {
        let photo = self.dataset.photo(view)?;
        let (from, to) = ([photo.width, photo.height], self.size(view));
        let smaller = |levels: &Vec<u8>| match from == to {
            true => levels.clone(),
            false => {
                let [from, to] = [from, to].map(|size| size.map(|side| side as usize));
                downscale(levels.as_chunks::<1>().0, from, to)
                    .into_iter()
                    .map(|[level]| level)
                    .collect()
            }
        };
        Ok(Photo {
            width: to[0],
            height: to[1],
            gray: smaller(&photo.gray),
            mask: photo.mask.as_ref().map(smaller),
            rgb: None,
        })
    }

    fn size(&self, view: usize) -> [u32; 2] {
        [self.cameras[view].width, self.cameras[view].height]
    }

    /// Gives a Gaussian the color of a claim on it, as far as it is claimed.
    fn guess(&mut self, splat: usize, (color, alpha): ([f32; 2], f32)) {
        let gray = 0.5 + sh::C0 * f64::from(self.luma.sh.of(splat)[0]);
        let lightness = gray_to_lightness(gray.clamp(0.0, 1.0)) as f32;
        let painted = shaded_at(color, lightness).map(|value| value / sh::C0 as f32);
        let share = whole_or_none(alpha);
        let stride = self.chroma.channels * sh::coefficient_count(self.chroma.degree);
        let own = splat * stride..(splat + 1) * stride;
        for (k, i) in own.enumerate() {
            let painted = painted.get(k).copied().unwrap_or(0.0);
            let value = (1.0 - share) * self.unpainted.coefficients[i] + share * painted;
            self.chroma.coefficients[i] = value;
            self.shown.coefficients[i] = value;
        }
    }

    /// Returns true if any of these Gaussians may show in a view.
    fn may_see(&self, view: usize, splats: &[usize]) -> bool {
        let camera = &self.cameras[view];
        splats.iter().any(|&i| {
            let place = glam::Vec3::from(self.luma.means[i]).as_dvec3();
            camera.pixel_of(place).is_some()
        })
    }

    /// Solves for the strokes so far, from the colors so far: first, where these are few, in the
    /// views that show what has changed. `settles` takes the colors after each part. Gives the
    /// number of rounds; none once `stop` is set, and the next solve goes on from here.
    ///
    /// # Errors
    /// [`ChromaError`] of a photo, the device or the file that targets wait in.
    pub fn solve(
        &mut self,
        stop: &AtomicBool,
        settles: &mut dyn FnMut(&ShField),
    ) -> Result<Option<usize>, ChromaError> {
        let stale: Vec<usize> = self.stale.iter().copied().collect();
        self.lay()?;
        let all: Vec<Task> = (0..self.target_of.len())
            .filter(|&view| self.learns(view))
            .filter_map(|view| {
                let target = self.target_of[view]?;
                Some(Task { view, target })
            })
            .collect();
        let changed = all
            .iter()
            .copied()
            .filter(|task| stale.contains(&task.view));
        let changed: Vec<Task> = changed.collect();
        let mut rounds = 0;
        let few = (changed.len() as f64) < FEW * all.len() as f64;
        for (tasks, whole) in [(changed, false), (all, true)] {
            if tasks.is_empty() || !(few || whole) {
                continue;
            }
            let (done, seen) = match self.solve_for(tasks, whole, stop) {
                Err(ChromaError::Cancelled) => return Ok(None),
                found => found?,
            };
            rounds += done;
            self.shown = self.chroma.clone();
            if self.settings.fill && whole {
                fill_unseen(self.frozen.primitives(), &mut self.shown, &seen);
            }
            settles(&self.shown);
        }
        Ok(Some(rounds))
    }

    /// Returns true if colors are learned from a view.
    fn learns(&self, view: usize) -> bool {
        self.supervision.views.binary_search(&view).is_ok() || self.painted.contains(&view)
    }

    /// Brings the claims into the targets of all views where they have changed.
    fn lay(&mut self) -> Result<(), ChromaError> {
        let fields = self.weights.fields();
        let fields = [
            self.frozen.colors(&fields[0])?,
            self.frozen.colors(&fields[1])?,
        ];
        while let Some(&view) = self.stale.first() {
            if self.learns(view) {
                self.lay_on(view, &fields)?;
            }
            self.stale.remove(&view);
        }
        Ok(())
    }

    fn lay_on(&mut self, view: usize, fields: &[Colors<'_>; 2]) -> Result<(), ChromaError> {
        let over = self.claims.on(&self.frozen, [view, view], fields)?;
        let taught = self.supervision.taught(view)?;
        let taught = taught.map(|target| target.resized(self.size(view)));
        let wanted = laid_over(taught, &self.photo(view)?, &over);
        self.target_of[view] = match (self.target_of[view], wanted) {
            (Some(target), Some((wanted, weights))) => {
                (self.targets).replace_ab(target, &wanted, Some(&weights))?;
                Some(target)
            }
            (None, Some((wanted, weights))) => Some(self.targets.push_ab(&wanted, Some(&weights))?),
            (_, None) => None,
        };
        Ok(())
    }

    /// A solve for the whole, or for some views: their corrections stay, and what they do not show.
    /// Gives the rounds, and in how many pixels each Gaussian shows.
    fn solve_for(
        &mut self,
        tasks: Vec<Task>,
        whole: bool,
        stop: &AtomicBool,
    ) -> Result<(usize, Vec<f32>), ChromaError> {
        let settings = &ChromaSettings {
            correct_views: self.settings.correct_views && whole,
            ..self.settings.clone()
        };
        let start = &self.chroma;
        let views: Vec<usize> = tasks.iter().map(|task| task.view).collect();
        let corrections: Vec<Correction> = views.iter().map(|&i| self.corrections[i]).collect();
        let mut solver =
            IrlsSolver::starting_at(&self.frozen, settings, &self.targets, tasks, start)?;
        if !self.cold {
            solver.warm(&corrections, ROUNDS);
        }
        let (mut rounds, mut settled) = (0, false);
        while !settled && solver.goes_on() {
            let mut moved = None;
            solver.run_within(1, stop, &mut |progress| {
                moved = progress.moved;
                ControlFlow::Continue(())
            })?;
            rounds += 1;
            settled = !self.cold && moved.is_some_and(|moved| moved < SETTLED);
        }
        let seen = solver.seen()?;
        if settings.correct_views {
            for (task, correction) in solver.corrections()? {
                self.corrections[task.view] = correction;
            }
        }
        let mut found = solver.chroma()?;
        if !whole {
            // Nothing but the pull toward gray moves what these views do not show.
            let stride = found.coefficients.len() / seen.len().max(1);
            let pairs = found.coefficients.iter_mut().zip(&self.shown.coefficients);
            for (i, (value, before)) in pairs.enumerate() {
                *value = before + seen[i / stride].min(1.0) * (*value - before);
            }
        }
        self.chroma = found;
        self.cold = false;
        if self.painted.is_empty() {
            self.unpainted = self.chroma.clone();
        }
        Ok((rounds, seen))
    }

    /// Colors to be shown: the last ones, what no view shows filled in.
    pub fn shown(&self) -> &ShField {
        &self.shown
    }

    /// Takes the colors that a whole coloring has found for the same strokes.
    pub fn rebase(&mut self, chroma: ShField) {
        self.shown = chroma.clone();
        self.chroma = chroma;
    }

    /// Doubt about each Gaussian's color, 0 to 1: where views contradict what was found, or where
    /// hardly any shows it. Strokes settle it.
    fn doubts(&self) -> Result<Vec<f32>, ChromaError> {
        let colors = self.frozen.colors(&self.chroma)?;
        let mut sums = vec![[0.0_f32; 2]; self.luma.len()];
        for view in 0..self.target_of.len() {
            let Some(target) = self.target_of[view].filter(|_| self.learns(view)) else {
                continue;
            };
            let target = self.targets.read(target, 0)?;
            let drawn = self.frozen.draw(view, &[&colors])?;
            let drawn = drawn[0].pixels.as_chunks::<2>().0;
            let correction = &self.corrections[view];
            let weights = target.weights.as_deref().unwrap_or_default();
            let figures: Vec<[f32; 4]> = (drawn.iter().zip(target.ab().ab).zip(weights))
                .map(|((drawn, wanted), &weight)| {
                    let wanted = correction.of(wanted);
                    let apart = (drawn[0] - wanted[0]).hypot(drawn[1] - wanted[1]);
                    let weight = weight.min(1.0);
                    [weight * apart, weight, 0.0, 0.0]
                })
                .collect();
            let found = self.frozen.gather(view, &figures)?;
            for (sum, figures) in sums.iter_mut().zip(found) {
                *sum = [sum[0] + figures[0], sum[1] + figures[1]];
            }
        }
        Ok((sums.iter().enumerate())
            .map(|(i, &[apart, pixels])| {
                let unseen = (1.0 - pixels / DECIDED).clamp(0.0, 1.0);
                let apart = apart / pixels.max(1e-6) - DOUBTED[0];
                let apart = (apart / (DOUBTED[1] - DOUBTED[0])).clamp(0.0, 1.0);
                let claimed = whole_or_none(self.weights.of(i).1);
                apart.max(unseen) * (1.0 - claimed)
            })
            .collect())
    }

    /// A map of doubt, as a and b that tint the Gaussians by it, and so many places to paint next:
    /// each in the view that shows most of what those before do not, where it shows most, in shares
    /// of its sides.
    ///
    /// # Errors
    /// [`ChromaError`] of the device or of the file that targets wait in.
    pub fn doubt(&self, places: usize) -> Result<(ShField, Vec<DoubtfulPlace>), ChromaError> {
        let mut doubts = self.doubts()?;
        let one = 1.0 / sh::C0 as f32;
        let mut tint = ShField::zeros(doubts.len(), 0, 2);
        for (ab, doubt) in tint.coefficients.chunks_exact_mut(2).zip(&doubts) {
            ab.copy_from_slice(&TINT.map(|value| one * doubt * value));
        }
        let mut found = Vec::new();
        for _ in 0..places.min(self.frozen.views()) {
            let mut field = ShField::zeros(doubts.len(), 0, 2);
            for (ab, doubt) in field.coefficients.chunks_exact_mut(2).zip(&doubts) {
                ab[0] = one * doubt;
            }
            let field = self.frozen.colors(&field)?;
            let mut most = (0.0, None);
            for view in 0..self.frozen.views() {
                let drawn = self.frozen.draw(view, &[&field])?;
                let doubt: f32 = drawn[0].pixels.iter().sum();
                if doubt > most.0 {
                    most = (doubt, Some((view, heaviest(&drawn[0]))));
                }
            }
            let Some((best, place)) = most.1 else {
                break;
            };
            found.push((best, place));
            let pixels = self.frozen.pixels(best, 0);
            let shown = self
                .frozen
                .gather(best, &vec![[1.0, 0.0, 0.0, 0.0]; pixels])?;
            for (doubt, figures) in doubts.iter_mut().zip(shown) {
                *doubt *= (1.0 - figures[0]).max(0.0);
            }
        }
        Ok((tint, found))
    }
}

/// A view, and a place in it in shares of its sides.
pub type DoubtfulPlace = (usize, [f32; 2]);

/// Cells to each side of a picture among which the heaviest is found.
const CELLS: usize = 12;

/// Center of the cell of a picture whose first channel sums to most.
fn heaviest(picture: &RenderedImage) -> [f32; 2] {
    let [width, height] = [picture.width, picture.height].map(|side| side as usize);
    let mut sums = [0.0_f32; CELLS * CELLS];
    for (i, pixel) in picture.pixels.chunks_exact(picture.channels).enumerate() {
        let cell = [i % width * CELLS / width, i / width * CELLS / height];
        sums[cell[1] * CELLS + cell[0]] += pixel[0];
    }
    let best = (0..sums.len()).max_by(|&a, &b| sums[a].total_cmp(&sums[b]));
    let best = best.unwrap_or_default();
    [best % CELLS, best / CELLS].map(|cell| (cell as f32 + 0.5) / CELLS as f32)
}
