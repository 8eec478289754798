//! `partition`: a capture divided into blocks.

use std::{
    fs,
    path::{Path, PathBuf},
};

use super::{Event, Observer, RunError, RunFolder, Stage, files};
use crate::{
    blocks::{BlockFile, BlocksError, COARSE, Division, Job, Planned, picture, plan},
    capture::{Capture, CaptureOptions, Rejected},
    disk,
};

/// The plan as a picture, in a job's folder.
const PICTURE: &str = "plan.png";

/// What `partition` is asked to do.
#[derive(Clone, Debug)]
pub struct PartitionOptions {
    /// The COLMAP folder.
    pub colmap_dir: PathBuf,
    /// The job's folder.
    pub output: PathBuf,
    /// How it is to be divided.
    pub division: Division,
}

/// Divides a capture and writes the job's folder; `job.json` appears last.
///
/// # Errors
/// [`RunError`]; a job whose blocks are trained, or are being trained, is not replaced.
pub fn partition(options: &PartitionOptions, observe: &mut Observer<'_>) -> Result<Job, RunError> {
    let folder = &options.output;
    let stale = replaceable(folder)?;
    observe(Event::begins(Stage::Model));
    let capture = Capture::load_with(
        &options.colmap_dir,
        &CaptureOptions {
            max_side: options.division.max_side,
            ..CaptureOptions::default()
        },
    )?;
    for Rejected { name, reason } in &capture.rejected {
        observe(Event::Warning(format!("left out {name}: {reason}")));
    }
    observe(Event::begins(Stage::Dividing));
    let root = fs::canonicalize(&options.colmap_dir).map_err(files::at(&options.colmap_dir))?;
    let Planned {
        job,
        coarse,
        blocks,
        warnings,
    } = plan(&capture, root, &options.division)?;
    for warning in warnings {
        observe(Event::Warning(warning));
    }
    observe(Event::begins(Stage::Saving));
    files::make_folder(folder)?;
    let path = Job::path(folder);
    disk::remove(&path).map_err(files::at(&path))?;
    for block in stale {
        disk::remove(&block).map_err(files::at(&block))?;
    }
    let names = job.blocks.iter().map(|block| block.name.as_str());
    for (name, file) in [COARSE]
        .into_iter()
        .chain(names)
        .zip([&coarse].into_iter().chain(&blocks))
    {
        let block = folder.join(name);
        files::make_folder(&block)?;
        files::write(&BlockFile::path(&block), &file.to_file())?;
    }
    files::write_png(&folder.join(PICTURE), &picture(&capture, &job))?;
    files::write(&path, &job.to_file())?;
    Ok(job)
}

/// The folders of a former job's blocks, which nobody has begun to train.
///
/// # Errors
/// [`RunError::File`] where somebody has.
fn replaceable(folder: &Path) -> Result<Vec<PathBuf>, RunError> {
    let mut blocks = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let run = RunFolder::at(&path);
        if run.report().exists() || run.checkpoint().exists() {
            return Err(RunError::File {
                path,
                reason: "is trained, or being trained: choose another folder with -o, or remove it"
                    .to_owned(),
            });
        }
        if BlockFile::path(&path).is_file() {
            blocks.push(path);
        }
    }
    Ok(blocks)
}

impl From<BlocksError> for RunError {
    fn from(error: BlocksError) -> Self {
        match error {
            BlocksError::Capture(error) => error.into(),
            BlocksError::File { path, reason } => Self::File { path, reason },
            other => Self::Blocks(other),
        }
    }
}
