//! Training on gray photos: the photos' square error and total variation by RMSProp, coarse to
//! fine, empty space pruned after each scale.

use std::thread;

use gs_chroma::capture::{Camera, CaptureError, Dataset};

use crate::grid::{Grid, Real, VALUES};

/// Rays of an iteration, as the paper has them.
const BATCH: usize = 5000;
/// Vertices of the scales, and how often each photo is looked at.
const SCALES: [f64; 3] = [6e4, 3e5, 1.5e6];
const EPOCHS: usize = 24;
/// Rates of density and harmonics at the first and the last iteration of a scale.
const RATES: [[Real; 2]; 2] = [[0.1, 0.01], [0.02, 0.002]];
/// RMSProp's memory.
const MEMORY: Real = 0.95;
/// Total variation of density and harmonics against the photos, a vertex.
const VARIATION: [Real; 2] = [2e-3, 2e-3];
/// Bends the total variation at zero.
const SMOOTH: Real = 1e-6;
/// Vertices that weigh less in every pixel are pruned.
const SHOWS: Real = 0.01;
/// Threads, whose sums are added in this order: results do not depend on the machine.
const THREADS: usize = 2;

/// A pixel of a photo: view, place, gray.
pub type Pixel = (u32, [u32; 2], Real);

/// Slopes of the loss, and the vertices that have some.
pub struct Slopes {
    pub values: Vec<Real>,
    pub touched: Vec<u32>,
    is_touched: Vec<bool>,
}

impl Slopes {
    pub fn new(vertices: usize) -> Self {
        Self {
            values: vec![0.0; VALUES * vertices],
            touched: Vec::new(),
            is_touched: vec![false; vertices],
        }
    }

    fn add(&mut self, vertex: usize, slopes: [Real; VALUES]) {
        if !std::mem::replace(&mut self.is_touched[vertex], true) {
            self.touched.push(vertex as u32);
        }
        let values = &mut self.values[vertex * VALUES..][..VALUES];
        for (value, slope) in values.iter_mut().zip(slopes) {
            *value += slope;
        }
    }

    fn take(&mut self, vertex: u32) -> [Real; VALUES] {
        let vertex = vertex as usize;
        self.is_touched[vertex] = false;
        let values = &mut self.values[vertex * VALUES..][..VALUES];
        std::array::from_fn(|k| std::mem::take(&mut values[k]))
    }
}

/// Adds the slopes of the mean square error of some of a batch's pixels, and gives the error.
pub fn photo_loss(
    grid: &Grid,
    cameras: &[Camera],
    pixels: &[Pixel],
    batch: usize,
    slopes: &mut Slopes,
) -> Real {
    let (mut samples, mut loss) = (Vec::new(), 0.0);
    for &(view, place, gray) in pixels {
        let ray = grid.ray(&cameras[view as usize], place);
        let miss = grid.shade(&ray, &mut samples) - gray;
        loss += miss * miss / batch as Real;
        let slope = 2.0 * miss / batch as Real;
        grid.shade_back(&ray, &samples, slope, |vertex, values| {
            slopes.add(vertex, values)
        });
    }
    loss
}

/// Adds the slopes of the total variation at the vertices that are touched so far, a mean over
/// these, and gives it: λ times the size of the differences to the next vertices, value by value.
pub fn variation(grid: &Grid, slopes: &mut Slopes) -> Real {
    let (strides, touched) = (grid.strides(), slopes.touched.len());
    let mut loss = 0.0;
    for k in 0..touched {
        let vertex = slopes.touched[k] as usize;
        let coordinates = grid.coordinates(vertex);
        // At the border there is no next one.
        let next = [0, 1, 2].map(|axis| match coordinates[axis] + 1 < grid.size[axis] {
            true => vertex + strides[axis],
            false => vertex,
        });
        let (mut own, mut others) = ([0.0; VALUES], [[0.0; VALUES]; 3]);
        for k in 0..VALUES {
            let weight = VARIATION[k.min(1)] / touched as Real;
            let value = |vertex: usize| grid.values[vertex * VALUES + k];
            let steps = next.map(|next| value(next) - value(vertex));
            let size = steps.iter().map(|step| step * step).sum::<Real>();
            let size = (size + SMOOTH).sqrt();
            loss += weight * size;
            for axis in 0..3 {
                let slope = weight * steps[axis] / size;
                own[k] -= slope;
                others[axis][k] += slope;
            }
        }
        slopes.add(vertex, own);
        for (next, slope) in next.into_iter().zip(others) {
            slopes.add(next, slope);
        }
    }
    loss
}

