//! From a capture to blocks.

use std::{collections::BTreeSet, path::PathBuf};

use super::{
    Area, Block, BlockFile, Blocks, BlocksError, Estimate, Ground, JOB_VERSION, Job, Kind,
    PhotoCoverage,
    cells::{Cell, GroundWork, MOST, ends},
};
use crate::{
    capture::{Camera, Capture, Chosen, split},
    luma::{LumaSettings, Preset},
};

/// Photos of a block, where nobody says how many blocks there are to be: as many as a scene of
/// the usual benchmarks has, or twice.
const PHOTOS: usize = 400;

/// A block with fewer photos to train on is joined with its neighbor: it is hardly constrained.
const FEWEST: usize = 8;

/// A photo is a block's where at least this share of its observations are above the block's
/// cell and margin. What it shows besides costs time, and what it shows of the block may be all
/// that is known of a corner. With 0.05 the blocks of docs/large-scenes.md take 12 % more iterations
/// for 0.01 dB across borders and inside (one seed).
const SHARE: f64 = 0.1;

/// The same for a photo that was taken above the block's own cell.
const SHARE_WITHIN: f64 = 0.02;

/// The farthest points at each end of the ground that do not say how far it reaches.
const FAR: f64 = 0.01;

/// Gaussians that a scene is expected to have for each of its points.
const SPLATS_PER_POINT: usize = 10;

/// Gaussians of the coarse model, as a part of all; and how many there are at least.
const COARSE_PART: usize = 12;
const COARSE_LEAST: usize = 1000;

/// Gaussians from the coarse model, beyond a block's margin, as a part of the block's own.
pub const FAR_PART: usize = 16;

/// Least number of times that the coarse model's training sees each photo.
const COARSE_EPOCHS: usize = 5;

/// Options of dividing a capture.
#[derive(Clone, Debug, PartialEq)]
pub struct Division {
    /// Number of blocks; by default as many as the memory limit or the photos require.
    pub blocks: Option<Blocks>,
    /// Margin by which blocks train beyond their own cells, as a share of a cell's length.
    pub overlap: f64,
    /// Gaussians of the whole scene; by default each block may have its preset's.
    pub max_splats: Option<usize>,
    /// The longer side that photos will be trained at, for estimates; as they are by default.
    pub max_side: Option<u32>,
    /// Bytes of the device that no block's training is to exceed.
    pub memory_limit: Option<u64>,
    /// True if every 8th photo is held out.
    pub holdout: bool,
}

/// A division, with what belongs into the folders of the coarse model and of each block.
#[derive(Clone, Debug, PartialEq)]
pub struct PartitionPlan {
    /// `job.json`.
    pub job: Job,
    /// `block.json` of the coarse model.
    pub coarse: BlockFile,
    /// `block.json` of each block.
    pub blocks: Vec<BlockFile>,
    /// Warnings about the division, a line each.
    pub warnings: Vec<String>,
}

/// Divides a capture; `root` is its folder's absolute path.
pub fn plan(
    capture: &Capture,
    root: PathBuf,
    division: &Division,
) -> Result<PartitionPlan, BlocksError> {
    let scene = Scene::of(capture, division);
    let photos = scene.photos.len();
    let counts = match (division.blocks, division.memory_limit) {
        (Some(blocks), _) => vec![blocks],
        (None, None) => vec![Blocks::Count(photos.div_ceil(PHOTOS).clamp(1, MOST))],
        (None, Some(_)) => (0..)
            .flat_map(|power| [1 << power, 3 << power >> 1])
            .filter(|&count| count > 0)
            .take_while(|&count| count <= MOST.min(photos))
            .map(Blocks::Count)
            .collect(),
    };
    let (mut found, mut least) = (None, u64::MAX);
    for blocks in counts {
        let divided = scene.divided(blocks);
        let needed = divided.iter().map(|(block, _)| block.estimate.memory).max();
        least = least.min(needed.unwrap_or(0));
        let fits = division.memory_limit.is_none_or(|limit| least <= limit);
        // Who says how many blocks has them, whatever they need.
        if fits || division.blocks.is_some() {
            found = Some((blocks, divided));
            break;
        }
    }
    let Some((asked, divided)) = found else {
        return Err(BlocksError::MemoryLimit {
            limit: division.memory_limit.unwrap_or(0) >> 20,
            needed: least.div_ceil(1 << 20),
            photos,
        });
    };
    let warnings = doubts(division, asked, &divided);
    Ok(scene.planned(root, divided, warnings))
}

