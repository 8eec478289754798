//! `fit JOB/block-3`: a block of a larger scene, as its job has planned it.

use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::{
    blocks::{Area, Block, BlockFile, COARSE, FAR_PART, Job, Kind, Region},
    capture::{Camera, Dataset},
    luma::{
        LumaSettings,
        start::{first_points, room_at_first},
    },
    report::{Report, ViewExposure},
    run::RunError,
    splats::{Splats, initial_splats},
    store::{RunFolder, StoreError},
    subject::scene::{Frame, read_splats},
    tell::{Event, Observer},
};

/// Standard deviations up to which a Gaussian shows anything to speak of.
const REACH: f64 = 3.0;

/// Minimum overlap for the bound on Gaussians, for blocks with almost no margin.
const LEAST_OVERLAP: f64 = 0.05;

/// Heights above and below the scene's that still belong to it, as a share of its height.
const HEADROOM: f64 = 0.5;

/// A block and the job that it belongs to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BlockPlace {
    pub(super) job: Job,
    pub(super) block: Block,
    /// See [`Job::plan_of`].
    plan: String,
    /// The coarse model, once it is trained.
    pub(super) coarse: Option<(RunFolder, Box<Report>)>,
}

impl BlockPlace {
    /// Reads the block of a folder; `None` if it is not a block's, or the coarse model's.
    ///
    /// # Errors
    /// [`StoreError::File`] where a file of the job is damaged.
    pub fn read(folder: &Path) -> Result<Option<Self>, RunError> {
        let file = match BlockFile::read(folder)? {
            Some(file) if file.kind == Kind::Block => file,
            _ => return Ok(None),
        };
        let job = Job::read(&job_of(folder))?;
        let name = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        let name = name.file_name().unwrap_or_default().to_string_lossy();
        let Some(block) = job.block(&name).cloned() else {
            return Err(StoreError::file(
                folder,
                "is no block of the job that it lies in: run `gs-chroma partition` again",
            )
            .into());
        };
        let coarse = RunFolder::at(&job_of(folder).join(COARSE));
        let coarse = match coarse.report().is_file() {
            true => {
                let report = Box::new(coarse.read_report()?);
                Some((coarse, report))
            }
            false => None,
        };
        Ok(Some(Self {
            plan: job.plan_of(&block, &file),
            job,
            block,
            coarse,
        }))
    }

    /// Exposures of the photos of all blocks; `None` without a coarse model.
    pub(super) fn exposures(&self) -> Option<&[ViewExposure]> {
        let (_, report) = self.coarse.as_ref()?;
        Some(&report.luma.exposures)
    }

    /// The whole scene's extent in world units; none where the coarse model is not there.
    pub(super) fn extent(&self) -> Option<f64> {
        let (_, report) = self.coarse.as_ref()?;
        Some(report.capture.extent)
    }

    pub(super) fn plan(&self) -> &Block {
        &self.block
    }

    pub(super) fn plan_sha256(&self) -> &str {
        &self.plan
    }

    /// The coarse model's Gaussians.
    pub(super) fn coarse(&self) -> Option<PathBuf> {
        Some(self.coarse.as_ref()?.0.luma())
    }

    /// The part of the world on which the block is trained, in moved coordinates.
    pub(super) fn near(&self, offset: DVec3) -> Region {
        self.region(self.block.near, offset)
    }

    fn region(&self, area: Area, offset: DVec3) -> Region {
        Region {
            ground: self.job.ground,
            area,
            offset,
        }
    }

