//! The Gaussians that a training starts from.

use super::{
    DensifyRules, LumaSettings, Schedule,
    carve::carved,
    densify_3dgs,
    gaps::{GapPoint, gap_points},
};
use crate::{
    capture::{CaptureError, Dataset},
    color::gray_from_rgb,
    effects::Evidence,
    splats::{InitialPoint, ShField, Splats, initial_splats, morton, sh},
};

/// At most so large a share of the Gaussians is there from the start: growth sees where photos
/// are not met, and places the others better (docs/experiments.md).
const FIRST_SHARE: f64 = 0.75;

/// At most so large a share of the Gaussians starts where COLMAP has no point, as numerator and
/// denominator: half of it gained less on the lawn of the bundled scene, more cost elsewhere.
const GAPS_PARTS: [usize; 2] = [3, 10];

/// At most one in so many Gaussians is one of the surroundings.
const SURROUNDINGS_SHARE: usize = 16;

/// Initial Gaussians from given ones: luma of the settings' degree, cut to their maximum number.
pub fn started(splats: &Splats, settings: &LumaSettings) -> Splats {
    let mut splats = splats.to_luma();
    splats.sh = at_degree(&splats.sh, splats.means.len(), settings.sh_degree);
    truncate(&mut splats, settings.max_splats);
    splats
}

/// One at each of COLMAP's points and where photos show some that it has not, as many as
/// [`room_at_first`] says, and a dome behind them; so many fewer than the settings allow as are
/// `reserved`.
///
/// # Errors
/// [`CaptureError`] of a photo.
pub fn placed_splats(
    dataset: &Dataset,
    evidence: &Evidence,
    settings: &LumaSettings,
    reserved: usize,
) -> Result<Splats, CaptureError> {
    let room = settings.max_splats - reserved;
    let points = first_points(dataset, settings, room, |_| true)?;
    let mut splats = initial_splats(&points, dataset.extent as f32, settings.sh_degree);
    if settings.rules == DensifyRules::Published {
        densify_3dgs::begin(&mut splats);
    }
    if dataset.removes_masked() {
        splats = carved(dataset, &splats)?;
    }
    let dome = match settings.background {
        true => Some(background(dataset, evidence, settings)?),
        false => None,
    };
    let taken = dome.as_ref().map_or(0, Splats::len);
    truncate(
        &mut splats,
        room_at_first(settings, settings.max_splats - taken - reserved),
    );
    dome.into_iter().for_each(|dome| splats.append(dome));
    Ok(splats)
}

/// Maximum number of initial Gaussians of a training that may have so many: some are left to
/// densification, unless the training is too short for it.
pub fn room_at_first(settings: &LumaSettings, splats: usize) -> usize {
    let densifications = Schedule::of(settings).densifications() as f64;
    match FIRST_SHARE * (1.0 + settings.growth).powf(densifications) < 1.0 {
        true => splats,
        false => (FIRST_SHARE * splats as f64).ceil() as usize,
    }
}

/// COLMAP's points and, if gaps are to be filled, some where photos show what it has no point
/// of: as many as `room` Gaussians leave. Only those are returned whose positions are `wanted`.
///
/// # Errors
/// [`CaptureError`] of a photo.
pub fn first_points(
    dataset: &Dataset,
    settings: &LumaSettings,
    room: usize,
    wanted: impl Fn([f32; 3]) -> bool,
) -> Result<Vec<InitialPoint>, CaptureError> {
    let mut points: Vec<InitialPoint> = (dataset.capture.points.iter())
        .map(|point| {
            let rgb = point.color.map(|v| f64::from(v) / 255.0);
            let position = point.position.as_vec3().to_array();
            (position, gray_from_rgb(rgb) as f32).into()
        })
        .filter(|point: &InitialPoint| wanted(point.position))
        .collect();
    // Where COLMAP has more points than there may be Gaussians, none of them is to spare.
    let most = (room * GAPS_PARTS[0] / GAPS_PARTS[1]).min(room.saturating_sub(points.len()));
    let found = match settings.fill_gaps && most > 0 {
        true => gap_points(dataset, most)?,
        false => Vec::new(),
    };
    let started = |point: &GapPoint| InitialPoint {
        position: point.position.as_vec3().to_array(),
        gray: point.gray,
        // Not the distance to its neighbors: what stands alone may be wrong, and would be wide
        // (docs/experiments.md).
        spacing: Some(point.width as f32),
    };
    let found = found.iter().map(started);
    points.extend(found.filter(|point| wanted(point.position)));
    Ok(points)
}

/// Gaussians for what no point explains, at most a quarter of all that there may be.
fn background(
    dataset: &Dataset,
    evidence: &Evidence,
    settings: &LumaSettings,
) -> Result<Splats, CaptureError> {
    let backdrop = evidence.backdrop();
    let mut places = backdrop.dome_places(settings.max_splats / 4);
    dataset.visit(backdrop.views(), |view, photo| {
        backdrop.look(view, photo, &mut places);
        Ok::<_, CaptureError>(())
    })?;
    Ok(backdrop.dome(&places, settings.sh_degree))
}

/// Shell around the scene: empty if the settings have none, or if masks remove the background.
///
/// # Errors
/// [`CaptureError`] of a photo.
pub fn surroundings(
    dataset: &Dataset,
    evidence: &Evidence,
    settings: &LumaSettings,
) -> Result<Splats, CaptureError> {
    if !settings.surround || dataset.removes_masked() {
        return Ok(Splats::default());
    }
    let most = settings.max_splats / SURROUNDINGS_SHARE;
    let mut shell = evidence.backdrop().shell(most, settings.background);
    dataset.visit(evidence.backdrop().views(), |view, photo| {
        shell.look(view, photo);
        Ok::<_, CaptureError>(())
    })?;
    Ok(shell.splats(settings.sh_degree))
}

