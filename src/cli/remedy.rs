//! Remedies for errors: the library knows none of the program's options.

use std::path::PathBuf;

use crate::{
    auto::AutoError,
    capture::CaptureError,
    chroma::{ChromaError, teacher::TeacherError},
    download::DownloadError,
    eval::EvalError,
    gpu::GpuError,
    prepare::{PrepareError, pycolmap::PINNED},
    programs::ProgramError,
    run::RunError,
    store::StoreError,
    subject::SubjectError,
    tradeoff::TradeoffError,
    trajectory::TrajectoryError,
    view::ViewerError,
};

/// Message of an error of a run.
pub(super) fn of_run(error: &RunError) -> String {
    match error {
        RunError::Store(error) => of_store(error),
        RunError::Subject(error) => of_subject(error),
        RunError::Teacher(error) => of_teacher(error),
        RunError::Chroma(ChromaError::OverLimit { .. }) => format!(
            "{error}: raise --memory-limit, or train with fewer Gaussians or smaller photos"
        ),
        RunError::Eval(EvalError::NoFlow { .. }) => {
            format!("{error}: --flow needs one file for each pair of frames and direction")
        }
        RunError::Eval(EvalError::Flow { .. }) => {
            format!("{error}: make it from the frames that `eval` writes, with as many --frames")
        }
        RunError::Eval(EvalError::OtherFrames { .. }) => format!(
            "{error}: color those of --gray-frames, with as many --frames, and keep their size"
        ),
        RunError::Coarse { .. } => format!(
            "{error}: leave --colmap-coordinates out, and the file lies near the origin and says by how much"
        ),
        RunError::NothingToResume(_) => {
            format!("{error}; without --resume training starts over")
        }
        RunError::NoTrainedBlock(_) => format!("{error}: --around is for these"),
        RunError::Trajectory(error @ TrajectoryError::Long { .. }) => {
            format!("{error}; lower --seconds or --fps")
        }
        RunError::Program(program) => of_program(program),
        RunError::NoHeldOut => format!("{error}: choose --views train or --views all"),
        RunError::NothingPainted(_) => format!("{error}, or give a --teacher as well"),
        RunError::NothingUntil { until, .. } => format!("--until {until}: {error}"),
        RunError::TimeTooShort { limit, .. } => {
            format!(
                "--time-limit {:.2}: {error}, or lower --max-side",
                limit / 60.0
            )
        }
        RunError::TargetMissed { target, .. } => format!(
            "--target-psnr {target}: {error}: give more time, a higher --preset or a larger --max-splats if there is one"
        ),
        _ => error.to_string(),
    }
}

/// Message of an error of a scene and its photos.
fn of_subject(error: &SubjectError) -> String {
    match error {
        SubjectError::Store(error) => of_store(error),
        SubjectError::Capture(error) => of_capture(error),
        SubjectError::Unsound(error) => format!("{error}; or continue with --force"),
        SubjectError::Exchanged { .. } => {
            format!("{error}: name them as before, train again, or continue with --force")
        }
        SubjectError::Gpu(error) => of_gpu(error),
        SubjectError::NoCameras(_) => format!("{error}: name the COLMAP folder with --colmap"),
        SubjectError::NoSplats(_) => {
            format!("{error}: name another file, or train again with `gs-chroma fit`")
        }
        _ => error.to_string(),
    }
}

/// Message of an error of a file or folder.
pub(super) fn of_store(error: &StoreError) -> String {
    match error {
        StoreError::Program(program) => of_program(program),
        StoreError::OtherModel { .. } => {
            format!("{error}: put the model back that `fit` has read, or run `fit` with this one")
        }
        StoreError::OtherFile(_) => format!(
            "{error}: put its own back, run `fit` or `colorize` again, or name the splat file in place of the run"
        ),
        StoreError::NoRun => {
            format!("{error}: train one with `gs-chroma fit COLMAP_DIR`, or name a run folder")
        }
        StoreError::Interrupted { .. } => format!("{error} with the same command and --resume"),
        StoreError::OtherCheckpoint { .. } => {
            format!("{error}: give the same options, or leave out --resume to train again")
        }
        _ => error.to_string(),
    }
}

fn of_program(program: &ProgramError) -> String {
    match program.lacks_ffmpeg() {
        true => format!("{program}, or write pictures: -o FOLDER"),
        false => program.to_string(),
    }
}

/// Message of an error of a sweep.
pub(super) fn of_sweep(error: &TradeoffError) -> String {
    match error {
        TradeoffError::Run(error) => of_run(error),
        TradeoffError::Store(error) => of_store(error),
        _ => error.to_string(),
    }
}

/// Message of an error of the viewer's page.
pub(super) fn of_viewer(error: &ViewerError) -> String {
    match error {
        ViewerError::Run(error) => of_run(error),
        ViewerError::Store(error) => of_store(error),
        ViewerError::Port { .. } => format!("{error}: choose another --port, or leave it out"),
        ViewerError::Nothing(_) => format!("{error}: train one with `gs-chroma fit COLMAP_DIR`"),
    }
}

