//! `eval`: how good a colored run is.

use std::{
    cell::RefCell,
    path::{Path, PathBuf},
    sync::Arc,
    time::Instant,
};

use super::{
    Event, Observer, RunError, RunFolder, Stage,
    commit::Commit,
    files,
    fit::open_gpu,
    flight::Filmed,
    keeping,
    lock::RunLock,
    scene::{Frame, read_splats, written_as},
    sound::open_same,
    teach::teacher_or_photos,
};
use crate::{
    capture::{Dataset, Orientation},
    chroma::teacher::{Teacher, TeacherSettings},
    eval::{
        ColoredScene, EvalError, Lpips, MeasuredTeacher, Painter, Peer, Progress, Scored,
        along_path, between_views, exposures, mean_bake, mean_luma, mean_pictures,
        teacher_colorfulness,
    },
    raster::Raster,
    report::{
        EVALUATION_VERSION, Evaluation, Figure, Method, PageRow, PeerReport, Report, Rules,
        TeacherReport, evaluation_page, to_image,
    },
    splats::{Splats, is_splat_file, write_splats},
};

/// Views on the page: a browser should not have to load a thousand pictures.
const MAX_ROWS: usize = 24;

/// Frames in the page's strip.
const STRIP_FRAMES: usize = 12;

/// What `eval` is asked to do.
#[derive(Clone, Debug)]
pub struct EvalOptions {
    /// Run folder; the newest run by default.
    pub run: Option<PathBuf>,
    /// The teacher, to be measured beside the scene.
    pub teacher: Option<PathBuf>,
    /// How it is asked.
    pub teacher_settings: TeacherSettings,
    /// COLMAP folder, where it is not the one that `fit` noted.
    pub colmap: Option<PathBuf>,
    /// Frames of the path, at least 2.
    pub frames: usize,
    /// Whether other ways to color a scene are measured beside it.
    pub baselines: bool,
    /// Ways of others to color the scene that are measured as well.
    pub recipes: Vec<Peer>,
    /// Bytes of the device that fitting RGB splats may take.
    pub memory_limit: Option<u64>,
    /// Folder of `.flo` files between the path's frames; geometric flow by default.
    pub flow: Option<PathBuf>,
    /// A network that tells how far two pictures are apart.
    pub lpips: Option<PathBuf>,
}

