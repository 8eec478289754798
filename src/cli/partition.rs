//! `gs-chroma partition`.

use std::path::PathBuf;

use clap::Args;

use super::{
    CliError, next, print,
    progress::Progress,
    values::{folder, mebibytes, share},
};
use crate::{
    blocks::{Blocks, Division, Estimate, Job},
    report::Table,
    run::{PartitionOptions, partition},
};

/// Divide a large capture into blocks, to be trained one by one.
///
/// `merge` puts them together.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma partition survey -o job --blocks 4
  gs-chroma fit job/coarse
  gs-chroma fit job/block-1")]
pub struct Partition {
    /// COLMAP folder with images/ and sparse/, or one with transforms.json.
    colmap_dir: PathBuf,
    /// Job folder to write.
    #[arg(short, long, value_name = "JOB", value_parser = folder())]
    output: PathBuf,
    /// Number of blocks, or a grid of them [default: one for every 400 photos, or as many as
    /// --memory-limit asks for].
    #[arg(long, value_name = "N|MxN")]
    blocks: Option<Blocks>,
    /// How far a block trains beyond its own cell, as a share of the cell's length.
    #[arg(long, value_name = "0..1", default_value = "0.15", value_parser = share::<f64>)]
    overlap: f64,
    /// Gaussians of the whole scene, shared among the blocks [default: each block has its
    /// preset's].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    max_splats: Option<u32>,
    /// Longer side that photos will be trained at, for the estimates [default: as they are].
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(16..))]
    max_side: Option<u32>,
    /// Divide until every block is expected to need no more of the device's memory than this.
    #[arg(long, value_name = "MIB", value_parser = mebibytes())]
    memory_limit: Option<u64>,
    /// Train on all photos, and measure on none.
    #[arg(long)]
    no_holdout: bool,
    /// Print the plan as JSON.
    #[arg(long)]
    json: bool,
}

impl Partition {
    pub(super) fn run(self) -> Result<(), CliError> {
        let options = PartitionOptions {
            colmap_dir: self.colmap_dir,
            output: self.output,
            division: Division {
                blocks: self.blocks,
                overlap: self.overlap,
                max_splats: self.max_splats.map(|splats| splats as usize),
                max_side: self.max_side,
                memory_limit: self.memory_limit,
                holdout: !self.no_holdout,
            },
        };
        let mut progress = Progress::through(options.stages());
        let job = partition(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        if self.json {
            let text = String::from_utf8_lossy(&job.to_file()).into_owned();
            return print(text.trim_end());
        }
        print(table(&job))?;
        let wrote = Job::path(&options.output);
        progress.close(&[&wrote], &next::fit(&options.output.join("coarse")))
    }
}

/// Blocks and what they are expected to take.
fn table(job: &Job) -> Table {
    let row = |name: &str, counts: [usize; 3], estimate: &Estimate| {
        let mut cells = vec![name.to_owned()];
        cells.extend(counts.iter().map(usize::to_string));
        cells.push(estimate.splats.to_string());
        cells.push(estimate.memory.div_ceil(1 << 20).to_string());
        cells.push(format!("{:.2}", estimate.time));
        cells
    };
    let all = [job.photos, job.held_out, job.points];
    let mut rows = vec![
        row("undivided", all, &job.whole),
        row("coarse", all, &job.coarse),
    ];
    rows.extend(job.blocks.iter().map(|block| {
        let counts = [block.photos, block.held_out, block.points];
        row(&block.name, counts, &block.estimate)
    }));
    let head = [
        "block",
        "photos",
        "held out",
        "points",
        "Gaussians",
        "MiB",
        "time",
    ];
    Table {
        title: format!("{} blocks", job.blocks.len()),
        head: head.map(str::to_owned).to_vec(),
        rows,
        notes: vec![
            "Estimates: Gaussians at the end, the device's memory at most, and time against one training of all photos with as many epochs.".to_owned(),
        ],
    }
}
