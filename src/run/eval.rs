//! `eval`: how good a colored run is.

use std::{
    cell::RefCell,
    path::{Path, PathBuf},
    sync::Arc,
    time::Instant,
};

use super::{
    RunError,
    against::Against,
    flight::{FlightOutput, page_row},
    teach::{TeachOptions, teacher_or_photos},
};
use crate::{
    capture::{Dataset, View},
    chroma::teacher::{Teacher, TeacherSettings},
    disk::trust::Originals,
    eval::{
        ColoredScene, Detector, EvalError, Lpips, MeasuredTeacher, Painter, Peer, Progress, Scored,
        Source, between_views, exposures, mean_bake, mean_luma, mean_pictures, mean_quality,
        measure_luma, path_of, strengths,
    },
    gpu::Gpu,
    raster::Raster,
    report::{
        EVALUATION_VERSION, Evaluation, LumaScore, Method, PageRow, PeerReport, Report, Rules,
        TeacherReport, evaluation_page,
    },
    splats::{ShField, Splats, is_splat_file, write_splats},
    store::{RunFolder, StoreError, commit::Commit, files, originals::OriginalFiles},
    subject::{
        LockMode, Run,
        scene::{Frame, read_splats, written_as},
        sound::open_same,
    },
    tell::{Event, Observer, Stage, keeping},
};

/// Views on the page: a browser should not have to load a thousand pictures.
const MAX_ROWS: usize = 24;

#[derive(Clone, Debug, Default)]
pub struct EvalOptions {
    /// Run folder; the newest run by default.
    pub run: Option<PathBuf>,
    /// Teacher to measure beside the scene; by default the one that colored the run, the first of
    /// several.
    pub teacher: Option<PathBuf>,
    pub teacher_settings: TeacherSettings,
    /// COLMAP folder, where it is not the one that `fit` noted.
    pub colmap: Option<PathBuf>,
    /// Frames of the path, at least 2.
    pub frames: usize,
    /// True if baselines are measured as well.
    pub baselines: bool,
    /// Published methods to measure as well.
    pub recipes: Vec<Peer>,
    /// Bytes of the device that fitting RGB splats may take.
    pub memory_limit: Option<u64>,
    /// Folder of `.flo` files between the path's frames; geometric flow by default.
    pub flow: Option<PathBuf>,
    /// LPIPS network: perceptual distance of two images.
    pub lpips: Option<PathBuf>,
    /// Detector of objects in the path's frames.
    pub detector: Option<PathBuf>,
    /// Names and results of other programs: splat files, and folders of the path's frames.
    pub against: Vec<(String, PathBuf)>,
    /// Folder for the path's frames in gray.
    pub gray_frames: Option<PathBuf>,
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
    let run = Run::find(options.run.as_deref(), LockMode::Writing)?;
    let (folder, report) = (&run.folder, &run.report);
    let named = options.teacher.is_some();
    let options = &with_own_teacher(options, report);
    observe(Event::begins(Stage::Model));
    let scene = load(&run, options, observe)?;
    let _kept = keep(options, &scene, report);
    files::check_page(&folder.evaluation_page())?;
    let commit = Commit::new(folder.path())?;
    let page = &commit.place(&folder.evaluation_page());
    files::make_folder(page)?;
    if let Some(folder) = &options.gray_frames {
        files::make_pictures_folder(folder)?;
    }
    let cameras = path_of(&scene, options.frames);
    let against = Against::open_all(&options.against, &scene.dataset, &cameras, observe)?;
    let mut lpips = options.lpips.as_deref().map(Lpips::open).transpose()?;
    let detector = options.detector.as_deref().map(Detector::open);
    let detector = detector.transpose()?;
    let mut teacher = match ask(options, &run, &scene, observe) {
        Err(error @ (RunError::Teacher(_) | RunError::TeacherCoversNothing { .. })) if !named => {
            observe(Event::Warning(format!(
                "the run's teacher is not measured: {error}"
            )));
            None
        }
        asked => asked?,
    };
    observe(Event::begins(Stage::Device));
    let gpu = Gpu::open()?;
    let raster = report.luma.settings.raster(&gpu);
    let peers = match &teacher {
        Some(teacher) => paint(options, &raster, (&scene, teacher), report, page, observe)?,
        None => Vec::new(),
    };
    let mut sources = vec![(Method::Exported, Source::Field(&scene.exported))];
    sources.extend((scene.chroma.iter()).map(|field| (Method::Native, Source::Field(field))));
    sources.extend((peers.iter()).map(|(field, told)| (told.method.clone(), Source::Field(field))));
    for (method, other) in &against {
        let source = other.source(&gpu, &scene.dataset, observe)?;
        sources.push((method.clone(), source));
    }
    let mut painter = Painter::new(&raster, &scene, sources, teacher.as_mut())?;

