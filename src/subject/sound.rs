//! Soundness of photos and model, and warnings about doubts.

use std::path::Path;

use serde::Serialize;

use super::{SubjectError, scene};
use crate::{
    capture::{
        Camera, Capture, CaptureError, Dataset, Headers, LoadOptions, MaskSource, Masked, Rejected,
        Shrunk, Unplaced, first_views,
    },
    effects::{
        Agreement, Cause, Contradiction, Contradictory, Evidence, FEW_POINTS, Levels, PointColors,
        Reprojection, SparsePhotos, Survey, doubts, listed, observe_where_projected,
    },
    report::{CaptureReport, PhotoReport},
    store::fingerprint::{Changes, Fingerprint, of_photos},
    tell::{Event, Observer, Stage},
};

/// Fewer photos make no scene: before as few are left, all are used.
const FEWEST: usize = 2;

/// Agreement of photos, poses and points; each figure `None` if unknown.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Soundness {
    /// The median distance of observations from where their points project, in pixels at
    /// working size; infinite, in JSON `null`, where most points lie behind the cameras.
    pub reprojection_error: Option<f64>,
    /// The lowest correlation, -1 to 1, of what a photo shows at the points with their colors.
    pub lowest_correlation: Option<f64>,
    /// The median correlation of the photos.
    pub median_correlation: Option<f64>,
}

/// A capture that can be worked with.
pub(crate) struct SoundCapture {
    pub dataset: Dataset,
    /// Evidence from its photos.
    pub evidence: Evidence,
    /// Agreement before anything was left out.
    pub soundness: Soundness,
    /// Photos, cameras and points in a few digits.
    pub fingerprint: String,
}

/// Checks of the model alone.
pub(crate) struct Model {
    /// See [`Soundness`].
    pub reprojection_error: Option<f64>,
    /// Photos with poses that contradict it.
    pub photos: Vec<Rejected>,
    tracks: Tracks,
}

/// Usability of a model's observations.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Tracks {
    /// They are where its points project to.
    Sound,
    /// Points are assigned to the right photos, but their pixels are only known by projection.
    Misplaced,
    /// There are none, or they belong to something else.
    Useless,
}

/// Opens a COLMAP folder and judges the model; of the photos only headers are read.
///
/// # Errors
/// [`SubjectError::Unsound`] where the model contradicts itself, unless the options say that this
/// does not matter.
pub(crate) fn open_checked(
    dir: &Path,
    options: &LoadOptions,
    observe: &mut Observer<'_>,
) -> Result<Dataset, SubjectError> {
    let (dataset, model) = open_judged(dir, options, observe)?;
    for Rejected { name, reason } in &model.photos {
        observe(Event::Warning(format!("{name}: {reason}")));
    }
    Ok(dataset)
}

/// Opens the COLMAP folder of a run, whose photos `fit` has compared with their model; as far
/// as they are those that were `trained` on, they are not looked at.
///
/// # Errors
/// As [`open_checked`], and as [`open_examined`] where photos have changed;
/// [`StoreError::OtherModel`], [`SubjectError::Exchanged`].
pub(crate) fn open_trusted(
    dir: &Path,
    options: &LoadOptions,
    trained: &[PhotoReport],
    observe: &mut Observer<'_>,
) -> Result<Dataset, SubjectError> {
    let dataset = open_checked(dir, options, observe)?;
    match tell_changes(&dataset.capture, trained, options.force, observe)? {
        true => Ok(open_examined(dir, options, observe)?.dataset),
        false => Ok(dataset),
    }
}

/// The same without a word about the model, for commands that do not learn from photos.
pub(crate) fn open_same(
    dir: &Path,
    options: &LoadOptions,
    trained: &CaptureReport,
    observe: &mut Observer<'_>,
) -> Result<Dataset, SubjectError> {
    let dataset = scene::open(dir, options, observe)?;
    let force = trained.load.force;
    match tell_changes(&dataset.capture, &trained.photos, force, observe)? {
        true => {
            let options = LoadOptions {
                force,
                ..options.clone()
            };
            Ok(open_examined(dir, &options, observe)?.dataset)
        }
        false => Ok(dataset),
    }
}

