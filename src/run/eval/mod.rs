//! `eval`: how good a coloured run is.

mod agreement;
mod drawing;
mod lpips;
mod score;
mod subject;
mod teacher;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::Instant,
};

use super::{Event, Observer, RunError, RunFolder, Stage, files, fit::open_gpu};
use crate::{
    chroma::teacher::TeacherSettings,
    raster::Raster,
    report::{
        EVALUATION_VERSION, Evaluation, Figure, Method, PageRow, Rules, evaluation_page, to_image,
    },
};
use drawing::Painter;
use lpips::Lpips;
use score::Scored;
use subject::Subject;
use teacher::EvalTeacher;

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
    /// Whether other ways to colour a scene are measured beside it.
    pub baselines: bool,
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
    let subject = Subject::load(options, observe)?;
    let folder = &subject.folder;
    let made = tempfile::Builder::new()
        .prefix(".eval-")
        .tempdir_in(folder.path())
        .map_err(files::at(folder.path()))?;
    files::check_page(&folder.evaluation_page())?;
    let mut lpips = options.lpips.as_deref().map(Lpips::open).transpose()?;
    let mut teacher = match &options.teacher {
        Some(path) => Some(EvalTeacher::ask(
            path,
            &options.teacher_settings,
            &subject,
            options.baselines,
            observe,
        )?),
        None => None,
    };
    let drawn = subject.report.luma.settings.raster_options();
    let raster = Arc::new(Raster::with(&open_gpu(false)?, drawn));
    let splats = match &teacher {
        Some(teacher) if options.baselines => {
            Some(teacher.rgb_splats(&raster, &subject, options.memory_limit, observe)?)
        }
        _ => None,
    };
    let mut rgb = vec![(Method::Exported, &subject.exported)];
    rgb.extend(splats.as_ref().map(|field| (Method::RgbSplats, field)));
    let mut painter = Painter::new(&raster, &subject, &rgb, teacher.as_mut())?;

    let mut views = Vec::new();
    let mut rows = Vec::new();
    let dataset = &subject.dataset;
    let (measured_on, measured) = dataset.measured();
    let mut done = 0;
    dataset.visit_colors(measured, |i, photo| {
        let name = &dataset.capture.views[i].name;
        observe(Event::Progress {
            stage: Stage::Measure,
            done,
            total: measured.len(),
            message: name.clone(),
        });
        done += 1;
        let yardstick = subject.yardstick(i, &photo);
        if !yardstick.measures() {
            return Ok(());
        }
        let drawing = painter.draw(&dataset.cameras[i], name)?;
        let answer = painter.answer(i)?;
        let scored = Scored::of(name, yardstick, &drawing, answer.as_ref(), lpips.as_mut())?;
        if rows.len() < MAX_ROWS {
            rows.push(page_row(made.path(), rows.len(), &scored)?);
        }
        views.push(scored);
        Ok::<_, RunError>(())
    })?;
    let mut strip = Vec::new();
    let every = options.frames.div_ceil(STRIP_FRAMES);
    let path = agreement::along_path(
        &mut painter,
        &subject,
        options,
        observe,
        &mut |frame, image| {
            let file = format!("frame-{frame:04}.png");
            files::write_png(&made.path().join(&file), &image)?;
            if frame % every == 0 {
                strip.push(file);
            }
            Ok(())
        },
    )?;
    let between = agreement::between_views(&mut painter, &subject, observe)?;
    let evaluation = Evaluation {
        version: EVALUATION_VERSION,
        program: env!("CARGO_PKG_VERSION").to_owned(),
        scene: subject.name(),
        teacher: painter.teacher(),
        teacher_colorfulness: score::teacher_colorfulness(&painter, &subject)?,
        measured_on: measured_on.to_owned(),
        luma: score::mean_luma(&views),
        bake: score::mean_bake(&views),
        pictures: score::mean_pictures(&views),
        views: views.into_iter().map(|scored| scored.score).collect(),
        rules: Rules::default(),
        path,
        between,
        seconds: begun.elapsed().as_secs_f64(),
    };
    let html = evaluation_page(&evaluation, &rows, &strip);
    files::write(&made.path().join(files::PAGE), html.as_bytes())?;
    files::replace_page(made, &folder.evaluation_page())?;
    let json = evaluation.to_json() + "\n";
    files::write(&folder.evaluation(), json.as_bytes())?;
    Ok((folder.clone(), evaluation))
}

/// Writes a view's pictures beside the page.
fn page_row(folder: &Path, index: usize, scored: &Scored) -> Result<PageRow, RunError> {
    let [width, height] = scored.size;
    let mut figures = Vec::new();
    for shot in &scored.shots {
        let file = format!("view-{index:02}-{}.png", shot.file);
        let image = to_image(width, height, &shot.pixels);
        files::write_png(&folder.join(&file), &image)?;
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
