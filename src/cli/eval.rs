//! `gs-chroma eval`.

use std::path::PathBuf;

use clap::Args;

use super::{CliError, network::NetworkArguments, next, print, progress::Progress, values::one_of};
use crate::{
    eval::Peer,
    run::{EvalOptions, eval},
};

/// Ways of others to color a scene.
const RECIPES: &[(Peer, &str)] = &[
    (
        Peer::ChromadistillPaper,
        "As ChromaDistill's paper says: 15,000 iterations, all harmonics, three scales",
    ),
    (
        Peer::ChromadistillCode,
        "As its released code does: 3,000 iterations, constant harmonics, half size; without the content loss, which needs VGG",
    ),
];

/// Measure a colored run: fidelity, colorfulness, and whether views agree.
#[derive(Args)]
pub struct Eval {
    /// Run folder [default: newest under runs/].
    run: Option<PathBuf>,
    /// The teacher, to be measured beside the scene, as for `colorize`.
    #[arg(long, value_name = "NAME|FILE.onnx|DIR|photos")]
    teacher: Option<PathBuf>,
    #[command(flatten)]
    network: NetworkArguments,
    /// Measure other ways to color a scene as well: RGB splats fitted to the teacher's pictures,
    /// and the teacher on each drawn gray frame.
    #[arg(long, requires = "teacher")]
    baselines: bool,
    /// Color the scene by another's recipe as well, and measure that; may be given more than once.
    #[arg(long, value_parser = one_of(RECIPES), requires = "teacher")]
    recipe: Vec<Peer>,
    /// Device memory in MiB for fitting what is measured beside the scene.
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u32).range(1..), requires = "teacher")]
    memory_limit: Option<u32>,
    /// Frames of the rendered path.
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u32).range(2..=9999))]
    frames: u32,
    /// Folder of optical flow between the path's frames, 0000-0007.flo and 0007-0000.flo for
    /// each pair [default: flow from depth and poses].
    #[arg(long, value_name = "DIR")]
    flow: Option<PathBuf>,
    /// A perceptual distance: two inputs [1,3,H,W] in [-1,1], one number out.
    #[arg(long, value_name = "FILE.onnx")]
    lpips: Option<PathBuf>,
    /// COLMAP folder with the photos, when it is not where `fit` found it.
    #[arg(long, value_name = "COLMAP_DIR")]
    colmap: Option<PathBuf>,
    /// Print eval.json.
    #[arg(long)]
    json: bool,
}

impl Eval {
    pub(super) fn run(self) -> Result<(), CliError> {
        let options = EvalOptions {
            run: self.run,
            teacher: self.teacher,
            teacher_settings: self.network.settings(),
            colmap: self.colmap,
            frames: self.frames as usize,
            baselines: self.baselines,
            recipes: self.recipe,
            memory_limit: self.memory_limit.map(|mib| u64::from(mib) << 20),
            flow: self.flow,
            lpips: self.lpips,
        };
        let mut progress = Progress::through(options.stages());
        let (folder, evaluation) = eval(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        if self.json {
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
