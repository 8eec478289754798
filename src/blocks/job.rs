//! The files of a job: `job.json` with the plan, and in each block's folder a `block.json` that
//! makes it a folder for `fit`.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use super::{Area, BlocksError, Estimate, Ground};
use crate::{capture::Chosen, disk::trust, hash::Hasher, input};

/// Version of both files' layout; raised when a key changes its meaning.
pub const JOB_VERSION: u32 = 1;

/// The folder of the coarse model.
pub const COARSE: &str = "coarse";

const JOB: &str = "job.json";
const BLOCK: &str = "block.json";

/// `job.json`: how a capture is divided.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Job {
    /// [`JOB_VERSION`].
    pub version: u32,
    /// Version of the program.
    pub program: String,
    /// The COLMAP folder, absolute; one that is not is seen from the job's folder.
    pub capture: PathBuf,
    /// The same, seen from the job's folder: both may be moved together.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nearby: Option<PathBuf>,
    /// The ground plane of the areas.
    pub ground: Ground,
    /// Margin by which blocks train beyond their own cells, as a share of a cell's length.
    pub overlap: f64,
    /// Photos with a pose.
    pub photos: usize,
    /// Those of them that are held out.
    pub held_out: usize,
    /// Triangulated points.
    pub points: usize,
    /// Area of the ground that holds all but the farthest points.
    pub bounds: Area,
    /// The heights between which all but the farthest points lie, in world units along `up`.
    pub heights: [f64; 2],
    /// The whole scene in one training.
    pub whole: Estimate,
    /// The coarse model.
    pub coarse: Estimate,
    pub blocks: Vec<Block>,
}

/// Plan of a block.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Block {
    /// The name of its folder.
    pub name: String,
    /// The cell of which its Gaussians are kept.
    pub core: Area,
    /// The cell with its margin, on which it is trained.
    pub near: Area,
    pub photos: usize,
    /// Those of them that are held out.
    pub held_out: usize,
    /// Points above its own cell.
    pub points: usize,
    /// Expected Gaussians, memory and time of its training.
    pub estimate: Estimate,
}

/// Kind of training that a job's folder is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// All photos, small, with few Gaussians.
    Coarse,
    /// Those of a block.
    Block,
}

/// `block.json`: what `fit` is to train on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BlockFile {
    /// [`JOB_VERSION`].
    pub version: u32,
    /// Kind of training.
    pub kind: Kind,
    pub photos: Chosen,
    /// Its Gaussians, at most, where that was asked for.
    pub max_splats: Option<usize>,
    /// Its iterations, where the preset's may be too few.
    pub iterations: Option<usize>,
}

impl Job {
    /// Factor on a block's learning rates. Adam's steps are alike whatever the gradient: a
    /// Gaussian in a share p of the photos moves by √p an iteration, and a block has fewer
    /// iterations by the share of its photos (docs/large-scenes.md).
    pub fn haste(&self, block: &Block) -> f64 {
        let train = |photos: usize, held_out| photos.saturating_sub(held_out).max(1) as f64;
        let whole = train(self.photos, self.held_out);
        (whole / train(block.photos, block.held_out)).sqrt()
    }

    /// The file in a job's folder.
    pub fn path(folder: &Path) -> PathBuf {
        folder.join(JOB)
    }

