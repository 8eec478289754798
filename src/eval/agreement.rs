//! Color consistency of pictures of one place: along a rendered path, and between the photographed
//! views.

use std::{
    collections::VecDeque,
    panic::resume_unwind,
    path::Path,
    sync::mpsc::{Receiver, sync_channel},
    thread,
};

use super::{
    ColoredScene, Drawing, EvalError, Layer, MethodAb, Observer, Painter, Progress, Task,
    mean_pictures,
    picture::{ab_of, to_picture},
};
use crate::{
    capture::{Camera, Photo, in_order},
    chroma::teacher::AbImage,
    input,
    measure::{Consistency, Flow, decode_flo, visible},
    report::{BetweenScore, ConsistencyScore, Method, PathConsistency, PathScore, PictureScore},
    trajectory::camera_path,
};

/// Distances in frames: short range as in the literature, with 1 beside 10, and long
/// range, with 30 beside 7.
const DELTAS: [usize; 4] = [1, 7, 10, 30];

/// Longer side of the pictures that are compared, in pixels: a path's frames wait in
/// memory for their partners.
const MAX_SIDE: u32 = 640;

/// Photographed views that are compared with each other; of more, an even choice. Pairs
/// grow with the square.
const MAX_VIEWS: usize = 60;

/// Share of the first picture that two photographed views must share.
const LEAST_OVERLAP: f64 = 0.2;

/// Triangulated points that each pair's flow is checked on; of more, an even choice.
const MAX_POINTS: usize = 2000;

/// Parts of a drawing that are compared.
struct Frame {
    camera: Camera,
    depth: Vec<f32>,
    colors: Vec<MethodAb>,
}

#[derive(Default)]
struct Sums(Vec<(Method, Consistency)>);

impl Frame {
    fn of(drawing: Drawing, depth: Vec<f32>) -> Self {
        let ab = |(method, layer): &(Method, Layer)| (method.clone(), layer.ab());
        let colors = drawing.layers.iter().map(ab);
        Self {
            colors: colors.collect(),
            camera: drawing.camera,
            depth,
        }
    }

    fn size(&self) -> [usize; 2] {
        [self.camera.width as usize, self.camera.height as usize]
    }

    fn flow_to(&self, other: &Self) -> Flow {
        Flow::geometric(&self.camera, &other.camera, &self.depth)
    }

    /// The flow to another, and which pixels are visible there.
    fn seen_from(&self, other: &Self) -> (Flow, Vec<bool>) {
        let forward = self.flow_to(other);
        let seen = visible(&forward, &other.flow_to(self));
        (forward, seen)
    }

    /// [`Self::seen_from`] by the flow of files, if there are some, between these frames.
    fn compared_with(
        &self,
        other: &Self,
        [own, others]: [usize; 2],
        flow_files: Option<&Path>,
    ) -> Result<(Flow, Vec<bool>), EvalError> {
        let Some(folder) = flow_files else {
            return Ok(self.seen_from(other));
        };
        let forward = self.masked(read_flow(folder, [own, others], self.size())?);
        let backward = other.masked(read_flow(folder, [others, own], other.size())?);
        let seen = visible(&forward, &backward);
        Ok((forward, seen))
    }

    /// Takes what is not known where the scene has no depth out of another's flow.
    fn masked(&self, mut flow: Flow) -> Flow {
        for (vector, depth) in flow.vectors.iter_mut().zip(&self.depth) {
            if depth.is_nan() {
                *vector = [f32::NAN; 2];
            }
        }
        flow
    }
}

impl Sums {
    fn add(&mut self, first: &Frame, second: &Frame, flow: &Flow, seen: &[bool]) {
        for ((method, ours), (other, theirs)) in first.colors.iter().zip(&second.colors) {
            debug_assert_eq!(method, other, "every frame has the same methods");
            if !self.0.iter().any(|(m, _)| m == method) {
                self.0.push((method.clone(), Consistency::default()));
            }
            for (_, sum) in self.0.iter_mut().filter(|(m, _)| m == method) {
                sum.add(ours, theirs, second.size(), flow, seen);
            }
        }
    }

    fn scores(&self) -> Vec<ConsistencyScore> {
        let score = |(method, sum): &(Method, Consistency)| ConsistencyScore::new(method, sum);
        self.0.iter().map(score).collect()
    }
}

/// Measures of a path's frames so far.
struct PathSums {
    /// By distance in frames.
    sums: Vec<(usize, Sums)>,
    pictures: Vec<PictureScore>,
    /// The last frames, the most recent one at the end.
    recent: VecDeque<Frame>,
}