    /// Initial Gaussians: points in and around the block, beyond them those of the coarse model
    /// that the block's photos show, and its surroundings; and the number of the last. `None`
    /// without a coarse model, with a warning.
    pub(super) fn start(
        &self,
        dataset: &Dataset,
        settings: &LumaSettings,
        observe: &mut Observer<'_>,
    ) -> Result<Option<(Splats, usize)>, RunError> {
        let Some((folder, report)) = &self.coarse else {
            observe(Event::Warning(format!(
                "{} is trained without a coarse model: background and brightness may differ between blocks; train {COARSE} first",
                self.block.name
            )));
            return Ok(None);
        };
        let frame = Frame::World(dataset.capture.offset);
        let coarse = read_splats(&folder.luma(), frame, observe)?.0.to_luma();
        let inner = coarse.len().saturating_sub(report.luma.surroundings);
        let [coarse, around] =
            [0..inner, inner..coarse.len()].map(|some| coarse.chosen(&some.collect::<Vec<_>>()));
        let offset = dataset.capture.offset;
        let near = self.near(offset);
        let far = self.far(dataset, &coarse);
        let room = settings.max_splats / (1 + FAR_PART);
        let far = coarse.chosen(&most_shown(dataset, &coarse, far, room));
        // Points give way, not the little that stands for all the rest.
        let taken = far.len() + around.len();
        let room = settings.max_splats.saturating_sub(taken).max(1);
        let points = first_points(dataset, settings, room, |place| near.holds(place))?;
        let mut start = initial_splats(&points, dataset.extent as f32, coarse.sh.degree);
        // Points far from all others would begin as a fog that covers the neighbors' cells, too,
        // and is gone there once the block is cropped.
        for (log_scales, &mean) in start.log_scales.iter_mut().zip(&start.means) {
            let widest = (self.free(mean, offset) / REACH).ln() as f32;
            for log_scale in log_scales {
                *log_scale = log_scale.min(widest);
            }
        }
        start = start.chosen(&evenly(&start.means, room_at_first(settings, room)));
        observe(Event::Note(format!(
            "starts from {} of {} points in and around the block and {} Gaussians of the coarse model beyond",
            start.len(),
            points.len(),
            far.len()
        )));
        start.append(far);
        let surroundings = around.len();
        start.append(around);
        Ok(Some((start, surroundings)))
    }

    /// Largest reach of a Gaussian at a place, in world units: the margin, plus the distance to the
    /// border of the block's own cell if it is inside.
    fn free(&self, place: [f32; 3], offset: DVec3) -> f64 {
        let at = self.at(place, offset);
        let to_border = [0, 1].map(|axis| {
            let [least, most] = self.block.core.0[axis];
            (at[axis] - least).min(most - at[axis])
        });
        self.margin() + to_border[0].min(to_border[1]).max(0.0)
    }

    /// Ground coordinates of a place.
    fn at(&self, place: [f32; 3], offset: DVec3) -> [f64; 2] {
        (self.job.ground).place(DVec3::from(place.map(f64::from)) + offset)
    }

    /// Least distance beyond its own cell that the block trains, in world units.
    fn margin(&self) -> f64 {
        let cell = self.block.core.within(&self.job.bounds);
        let sides = cell.0.map(|[least, most]| most - least);
        self.job.overlap.max(LEAST_OVERLAP) * sides[0].min(sides[1]).max(f64::MIN_POSITIVE)
    }

    /// Distance of a place from the block's own cell over the ground, in world units.
    fn distance(&self, place: [f32; 3], offset: DVec3) -> f64 {
        let at = self.at(place, offset);
        let beyond = [0, 1].map(|axis| {
            let [least, most] = self.block.core.0[axis];
            (least - at[axis]).max(at[axis] - most).max(0.0)
        });
        beyond[0].hypot(beyond[1])
    }

    /// The coarse model's Gaussians beyond what the block's points stand for.
    fn far(&self, dataset: &Dataset, coarse: &Splats) -> Vec<usize> {
        let offset = dataset.capture.offset;
        let (near, bounds) = (self.near(offset), self.region(self.job.bounds, offset));
        let [lowest, highest] = self.job.heights;
        let headroom = HEADROOM * (highest - lowest);
        let is_far = |&i: &usize| {
            let place = coarse.means[i];
            let height = (self.job.ground).height(DVec3::from(place.map(f64::from)) + offset);
            let level = (lowest - headroom..=highest + headroom).contains(&height);
            let size = coarse.log_scales[i].into_iter().fold(f32::MIN, f32::max);
            // What is not the block's own but covers its cell is gone once it is cropped.
            let beyond = self.distance(place, offset);
            let reaches = beyond > 0.0 && beyond < REACH * f64::from(size).exp();
            !(reaches || level && near.holds(place) && bounds.holds(place))
        };
        (0..coarse.len()).filter(is_far).collect()
    }
}

