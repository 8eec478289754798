//! Strokes that color what they lie on, in all views.
//!
//! On the photo a stroke [claims](region) what it touches and is alike; what the photo shows of
//! each Gaussian tells how much of that is claimed, and from there claims [go on](spread) to
//! Gaussians that the photo does not show. Drawn into every view, they take the place of what the
//! teacher wants there, so that all views agree.

mod region;
mod shade;
mod spread;

use std::{collections::BTreeMap, sync::Arc};

use super::{
    ChromaError, Supervision, Target, Targets, Task,
    field::{Colors, FrozenField, Primitives},
    teacher::{AbImage, HintImage},
};
use crate::{
    capture::{Dataset, Photo},
    color::gray_to_lightness,
    raster::RenderedImage,
    splats::{ShField, sh},
};
use region::{Surface, grow};
use shade::shaded;
pub(crate) use shade::{at_middle as at_middle_lightness, shaded as shaded_at};
use spread::{Cloud, StrokeWeight};

/// Claim of paint on a photo, as [`grow`] has it: α a, α b, α of each pixel, a and b at
/// the middle lightness. `lightness` is `L*`, `depth` in any unit, NaN where nobody knows.
pub(crate) fn claimed_by_strokes(
    size: [usize; 2],
    lightness: &[f32],
    depth: &[f32],
    paint: &HintImage,
) -> Vec<[f32; 3]> {
    let surface = Surface {
        size,
        lightness,
        depth,
    };
    grow(&surface, paint)
}

/// Opacity of a pixel from which on it shows the scene.
const OPAQUE: f32 = 0.5;

/// Drawn claims below the first are none and above the second whole: between them lies an edge
/// that Gaussians draw softer than the photo has it.
const EDGE: [f32; 2] = [0.3, 0.7];

/// Targets of all views, with strokes over the teachers'.
pub(super) struct StrokeTargets {
    pub targets: Targets,
    pub tasks: Vec<Task>,
    /// Share of the Gaussians that are claimed by half or more.
    pub claimed: f64,
}

/// Claim of all strokes together on each Gaussian.
pub(super) struct StrokeWeights {
    /// Σ α² a, Σ α² b, Σ α² over the photos.
    colors: Vec<[f32; 3]>,
    /// The largest α.
    alphas: Vec<f32>,
}

impl StrokeWeights {
    fn new(count: usize) -> Self {
        Self {
            colors: vec![[0.0; 3]; count],
            alphas: vec![0.0; count],
        }
    }

    /// A photo that shows a thing without strokes takes nothing from what another's claim.
    fn add(&mut self, claims: &[StrokeWeight]) {
        for claim in claims {
            let i = claim.splat as usize;
            let weight = claim.alpha * claim.alpha;
            let [a, b] = claim.color;
            for (sum, value) in self.colors[i].iter_mut().zip([a, b, 1.0]) {
                *sum += weight * value;
            }
            self.alphas[i] = self.alphas[i].max(claim.alpha);
        }
    }

    /// Share of the Gaussians that are claimed by half or more.
    fn claimed(&self) -> f64 {
        let claimed = self.alphas.iter().filter(|&&alpha| alpha >= 0.5).count();
        claimed as f64 / self.alphas.len().max(1) as f64
    }

    /// Color at the middle lightness and α of the claim on a Gaussian.
    pub fn of(&self, splat: usize) -> ([f32; 2], f32) {
        let [a, b, weight] = self.colors[splat];
        let over = if weight > 0.0 { 1.0 / weight } else { 0.0 };
        ([over * a, over * b], self.alphas[splat])
    }

    /// Fields that draw α a, α b and α, 1.
    pub fn fields(&self) -> [ShField; 2] {
        let one = 1.0 / sh::C0 as f32;
        let mut fields = [(); 2].map(|()| ShField::zeros(self.alphas.len(), 0, 2));
        for (i, (&alpha, &[a, b, weight])) in self.alphas.iter().zip(&self.colors).enumerate() {
            if weight > 0.0 {
                let strength = one * alpha / weight;
                fields[0].coefficients[2 * i] = strength * a;
                fields[0].coefficients[2 * i + 1] = strength * b;
            }
            fields[1].coefficients[2 * i] = one * alpha;
            fields[1].coefficients[2 * i + 1] = one;
        }
        fields
    }
}