impl PathSums {
    /// Measures frames and their depths as they come.
    fn of(
        frames: Receiver<(Drawing, Vec<f32>)>,
        flow_files: Option<&Path>,
    ) -> Result<Self, EvalError> {
        let mut measured = Self {
            sums: DELTAS.map(|delta| (delta, Sums::default())).into(),
            pictures: Vec::new(),
            recent: VecDeque::new(),
        };
        for (index, (drawing, depth)) in frames.into_iter().enumerate() {
            let (scores, colors): (Vec<PictureScore>, _) = drawing.scores().into_iter().unzip();
            measured.pictures.extend(scores);
            let camera = drawing.camera;
            measured.add(
                index,
                Frame {
                    camera,
                    depth,
                    colors,
                },
                flow_files,
            )?;
        }
        Ok(measured)
    }

    /// Compares a frame with those before it.
    fn add(
        &mut self,
        index: usize,
        frame: Frame,
        flow_files: Option<&Path>,
    ) -> Result<(), EvalError> {
        let recent = &self.recent;
        // The most recent frame is one back.
        let deltas: Vec<usize> = DELTAS.into_iter().filter(|&d| d <= recent.len()).collect();
        let compared = |delta: &usize| {
            let first = &recent[recent.len() - delta];
            first.compared_with(&frame, [index - delta, index], flow_files)
        };
        in_order(&deltas, compared, |delta, compared| {
            let (forward, seen) = compared?;
            let first = &recent[recent.len() - delta];
            for (_, sums) in self.sums.iter_mut().filter(|(d, _)| d == delta) {
                sums.add(first, &frame, &forward, &seen);
            }
            Ok::<_, EvalError>(())
        })?;
        self.recent.push_back(frame);
        if self.recent.len() > DELTAS[DELTAS.len() - 1] {
            self.recent.pop_front();
        }
        Ok(())
    }
}

/// Cameras of a path of so many frames through the training views.
pub fn path_of(scene: &ColoredScene, frames: usize) -> Vec<Camera> {
    let dataset = &scene.dataset;
    let train = &dataset.split.train;
    let cameras: Vec<Camera> = train.iter().map(|&i| small(&dataset.cameras[i])).collect();
    let cameras: Vec<&Camera> = cameras.iter().collect();
    camera_path(&cameras, dataset.extent, frames)
}

/// Draws the frames of a path, gives each to `keep`, and compares them by the scene's own geometry
/// or by optical flow in `flow_files`, named `0000-0007.flo`.
///
/// # Errors
/// [`EvalError`] of the device, the teacher, frames of others or the flow, and whatever `keep`
/// fails with.
pub fn along_path<E: From<EvalError>>(
    painter: &mut Painter<'_>,
    path: &[Camera],
    flow_files: Option<&Path>,
    observe: &mut Observer<'_>,
    keep: &mut dyn FnMut(usize, &Drawing) -> Result<(), E>,
) -> Result<PathScore, E> {
    // Frames are measured while the device draws the next one.
    let (sender, receiver) = sync_channel(1);
    let measured = thread::scope(|scope| {
        let measuring = scope.spawn(|| PathSums::of(receiver, flow_files));
        for (index, camera) in path.iter().enumerate() {
            observe(Progress {
                task: Task::Path,
                done: index,
                total: path.len(),
                name: "",
            });
            let drawing = painter.draw_frame(camera, index)?;
            let depth = painter.depth(camera)?;
            keep(index, &drawing)?;
            if sender.send((drawing, depth)).is_err() {
                // It has failed, and says why.
                break;
            }
        }
        drop(sender);
        let ended = measuring.join();
        Ok::<_, E>(ended.unwrap_or_else(|panic| resume_unwind(panic))?)
    })?;
    let skipped: Vec<usize> = DELTAS.into_iter().filter(|&d| d >= path.len()).collect();
    let flow = if flow_files.is_some() {
        "files"
    } else {
        "geometric"
    };
    Ok(PathScore {
        frames: path.len(),
        size: [path[0].width, path[0].height],
        flow: flow.to_owned(),
        skipped,
        consistency: (measured.sums.iter())
            .flat_map(|(delta, sums)| {
                let delta = *delta;
                let scores = sums.scores().into_iter();
                scores.map(move |score| PathConsistency { delta, score })
            })
            .collect(),
        pictures: mean_pictures(measured.pictures.iter()),
        detections: Vec::new(),
    })
}