/// Those that photos of the dataset show, at most so many: the ones that show largest.
fn most_shown(dataset: &Dataset, splats: &Splats, some: Vec<usize>, room: usize) -> Vec<usize> {
    let opacities: Vec<f64> = splats.opacities().collect();
    let mut shown: Vec<(f64, usize)> = (some.into_iter())
        .map(|i| {
            let place = DVec3::from(splats.means[i].map(f64::from));
            let size = (splats.log_scales[i].iter()).map(|&s| f64::from(s).exp());
            let size = size.fold(0.0, f64::max);
            let of_views = dataset.cameras.iter().map(|camera| {
                let depth = camera.depth(place);
                // Its middle may lie outside of a picture that shows its edge.
                match shows(camera, place, size) {
                    true => opacities[i] * (camera.fx * size / depth).powi(2),
                    false => 0.0,
                }
            });
            (of_views.fold(0.0, f64::max), i)
        })
        .filter(|&(area, _)| area > 0.0)
        .collect();
    shown.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    shown.truncate(room);
    let mut kept: Vec<usize> = shown.into_iter().map(|(_, i)| i).collect();
    kept.sort_unstable();
    kept
}

/// Returns true if a camera shows any of a ball with a standard deviation of `deviation`.
pub(super) fn shows(camera: &Camera, middle: DVec3, deviation: f64) -> bool {
    let at = camera.rotation * middle + camera.translation;
    let margin = REACH * deviation * camera.fx.max(camera.fy) / at.z;
    let inside = |pixel: f64, side: u32| pixel > -margin && pixel < f64::from(side) + margin;
    at.z > 0.0
        && inside(camera.fx * at.x / at.z + camera.cx, camera.width)
        && inside(camera.fy * at.y / at.z + camera.cy, camera.height)
}

/// At most so many places: the same come first wherever there are more, so that blocks begin
/// with the same Gaussians where they overlap.
fn evenly(places: &[[f32; 3]], room: usize) -> Vec<usize> {
    let mut order: Vec<(u64, usize)> = (places.iter().zip(0..))
        .map(|(place, i)| {
            let words = place.map(|c| u64::from(c.to_bits()));
            let seed = words.iter().fold(0, |seed: u64, word| {
                (seed ^ word)
                    .wrapping_mul(0x9e37_79b9_7f4a_7c15)
                    .rotate_left(29)
            });
            (fastrand::Rng::with_seed(seed).u64(..), i)
        })
        .collect();
    order.sort_unstable();
    order.truncate(room);
    let mut kept: Vec<usize> = order.into_iter().map(|(_, i)| i).collect();
    kept.sort_unstable();
    kept
}

/// The folder of the job that a block's folder lies in.
pub(super) fn job_of(folder: &Path) -> PathBuf {
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    folder.parent().unwrap_or(&folder).to_owned()
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;

    #[test]
    fn the_same_places_come_first() {
        let mut random = fastrand::Rng::with_seed(3);
        let places: Vec<[f32; 3]> = (0..400).map(|_| [0; 3].map(|_| random.f32())).collect();
        let few = |all: &[[f32; 3]], room| -> Vec<[f32; 3]> {
            evenly(all, room).into_iter().map(|i| all[i]).collect()
        };
        let (all, part) = (few(&places, 100), few(&places[..300], 90));
        assert_eq!(
            (all.len(), part.len(), few(&places, 900).len()),
            (100, 90, 400)
        );
        // Of what both have, the part keeps what the whole keeps.
        let shared: Vec<_> = all
            .iter()
            .filter(|place| places[..300].contains(place))
            .collect();
        assert!(
            shared.len() > 60
                && shared.iter().filter(|place| part.contains(place)).count()
                    >= shared.len().min(90)
        );
    }

    #[test]
    fn a_camera_shows_the_edge_of_what_is_beside_its_picture() {
        let camera = Camera {
            width: 100,
            height: 80,
            fx: 100.0,
            fy: 100.0,
            cx: 50.0,
            cy: 40.0,
            rotation: DMat3::IDENTITY,
            translation: DVec3::ZERO,
        };
        let beside = DVec3::new(6.0, 0.0, 10.0);
        assert!(shows(&camera, beside, 0.5) && !shows(&camera, beside, 0.2));
        assert!(!shows(&camera, -beside, 0.5));
    }
}