/// Claims of strokes, photo by photo.
pub(super) struct Claims {
    cloud: Cloud,
    splats: usize,
    /// Of each painted view of the dataset: its Gaussians, and its pixels' place among the regions.
    of_view: BTreeMap<usize, (Vec<StrokeWeight>, usize)>,
    regions: Targets,
}

impl Claims {
    /// No claims on the Gaussians of a field.
    pub fn new(primitives: &Arc<Primitives>) -> Self {
        Self {
            cloud: Cloud::of(primitives),
            splats: primitives.count(),
            of_view: BTreeMap::new(),
            regions: Targets::new(1),
        }
    }

    /// Takes the paint on view `view` of the dataset, which is `frozen`'s `index`th and shows
    /// `photo`, in the place of what was painted there.
    pub fn paint(
        &mut self,
        frozen: &dyn FrozenField,
        [view, index]: [usize; 2],
        photo: &Photo,
        paint: &HintImage,
    ) -> Result<(), ChromaError> {
        let lightness = lightness(photo);
        let surface = Surface {
            size: [photo.width, photo.height].map(|side| side as usize),
            lightness: &lightness,
            depth: &frozen.depth(index)?,
        };
        let mut region = grow(&surface, paint);
        if let Some(mask) = &photo.mask {
            for (claim, &counts) in region.iter_mut().zip(mask) {
                *claim = claim.map(|value| value * f32::from(counts) / 255.0);
            }
        }
        let figures: Vec<[f32; 4]> = region
            .iter()
            .map(|&[a, b, alpha]| [a, b, alpha, 1.0])
            .collect();
        let claims = self.cloud.claims(&frozen.gather(index, &figures)?);
        let (colors, alphas): (Vec<[f32; 2]>, Vec<f32>) = (region.iter())
            .map(|&[a, b, alpha]| {
                let over = if alpha > 0.0 { 1.0 / alpha } else { 0.0 };
                ([over * a, over * b], alpha)
            })
            .unzip();
        let colors = AbImage {
            width: photo.width,
            height: photo.height,
            ab: colors,
        };
        let own = self.of_view.remove(&view).map(|(_, region)| region);
        let region = match own {
            Some(region) => {
                (self.regions).replace_ab(region, &colors, Some(&alphas))?;
                region
            }
            None => self.regions.push_ab(&colors, Some(&alphas))?,
        };
        self.of_view.insert(view, (claims, region));
        Ok(())
    }

    /// Claims of all photos on each Gaussian.
    pub fn weights(&self) -> StrokeWeights {
        let mut weights = StrokeWeights::new(self.splats);
        for (claims, _) in self.of_view.values() {
            weights.add(claims);
        }
        weights
    }