/// Warnings about a division, a line each.
fn doubts(division: &Division, asked: Blocks, divided: &[(Block, Chosen)]) -> Vec<String> {
    let mut warnings = Vec::new();
    if divided.len() < asked.count() {
        warnings.push(format!(
            "{} blocks instead of {asked}: others would have fewer than {FEWEST} photos to train on, or no room of their own",
            divided.len()
        ));
    }
    let limit = division.memory_limit.unwrap_or(u64::MAX);
    for (block, _) in divided {
        if block.estimate.memory > limit {
            warnings.push(format!(
                "{} is expected to need {} MiB, more than {}: divide into more blocks",
                block.name,
                block.estimate.memory.div_ceil(1 << 20),
                limit >> 20
            ));
        }
    }
    warnings
}

/// Ground, points and photos of a capture, as a division needs them.
struct Scene<'a> {
    capture: &'a Capture,
    division: &'a Division,
    ground: Ground,
    /// Position of each point on the ground, and its number of observations.
    places: Vec<[f64; 2]>,
    weights: Vec<f32>,
    bounds: Area,
    heights: [f64; 2],
    /// The photos' names, sorted, and whether each is held out.
    photos: Vec<String>,
    held_out: Vec<bool>,
    /// Cameras of each photo's views, at working size.
    cameras: Vec<Vec<Camera>>,
    /// Camera center of each photo on the ground.
    stands: Vec<[f64; 2]>,
    /// Gaussians of the whole, as asked or expected.
    splats: usize,
}

impl<'a> Scene<'a> {
    fn of(capture: &'a Capture, division: &'a Division) -> Self {
        let ground = Ground::of(capture);
        let world = |position| position + capture.offset;
        let places: Vec<[f64; 2]> = (capture.points.iter())
            .map(|point| ground.place(world(point.position)))
            .collect();
        let weights = (capture.points.iter())
            .map(|point| point.track.len().max(1) as f32)
            .collect();
        let middle = |values: Vec<f64>| {
            let mut values = values;
            ends(&mut values, FAR).unwrap_or_default()
        };
        let bounds = [0, 1].map(|axis| middle(places.iter().map(|p| p[axis]).collect()));
        let heights = (capture.points.iter())
            .map(|point| ground.height(world(point.position)))
            .collect();
        let held_out: BTreeSet<usize> = (split(&capture.views, division.holdout).test)
            .into_iter()
            .collect();
        let mut scene = Self {
            capture,
            division,
            ground,
            weights,
            bounds: Area(bounds),
            heights: middle(heights),
            photos: Vec::new(),
            held_out: Vec::new(),
            cameras: Vec::new(),
            stands: Vec::new(),
            splats: division
                .max_splats
                .unwrap_or(SPLATS_PER_POINT * places.len()),
            places,
        };
        for (index, view) in capture.views.iter().enumerate() {
            if scene.photos.last() != Some(&view.photo) {
                scene.photos.push(view.photo.clone());
                scene.held_out.push(held_out.contains(&index));
                scene.cameras.push(Vec::new());
                let place = ground.place(world(view.camera.center()));
                scene.stands.push(place);
            }
            if let Some(cameras) = scene.cameras.last_mut() {
                cameras.push(at_side(&view.camera, division.max_side));
            }
        }
        scene
    }

    /// Blocks that all have enough photos, with these.
    fn divided(&self, blocks: Blocks) -> Vec<(Block, Chosen)> {
        let work = GroundWork {
            places: &self.places,
            weights: &self.weights,
        };
        let mut cell = work.balanced(blocks, |core| self.near(core));
        loop {
            let cores = cell.leaves();
            let near: Vec<Area> = cores.iter().map(|core| self.near(core)).collect();
            let chosen = self.chosen(&cores, &near);
            let poorest = (0..cores.len()).min_by_key(|&block| chosen[block].train.len());
            match poorest {
                Some(block) if cores.len() > 1 && chosen[block].train.len() < FEWEST => {
                    cell.join(block);
                }
                _ => return self.blocks(&cell, &near, chosen),
            }
        }
    }

    /// A cell with its margin, as long along each axis as what it has of the scene.
    fn near(&self, core: &Area) -> Area {
        let finite = core.within(&self.bounds).grown(self.division.overlap);
        Area([0, 1].map(|axis| {
            let ([least, most], [lower, upper]) = (core.0[axis], finite.0[axis]);
            [
                if least.is_finite() {
                    lower.min(least)
                } else {
                    least
                },
                if most.is_finite() {
                    upper.max(most)
                } else {
                    most
                },
            ]
        }))
    }

    /// The photos of each block: those that show enough of it, and every photo at least where
    /// it shows most.
    fn chosen(&self, cores: &[Area], near: &[Area]) -> Vec<Chosen> {
        let seen = PhotoCoverage::count(self.capture, &self.ground, near);
        let mut chosen = vec![Chosen::default(); cores.len()];
        for (photo, name) in self.photos.iter().enumerate() {
            let share = |block: usize| seen.share(block, photo);
            let most = (0..cores.len())
                .rev()
                .max_by(|&a, &b| share(a).total_cmp(&share(b)));
            for (block, core) in cores.iter().enumerate() {
                let stands = core.holds(self.stands[photo]);
                let enough = match (stands, seen.all[photo]) {
                    // Nothing is known but where it was taken.
                    (_, 0) => stands,
                    (true, _) => share(block) >= SHARE_WITHIN,
                    (false, _) => share(block) >= SHARE || most == Some(block),
                };
                if enough {
                    let names = match self.held_out[photo] {
                        true => &mut chosen[block].test,
                        false => &mut chosen[block].train,
                    };
                    names.insert(name.clone());
                }
            }
        }
        chosen
    }