/// Compares photos and poses with those that were trained on, and tells what differs; whether
/// photos have changed.
fn tell_changes(
    capture: &Capture,
    trained: &[PhotoReport],
    force: bool,
    observe: &mut Observer<'_>,
) -> Result<bool, SubjectError> {
    // Runs of former versions say nothing.
    if trained.is_empty() {
        return Ok(false);
    }
    let found = Changes::between(trained, &of_photos(capture, trained)?);
    found.check_poses(&capture.root)?;
    if let Some([photo, other]) = found.exchanged.filter(|_| !force) {
        return Err(SubjectError::Exchanged {
            folder: capture.root.clone(),
            photo,
            other,
        });
    }
    let folder = capture.root.display();
    if let Some(first) = found.gone.first() {
        observe(Event::Warning(format!(
            "{} of {} training photos are missing in {folder} (such as {first}): they are not used for color",
            found.gone.len(),
            trained.len(),
        )));
    }
    if let Some(first) = found.changed.first() {
        observe(Event::Warning(format!(
            "{} of {} photos in {folder} are not what was trained on (such as {first})",
            found.changed.len(),
            found.photos,
        )));
    }
    Ok(!found.changed.is_empty())
}

/// Opens a COLMAP folder, judges the model and leaves of its observations what is of use.
fn open_judged(
    dir: &Path,
    options: &LoadOptions,
    observe: &mut Observer<'_>,
) -> Result<(Dataset, Model), SubjectError> {
    observe(Event::begins(Stage::Model));
    let mut dataset = scene::open(dir, options, observe)?;
    let headers = Headers::read(&dataset.capture.views)?;
    tell_headers(&headers, observe);
    // Of a part it is no news that there are more photos.
    if dataset.options.chosen.is_none() {
        tell_unplaced(&dataset.capture, observe)?;
        tell_masks(dataset.masked(), observe);
    }
    let model = check_model(&dataset.capture, &dataset.cameras, options.force, observe)?;
    model.mend(&mut dataset.capture);
    Ok((dataset, model))
}

/// Opens a COLMAP folder, judges model and photos and examines the photos, each decoded once.
/// Where single photos contradict the model, all is done again without them.
///
/// # Errors
/// [`SubjectError::Unsound`] where all contradict it, unless the options say that this does not
/// matter.
pub(crate) fn open_examined(
    dir: &Path,
    options: &LoadOptions,
    observe: &mut Observer<'_>,
) -> Result<SoundCapture, SubjectError> {
    let (mut dataset, model) = open_judged(dir, options, observe)?;
    for doubt in doubts(&dataset.capture, &dataset.cameras) {
        observe(Event::Warning(doubt));
    }
    let (evidence, agreement, fingerprint) = examine(&dataset, observe)?;
    let transparent = dataset.settle_transparency();
    if transparent > 0 && options.masks != MaskSource::Alpha {
        observe(Event::Warning(format!(
            "{transparent} photos have transparency, which is taken for their masks (masks from alpha say so, masks off ignore it)"
        )));
    }
    let soundness = Soundness {
        reprojection_error: model.reprojection_error,
        lowest_correlation: agreement.lowest(),
        median_correlation: agreement.median(),
    };
    let mut unfit = model.photos.clone();
    unfit.extend(unlike(&agreement, &dataset, observe)?);
    unfit.sort_by(|a, b| a.name.cmp(&b.name));
    unfit.dedup_by(|b, a| a.name == b.name);
    let photos = first_views(&dataset.capture.views).count();
    let all_are_used = options.force || photos < unfit.len() + FEWEST;
    for Rejected { name, reason } in &unfit {
        observe(Event::Warning(match all_are_used {
            true => format!("used {name} in spite of this: {reason}"),
            false => format!("left out {name}: {reason}"),
        }));
    }
    let (dataset, evidence, fingerprint) = match unfit.is_empty() || all_are_used {
        true => (dataset, evidence, fingerprint),
        false => {
            let mut options = dataset.options.clone();
            options.left_out.extend(unfit);
            // What is to be said has been said.
            let quietly = &mut |event| {
                if matches!(event, Event::Progress { .. }) {
                    observe(event);
                }
            };
            let mut dataset = scene::open(dir, &options, quietly)?;
            model.mend(&mut dataset.capture);
            let (evidence, _, fingerprint) = examine(&dataset, quietly)?;
            dataset.settle_transparency();
            (dataset, evidence, fingerprint)
        }
    };
    Ok(SoundCapture {
        dataset,
        evidence,
        soundness,
        fingerprint,
    })
}