    /// Claims on a view's pixels, drawn of `fields` or painted there: colors at the middle
    /// lightness, and α.
    pub fn on(
        &self,
        frozen: &dyn FrozenField,
        [view, index]: [usize; 2],
        fields: &[Colors<'_>; 2],
    ) -> Result<Vec<([f32; 2], f32)>, ChromaError> {
        let mut over = drawn_claims(&frozen.draw(index, &[&fields[0], &fields[1]])?);
        if let Some((_, region)) = self.of_view.get(&view) {
            let region = self.regions.read(*region, 0)?;
            let alphas = region.weights.as_deref().unwrap_or_default();
            for ((own, color), &alpha) in over.iter_mut().zip(region.ab().ab).zip(alphas) {
                if alpha > own.1 {
                    *own = (color, alpha);
                }
            }
        }
        Ok(over)
    }
}

/// Lays the strokes of a supervision over what its teachers want, in all views that color learns
/// from: `frozen` has these and no others, in their order.
pub(super) fn lay(
    frozen: &dyn FrozenField,
    dataset: &Dataset,
    supervision: &Supervision,
) -> Result<StrokeTargets, ChromaError> {
    let mut claims = Claims::new(frozen.primitives());
    for (index, &view) in supervision.views.iter().enumerate() {
        if let Some(paint) = supervision.paint(view)? {
            let photo = dataset.photo(view)?;
            claims.paint(frozen, [view, index], &photo, &paint)?;
        }
    }
    let weights = claims.weights();
    let fields = weights.fields();
    let fields = [frozen.colors(&fields[0])?, frozen.colors(&fields[1])?];
    let mut targets = Targets::new(supervision.targets.scales());
    let mut tasks = Vec::new();
    let mut index = 0;
    dataset.visit(&supervision.views, |view, photo| {
        let over = claims.on(frozen, [view, index], &fields)?;
        let taught = supervision.taught(view)?;
        if let Some((wanted, weights)) = laid_over(taught, photo, &over) {
            let target = targets.push_ab(&wanted, Some(&weights))?;
            tasks.push(Task {
                view: index,
                target,
            });
        }
        index += 1;
        Ok::<_, ChromaError>(())
    })?;
    dataset.release();
    Ok(StrokeTargets {
        targets,
        tasks,
        claimed: weights.claimed(),
    })
}

/// Claims as a view shows them: colors at the middle lightness, and α.
fn drawn_claims(drawn: &[RenderedImage]) -> Vec<([f32; 2], f32)> {
    let [colors, alphas] = [0, 1].map(|k: usize| drawn[k].pixels.as_chunks::<2>().0);
    (colors.iter().zip(alphas))
        .map(|(color, &[alpha, opacity])| {
            if alpha <= 0.0 {
                return ([0.0; 2], 0.0);
            }
            let share = whole_or_none(alpha / opacity.max(OPAQUE));
            (color.map(|value| value / alpha), share)
        })
        .collect()
}

/// Share of a claim that counts: see [`EDGE`].
pub(super) fn whole_or_none(share: f32) -> f32 {
    let t = ((share - EDGE[0]) / (EDGE[1] - EDGE[0])).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Colors that a view is to have with claims over its teacher's, all at the photo's size, and the
/// weight of each pixel; `None` where nothing is wanted.
pub(super) fn laid_over(
    taught: Option<Target>,
    photo: &Photo,
    claims: &[([f32; 2], f32)],
) -> Option<(AbImage, Vec<f32>)> {
    if taught.is_none() && claims.iter().all(|&(_, alpha)| alpha == 0.0) {
        return None;
    }
    let size = claims.len();
    let mut ab = match &taught {
        Some(target) => target.ab().ab,
        None => vec![[0.0; 2]; size],
    };
    let mut weights = match taught {
        Some(target) => target.weights.unwrap_or_else(|| vec![1.0; size]),
        None => vec![0.0; size],
    };
    let lightness = lightness(photo);
    for (i, &(color, alpha)) in claims.iter().enumerate() {
        if alpha == 0.0 {
            continue;
        }
        let counts = photo
            .mask
            .as_ref()
            .map_or(1.0, |mask| f32::from(mask[i]) / 255.0);
        let color = shaded(color, lightness[i]);
        let [own, over] = [(1.0 - alpha) * weights[i], alpha * counts];
        if own + over > 0.0 {
            for c in 0..2 {
                ab[i][c] = (own * ab[i][c] + over * color[c]) / (own + over);
            }
        }
        weights[i] = own + over;
    }
    let wanted = AbImage {
        width: photo.width,
        height: photo.height,
        ab,
    };
    Some((wanted, weights))
}

/// `L*` of each pixel.
fn lightness(photo: &Photo) -> Vec<f32> {
    let of_gray: [f32; 256] =
        std::array::from_fn(|gray| gray_to_lightness(gray as f64 / 255.0) as f32);
    photo
        .gray
        .iter()
        .map(|&gray| of_gray[usize::from(gray)])
        .collect()
}