/// Pixels of the training photos.
fn pixels(dataset: &Dataset) -> Result<Vec<Pixel>, CaptureError> {
    let mut pixels = Vec::new();
    dataset.visit(&dataset.split.train, |view, photo| {
        let gray = photo.gray_values();
        let all = (0..gray.len()).filter(|&pixel| photo.counts(pixel));
        pixels.extend(all.map(|pixel| {
            let place = [pixel as u32 % photo.width, pixel as u32 / photo.width];
            (view as u32, place, gray[pixel] as Real)
        }));
        Ok::<_, CaptureError>(())
    })?;
    Ok(pixels)
}

/// One step of RMSProp from slopes that are used up.
fn descend(grid: &mut Grid, squares: &mut [Real], slopes: &mut [Slopes; THREADS], t: Real) {
    let [first, rest @ ..] = slopes;
    for more in rest {
        for vertex in std::mem::take(&mut more.touched) {
            let values = more.take(vertex);
            first.add(vertex as usize, values);
        }
    }
    variation(grid, first);
    let rate = |[begin, end]: [Real; 2]| begin * (end / begin).powf(t);
    let rates = RATES.map(rate);
    for vertex in std::mem::take(&mut first.touched) {
        let values = first.take(vertex);
        let vertex = vertex as usize;
        if !grid.live[vertex] {
            continue;
        }
        for (k, slope) in values.into_iter().enumerate() {
            let square = &mut squares[vertex * VALUES + k];
            // What is touched for the first time has no past.
            let memory = if *square == 0.0 { 0.0 } else { MEMORY };
            *square = memory * *square + (1.0 - memory) * slope * slope;
            let step = rates[k.min(1)] * slope / (square.sqrt() + Real::EPSILON);
            grid.values[vertex * VALUES + k] -= step;
        }
    }
}

/// The most that any pixel shows of each vertex.
fn most_shown(grid: &Grid, cameras: &[Camera], pixels: &[Pixel]) -> Vec<Real> {
    let (mut most, mut samples) = (vec![0.0; grid.live.len()], Vec::new());
    for &(view, place, _) in pixels {
        let ray = grid.ray(&cameras[view as usize], place);
        for (vertex, weight) in grid.weights(&ray, &mut samples) {
            most[vertex] = weight.max(most[vertex]);
        }
    }
    most
}

/// A grid that looks as the gray training photos; `tell` hears of scale, error and vertices.
pub fn train(
    dataset: &Dataset,
    mut tell: impl FnMut(usize, Real, usize),
) -> Result<Grid, CaptureError> {
    let mut random = fastrand::Rng::with_seed(0);
    let (mut pixels, cameras) = (pixels(dataset)?, &dataset.cameras);
    let mut grid = Grid::around(dataset, SCALES[0]);
    for (scale, vertices) in SCALES.into_iter().enumerate() {
        if scale > 0 {
            grid = grid.finer((vertices / SCALES[scale - 1]).cbrt());
        }
        let mut squares = vec![0.0; grid.values.len()];
        let mut slopes = [(); THREADS].map(|()| Slopes::new(grid.live.len()));
        let mut error = 0.0;
        for epoch in 0..EPOCHS {
            random.shuffle(&mut pixels);
            error = 0.0;
            for (k, batch) in pixels.chunks(BATCH).enumerate() {
                let share = batch.len().div_ceil(THREADS);
                let own = |(some, slopes)| photo_loss(&grid, cameras, some, batch.len(), slopes);
                let loss: Real = thread::scope(|scope| {
                    let parts = batch.chunks(share).zip(&mut slopes);
                    let running: Vec<_> =
                        parts.map(|part| scope.spawn(move || own(part))).collect();
                    running
                        .into_iter()
                        .map(|one| one.join().unwrap_or(Real::NAN))
                        .sum()
                });
                error += loss * batch.len() as Real / pixels.len() as Real;
                let batches = pixels.len().div_ceil(BATCH);
                let t = (epoch * batches + k) as Real / (EPOCHS * batches) as Real;
                descend(&mut grid, &mut squares, &mut slopes, t);
            }
        }
        let most = most_shown(&grid, cameras, &pixels);
        grid.prune(|vertex| most[vertex] >= SHOWS);
        tell(scale, error, grid.live.iter().filter(|live| **live).count());
    }
    Ok(grid)
}