/// Message of an error of `prepare`.
pub(super) fn of_preparing(error: &PrepareError) -> String {
    match error {
        PrepareError::Capture(error) => of_capture(error),
        PrepareError::Store(error) => of_store(error),
        PrepareError::NoColmap | PrepareError::UnknownLens { .. } => {
            format!("{error}, or give --install, which puts {PINNED} into the cache")
        }
        PrepareError::OtherInput { .. } => format!("{error}, or start over with --force"),
        PrepareError::Changed { .. } => format!(
            "{error} (masks are taken from there with --masks), or choose another folder with -o"
        ),
        PrepareError::Program(program) if program.lacks_ffmpeg() => {
            format!("{error}, or give a folder of frames")
        }
        _ => error.to_string(),
    }
}

/// Message of an error of a step of `auto`.
pub(super) fn of_auto(error: &AutoError) -> String {
    match error {
        AutoError::Prepare(PrepareError::OtherInput { folder, input }) => format!(
            "{}: was prepared from {}; name another folder with -o, or remove this one",
            folder.display(),
            input.display()
        ),
        AutoError::Prepare(error) => of_preparing(error),
        AutoError::Run(RunError::Store(StoreError::Interrupted { iteration, .. })) => {
            format!(
                "interrupted after iteration {iteration}; the same command continues from there"
            )
        }
        AutoError::Run(error) => of_run(error),
        AutoError::Store(error) => of_store(error),
    }
}

/// Message of an error of fetching a network.
pub(super) fn of_download(error: &DownloadError, by_hand: Option<&(String, PathBuf)>) -> String {
    match by_hand {
        Some((url, path)) => format!(
            "{error}; or fetch {url} by other means (behind a proxy HTTPS_PROXY has to name it) and put it at {}",
            path.display()
        ),
        None => error.to_string(),
    }
}

fn of_gpu(error: &GpuError) -> String {
    match error {
        GpuError::TooLarge { .. } => format!("{error}: lower --max-splats or --max-side"),
        GpuError::TooManySplats { fits, .. } => {
            format!("{error}: set --max-splats {fits}, or lower --max-side")
        }
        GpuError::OverLimit { .. } => {
            format!("{error}: raise --memory-limit, or lower --max-splats or --max-side")
        }
        _ => error.to_string(),
    }
}

fn of_capture(error: &CaptureError) -> String {
    match error {
        CaptureError::RangeBeyond {
            path,
            depth,
            white,
            range: [low, high],
        } => format!(
            "{}: has {depth} a channel, values from 0 to {white}: none lies within --normalize {low},{high}",
            path.display()
        ),
        CaptureError::NoFolder { .. }
        | CaptureError::NoImagesFolder { .. }
        | CaptureError::NoModel { .. } => format!(
            "{error}; photos or a film without poses go through `gs-chroma prepare` or `gs-chroma auto` first"
        ),
        CaptureError::MixedDepths { .. } => format!("{error}, or give --normalize off"),
        CaptureError::NoMaskFolder { .. } => {
            format!("{error}; name another with --masks, or leave it out")
        }
        CaptureError::NoMasks { .. } => format!("{error}, or give --masks off"),
        _ => error.to_string(),
    }
}

fn of_teacher(error: &TeacherError) -> String {
    match error {
        TeacherError::SeveralProfiles { path, profiles } => format!(
            "{}: several kinds of networks have its inputs and outputs, and only you can know which it is: give --teacher-profile {profiles} (`gs-chroma teacher check` tries them)",
            path.display()
        ),
        TeacherError::Senseless { .. } => format!(
            "{error}: give --teacher-profile, or another one (`gs-chroma teacher check` tries the usual ones)"
        ),
        TeacherError::NoTransparency { .. } => {
            format!("{error}, or give whole pictures as a --teacher folder")
        }
        TeacherError::UnknownTeacher { .. } => {
            format!("{error} (`gs-chroma teacher list` says more)")
        }
        TeacherError::NotFetched { name } => {
            format!("{error}: get it with `gs-chroma teacher fetch {name}`")
        }
        TeacherError::NoRuntime { cache: Some(cache) } => format!(
            "{error}; in one line: {} -m pip install --no-deps --target \"{}\" onnxruntime",
            if cfg!(windows) { "py" } else { "python3" },
            cache.display()
        ),
        TeacherError::NoDevice { .. } => format!(
            "{error}: choose another --teacher-device, or let ORT_DYLIB_PATH name a library that has it"
        ),
        TeacherError::UnknownProfile { .. } => format!("--teacher-profile {error}"),
        TeacherError::NoClass { .. } => format!("{error}: leave out --teacher-class"),
        TeacherError::BadSize { path, size, reason } => {
            format!("{}: --teacher-size {size}: {reason}", path.display())
        }
        _ => error.to_string(),
    }
}