    let (views, rows) = measure(&scene, &mut painter, lpips.as_mut(), page, observe)?;
    let output = FlightOutput::begin(page, options.gray_frames.as_deref(), cameras.len());
    let flow = options.flow.as_deref();
    let (mut path, flight) = output.draw(&mut painter, &cameras, flow, detector, observe)?;
    let mut told = |progress: Progress<'_>| observe(Event::from(progress));
    let mut between = between_views(&mut painter, &scene, &mut told)?;
    let [colorfulness, teacher_colorfulness] = strengths(&mut painter, &scene, &mut told)?;
    let plain_psnr = match report.luma.settings.antialiased {
        true => mean_quality(&measure_luma(
            &raster,
            &scene.dataset,
            &scene.luma,
            &mut told,
        )?),
        false => None,
    };
    let plain_psnr = plain_psnr.and_then(|quality| quality.plain_psnr);
    observe(Event::begins(Stage::Page));
    let pictures = mean_pictures(views.iter().flat_map(|view| &view.score.pictures));
    let of_path = path.consistency.iter_mut().map(|entry| &mut entry.score);
    for score in of_path.chain(&mut between.consistency) {
        score.equal_rms = score.at_equal_colorfulness(&pictures);
    }
    let evaluation = Evaluation {
        version: EVALUATION_VERSION,
        program: env!("CARGO_PKG_VERSION").to_owned(),
        scene: scene.name(),
        teacher: painter.teacher(),
        teacher_colorfulness,
        colorfulness,
        measured_on: scene.dataset.measured().0.to_owned(),
        luma: LumaScore {
            plain_psnr,
            ..mean_luma(&views)
        },
        bake: mean_bake(&views),
        pictures,
        views: views.into_iter().map(|scored| scored.score).collect(),
        peers: peers.into_iter().map(|(_, told)| told).collect(),
        rules: Rules::default(),
        warnings: warnings.take(),
        path,
        between,
        seconds: begun.elapsed().as_secs_f64(),
    };
    let html = evaluation_page(&evaluation, &flight, &rows);
    files::write(&page.join(files::PAGE), html.as_bytes())?;
    let json = evaluation.to_json() + "\n";
    files::write(&commit.place(&folder.evaluation()), json.as_bytes())?;
    commit.finish()?;
    Ok((run.folder, evaluation))
}

/// Keeps photos and what others have made from being written over.
fn keep(options: &EvalOptions, scene: &ColoredScene, report: &Report) -> Originals {
    let others = options.against.iter().map(|(_, path)| path);
    let kept = OriginalFiles::default().with_all(others, "a file that is measured");
    let (root, masks) = (&scene.dataset.capture.root, &report.capture.load.masks);
    kept.with_capture(root, Some(masks)).keep()
}

/// Colors the scene in other ways, and writes these scenes beside the page.
fn paint(
    options: &EvalOptions,
    raster: &Arc<Raster>,
    (scene, teacher): (&ColoredScene, &MeasuredTeacher),
    report: &Report,
    page: &Path,
    observe: &mut Observer<'_>,
) -> Result<Vec<(ShField, PeerReport)>, RunError> {
    let settings = &report.luma.settings;
    let written = written_as(settings.raster_options(), scene.dataset.capture.offset);
    let mut peers: Vec<(ShField, PeerReport)> = Vec::new();
    let baseline = options.baselines.then_some(Peer::RgbSplats);
    for peer in baseline.into_iter().chain(options.recipes.iter().copied()) {
        if peers.iter().any(|(_, told)| told.method == peer.method()) {
            continue;
        }
        let mut told = |progress: Progress<'_>| observe(Event::from(progress));
        let limit = options.memory_limit;
        let colored = peer.color(raster, scene, teacher, settings.seed, limit, &mut told);
        peers.push(colored.map_err(covers_nothing(options, &scene.dataset))?);
    }
    for (field, told) in &peers {
        let splats = Splats {
            sh: field.clone(),
            ..scene.luma.clone()
        };
        let path = page.join(told.method.file_stem()).with_extension("ply");
        write_splats(&path, &splats, &written)?;
    }
    Ok(peers)
}