/// Judges the model of a capture; `cameras` are those of its views at working size.
///
/// # Errors
/// [`SubjectError::Unsound`] where it contradicts itself, unless it is `forced`.
pub(crate) fn check_model(
    capture: &Capture,
    cameras: &[Camera],
    forced: bool,
    observe: &mut Observer<'_>,
) -> Result<Model, SubjectError> {
    let reprojection = Reprojection::of(capture, cameras);
    let found = (reprojection.as_ref()).and_then(|found| found.contradictory(capture, cameras));
    let mut model = Model {
        reprojection_error: reprojection.as_ref().map(|found| found.error),
        photos: Vec::new(),
        tracks: match reprojection {
            Some(_) => Tracks::Sound,
            None => Tracks::Useless,
        },
    };
    match found {
        None => {}
        Some(Contradictory::Some(photos)) => model.photos = photos,
        Some(Contradictory::All(error)) => {
            let cameras_are_right = matches!(
                error,
                Contradiction::Model {
                    cause: Cause::Observations(_),
                    ..
                }
            );
            if !(forced || cameras_are_right) {
                return Err(error.into());
            }
            let (tracks, instead) = match cameras_are_right {
                true => (Tracks::Misplaced, "reprojecting the points instead"),
                false => (Tracks::Useless, "ignoring the observations"),
            };
            observe(Event::Warning(format!("{error}; {instead}")));
            model.tracks = tracks;
        }
    }
    if model.tracks != Tracks::Sound
        && let Some(unseeing) = SparsePhotos::of(capture, cameras)
    {
        observe(Event::Warning(of_unseeing(&unseeing)));
    }
    Ok(model)
}

impl Model {
    /// Leaves of the observations of a capture what is of use.
    fn mend(&self, capture: &mut Capture) {
        match self.tracks {
            Tracks::Sound => {}
            Tracks::Misplaced => observe_where_projected(capture),
            Tracks::Useless => (capture.points.iter_mut()).for_each(|point| point.track.clear()),
        }
    }
}

/// Examines all photos, each decoded once; also gives how they agree with the points' colors,
/// and all of it in a few digits.
fn examine(
    dataset: &Dataset,
    observe: &mut Observer<'_>,
) -> Result<(Evidence, Agreement, String), SubjectError> {
    let mut fingerprint = Fingerprint::default();
    let channel = dataset.options.channel;
    observe(Event::begins(Stage::Photos));
    let mut colors = PointColors::of(&dataset.capture, &dataset.cameras, channel);
    let mut survey = Survey::new(&dataset.capture, &dataset.cameras, &dataset.split);
    let mut levels = Levels::default();
    let all: Vec<usize> = (0..dataset.cameras.len()).collect();
    dataset.visit(&all, |view, photo| {
        survey.look(view, photo);
        levels.look(photo);
        colors.look(view, photo);
        fingerprint.look(dataset, view, photo);
        observe(Event::progress(
            Stage::Photos,
            view + 1,
            all.len(),
            &dataset.capture.views[view].name,
        ));
        Ok::<_, CaptureError>(())
    })?;
    scene::tell_not_finite(dataset, observe);
    if let Some(doubt) = levels.doubt() {
        observe(Event::Warning(doubt));
    }
    observe(Event::begins(Stage::Plan));
    let agreement = colors.finish(&dataset.capture);
    let fingerprint = fingerprint.finish(&dataset.capture);
    Ok((survey.finish(), agreement, fingerprint))
}

