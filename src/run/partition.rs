//! `partition`: a capture divided into blocks.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use super::RunError;
use crate::{
    blocks::{
        BlockFile, BlocksError, COARSE, Division, Job, PartitionPlan, picture, plan, refuse_link,
    },
    capture::{Capture, LoadOptions, Rejected},
    disk,
    store::{
        RunFolder, StoreError, files,
        lock::{LOCK, RunLock},
    },
    tell::{Event, Observer, Stage},
};

/// The plan as a picture, in a job's folder.
const PICTURE: &str = "plan.png";

#[derive(Clone, Debug)]
pub struct PartitionOptions {
    /// The COLMAP folder.
    pub colmap_dir: PathBuf,
    /// The job's folder.
    pub output: PathBuf,
    /// Division into blocks.
    pub division: Division,
}

/// Divides a capture and writes the job's folder; `job.json` appears last.
///
/// # Errors
/// [`RunError`]; a job whose blocks are trained, or are being trained, is not replaced.
pub fn partition(options: &PartitionOptions, observe: &mut Observer<'_>) -> Result<Job, RunError> {
    let folder = &options.output;
    if folder.is_dir() {
        files::make_own_folder(folder, &["job.json", COARSE], &[])?;
    }
    let mut lock = (folder.is_dir().then(|| RunLock::take(folder))).transpose()?;
    let mut held = replaceable(folder)?;
    observe(Event::begins(Stage::Model));
    let capture = Capture::load_with(
        &options.colmap_dir,
        &LoadOptions {
            max_side: options.division.max_side,
            ..LoadOptions::default()
        },
    )?;
    for doubt in &capture.doubts {
        observe(Event::Warning(doubt.clone()));
    }
    for Rejected { name, reason } in &capture.rejected {
        observe(Event::Warning(format!("left out {name}: {reason}")));
    }
    observe(Event::begins(Stage::Dividing));
    let root = fs::canonicalize(&options.colmap_dir).map_err(files::at(&options.colmap_dir))?;
    let PartitionPlan {
        mut job,
        coarse,
        blocks,
        warnings,
    } = plan(&capture, root, &options.division)?;
    for warning in warnings {
        observe(Event::Warning(warning));
    }
    observe(Event::begins(Stage::Saving));
    files::make_folder(folder)?;
    if lock.is_none() {
        lock = Some(RunLock::take(folder)?);
    }
    job.note_nearby(&fs::canonicalize(folder).map_err(files::at(folder))?);
    let names = job.blocks.iter().map(|block| block.name.as_str());
    let folders: Vec<PathBuf> = ([COARSE].into_iter().chain(names))
        .map(|name| folder.join(name))
        .collect();
    for block in &folders {
        refuse_link(block)?;
        if !held.contains_key(block) {
            files::make_folder(block)?;
            held.insert(block.clone(), RunLock::take(block)?);
        }
    }
    let path = Job::path(folder);
    disk::remove(&path).map_err(files::at(&path))?;
    for block in held.keys().filter(|block| !folders.contains(block)) {
        clear(block)?;
    }
    for (block, file) in folders.iter().zip([&coarse].into_iter().chain(&blocks)) {
        files::write(&BlockFile::path(block), &file.to_file())?;
    }
    files::write_png(&folder.join(PICTURE), &picture(&capture, &job))?;
    files::write(&path, &job.to_file())?;
    drop(lock);
    Ok(job)
}

/// The folders of a former job's blocks, which nobody has begun to train, nor can.
///
/// # Errors
/// [`StoreError::File`] where somebody has, [`StoreError::InUse`].
fn replaceable(folder: &Path) -> Result<BTreeMap<PathBuf, RunLock>, RunError> {
    let mut blocks = BTreeMap::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if BlockFile::path(&path).is_file() && !path.is_symlink() {
            blocks.insert(path.clone(), RunLock::take(&path)?);
        }
        let run = RunFolder::at(&path);
        if run.report().exists() || run.checkpoint().exists() {
            return Err(StoreError::file(
                &path,
                "is trained, or being trained: choose another folder with -o, or remove it",
            )
            .into());
        }
    }
    Ok(blocks)
}

/// Makes a folder none of a block; it stays where somebody has put something there.
fn clear(block: &Path) -> Result<(), StoreError> {
    let file = BlockFile::path(block);
    let entries = fs::read_dir(block).map_err(files::at(block))?.flatten();
    let ours = |path: &Path| path == file || path.file_name().is_some_and(|name| name == LOCK);
    let gone = match entries.map(|entry| entry.path()).all(|path| ours(&path)) {
        true => block,
        false => &file,
    };
    disk::remove(gone).map_err(files::at(gone))
}

impl From<BlocksError> for RunError {
    fn from(error: BlocksError) -> Self {
        match error {
            BlocksError::Capture(error) => error.into(),
            BlocksError::File { path, reason } => StoreError::File { path, reason }.into(),
            other => Self::Blocks(other),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(job: &Path, name: &str) -> PathBuf {
        let block = job.join(name);
        fs::create_dir(&block).unwrap();
        fs::write(BlockFile::path(&block), "").unwrap();
        block
    }

    #[test]
    fn a_block_that_is_being_trained_is_not_replaced() {
        let job = tempfile::tempdir().unwrap();
        let [one, two] = ["block-1", "block-2"].map(|name| block(job.path(), name));
        let training = RunLock::take(&two).unwrap();
        let error = replaceable(job.path()).unwrap_err().to_string();
        assert!(error.contains("block-2"), "{error}");
        drop(training);
        let held = replaceable(job.path()).unwrap();
        assert_eq!(held.keys().collect::<Vec<_>>(), [&one, &two]);
        assert!(RunLock::take(&one).is_err());
    }

    #[test]
    fn what_somebody_put_into_a_block_stays() {
        let job = tempfile::tempdir().unwrap();
        let [empty, used] = ["block-1", "block-2"].map(|name| block(job.path(), name));
        fs::write(used.join("notes.txt"), "mine").unwrap();
        for block in [&empty, &used] {
            let _lock = RunLock::take(block).unwrap();
            clear(block).unwrap();
        }
        assert!(!empty.exists() && !BlockFile::path(&used).exists());
        assert!(used.join("notes.txt").exists());
    }
}