/// Measures the views that are measured on, and writes pictures of some beside the page.
fn measure(
    scene: &ColoredScene,
    painter: &mut Painter<'_>,
    mut lpips: Option<&mut Lpips>,
    page: &Path,
    observe: &mut Observer<'_>,
) -> Result<(Vec<Scored>, Vec<PageRow>), RunError> {
    observe(Event::begins(Stage::Measuring));
    let (mut views, mut rows) = (Vec::new(), Vec::new());
    let dataset = &scene.dataset;
    let measured = dataset.measured().1;
    let mut done = 0;
    dataset.visit_colors(measured, |i, photo| {
        let View { name, stance, .. } = &dataset.capture.views[i];
        observe(Event::progress(
            Stage::Measuring,
            done,
            measured.len(),
            name,
        ));
        done += 1;
        let reference = scene.reference(i, &photo);
        if !reference.measures() {
            return Ok(());
        }
        let drawing = painter.draw(&dataset.cameras[i], name)?;
        let answer = painter.answer(i)?;
        let lpips = lpips.as_deref_mut();
        let scored = Scored::of(name, reference, &drawing, answer.as_ref(), lpips)?;
        if rows.len() < MAX_ROWS {
            let file = format!("view-{:02}", rows.len());
            let row = page_row(
                page,
                [name, &file],
                scored.size,
                &scored.shots,
                stance.upright,
            )?;
            rows.push(row);
        }
        views.push(scored);
        Ok::<_, RunError>(())
    })?;
    Ok((views, rows))
}

/// Opens the run that is to be measured.
fn load(
    run: &Run,
    options: &EvalOptions,
    observe: &mut Observer<'_>,
) -> Result<ColoredScene, RunError> {
    let (folder, report) = (&run.folder, &run.report);
    let refused = |path: PathBuf, reason: &str| {
        RunError::from(StoreError::file(
            &path,
            format!("{reason}: run `gs-chroma colorize` first"),
        ))
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
    let colmap = run.colmap(options.colmap.as_deref());
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

/// Asks the teacher that is named, if one is, for all photos, through the run's cache; for frames
/// too where baselines are wanted and it is a network.
fn ask(
    options: &EvalOptions,
    run: &Run,
    scene: &ColoredScene,
    observe: &mut Observer<'_>,
) -> Result<Option<MeasuredTeacher>, RunError> {
    let dataset = &scene.dataset;
    let Some(path) = named_teacher(options, dataset) else {
        return Ok(None);
    };
    observe(Event::begins(Stage::Teacher));
    let settings = &options.teacher_settings;
    let mut teacher = Teacher::open(&path, Some(&run.folder.teacher()), settings)?;
    teacher.know(&dataset.capture);
    let info = teacher.describe();
    let is_same = |t: &TeacherReport| (&t.info.name, &t.info.sha256) == (&info.name, &info.sha256);
    if let Some(chroma) = &run.report.chroma
        && !chroma.teachers.iter().any(is_same)
    {
        observe(Event::Warning(
            "the run was colored by another teacher than the one it is measured against".to_owned(),
        ));
    }
    let frames = options.baselines || options.detector.is_some();
    let frames = match frames && teacher.is_network() {
        true => Some(Teacher::open(&path, None, settings)?),
        false => None,
    };
    if options.baselines && frames.is_none() {
        observe(Event::Warning(
            "a folder of images cannot color frames: no baseline of luma, then teacher".to_owned(),
        ));
    }
    let mut told = |progress: Progress<'_>| observe(Event::from(progress));
    let asked = MeasuredTeacher::ask(teacher, frames, dataset, &mut told);
    Ok(Some(asked.map_err(covers_nothing(options, dataset))?))
}

/// The options with the run's own teacher, the first of several, where none is named.
fn with_own_teacher(options: &EvalOptions, report: &Report) -> EvalOptions {
    let mut options = options.clone();
    let own = TeachOptions::of_run(report);
    if let (None, Some((path, _))) = (&options.teacher, own.teachers.into_iter().next()) {
        options.teacher = Some(path);
        options.teacher_settings = own.settings;
    }
    options
}

fn named_teacher(options: &EvalOptions, dataset: &Dataset) -> Option<PathBuf> {
    let teacher = options.teacher.as_deref()?;
    Some(teacher_or_photos(teacher, &dataset.capture.root))
}

/// Names the teacher that has nothing to say.
fn covers_nothing(options: &EvalOptions, dataset: &Dataset) -> impl FnOnce(EvalError) -> RunError {
    move |error| match error {
        EvalError::NothingTaught => RunError::TeacherCoversNothing {
            teacher: named_teacher(options, dataset).unwrap_or_default(),
            example: dataset.capture.views[dataset.split.train[0]].name.clone(),
        },
        other => other.into(),
    }
}