/// The photos that do not show what COLMAP saw.
///
/// # Errors
/// [`SubjectError::Unsound`] where these are most of them, unless that does not matter.
fn unlike(
    agreement: &Agreement,
    dataset: &Dataset,
    observe: &mut Observer<'_>,
) -> Result<Vec<Rejected>, SubjectError> {
    match agreement.contradictory(&dataset.capture) {
        None => Ok(Vec::new()),
        Some(Contradictory::Some(photos)) => Ok(photos),
        Some(Contradictory::All(error)) if dataset.options.force => {
            observe(Event::Warning(error.to_string()));
            Ok(Vec::new())
        }
        Some(Contradictory::All(error)) => Err(error.into()),
    }
}

/// Warns where few of the photos that are there are used.
///
/// # Errors
/// [`SubjectError::Capture`] if the model is gone.
pub(crate) fn tell_unplaced(
    capture: &Capture,
    observe: &mut Observer<'_>,
) -> Result<(), SubjectError> {
    if let Some(unplaced) = Unplaced::of(capture)? {
        observe(Event::Warning(of_unplaced(&unplaced)));
    }
    Ok(())
}

/// Warns where photos are small versions of what COLMAP saw.
pub(crate) fn tell_headers(headers: &Headers, observe: &mut Observer<'_>) {
    if let Some(shrunk) = &headers.shrunk {
        observe(Event::Warning(of_shrunk(shrunk)));
    }
}

/// Warns where only some of the photos have masks, or some masks no photo.
pub(crate) fn tell_masks(masked: Option<&Masked>, observe: &mut Observer<'_>) {
    let Some(found) = masked else { return };
    let dir = found.dir.display();
    if let Some(first) = found.strays.first() {
        observe(Event::Warning(format!(
            "{} files in {dir} belong to no photo, such as {first}: name masks like photos, with .png behind the name",
            found.strays.len()
        )));
    }
    if found.masked < found.photos {
        observe(Event::Warning(format!(
            "{} of {} photos have a mask in {dir}: the others count fully",
            found.masked, found.photos
        )));
    }
}

fn of_unplaced(found: &Unplaced) -> String {
    let Unplaced {
        placed,
        photos,
        model,
        better,
    } = found;
    let has = format!(
        "{placed} of {photos} photos in images/ have a pose in {}",
        model.display()
    );
    match better {
        Some((path, count)) => format!(
            "{has}, and {} places {count}: put that model in its place",
            path.display()
        ),
        None => format!("{has}: the others are not used"),
    }
}

fn of_shrunk(found: &Shrunk) -> String {
    let Shrunk {
        count,
        name,
        photo: [width, height],
        camera: [of_camera, by],
    } = found;
    format!(
        "{count} photos are less than half as large as their cameras, such as {name} with {width}×{height} of {of_camera}×{by} pixels: put the photos there that COLMAP saw, unless you shrank them"
    )
}

fn of_unseeing(found: &SparsePhotos) -> String {
    let (count, total) = (found.photos.len(), found.total);
    let names = listed(found.photos.iter().map(String::as_str));
    let center = match found.center_outside {
        true => ", and a principal point lies outside its photo",
        false => "",
    };
    format!(
        "{count} of {total} photos have fewer than {FEW_POINTS} of the points before them ({names}){center}: poses or intrinsics may be wrong"
    )
}