    /// Reads that of a job's folder.
    ///
    /// # Errors
    /// [`BlocksError::File`] where there is none, or it is damaged or of another version.
    pub fn read(folder: &Path) -> Result<Self, BlocksError> {
        let path = Self::path(folder);
        if !path.is_file() {
            return Err(BlocksError::File {
                path: folder.to_owned(),
                reason: "is no job: make one with `gs-chroma partition`".to_owned(),
            });
        }
        let mut job: Self = read(&path)?;
        let names: BTreeSet<&str> = job.blocks.iter().map(|block| &*block.name).collect();
        let is_name = |name: &&str| trust::is_entry(name) && *name != COARSE;
        if names.is_empty() || names.len() != job.blocks.len() || !names.iter().all(is_name) {
            let reason = "its blocks have no names of folders, or not each its own";
            return Err(damaged(&path, reason));
        }
        for name in names.into_iter().chain([COARSE]) {
            refuse_link(&folder.join(name))?;
        }
        let places = [Some(&job.capture), job.nearby.as_ref()].map(|place| {
            let place = folder.join(place?);
            place.is_dir().then_some(place)
        });
        let Some(found) = places.into_iter().flatten().next() else {
            return Err(BlocksError::File {
                path,
                reason: format!(
                    "its photos are not at {}: put the COLMAP folder there, or write where it is at \"capture\"",
                    job.capture.display()
                ),
            });
        };
        job.capture = found.canonicalize().unwrap_or(found);
        Ok(job)
    }

    /// SHA-256 of what is planned of a block: where it lies, and its photos.
    pub fn plan_of(&self, block: &Block, file: &BlockFile) -> String {
        let mut hash = Hasher::default();
        hash.update(&to_file(&(self.ground, block.core, block.near)));
        hash.update(&to_file(&file.photos));
        hash.finish()
    }

    /// Notes where the COLMAP folder lies, seen from the job's; both are absolute.
    pub fn note_nearby(&mut self, folder: &Path) {
        let (mut up, mut from) = (PathBuf::new(), Some(folder));
        while let Some(above) = from {
            if let Ok(down) = self.capture.strip_prefix(above) {
                self.nearby = Some(up.join(down));
                return;
            }
            up.push("..");
            from = above.parent();
        }
    }

    /// The bytes of the file.
    pub fn to_file(&self) -> Vec<u8> {
        to_file(self)
    }

    pub fn block(&self, name: &str) -> Option<&Block> {
        self.blocks.iter().find(|block| block.name == name)
    }
}

impl BlockFile {
    /// The file in a block's folder.
    pub fn path(folder: &Path) -> PathBuf {
        folder.join(BLOCK)
    }

    /// Reads that of a block's folder; none where the folder is no block's.
    ///
    /// # Errors
    /// [`BlocksError::File`] where it is damaged or of another version.
    pub fn read(folder: &Path) -> Result<Option<Self>, BlocksError> {
        let path = Self::path(folder);
        path.is_file().then(|| read(&path)).transpose()
    }

    /// The bytes of the file.
    pub fn to_file(&self) -> Vec<u8> {
        to_file(self)
    }
}

/// Refuses a folder of a job that lies elsewhere.
pub fn refuse_link(folder: &Path) -> Result<(), BlocksError> {
    match folder.is_symlink() {
        true => Err(BlocksError::File {
            path: folder.to_owned(),
            reason: "is a link: put the folder itself there".to_owned(),
        }),
        false => Ok(()),
    }
}

fn to_file(value: &impl Serialize) -> Vec<u8> {
    // Plain structs with string keys: serializing them cannot fail.
    let text = serde_json::to_string_pretty(value).unwrap_or_default();
    (text + "\n").into_bytes()
}

fn damaged(path: &Path, reason: &str) -> BlocksError {
    BlocksError::File {
        path: path.to_owned(),
        reason: format!("damaged ({reason}): run `gs-chroma partition` again"),
    }
}

/// The version field of a job's file.
#[derive(Deserialize)]
struct Version {
    version: u32,
}

fn read<T: DeserializeOwned>(path: &Path) -> Result<T, BlocksError> {
    let text = input::read_to_string(path).map_err(|error| BlocksError::File {
        path: path.to_owned(),
        reason: error.to_string(),
    })?;
    let wrong = |error: serde_json::Error| damaged(path, &error.to_string());
    let Version { version } = serde_json::from_str(&text).map_err(wrong)?;
    if version != JOB_VERSION {
        return Err(BlocksError::File {
            path: path.to_owned(),
            reason: format!(
                "has version {version}, this program reads {JOB_VERSION}: run `gs-chroma partition` again"
            ),
        });
    }
    serde_json::from_str(&text).map_err(wrong)
}
