//! `gs-chroma render`.

use std::path::{Path, PathBuf};

use clap::{Args, CommandFactory, error::ErrorKind};

use super::{
    Cli, CliError, next, print,
    progress::Progress,
    values::{Rate, one_of, positive, rate},
};
use crate::run::{PathOptions, RenderOptions, Rendered, Views, Way, is_film, render, render_path};

const VIEWS: &[(Views, &str)] = &[
    (Views::Train, "Those trained on"),
    (Views::Test, "Those held out"),
    (Views::All, "All"),
];

/// Draw a scene from the photographed viewpoints, one PNG a view, or along a path.
#[derive(Args)]
pub struct Render {
    /// Run folder, or a splat file: with --colmap, or along a path [default: newest under runs/].
    run: Option<PathBuf>,
    /// COLMAP folder with the cameras, when it is not where `fit` found it.
    #[arg(long, value_name = "COLMAP_DIR")]
    colmap: Option<PathBuf>,
    /// Which views [default: those held out, or all where none is].
    #[arg(long, value_parser = one_of(VIEWS), conflicts_with = "path")]
    views: Option<Views>,
    /// Draw luma.ply although color.ply is there.
    #[arg(long)]
    luma: bool,
    /// Folder to write the pictures to.
    #[arg(short, long, value_name = "DIR", required_unless_present_any = ["video", "save_path"])]
    output: Option<PathBuf>,
    #[command(flatten)]
    path: PathArguments,
}

#[derive(Args)]
#[command(next_help_heading = "Along a path")]
struct PathArguments {
    /// Draw along a path: around the scene, through the photos' viewpoints, or as a file says
    /// (camera_path.json of nerfstudio, transforms.json, cameras.json of 3DGS; document.json or
    /// settings.json of SuperSplat).
    #[arg(long, value_name = "orbit|photos|FILE.json", value_parser = way)]
    path: Option<Way>,
    /// Film to write (.mp4, .mov, .mkv), by ffmpeg.
    #[arg(long, value_name = "FILM", requires = "path", value_parser = film)]
    video: Option<PathBuf>,
    /// Frames a second: 24, or 24000/1001 [default: as the file says, or 24].
    #[arg(long, value_name = "RATE", requires = "path", value_parser = rate)]
    fps: Option<Rate>,
    /// How long the path takes, in seconds, unless a file says it [default: 10].
    #[arg(long, requires = "path", value_parser = positive::<f64>)]
    seconds: Option<f64>,
    /// Size of a picture in pixels [default: as the file says, or the photos', or 1280x720].
    #[arg(long, value_name = "WxH", requires = "path", value_parser = size)]
    size: Option<Size>,
    /// Draw the gray scene left of the colored one.
    #[arg(long, requires = "path", conflicts_with = "luma")]
    side_by_side: bool,
    /// Write the path itself, as nerfstudio's camera_path.json in COLMAP's coordinates.
    #[arg(long, value_name = "FILE.json", requires = "path")]
    save_path: Option<PathBuf>,
}

#[derive(Clone, Copy)]
struct Size([u32; 2]);

/// Width and height in pixels.
fn size(text: &str) -> Result<Size, String> {
    let side = |text: &str| text.parse().ok().filter(|side| (2..=16384).contains(side));
    let sides = text
        .split_once('x')
        .map(|(width, height)| [side(width), side(height)]);
    match sides {
        Some([Some(width), Some(height)]) => Ok(Size([width, height])),
        _ => Err("no size: 1280x720, with 2 to 16384 pixels a side".to_owned()),
    }
}

fn way(text: &str) -> Result<Way, String> {
    match text {
        "orbit" => Ok(Way::Orbit),
        "photos" => Ok(Way::Photos),
        file if file.to_ascii_lowercase().ends_with(".json") => Ok(Way::File(file.into())),
        _ => Err("must be orbit, photos or a .json file".to_owned()),
    }
}

fn film(text: &str) -> Result<PathBuf, String> {
    match is_film(Path::new(text)) {
        true => Ok(text.into()),
        false => Err("no film: name it .mp4, .mov, .m4v or .mkv".to_owned()),
    }
}

impl Render {
    pub(super) fn run(self) -> Result<(), CliError> {
        let next = match &self.run {
            // What is drawn is a file already.
            Some(file) if file.is_file() => next::view(file),
            run => next::export(run.as_deref()),
        };
        match self.path.path.clone() {
            Some(way) => self.along(way, &next),
            None => self.views(&next),
        }
    }

    fn views(self, next: &str) -> Result<(), CliError> {
        let options = RenderOptions {
            run: self.run,
            colmap: self.colmap,
            views: self.views,
            luma: self.luma,
            // Required without a path.
            output: self.output.unwrap_or_default(),
        };
        let mut progress = Progress::through(options.stages());
        let count = render(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        print(format_args!(
            "wrote {count} pictures to {}",
            options.output.display()
        ))?;
        progress.close(&[], next)
    }

    fn along(self, way: Way, next: &str) -> Result<(), CliError> {
        if let (Way::File(file), Some(_)) = (&way, self.path.seconds) {
            let reason = format!(
                "--seconds cannot be used with {}, which says it",
                file.display()
            );
            Cli::command()
                .error(ErrorKind::ArgumentConflict, reason)
                .exit()
        }
        let options = PathOptions {
            run: self.run,
            colmap: self.colmap,
            way,
            seconds: self.path.seconds,
            rate: self.path.fps.map(|Rate(rate)| rate),
            size: self.path.size.map(|Size(size)| size),
            luma: self.luma,
            side_by_side: self.path.side_by_side,
            output: self.output,
            video: self.path.video,
            save_path: self.path.save_path,
        };
        let mut progress = Progress::through(options.stages());
        let done = render_path(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        print(summary(&done))?;
        let wrote = [&options.output, &options.video, &options.save_path];
        let wrote: Vec<&Path> = wrote.into_iter().flatten().map(PathBuf::as_path).collect();
        progress.close(&wrote, next)
    }
}

fn summary(done: &Rendered) -> String {
    let Rendered {
        frames,
        size: [width, height],
        rate,
    } = done;
    let seconds = *frames as f64 / rate;
    format!(
        "drew {frames} frames of {width} x {height} pixels: {seconds:.1} s at {rate:.4} a second"
    )
    .replace(".0000 a second", " a second")
}