/// Compares the photographed views in pairs; where there is a teacher, those that it
/// colored. What photos in color differ by among themselves tells how much is due to
/// light, noise and the flow.
pub fn between_views(
    painter: &mut Painter<'_>,
    scene: &ColoredScene,
    observe: &mut Observer<'_>,
) -> Result<BetweenScore, EvalError> {
    let dataset = &scene.dataset;
    let taught = painter.teacher().is_some();
    let candidates: Vec<usize> = (0..dataset.cameras.len())
        .filter(|&i| !taught || painter.answers(i))
        .collect();
    let count = candidates.len().min(MAX_VIEWS);
    let chosen: Vec<usize> = (0..count)
        .map(|k| candidates[k * candidates.len() / count])
        .collect();
    let mut in_color = true;
    for (done, &view) in chosen.iter().enumerate() {
        observe(Progress {
            task: Task::Views,
            done,
            total: 2 * count,
            name: &dataset.capture.views[view].name,
        });
        in_color = in_color && dataset.color(view)?.rgb.is_some();
    }
    let mut frames = Vec::with_capacity(count);
    for (k, &i) in chosen.iter().enumerate() {
        let name = &dataset.capture.views[i].name;
        observe(Progress {
            task: Task::Views,
            done: count + k,
            total: 2 * count,
            name,
        });
        let camera = small(&dataset.cameras[i]);
        let photo = dataset.color(i)?;
        let mut drawing = painter.draw(&camera, name)?;
        if let Some(answer) = painter.answer(i)? {
            let answer = answer.resized(camera.width, camera.height);
            let layer = Layer::Ab(to_picture(&answer));
            drawing.layers.push((Method::Teacher, layer));
        }
        if in_color {
            let truth = AbImage {
                width: photo.width,
                height: photo.height,
                ab: ab_of(&photo.rgb_values()),
            };
            let truth = to_picture(&truth.resized(camera.width, camera.height));
            drawing.layers.push((Method::Photo, Layer::Ab(truth)));
        }
        let mut depth = painter.depth(&camera)?;
        hide_masked(&photo, &camera, &mut depth);
        frames.push(Frame::of(drawing, depth));
    }
    let points = &dataset.capture.points;
    let every = points.len().div_ceil(MAX_POINTS);
    let mut misses = Vec::new();
    let mut sums = Sums::default();
    let pairs: Vec<[usize; 2]> = (0..count)
        .flat_map(|i| (i + 1..count).map(move |j| [i, j]))
        .collect();
    let mut done = 0;
    let compared = |&[i, j]: &[usize; 2]| frames[i].seen_from(&frames[j]);
    in_order(&pairs, compared, |&[i, j], (forward, seen)| {
        observe(Progress {
            task: Task::Pairs,
            done,
            total: pairs.len(),
            name: "",
        });
        done += 1;
        let (first, second) = (&frames[i], &frames[j]);
        let shared = seen.iter().filter(|seen| **seen).count();
        if shared as f64 >= LEAST_OVERLAP * seen.len() as f64 {
            sums.add(first, second, &forward, &seen);
            let miss = points.iter().step_by(every).filter_map(|point| {
                let (pixel, miss) = forward.miss(&first.camera, &second.camera, point.position)?;
                seen[pixel].then_some(miss)
            });
            misses.extend(miss);
        }
        Ok::<_, EvalError>(())
    })?;
    Ok(BetweenScore {
        views: count,
        size: frames
            .first()
            .map_or([0; 2], |frame| [frame.camera.width, frame.camera.height]),
        least_overlap: LEAST_OVERLAP,
        flow_error: median(misses),
        consistency: sums.scores(),
    })
}

/// The upper median.
fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Takes the depth from where the photo does not count: what someone who walks by hides
/// cannot be compared.
fn hide_masked(photo: &Photo, camera: &Camera, depth: &mut [f32]) {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let across = |at: usize, from: usize, to: u32| at * to as usize / from;
    for (pixel, depth) in depth.iter_mut().enumerate() {
        let column = across(pixel % width, width, photo.width);
        let row = across(pixel / width, height, photo.height);
        if !photo.counts(row * photo.width as usize + column) {
            *depth = f32::NAN;
        }
    }
}

/// The camera at no more than [`MAX_SIDE`] pixels.
fn small(camera: &Camera) -> Camera {
    let longer = camera.width.max(camera.height);
    if longer <= MAX_SIDE {
        return camera.clone();
    }
    let scaled = |side: u32| {
        let exact = f64::from(side) * f64::from(MAX_SIDE) / f64::from(longer);
        (exact.round() as u32).max(1)
    };
    camera.resized(scaled(camera.width), scaled(camera.height))
}

/// The flow from one frame to another: `0000-0007.flo`.
fn read_flow(folder: &Path, [from, to]: [usize; 2], size: [usize; 2]) -> Result<Flow, EvalError> {
    let path = folder.join(format!("{from:04}-{to:04}.flo"));
    let bytes = input::read(&path).map_err(|error| EvalError::NoFlow {
        path: path.clone(),
        error,
    })?;
    decode_flo(&bytes, size[0], size[1]).map_err(|reason| EvalError::Flow { path, reason })
}
