//! `colorize`: a teacher's colors into a trained scene.

use std::{
    cell::RefCell,
    fmt::Write,
    ops::ControlFlow,
    path::PathBuf,
    sync::Arc,
    time::{Duration, Instant},
};

use glam::DVec3;

use super::{
    Event, Live, Observer, Preset, RunError, RunFolder, SceneKind, Stage,
    checkpoints::{CheckpointOptions, FileKeeper, Found, tell_given_up},
    color_checkpoint::{found_in, question},
    color_files::{ColorFiles, Output},
    color_source::Source,
    files,
    fingerprint::check_poses,
    fit::{capture_report, open_gpu},
    foreign::drawn_like_photos,
    keeping,
    live::Showing,
    scene::{Frame, read_scene, tell_not_finite, written_as},
    sound::{open_checked, open_examined, open_trusted},
    teach::{Taught, TeachOptions, Teachers},
};
use crate::{
    capture::LoadOptions,
    chroma::{
        ChosenDegree, ChromaCheckpoint, ChromaKeeper, ChromaProgress, ChromaSettings,
        ColorizeEvent, Degree, Distill, NoChromaKeeper, SolverKind, relight, unseen_share,
    },
    effects::table,
    eval::{Measured, exposures},
    raster::Raster,
    report::{ChromaReport, ChromaSeconds, EffectReport, Report, kernel_reports},
    splats::WriteOptions,
};

/// A share of Gaussians without a colored photo that is worth a warning.
const UNSEEN: f64 = 0.05;

/// What `colorize` is asked to do.
#[derive(Clone, Debug)]
pub struct ColorizeOptions {
    /// Run folder or gray splat file; the newest run by default.
    pub run: Option<PathBuf>,
    /// Who colors the photos.
    pub teach: TeachOptions,
    /// The colored splat file; `color.ply` in the run folder by default.
    pub output: Option<PathBuf>,
    /// Last iteration, counted from the start of stage 1; the preset's by default.
    pub until: Option<usize>,
    /// How chroma is solved for. Seed and iterations are those of the run, the degree follows
    /// from `sh_degree`, and whether views are corrected from `correct_views`.
    pub settings: ChromaSettings,
    /// Degree of the chroma harmonics.
    pub sh_degree: Degree,
    /// Whether each view's teacher is brought into line with the others; by default where
    /// they disagree.
    pub correct_views: Option<bool>,
    /// COLMAP folder, where it is not the one that `fit` noted.
    pub colmap: Option<PathBuf>,
    /// Whether lightness, too, is what the photos show, and not what was trained; a run keeps
    /// its own files then.
    pub relight: bool,
    /// Whether photos are taken as they are where they and the model contradict each other.
    pub force: bool,
    /// Whether the report says where the device's time went.
    pub timings: bool,
    /// How it can go on where it is interrupted, if not by Adam or without a run.
    pub checkpoints: CheckpointOptions,
    /// Who looks on, if not with Adam.
    pub live: Option<Arc<Live>>,
}