/// The field cut or filled up with zeros to another degree.
fn at_degree(field: &ShField, count: usize, degree: u32) -> ShField {
    let mut out = ShField::zeros(count, degree, field.channels);
    let stride = sh::coefficient_count(degree) * field.channels;
    for i in 0..count {
        let from = field.of(i);
        let shared = from.len().min(stride);
        out.coefficients[i * stride..i * stride + shared].copy_from_slice(&from[..shared]);
    }
    out
}

/// Keeps at most `max` Gaussians: a cap is a cap. Small ones stand close together and for each
/// other, so the chance to stay goes with the root of the size, the geometric mean of the axes,
/// and the choice is even along a Z-order curve (docs/experiments.md).
fn truncate(splats: &mut Splats, max: usize) {
    if splats.len() > max {
        let root = |axes: &[f32; 3]| {
            let mean = axes.iter().copied().map(f64::from).sum::<f64>() / 3.0;
            // Sums of what a file may hold stay finite.
            (mean / 2.0).clamp(-300.0, 300.0).exp()
        };
        let along = morton::order(&splats.means);
        let weights: Vec<f64> = (along.iter())
            .map(|&index| root(&splats.log_scales[index as usize]))
            .collect();
        let mut kept: Vec<usize> = (sampled(&weights, max).into_iter())
            .map(|place| along[place] as usize)
            .collect();
        kept.sort_unstable();
        *splats = splats.chosen(&kept);
    }
}

/// Systematic sampling (Madow 1949): `count` of the indices, ascending and evenly spread, each
/// with a chance in proportion to its positive weight, but at most 1.
fn sampled(weights: &[f64], count: usize) -> Vec<usize> {
    let mut sorted = weights.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let sums: Vec<f64> = (sorted.iter())
        .scan(0.0, |sum, weight| {
            *sum += weight;
            Some(*sum)
        })
        .collect();
    // The heaviest stay for sure while their share of what is left exceeds one.
    let last = weights.len() - 1;
    let sure = (0..count)
        .take_while(|&sure| sorted[last - sure] * (count - sure) as f64 > sums[last - sure])
        .count();
    let chance = (count - sure) as f64 / sums[last - sure];
    let mut sum = 0.5;
    (0..weights.len())
        .filter(|&index| {
            let before = f64::floor(sum);
            sum += (weights[index] * chance).min(1.0);
            sum.floor() > before
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(count: usize, degree: u32) -> Splats {
        let mut splats = Splats {
            means: (0..count).map(|i| [i as f32; 3]).collect(),
            quats: vec![[1.0, 0.0, 0.0, 0.0]; count],
            log_scales: (0..count).map(|i| [-(i as f32); 3]).collect(),
            opacity_logits: (0..count).map(|i| i as f32).collect(),
            sh: ShField::zeros(count, degree, 1),
        };
        for (k, c) in splats.sh.coefficients.iter_mut().enumerate() {
            *c = k as f32;
        }
        splats
    }

    #[test]
    fn a_cap_is_a_cap_for_the_first_gaussians_too() {
        let mut splats = numbered(10, 1);
        splats.log_scales.fill([-3.0; 3]);
        truncate(&mut splats, 4);
        assert_eq!(splats.opacity_logits, [1.0, 3.0, 6.0, 8.0]);
        assert_eq!(splats.means[3], [8.0; 3]);
        assert_eq!(splats.sh.of(2), [24.0, 25.0, 26.0, 27.0]);
        let before = splats.clone();
        truncate(&mut splats, 4);
        assert_eq!(splats, before);
        truncate(&mut splats, 0);
        assert_eq!(splats.len(), 0);
    }

    #[test]
    fn where_gaussians_are_small_fewer_stay() {
        let mut splats = numbered(1_000, 0);
        // A clump of nine hundred, a hundredth as large as the others: a tenth of their chance.
        splats.log_scales.fill([0.0; 3]);
        splats.log_scales[..900].fill([-100.0_f32.ln(); 3]);
        let stayed = |count| {
            let mut splats = splats.clone();
            truncate(&mut splats, count);
            assert_eq!(splats.len(), count);
            let large = splats.log_scales.iter().filter(|axes| axes[0] == 0.0);
            large.count()
        };
        assert_eq!([19, 95, 190, 999].map(stayed), [10, 50, 100, 100]);
    }

    #[test]
    fn sizes_beyond_all_bounds_are_chosen_from() {
        let mut splats = numbered(6, 0);
        splats.log_scales = [f32::MIN, f32::MAX, 0.0, f32::MIN, f32::MAX, 0.0]
            .map(|size| [size; 3])
            .into();
        for count in 0..6 {
            let mut some = splats.clone();
            truncate(&mut some, count);
            assert_eq!(some.len(), count);
        }
    }

    #[test]
    fn a_quarter_is_left_to_growth_where_there_is_any() {
        let [long, short] = [1_000, 3].map(LumaSettings::new);
        let room = |settings| [0, 1, 2, 4, 10_000].map(|splats| room_at_first(settings, splats));
        assert_eq!(room(&long), [0, 1, 2, 3, 7_500]);
        assert_eq!(room(&short), [0, 1, 2, 4, 10_000]);
    }

    #[test]
    fn harmonics_change_degree_without_moving() {
        let splats = numbered(2, 1);
        assert_eq!(at_degree(&splats.sh, 2, 0).coefficients, [0.0, 4.0]);
        let raised = at_degree(&splats.sh, 2, 2);
        assert_eq!(raised.of(1)[..5], [4.0, 5.0, 6.0, 7.0, 0.0]);
        assert_eq!(raised.of(1).len(), 9);
    }
}
