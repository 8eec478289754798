//! `gs-chroma render`.

use std::path::{Path, PathBuf};

use clap::{Args, error::ErrorKind};

use super::{
    CliError,
    headings::{INPUT, OUTPUT, PATH},
    next, print,
    progress::Progress,
    usage::refuse,
    values::{Rate, folder, one_of, positive, rate},
};
use crate::{
    run::{PathOptions, PathShape, RenderOptions, Rendered, Views, render, render_path},
    store::is_film,
};

const VIEWS: &[(Views, &str)] = &[
    (Views::Train, "Those trained on"),
    (Views::Test, "Those held out"),
    (Views::All, "All"),
];

/// Render a scene from the photos' viewpoints or along a path.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma render runs/house --views test -o renders/
  gs-chroma render runs/house --path orbit --video house.mp4")]
pub struct Render {
    /// Run folder, or splats with --colmap or --path [default: newest under runs/].
    run: Option<PathBuf>,
    /// COLMAP folder of the splats, or of a moved run.
    #[arg(long, help_heading = INPUT, value_name = "COLMAP_DIR")]
    colmap: Option<PathBuf>,
    /// Which views [default: held-out ones, or all where none is held out].
    #[arg(long, help_heading = INPUT, value_parser = one_of(VIEWS), conflicts_with = "path")]
    views: Option<Views>,
    /// Render the gray scene of a colored run.
    #[arg(long, help_heading = INPUT)]
    luma: bool,
    /// Folder for PNG files.
    #[arg(short, long, help_heading = OUTPUT, value_name = "DIR", value_parser = folder(), required_unless_present_any = ["video", "save_path"])]
    output: Option<PathBuf>,
    #[command(flatten)]
    path: PathArguments,
}

#[derive(Args)]
#[command(next_help_heading = PATH)]
struct PathArguments {
    /// Camera path: orbit, photos (their viewpoints) or FILE.json.
    ///
    /// Files: nerfstudio's camera_path.json, transforms.json, 3DGS's cameras.json, SuperSplat's
    /// document.json or settings.json.
    #[arg(long, value_name = "PATH", value_parser = way)]
    path: Option<PathShape>,
    /// Film to write (.mp4, .mov, .mkv, .m4v), by FFmpeg.
    #[arg(long, value_name = "FILM", requires = "path", value_parser = film)]
    video: Option<PathBuf>,
    /// Frames per second, such as 24000/1001 [default: the path file's, or 24].
    #[arg(long, value_name = "RATE", requires = "path", value_parser = rate)]
    fps: Option<Rate>,
    /// Duration of the path [default: the path file's, or 10].
    #[arg(long, requires = "path", value_parser = positive::<f64>)]
    seconds: Option<f64>,
    /// Picture size in pixels [default: the path file's, the photos', or 1280x720].
    #[arg(long, value_name = "WxH", requires = "path", value_parser = size)]
    size: Option<Size>,
    /// Show the gray scene left of the colored one.
    #[arg(long, requires = "path", conflicts_with = "luma")]
    side_by_side: bool,
    /// Write the path as nerfstudio's camera_path.json.
    ///
    /// In COLMAP's coordinates.
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

fn way(text: &str) -> Result<PathShape, String> {
    match text {
        "orbit" => Ok(PathShape::Orbit),
        "photos" => Ok(PathShape::Photos),
        file if file.to_ascii_lowercase().ends_with(".json") => Ok(PathShape::File(file.into())),
        _ => Err("must be orbit, photos or a .json file".to_owned()),
    }
}

fn film(text: &str) -> Result<PathBuf, String> {
    match is_film(Path::new(text)) {
        true => Ok(text.into()),
        false => Err("no film: name it .mp4, .mov, .m4v, .mkv or .mxf".to_owned()),
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

    fn along(self, way: PathShape, next: &str) -> Result<(), CliError> {
        if let (PathShape::File(file), Some(_)) = (&way, self.path.seconds) {
            let reason = format!(
                "--seconds cannot be used with {}, which says it",
                file.display()
            );
            refuse(ErrorKind::ArgumentConflict, reason);
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
