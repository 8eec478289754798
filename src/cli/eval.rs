//! `gs-chroma eval`.

use std::path::PathBuf;

use clap::Args;

use super::{
    CliError,
    headings::{COMPARE, INPUT, MEASURES, OUTPUT, TEACHER},
    network::NetworkArguments,
    next, print,
    progress::Progress,
    values::{folder, mebibytes, named, one_of},
};
use crate::{
    eval::Peer,
    run::{EvalOptions, eval},
};

/// Ways of others to color a scene.
const RECIPES: &[(Peer, &str)] = &[
    (
        Peer::ChromadistillPaper,
        "As the paper: 15,000 iterations, SH degree 3, three scales",
    ),
    (
        Peer::ChromadistillCode,
        "As the released code: 3,000 iterations, SH degree 0, scales 1, 1/2, 1/4, no VGG loss",
    ),
    (
        Peer::ChromadistillOneScale,
        "The paper's without coarser scales",
    ),
    (Peer::ChromadistillRgb, "The code's in RGB, not CIELAB"),
];

/// Measure a colored run: fidelity, colorfulness, consistency.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma eval runs/house --teacher ddcolor-tiny --baselines
  gs-chroma eval runs/house --gray-frames gray/
  gs-chroma eval runs/house --against film=colored/ --against brush=b.ply")]
pub struct Eval {
    /// Run folder [default: newest under runs/].
    run: Option<PathBuf>,
    /// Teacher to measure beside the scene [default: the run's own].
    #[arg(long, help_heading = TEACHER, value_name = "TEACHER")]
    teacher: Option<PathBuf>,
    #[command(flatten)]
    network: NetworkArguments,
    /// Also measure RGB splats, and coloring frame by frame.
    ///
    /// The RGB splats are fitted to the teacher's pictures.
    #[arg(long, requires = "teacher", help_heading = COMPARE)]
    baselines: bool,
    /// Also measure coloring by ChromaDistill's recipe; repeatable.
    #[arg(long, hide_short_help = true, help_heading = COMPARE, value_parser = one_of(RECIPES), requires = "teacher")]
    recipe: Vec<Peer>,
    /// Also measure another program's splats or frames; repeatable.
    ///
    /// Splats lie in COLMAP's frame. A folder of colored frames of the path holds a PNG or JPEG for
    /// each frame of --gray-frames, of the same size and in the same order.
    #[arg(long, help_heading = COMPARE, value_name = "NAME=PATH", value_parser = named)]
    against: Vec<(String, PathBuf)>,
    /// Limit device memory for --baselines and --recipe, in MiB.
    #[arg(long, hide_short_help = true, help_heading = COMPARE, value_name = "MIB", value_parser = mebibytes(), requires = "teacher")]
    memory_limit: Option<u64>,
    /// Frames of the rendered path.
    #[arg(long, help_heading = MEASURES, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u32).range(2..=9999))]
    frames: u32,
    /// Folder of optical flow [default: from depth and poses].
    ///
    /// Between the path's frames: Middlebury files for each pair and direction: 0000-0007.flo,
    /// 0007-0000.flo.
    #[arg(long, help_heading = MEASURES, value_name = "DIR")]
    flow: Option<PathBuf>,
    /// Perceptual distance such as LPIPS.
    ///
    /// Two inputs [1,3,H,W] in [-1,1], one number out.
    #[arg(long, help_heading = MEASURES, value_name = "FILE.onnx")]
    lpips: Option<PathBuf>,
    /// Count objects along the path: YOLOX or another YOLO.
    ///
    /// Decoded outputs of the latter: [1,N,5+classes] or [1,4+classes,N].
    #[arg(long, help_heading = MEASURES, value_name = "FILE.onnx")]
    detector: Option<PathBuf>,
    /// COLMAP folder, if it has moved since fit.
    #[arg(long, help_heading = INPUT, value_name = "COLMAP_DIR")]
    colmap: Option<PathBuf>,
    /// Write the path's frames in gray, for programs that color films.
    #[arg(long, help_heading = OUTPUT, value_name = "DIR", value_parser = folder())]
    gray_frames: Option<PathBuf>,
    /// Print eval.json.
    #[arg(long, help_heading = OUTPUT)]
    json: bool,
}

impl Eval {
    /// The request.
    pub(super) fn options(self) -> EvalOptions {
        EvalOptions {
            run: self.run,
            teacher: self.teacher,
            teacher_settings: self.network.settings(),
            colmap: self.colmap,
            frames: self.frames as usize,
            baselines: self.baselines,
            recipes: self.recipe,
            memory_limit: self.memory_limit,
            flow: self.flow,
            lpips: self.lpips,
            detector: self.detector,
            against: self.against,
            gray_frames: self.gray_frames,
        }
    }

    pub(super) fn run(self) -> Result<(), CliError> {
        let json = self.json;
        let options = self.options();
        let mut progress = Progress::through(options.stages());
        let (folder, evaluation) = eval(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        if json {
            return print(evaluation.to_json());
        }
        print(evaluation.verdict().join("\n") + "\n")?;
        for table in evaluation.tables() {
            print(format_args!("{table}\n"))?;
        }
        let page = folder.evaluation_page().join("index.html");
        progress.close(&[&folder.evaluation(), &page], &next::look(&page))
    }
}