/// Colors a run or a gray splat file.
///
/// # Errors
/// [`RunError`]; nothing is written before the colors are found.
pub fn colorize(
    options: &ColorizeOptions,
    observe: &mut Observer<'_>,
) -> Result<(Output, Report), RunError> {
    let started = Instant::now();
    let warnings = RefCell::default();
    let observe = &mut keeping(&warnings, observe);
    let source = Source::find(options)?;
    let cache = source.folder.as_ref().map(RunFolder::teacher);
    let colmap_dir = source.colmap_dir(options)?;
    let _kept = source.kept_files(options, &colmap_dir).keep();
    let mut teachers = Teachers::open(&options.teach, &colmap_dir, cache.as_deref())?;
    observe(Event::begins(Stage::Device));
    let gpu = open_gpu(options.timings)?;
    let mut report = source.report(&gpu);
    let load = LoadOptions {
        force: options.force || report.capture.load.force,
        ..report.capture.load.clone()
    };
    // `fit` has compared a run's photos with their model; in another light they may well show
    // something else.
    let trusted = options.relight || (source.report.is_some() && options.colmap.is_none());
    let trained = &report.capture.photos;
    let dataset = match trusted {
        true if options.relight => open_checked(&colmap_dir, &load, observe)?,
        true => open_trusted(&colmap_dir, &load, trained, observe)?,
        false => open_examined(&colmap_dir, &load, observe)?.dataset,
    };
    check_poses(&dataset.capture, trained)?;
    // From here on every photo is looked at once.
    let dataset = Arc::new(dataset.caching(0));
    let frame = match source.folder {
        Some(_) => Frame::Own,
        None => Frame::World(dataset.capture.offset),
    };
    let read = read_scene(&source.splats, frame, observe)?;
    let (mut luma, mut drawn) = (read.splats.to_luma(), read.drawn);
    if source.report.is_none() {
        let splats = (source.splats.as_path(), &luma);
        drawn = drawn_like_photos(&gpu, &dataset, splats, drawn, observe)?;
    }
    let iterations = adam_iterations(options, report.preset, report.luma.iterations)?;
    let output = Output {
        ply: options
            .output
            .clone()
            .unwrap_or_else(|| source.default_output()),
        contact_sheet: (source.kept(options))
            .filter(|folder| options.output.is_none() || output_is_own(options, folder))
            .map(RunFolder::contact_sheet),
    };
    // Its own is replaced together with the run's other files.
    if output.contact_sheet.is_none() {
        files::format_of(&output.ply)?;
        files::make_folder_of(&output.ply)?;
    }

    let begun = Instant::now();
    let settings = ChromaSettings {
        iterations,
        seed: report.luma.settings.seed,
        ..options.settings.clone()
    };
    observe(Event::begins(Stage::Teacher));
    let Taught {
        lesson,
        hinted,
        wanted,
    } = teachers.ask(&dataset, settings.target_scales(), observe)?;
    // Hints stay as painted.
    let match_saturation = settings.match_saturation && hinted == 0;
    let settings = ChromaSettings {
        match_saturation,
        ..settings
    };
    let painted = lesson.painted_held_out(&dataset.split).len();
    if painted > 0 {
        observe(Event::Note(format!(
            "colors are learned from {painted} held-out {} painted by hand, too; measured {}",
            if painted == 1 { "photo" } else { "photos" },
            match lesson.measured(&dataset.split) {
                ("test", views) => format!("on the other {}", views.len()),
                _ => "on the photos that they are learned from, for no other is left".to_owned(),
            }
        )));
    }
    let seconds_teacher = begun.elapsed().as_secs_f64();
    if trusted {
        tell_not_finite(&dataset, observe);
    }
    if source.report.is_none() {
        report.capture = capture_report(&colmap_dir, &dataset);
        report.luma.splats = luma.len();
        report.luma.settings.sh_degree = luma.sh.degree;
        report.luma.settings.antialiased = drawn.antialiased;
    }
    let drawn = report.luma.settings.raster_options();
    let raster = Arc::new(Raster::with(&gpu, drawn));
    let told = |stage, progress: ChromaProgress, message| Event::Progress {
        stage,
        done: progress.iteration,
        total: progress.total,
        message,
    };
    if options.relight {
        observe(Event::begins(Stage::Relight));
        let limit = settings.memory_limit;
        let mut told = |progress: ChromaProgress| {
            let message = format!("loss {:.3}", progress.loss);
            observe(told(Stage::Relight, progress, message));
            ControlFlow::Continue(())
        };
        luma = relight(&raster, &dataset, &luma, limit, &mut told)?;
        // These are other photos than those whose exposures the run knows.
        report.luma.exposures.clear();
    }
    if let Some(live) = &options.live {
        live.begin(&dataset);
        live.draw(drawn);
        live.show(SceneKind::Luma, luma.clone(), Duration::ZERO);
    }
    let distill = Distill {
        raster: &raster,
        dataset: &dataset,
        luma: &luma,
        lesson: &lesson,
        sh_degree: options.sh_degree,
        correct_views: options.correct_views,
    };
    // Adam keeps none.
    let keeps_some = settings.solver == SolverKind::Irls;
    let kept = source.kept(options).filter(|_| keeps_some);
    let found = match options.checkpoints.resume {
        true => found_in(kept, observe)?,
        false => {
            if let Some(folder) = source.kept(options) {
                tell_given_up(&folder.color_checkpoint(), observe);
            }
            None
        }
    };
    let log = RefCell::new(found.as_ref().map_or(String::new(), Found::log));
    let observe = RefCell::new(observe);
    let tell = |event| observe.borrow_mut()(event);
    let mut keeper = match kept {
        Some(folder) => {
            let question = question(folder, options, &settings, &gpu, &wanted)?;
            if let Some(found) = &found {
                found.check(&question)?;
            }
            let path = folder.color_checkpoint();
            let checkpoints = &options.checkpoints;
            Some(FileKeeper::new(
                path,
                question,
                (),
                checkpoints,
                &log,
                &tell,
                begun,
            ))
        }
        None => None,
    };
    let checkpoint = found.as_ref().map(|found| &found.checkpoint);
    let rounds_before = checkpoint.map_or(0, ChromaCheckpoint::rounds);
    let rounds = match settings.solver {
        SolverKind::Irls => settings.rounds,
        SolverKind::Adam => settings.iterations,
    };
    let keeps: &mut dyn ChromaKeeper = match &mut keeper {
        Some(keeper) => keeper,
        None => &mut NoChromaKeeper,
    };
    let mut showing = Showing {
        keeper: keeps,
        live: options.live.as_deref(),
        luma: Some(&luma),
    };
    let colored = distill.run_from(checkpoint, &mut showing, &settings, &mut |event| {
        let observe = &mut *observe.borrow_mut();
        match event {
            // It has been asked already.
            ColorizeEvent::Asked { .. } => {}
            ColorizeEvent::Listing => observe(Event::begins(Stage::Lists)),
            ColorizeEvent::Streaming { at_a_time } => observe(Event::Note(format!(
                "{} Gaussians have no room on the device: at most {at_a_time} that a photo may show come at a time",
                luma.len()
            ))),
            ColorizeEvent::Chosen(chosen) => observe(Event::Note(describe(chosen))),
            ColorizeEvent::Plan(effects) => {
                observe(Event::Note(table(effects)));
                observe(Event::Progress {
                    stage: Stage::Solving,
                    done: rounds_before,
                    total: rounds,
                    message: String::new(),
                });
            }
            ColorizeEvent::Uncorrected { before, after } => observe(Event::Note(format!(
                "view correction is off: corrected, the teacher's views would disagree more ({:.0} % instead of {:.0} % of its colors' mean square)",
                100.0 * after,
                100.0 * before
            ))),
            ColorizeEvent::Solving(progress) => {
                // Writing to a string cannot fail.
                let _ = writeln!(
                    log.borrow_mut(),
                    "{},{:.6},{},{:.3},",
                    report.luma.iterations + progress.iteration,
                    progress.loss,
                    luma.len(),
                    progress.seconds
                );
                let moved = progress.moved;
                let moved = moved.map_or(String::new(), |moved| format!(", moved {moved:.2}"));
                let message = format!("loss {:.3}{moved}", progress.loss);
                observe(told(Stage::Solving, progress, message));
            }
            ColorizeEvent::Trying { degree, progress } => {
                let message = format!("SH degree {degree}, loss {:.3}", progress.loss);
                observe(told(Stage::Degree, progress, message));
            }
            ColorizeEvent::Matching { view, total } => observe(Event::Progress {
                stage: Stage::Strength,
                done: view,
                total,
                message: String::new(),
            }),
            ColorizeEvent::Drawing { view, total } => observe(Event::Progress {
                stage: Stage::Bake,
                done: 0,
                total: 0,
                message: format!("drawing view {} of {total}", view + 1),
            }),
            ColorizeEvent::Baking(progress) => {
                let message = format!("loss {:.3}", progress.loss);
                observe(told(Stage::Bake, progress, message));
            }
        }
        ControlFlow::Continue(())
    });
    if let Some(written) = keeper.as_mut().and_then(|keeper| keeper.interrupted.take()) {
        return Err(RunError::Interrupted {
            iteration: written?,
            path: source
                .kept(options)
                .map(RunFolder::color_checkpoint)
                .unwrap_or_default(),
        });
    }
    drop(keeper);
    let colored = colored?;
    if let Some(live) = &options.live {
        live.show(SceneKind::Color, colored.splats.clone(), Duration::ZERO);
    }
    let (observe, log) = (observe.into_inner(), log.into_inner());
    let timings = (options.timings)
        .then(|| Ok::<_, RunError>(kernel_reports(&gpu.timings()?, &colored.load)))
        .transpose()?;

    let views = [colored.colored_views, lesson.views.len()];
    // Surroundings are what no photo shows.
    let scene = luma.len().saturating_sub(report.luma.surroundings);
    let unseen = (colored.seen.as_ref()).map(|seen| unseen_share(&seen[..scene]));
    if let Some(warning) = few_colors(unseen, views) {
        observe(Event::Warning(warning));
    }
    let begun = Instant::now();
    let exposures = exposures(&dataset, &report.luma.exposures);
    let measured = Measured::of(
        &raster,
        &dataset,
        &exposures,
        [&luma, &colored.splats],
        (&colored.chroma, colored.splats_at_a_time.is_some()),
        &lesson,
        &mut |progress| observe(progress.into()),
    )?;
    observe(Event::begins(Stage::Saving));
    let [distilling, baking] = colored.seconds;
    let steps = colored.last.map_or(0, |progress| progress.iteration);
    report.chroma = Some(ChromaReport {
        teachers: teachers.describe(),
        strength: options.teach.strength,
        upsample: options.teach.settings.upsample,
        hints: hinted,
        hint_folder: options.teach.hints.as_ref().and_then(|folder| {
            let found = folder.canonicalize();
            let path = found.as_ref().unwrap_or(folder);
            path.to_str().map(str::to_owned)
        }),
        claimed: colored.claimed,
        painted_held_out: (lesson.painted_held_out(&dataset.split).iter())
            .map(|&view| dataset.capture.views[view].name.clone())
            .collect(),
        colored_views: colored.colored_views,
        unseen,
        saturation: colored.saturation,
        iterations: steps,
        until: report.luma.iterations + steps,
        passes: colored.last.map_or(0.0, |progress| progress.passes),
        moved: colored.last.and_then(|progress| progress.moved),
        effects: EffectReport::of(&colored.effects),
        warnings: warnings.take(),
        loss: colored.last.map_or(0.0, |progress| progress.loss),
        seconds: ChromaSeconds {
            teacher: seconds_teacher,
            distill: distilling,
            bake: baking,
            measure: begun.elapsed().as_secs_f64(),
            all: started.elapsed().as_secs_f64(),
        },
        peak_host_memory: files::peak_host_memory(),
        peak_device_memory: colored.peak_device_memory,
        estimated_device_memory: colored.estimated_device_memory,
        pinned_views: colored.pinned_views,
        splats_at_a_time: colored.splats_at_a_time,
        settings: colored.settings,
        bake: measured.bake,
        measured_on: lesson.measured(&dataset.split).0.to_owned(),
        pictures: measured.mean(),
        views: measured.views,
        timings,
    });
    let moved = dataset.capture.offset;
    let (added, left) = match &source.folder {
        Some(_) => (DVec3::ZERO, moved),
        // As the gray file has it.
        None if read.offset != DVec3::ZERO => (DVec3::ZERO, moved),
        None => (moved, DVec3::ZERO),
    };
    let written = WriteOptions {
        added,
        ..written_as(drawn, left)
    };
    let files = ColorFiles {
        splats: &colored.splats,
        chroma: &colored.chroma,
        rows: &measured.rows,
        log: &log,
        written: &written,
    };
    files.write(source.kept(options), &output, &mut report, observe)?;
    Ok((output, report))
}

