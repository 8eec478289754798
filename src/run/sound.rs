//! Whether photos and model can be worked with, and what is told where that is doubtful.

use std::path::Path;

use super::{Event, Observer, RunError, Stage, scene};
use crate::{
    capture::{
        Camera, Capture, CaptureError, Dataset, Headers, LoadOptions, Rejected, Shrunk, Unplaced,
    },
    effects::{
        Cause, Contradiction, Contradictory, Evidence, FEW_POINTS, Place, PointColors,
        Reprojection, Survey, Unseeing, listed,
    },
};

/// What follows from the model alone.
pub(super) struct Model {
    /// Photos with poses that contradict it.
    pub photos: Vec<Rejected>,
    /// Whether its observations are where its points project to.
    tracks: bool,
    /// Where photos can be compared with the points' colors, if anywhere.
    colors: Option<Place>,
}

/// Opens a COLMAP folder and judges the model; of the photos only headers are read.
pub(super) fn open_checked(
    dir: &Path,
    options: &LoadOptions,
    observe: &mut Observer<'_>,
) -> Result<Dataset, RunError> {
    let mut dataset = scene::open(dir, options, observe)?;
    let headers = Headers::read(&dataset.capture.views)?;
    tell_folder(&dataset.capture, &headers, observe)?;
    let model = check_model(&dataset.capture, &dataset.cameras, options.force, observe)?;
    for Rejected { name, reason } in &model.photos {
        observe(Event::Warning(format!("{name}: {reason}")));
    }
    model.keep_tracks(&mut dataset.capture);
    Ok(dataset)
}

/// Opens a COLMAP folder, judges model and photos and examines the photos, each decoded once.
/// Where single photos contradict the model, all is done again without them.
///
/// # Errors
/// [`RunError::Unsound`] where all contradict it, unless the options say that this does not
/// matter.
pub(super) fn open_examined(
    dir: &Path,
    options: &LoadOptions,
    observe: &mut Observer<'_>,
) -> Result<(Dataset, Evidence), RunError> {
    let mut dataset = scene::open(dir, options, observe)?;
    let headers = Headers::read(&dataset.capture.views)?;
    tell_folder(&dataset.capture, &headers, observe)?;
    let model = check_model(&dataset.capture, &dataset.cameras, options.force, observe)?;
    let colors = model
        .colors
        .map(|place| PointColors::of(&dataset.capture, &dataset.cameras, options.channel, place));
    model.keep_tracks(&mut dataset.capture);
    let (evidence, photos) = examine(&dataset, colors, observe)?;
    let mut unfit = model.photos.clone();
    unfit.extend(photos);
    unfit.sort_by(|a, b| a.name.cmp(&b.name));
    unfit.dedup_by(|b, a| a.name == b.name);
    if unfit.is_empty() {
        return Ok((dataset, evidence));
    }
    let done = match options.force {
        true => "used all the same",
        false => "left out",
    };
    for Rejected { name, reason } in &unfit {
        observe(Event::Warning(format!("{done}: {name}: {reason}")));
    }
    if options.force {
        return Ok((dataset, evidence));
    }
    let mut options = dataset.options.clone();
    options.left_out.extend(unfit);
    // What is to be said has been said.
    let quietly = &mut |event| {
        if matches!(event, Event::Progress { .. }) {
            observe(event);
        }
    };
    let mut dataset = scene::open(dir, &options, quietly)?;
    model.keep_tracks(&mut dataset.capture);
    let (evidence, _) = examine(&dataset, None, quietly)?;
    Ok((dataset, evidence))
}

/// Judges the model of a capture; `cameras` are those of its views at working size.
///
/// # Errors
/// [`RunError::Unsound`] where it contradicts itself, unless it is `forced`.
pub(super) fn check_model(
    capture: &Capture,
    cameras: &[Camera],
    forced: bool,
    observe: &mut Observer<'_>,
) -> Result<Model, RunError> {
    let reprojection = Reprojection::of(capture, cameras);
    let found = (reprojection.as_ref()).and_then(|found| found.contradictory(capture, cameras));
    let mut model = Model {
        photos: Vec::new(),
        tracks: reprojection.is_some(),
        colors: Some(Place::Seen),
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
            observe(Event::Warning(format!(
                "{error}; its observations are no evidence of anything"
            )));
            model.tracks = false;
            model.colors = cameras_are_right.then_some(Place::Projected);
        }
    }
    if !model.tracks
        && let Some(unseeing) = Unseeing::of(capture, cameras)
    {
        observe(Event::Warning(of_unseeing(&unseeing)));
    }
    Ok(model)
}

impl Model {
    /// Drops the observations of a capture if they are of no use.
    fn keep_tracks(&self, capture: &mut Capture) {
        if !self.tracks {
            for point in &mut capture.points {
                point.track.clear();
            }
        }
    }
}

/// Examines all photos, each decoded once; also gives those that do not show what COLMAP saw.
fn examine(
    dataset: &Dataset,
    mut colors: Option<PointColors>,
    observe: &mut Observer<'_>,
) -> Result<(Evidence, Vec<Rejected>), RunError> {
    let mut survey = Survey::new(&dataset.capture, &dataset.cameras, &dataset.split);
    let all: Vec<usize> = (0..dataset.cameras.len()).collect();
    dataset.visit(&all, |view, photo| {
        survey.look(view, photo);
        if let Some(colors) = &mut colors {
            colors.look(view, photo);
        }
        observe(Event::Progress {
            stage: Stage::Photos,
            done: view,
            total: all.len(),
            message: dataset.capture.views[view].name.clone(),
        });
        Ok::<_, CaptureError>(())
    })?;
    scene::tell_not_finite(dataset, observe);
    let agreement = colors.map(|colors| colors.finish(&dataset.capture));
    let found = agreement.and_then(|agreement| agreement.contradictory(&dataset.capture));
    let photos = match found {
        None => Vec::new(),
        Some(Contradictory::Some(photos)) => photos,
        Some(Contradictory::All(error)) if dataset.options.force => {
            observe(Event::Warning(error.to_string()));
            Vec::new()
        }
        Some(Contradictory::All(error)) => return Err(error.into()),
    };
    Ok((survey.finish(), photos))
}

/// Warns where few of the photos that are there are used, or small versions of them.
///
/// # Errors
/// [`RunError::Capture`] if the model is gone.
pub(super) fn tell_folder(
    capture: &Capture,
    headers: &Headers,
    observe: &mut Observer<'_>,
) -> Result<(), RunError> {
    if let Some(unplaced) = Unplaced::of(capture)? {
        observe(Event::Warning(of_unplaced(&unplaced)));
    }
    if let Some(shrunk) = &headers.shrunk {
        observe(Event::Warning(of_shrunk(shrunk)));
    }
    Ok(())
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

fn of_unseeing(found: &Unseeing) -> String {
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