/// Measures a run and writes `eval.json` and the page into its folder.
///
/// # Errors
/// [`RunError`]; the files of an earlier evaluation stay until all is measured.
pub fn eval(
    options: &EvalOptions,
    observe: &mut Observer<'_>,
) -> Result<(RunFolder, Evaluation), RunError> {
    let begun = Instant::now();
    let warnings = RefCell::default();
    let observe = &mut keeping(&warnings, observe);
    if let Some(path) = &options.run {
        is_splat_file(path)?;
    }
    let folder = RunFolder::find(options.run.as_deref())?;
    let (_lock, report) = RunLock::of_run(&folder)?;
    observe(Event::begins(Stage::Model));
    let scene = load(&folder, &report, options, observe)?;
    files::check_page(&folder.evaluation_page())?;
    let commit = Commit::new(folder.path())?;
    let page = commit.place(&folder.evaluation_page());
    files::make_folder(&page)?;
    let mut lpips = options.lpips.as_deref().map(Lpips::open).transpose()?;
    let asked = (options.teacher.as_deref())
        .map(|teacher| teacher_or_photos(teacher, &scene.dataset.capture.root));
    let mut teacher = match &asked {
        Some(path) => {
            observe(Event::begins(Stage::Teacher));
            Some(ask(path, options, &folder, &report, &scene, observe)?)
        }
        None => None,
    };
    observe(Event::begins(Stage::Device));
    let drawn = report.luma.settings.raster_options();
    let raster = Arc::new(Raster::with(&open_gpu(false)?, drawn));
    let seed = report.luma.settings.seed;
    let mut peers = Vec::new();
    if let (Some(teacher), Some(path)) = (&teacher, &asked) {
        let baseline = options.baselines.then_some(Peer::RgbSplats);
        for peer in baseline.into_iter().chain(options.recipes.iter().copied()) {
            if peers
                .iter()
                .any(|(_, told): &(_, PeerReport)| told.method == peer.method())
            {
                continue;
            }
            let limit = options.memory_limit;
            let mut told = |progress: Progress<'_>| observe(Event::from(progress));
            let colored = peer.color(&raster, &scene, teacher, seed, limit, &mut told);
            peers.push(colored.map_err(covers_nothing(path, &scene.dataset))?);
        }
    }
    for (field, told) in &peers {
        let splats = Splats {
            sh: field.clone(),
            ..scene.luma.clone()
        };
        let path = page.join(told.method.file_stem()).with_extension("ply");
        write_splats(
            &path,
            &splats,
            &written_as(drawn, scene.dataset.capture.offset),
        )?;
    }
    let mut rgb = vec![(Method::Exported, &scene.exported)];
    rgb.extend(peers.iter().map(|(field, told)| (told.method, field)));
    let mut painter = Painter::new(&raster, &scene, &rgb, teacher.as_mut())?;

    observe(Event::begins(Stage::Measuring));
    let mut views = Vec::new();
    let mut rows = Vec::new();
    let dataset = &scene.dataset;
    let (measured_on, measured) = dataset.measured();
    let mut done = 0;
    dataset.visit_colors(measured, |i, photo| {
        let name = &dataset.capture.views[i].name;
        observe(Event::Progress {
            stage: Stage::Measuring,
            done,
            total: measured.len(),
            message: name.clone(),
        });
        done += 1;
        let reference = scene.reference(i, &photo);
        if !reference.measures() {
            return Ok(());
        }
        let drawing = painter.draw(&dataset.cameras[i], name)?;
        let answer = painter.answer(i)?;
        let scored = Scored::of(name, reference, &drawing, answer.as_ref(), lpips.as_mut())?;
        if rows.len() < MAX_ROWS {
            let upright = scene.dataset.capture.views[i].stance.upright;
            rows.push(page_row(&page, rows.len(), &scored, upright)?);
        }
        views.push(scored);
        Ok::<_, RunError>(())
    })?;
    let mut strip = Vec::new();
    let every = options.frames.div_ceil(STRIP_FRAMES);
    let flow = options.flow.as_deref();
    let mut filmed = Filmed::begin(&page);
    let mut keep = |frame, image| {
        let file = format!("frame-{frame:04}.png");
        files::write_png(&page.join(&file), &image)?;
        filmed.add(&file, &image);
        if frame % every == 0 {
            strip.push(file);
        }
        Ok::<_, RunError>(())
    };
    let mut told = |progress: Progress<'_>| observe(Event::from(progress));
    let frames = options.frames;
    let path = along_path(&mut painter, &scene, frames, flow, &mut told, &mut keep)?;
    let between = between_views(&mut painter, &scene, &mut told)?;
    let teacher_colorfulness = teacher_colorfulness(&painter, &scene, &mut told)?;
    if !path.skipped.is_empty() {
        observe(Event::Warning(format!(
            "a path of {} frames is too short for Δ = {:?}: choose more",
            path.frames, path.skipped
        )));
    }
    observe(Event::begins(Stage::Page));
    let flight = filmed.end(&page, &path, observe);
    let evaluation = Evaluation {
        version: EVALUATION_VERSION,
        program: env!("CARGO_PKG_VERSION").to_owned(),
        scene: scene.name(),
        teacher: painter.teacher(),
        teacher_colorfulness,
        measured_on: measured_on.to_owned(),
        luma: mean_luma(&views),
        bake: mean_bake(&views),
        pictures: mean_pictures(&views),
        views: views.into_iter().map(|scored| scored.score).collect(),
        peers: peers.into_iter().map(|(_, told)| told).collect(),
        rules: Rules::default(),
        warnings: warnings.take(),
        path,
        between,
        seconds: begun.elapsed().as_secs_f64(),
    };
    let html = evaluation_page(&evaluation, &rows, &flight, &strip);
    files::write(&page.join(files::PAGE), html.as_bytes())?;
    let json = evaluation.to_json() + "\n";
    files::write(&commit.place(&folder.evaluation()), json.as_bytes())?;
    commit.finish()?;
    Ok((folder, evaluation))
}