/// Whether the colors go into the run's own file.
fn output_is_own(options: &ColorizeOptions, folder: &RunFolder) -> bool {
    options.output.as_ref() == Some(&folder.color())
}

/// What the views held back say about the degree.
fn describe(chosen: &ChosenDegree) -> String {
    let losses: Vec<String> = (0..)
        .zip(&chosen.losses)
        .map(|(degree, loss)| format!("{degree}: {loss:.3}"))
        .collect();
    format!(
        "chose SH degree {} for chroma; held-out loss by degree: {}",
        chosen.degree,
        losses.join(", ")
    )
}

fn adam_iterations(
    options: &ColorizeOptions,
    preset: Preset,
    luma: usize,
) -> Result<usize, RunError> {
    match options.until {
        Some(until) if until <= luma => Err(RunError::NothingUntil { until, luma }),
        Some(until) => Ok(until - luma),
        // As many as the preset's, however many stage 1 really took.
        None => Ok(preset.adam_iterations()),
    }
}

/// What to say where some of the views have colors and these do not show all; without any that
/// has none, it is what no photo shows at all.
fn few_colors(unseen: Option<f64>, [colored, views]: [usize; 2]) -> Option<String> {
    let unseen = unseen.filter(|&unseen| unseen >= UNSEEN && colored < views)?;
    Some(format!(
        "{colored} of {views} photos have colors, and {:.0} % of the Gaussians are in none of these: they take the color of what is like them; color photos that show the rest",
        100.0 * unseen
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_colored_photo_shows_is_told() {
        let told = few_colors(Some(0.37), [2, 15]).expect("a warning");
        assert!(
            told.starts_with("2 of 15 photos") && told.contains("37 %"),
            "{told}"
        );
        for (unseen, views) in [
            (Some(0.37), [15, 15]),
            (Some(0.01), [2, 15]),
            (None, [2, 15]),
        ] {
            assert_eq!(few_colors(unseen, views), None);
        }
    }
}
