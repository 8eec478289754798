//! `gs-chroma export`.

use std::path::PathBuf;

use clap::{ArgGroup, Args};

use super::{
    CliError,
    headings::{INPUT, OUTPUT, QUALITY},
    next, print,
    progress::Progress,
    values::one_of,
};
use crate::{
    run::{ExportOptions, Exported, ViewedScene, ViewerCameras, export},
    tell::{Event, Stage},
    view::{is_html, write_html},
    viewers::ViewerChoice,
};

const VIEWERS: &[(ViewerChoice, &str)] = &[
    (ViewerChoice::Spark, "Spark"),
    (ViewerChoice::PlayCanvas, "PlayCanvas and SuperSplat"),
    (ViewerChoice::Any, "A compromise for all viewers"),
];

/// Write a scene for viewers, as a splat file or one HTML page.
///
/// The extension chooses the format: .ply, .compressed.ply, .splat, .spz, .sog, .glb, .usda or
/// .html. The file is read back, and its loss reported.
#[derive(Args)]
#[command(group(ArgGroup::new("before cameras").multiple(true)))]
#[command(after_long_help = "Example:
  gs-chroma export runs/house -o house.sog
  gs-chroma export house.ply -o house.spz
  gs-chroma export runs/house -o house.html")]
pub struct Export {
    /// Run folder or splat file [default: newest run under runs/].
    run: Option<PathBuf>,
    /// File to write: .ply, .compressed.ply, .splat, .spz, .sog, .glb, .usda or .html.
    #[arg(short, long, value_name = "FILE", help_heading = OUTPUT)]
    output: PathBuf,
    /// Write the gray scene of a colored run.
    #[arg(long, help_heading = INPUT)]
    luma: bool,
    /// Write COLMAP's coordinates, even of a moved scene.
    #[arg(long, help_heading = OUTPUT)]
    colmap_coordinates: bool,
    /// Leave out Gaussians that no training view needs.
    #[arg(long, help_heading = QUALITY, group = "before cameras")]
    clean: bool,
    /// Fit scales, opacities and colors to what this viewer draws.
    #[arg(long, help_heading = QUALITY, group = "before cameras", value_parser = one_of(VIEWERS))]
    viewer: Option<ViewerChoice>,
    /// Keep opacities for viewers that antialias.
    ///
    /// By Mip-Splatting; the file is marked so.
    #[arg(long, help_heading = QUALITY, conflicts_with = "viewer")]
    antialiased: bool,
    /// COLMAP folder of splats or a moved run, for --clean and --viewer.
    #[arg(long, help_heading = INPUT, value_name = "COLMAP_DIR", requires = "before cameras")]
    colmap: Option<PathBuf>,
    /// Print what was written as JSON.
    #[arg(long, help_heading = OUTPUT)]
    json: bool,
}

impl Export {
    /// The request of a splat file.
    pub(super) fn options(self) -> ExportOptions {
        ExportOptions {
            run: self.run,
            output: self.output,
            luma: self.luma,
            colmap_coordinates: self.colmap_coordinates,
            clean: self.clean,
            viewer: self.viewer,
            antialiased: self.antialiased,
            colmap: self.colmap,
        }
    }

    pub(super) fn run(self) -> Result<(), CliError> {
        if is_html(&self.output) {
            return self.run_html();
        }
        let json = self.json;
        let options = self.options();
        let mut progress = Progress::through(options.stages());
        let wrote = export(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        if json {
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
        if let Some(cleaned) = &wrote.cleaned {
            print(format_args!(
                "left out {} Gaussians that no training view needs; {:.1} dB against the scene with them",
                cleaned.dropped, cleaned.psnr
            ))?;
        }
        if !wrote.shown.is_empty() {
            print(line_of(&wrote.shown))?;
        }
        progress.close(&[], &next::view(&options.output))
    }

    /// The page with the scene in it.
    fn run_html(self) -> Result<(), CliError> {
        let mut progress = Progress::through(vec![Stage::Model, Stage::Rendering, Stage::Saving]);
        let of_files = [
            ("--clean", self.clean),
            ("--viewer", self.viewer.is_some()),
            ("--antialiased", self.antialiased),
            ("--colmap-coordinates", self.colmap_coordinates),
        ];
        for (name, _) in of_files.into_iter().filter(|(_, asked)| *asked) {
            let told = format!("{name} is for splat files: the page is written without");
            progress.show(&Event::Warning(told));
        }
        let viewed = ViewedScene::open(self.run.as_deref(), None, &mut |event| {
            progress.show(&event)
        })?;
        let observe = &mut |event| progress.show(&event);
        let wrote = write_html(&viewed, self.luma, &self.output, observe)?;
        progress.finish();
        if self.json {
            let wrote = serde_json::json!({
                "file": self.output, "splats": wrote.splats, "bytes": wrote.bytes,
            });
            return print(format_args!("{wrote:#}"));
        }
        print(format_args!(
            "wrote {} Gaussians to {}, {:.1} MB",
            wrote.splats,
            self.output.display(),
            wrote.bytes as f64 / 1e6
        ))?;
        progress.close(&[], &next::look(&self.output))
    }
}

/// PSNR in each viewer, with and without cameras fitted to it.
fn line_of(shown: &[ViewerCameras]) -> String {
    let each = |of: fn(&ViewerCameras) -> f64| {
        let each = (shown.iter()).map(|s| format!("{} {:.1} dB", s.viewer, of(s)));
        each.collect::<Vec<_>>().join(", ")
    };
    format!(
        "viewers show the rendered views: {}; unfitted {}",
        each(|shown| shown.after),
        each(|shown| shown.before)
    )
}

/// Bytes per Gaussian and loss of the format.
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