/// Opens the run that is to be measured.
fn load(
    folder: &RunFolder,
    report: &Report,
    options: &EvalOptions,
    observe: &mut Observer<'_>,
) -> Result<ColoredScene, RunError> {
    let refused = |path: PathBuf, reason: &str| RunError::File {
        path,
        reason: format!("{reason}: run `gs-chroma colorize` first"),
    };
    let color = folder.color();
    if !color.exists() {
        return Err(refused(color, "the run is not colored yet"));
    }
    let luma = read_splats(&folder.luma(), Frame::Own, observe)?
        .0
        .to_luma();
    let exported = read_splats(&color, Frame::Own, observe)?.0;
    if exported.means != luma.means || exported.sh.channels != 3 {
        return Err(refused(color, "its Gaussians are not those of luma.ply"));
    }
    let chroma = folder.read_chroma(luma.len())?;
    if chroma.is_none() {
        observe(Event::Warning(format!(
            "{} is missing: the native picture is not measured; `gs-chroma colorize` writes it",
            folder.chroma().display()
        )));
    }
    let colmap = match &options.colmap {
        Some(path) => path.clone(),
        None => PathBuf::from(&report.capture.path),
    };
    let mut dataset = open_same(&colmap, &report.capture.load, &report.capture, observe)?;
    if let Some(chroma) = &report.chroma {
        // Colors were learned from these.
        let names = dataset.capture.views.iter().map(|view| &view.name);
        let painted = |name: &&String| chroma.painted_held_out.contains(name);
        let of_view: Vec<bool> = names.map(|name| painted(&name)).collect();
        dataset.split.train_on(|view| of_view[view]);
    }
    Ok(ColoredScene {
        exposures: exposures(&dataset, &report.luma.exposures),
        dataset,
        luma,
        chroma,
        exported: exported.sh,
    })
}

/// Asks the teacher for all photos, through the run's cache; for frames too where baselines
/// are wanted and it is a network.
fn ask(
    path: &Path,
    options: &EvalOptions,
    folder: &RunFolder,
    report: &Report,
    scene: &ColoredScene,
    observe: &mut Observer<'_>,
) -> Result<MeasuredTeacher, RunError> {
    let settings = &options.teacher_settings;
    let mut teacher = Teacher::open(path, Some(&folder.teacher()), settings)?;
    teacher.know(&scene.dataset.capture);
    let info = teacher.describe();
    let is_same = |t: &TeacherReport| (&t.info.name, &t.info.sha256) == (&info.name, &info.sha256);
    if let Some(chroma) = &report.chroma
        && !chroma.teachers.iter().any(is_same)
    {
        observe(Event::Warning(
            "the run was colored by another teacher than the one it is measured against".to_owned(),
        ));
    }
    let frames = if options.baselines && teacher.is_network() {
        Some(Teacher::open(path, None, settings)?)
    } else {
        None
    };
    if options.baselines && frames.is_none() {
        observe(Event::Warning(
            "a folder of images cannot color frames: no baseline of luma, then teacher".to_owned(),
        ));
    }
    let mut told = |progress: Progress<'_>| observe(Event::from(progress));
    let asked = MeasuredTeacher::ask(teacher, frames, &scene.dataset, &mut told);
    asked.map_err(covers_nothing(path, &scene.dataset))
}

/// Names the teacher that has nothing to say.
fn covers_nothing(path: &Path, dataset: &Dataset) -> impl FnOnce(EvalError) -> RunError {
    move |error| match error {
        EvalError::NothingTaught => RunError::TeacherCoversNothing {
            teacher: path.to_owned(),
            example: dataset.capture.views[dataset.split.train[0]].name.clone(),
        },
        other => other.into(),
    }
}

/// Writes a view's pictures beside the page, upright.
fn page_row(
    folder: &Path,
    index: usize,
    scored: &Scored,
    upright: Orientation,
) -> Result<PageRow, RunError> {
    let [width, height] = scored.size;
    let mut figures = Vec::new();
    for shot in &scored.shots {
        let file = format!("view-{index:02}-{}.png", shot.file);
        let image = to_image(width, height, &shot.pixels).into();
        files::write_png(&folder.join(&file), &upright.image(image).into_rgb8())?;
        figures.push(Figure {
            caption: shot.caption.to_owned(),
            file,
        });
    }
    Ok(PageRow {
        name: scored.score.name.clone(),
        figures,
    })
}