    fn blocks(&self, cell: &Cell, near: &[Area], chosen: Vec<Chosen>) -> Vec<(Block, Chosen)> {
        let all: f64 = self.weights.iter().map(|&weight| f64::from(weight)).sum();
        let of_each = cell.leaves().into_iter().zip(near).zip(chosen);
        (1..)
            .zip(of_each)
            .map(|(number, ((core, &near), chosen))| {
                let (mut points, mut work) = (0, 0.0);
                for (&place, &weight) in self.places.iter().zip(&self.weights) {
                    points += usize::from(core.holds(place));
                    work += if near.holds(place) {
                        f64::from(weight)
                    } else {
                        0.0
                    };
                }
                let own = (self.splats as f64 * work / all.max(1.0)).ceil() as usize;
                let splats = match near == Area::EVERYWHERE {
                    true => own,
                    false => own + (own / FAR_PART).min(self.coarse_splats()),
                };
                let block = Block {
                    name: format!("block-{number}"),
                    core,
                    near,
                    photos: chosen.len(),
                    held_out: chosen.test.len(),
                    points,
                    estimate: self.estimate(splats, true, |name| chosen.has(name)),
                };
                (block, chosen)
            })
            .collect()
    }

    /// Gaussians of the coarse model.
    fn coarse_splats(&self) -> usize {
        (self.splats / COARSE_PART).max(COARSE_LEAST)
    }

    /// Estimate of a training of so many Gaussians on some photos.
    fn estimate(&self, splats: usize, streams: bool, has: impl Fn(&str) -> bool) -> Estimate {
        let of_photos = (self.photos.iter().zip(&self.cameras)).filter(|(name, _)| has(name));
        let share = of_photos.clone().count() as f64 / self.photos.len() as f64;
        let cameras = of_photos.flat_map(|(_, cameras)| cameras);
        let settings = LumaSettings {
            stream_photos: streams,
            ..Preset::Paper.settings()
        };
        Estimate::of(cameras, &settings, splats, share, self.splats)
    }

    fn planned(
        &self,
        root: PathBuf,
        divided: Vec<(Block, Chosen)>,
        warnings: Vec<String>,
    ) -> PartitionPlan {
        let mut photos = Chosen::default();
        for (name, &held_out) in self.photos.iter().zip(&self.held_out) {
            let names = if held_out {
                &mut photos.test
            } else {
                &mut photos.train
            };
            names.insert(name.clone());
        }
        let draft = Preset::Draft.settings();
        let iterations = (COARSE_EPOCHS * photos.train.len()).max(draft.iterations);
        let coarse = BlockFile {
            version: JOB_VERSION,
            kind: Kind::Coarse,
            max_splats: Some(self.coarse_splats()),
            iterations: Some(iterations),
            photos,
        };
        let small = |camera: &Camera| at_side(camera, Preset::Draft.max_side());
        let small: Vec<Camera> = self.cameras.iter().flatten().map(small).collect();
        let of_coarse = self.coarse_splats();
        let (blocks, files) = (divided.into_iter())
            .map(|(block, photos)| {
                let file = BlockFile {
                    version: JOB_VERSION,
                    kind: Kind::Block,
                    photos,
                    max_splats: (self.division.max_splats).map(|_| block.estimate.splats),
                    iterations: None,
                };
                (block, file)
            })
            .unzip();
        PartitionPlan {
            job: Job {
                version: JOB_VERSION,
                program: env!("CARGO_PKG_VERSION").to_owned(),
                capture: root,
                nearby: None,
                ground: self.ground,
                overlap: self.division.overlap,
                photos: self.photos.len(),
                held_out: coarse.photos.test.len(),
                points: self.capture.points.len(),
                bounds: self.bounds,
                heights: self.heights,
                whole: self.estimate(self.splats, false, |_| true),
                coarse: Estimate::of(small.iter(), &draft, of_coarse, 1.0, self.splats),
                blocks,
            },
            coarse,
            blocks: files,
            warnings,
        }
    }
}

/// A camera whose longer side is at most so many pixels.
fn at_side(camera: &Camera, side: Option<u32>) -> Camera {
    let longer = camera.width.max(camera.height);
    let scale = f64::from(side.unwrap_or(longer).min(longer)) / f64::from(longer);
    let size =
        [camera.width, camera.height].map(|side| (f64::from(side) * scale).round().max(1.0) as u32);
    camera.resized(size[0], size[1])
}
