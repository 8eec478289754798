//! `gs-chroma export`.

use std::path::PathBuf;

use clap::Args;

use super::{CliError, next, print, progress::Progress, values::one_of};
use crate::{
    run::{ExportOptions, Exported, export},
    splats::SpzVersion,
};

const SPZ_VERSIONS: &[(SpzVersion, &str)] = &[
    (SpzVersion::V3, "One gzip stream, which more viewers read"),
    (SpzVersion::V4, "Zstandard streams: smaller"),
];

/// Write a run's scene, or another splat file, in the format that the file's name tells: .ply,
/// .compressed.ply, .splat, .spz, .sog, .glb or .usda.
#[derive(Args)]
pub struct Export {
    /// Run folder or splat file [default: newest run under runs/].
    run: Option<PathBuf>,
    /// Splat file to write.
    #[arg(
        short,
        long,
        value_name = "FILE.ply|.compressed.ply|.splat|.spz|.sog|.glb|.usda"
    )]
    output: PathBuf,
    /// Write the luminance although the scene is colored.
    #[arg(long)]
    luma: bool,
    /// Write COLMAP's coordinates even where the scene was moved to the origin.
    #[arg(long)]
    colmap_coordinates: bool,
    /// Version of an .spz file [default: 3].
    #[arg(long, value_name = "VERSION", value_parser = one_of(SPZ_VERSIONS))]
    spz_version: Option<SpzVersion>,
    /// Print what was written as JSON.
    #[arg(long)]
    json: bool,
}

impl Export {
    pub(super) fn run(self) -> Result<(), CliError> {
        let options = ExportOptions {
            run: self.run,
            output: self.output,
            luma: self.luma,
            colmap_coordinates: self.colmap_coordinates,
            spz: self.spz_version,
        };
        let mut progress = Progress::through(options.stages());
        let wrote = export(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        if self.json {
            return print(format_args!("{:#}", serde_json::json!(wrote)));
        }
        print(format_args!(
            "wrote {} Gaussians to {}",
            wrote.splats,
            options.output.display()
        ))?;
        print(cost(&wrote))?;
        if wrote.offset != [0.0; 3] {
            let [x, y, z] = wrote.offset;
            let said = match wrote.tells_offset {
                true => "as its header says",
                false => "which its format has no place for",
            };
            print(format_args!(
                "its coordinates are COLMAP's less {x} {y} {z}, {said} (--colmap-coordinates for COLMAP's own)"
            ))?;
        }
        progress.close(&[], &next::view(&options.output))
    }
}

/// What the format takes and costs.
fn cost(wrote: &Exported) -> String {
    let bytes = wrote.bytes as f64 / wrote.splats.max(1) as f64;
    let loss = &wrote.loss;
    match (loss.psnr, loss.delta_e) {
        (Some(psnr), Some(delta_e)) => format!(
            "{bytes:.1} bytes a Gaussian, {psnr:.1} dB, ΔE00 {delta_e:.2} against the scene ({} {})",
            loss.views, loss.measured
        ),
        _ => format!("{bytes:.1} bytes a Gaussian, {}", loss.measured),
    }
}
