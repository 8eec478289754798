//! The voxel grid: density and luma harmonics at its vertices, between them trilinear, and rays
//! through it (Plenoxels, CVPR 2022).

use glam::{DMat3, DVec3};
use gs_chroma::{
    capture::{Camera, Dataset},
    splats::sh,
};

/// What is computed in; tests compare gradients with differences, which needs more digits.
#[cfg(not(test))]
pub type Real = f32;
#[cfg(test)]
pub type Real = f64;

/// Degree of the luma harmonics.
pub const DEGREE: u32 = 1;
/// Harmonics of a vertex, and its values with the density, which comes first.
pub const HARMONICS: usize = sh::coefficient_count(DEGREE);
pub const VALUES: usize = 1 + HARMONICS;

/// Step along a ray, in cells.
const STEP: Real = 0.5;
/// A ray ends where less light than this passes.
const DARK: Real = 1e-3;
/// Density to begin with, a cell.
const BEGIN: Real = 0.01;

/// Share of COLMAP's points outside the box on either side of an axis, and its margin.
const OUTSIDE: f64 = 0.01;
const MARGIN: f64 = 0.15;

/// A grid of cubes. Coordinates of the grid count cells from the first vertex.
#[derive(Clone)]
pub struct Grid {
    /// From the world's axes to the grid's.
    rotation: DMat3,
    /// The first vertex, along the grid's axes.
    origin: DVec3,
    /// Side of a cell in world units.
    pub cell: f64,
    /// Vertices along each axis.
    pub size: [usize; 3],
    /// `[vertices][density, harmonics]`; the density a cell, none below 0.
    pub values: Vec<Real>,
    /// Vertices that may show.
    pub live: Vec<bool>,
    /// Cells, by their first vertex, of which a corner may show.
    occupied: Vec<bool>,
}

/// A ray in the grid's coordinates; `direction` has the length of a step.
pub struct Ray {
    origin: [Real; 3],
    direction: [Real; 3],
    basis: [Real; HARMONICS],
    /// Steps at which it is in the grid.
    steps: [usize; 2],
}

/// A place on a ray that shows.
pub struct Sample {
    /// First vertex of the cell.
    pub first: usize,
    /// Weights of the cell's corners.
    pub corners: [Real; 8],
    /// Share of the pixel's light that comes from here.
    pub weight: Real,
    luma: Real,
    /// Light that passes the place.
    passing: Real,
}

impl Grid {
    /// About so many vertices around COLMAP's points, along the axes of a camera in the middle.
    pub fn around(dataset: &Dataset, vertices: f64) -> Self {
        let train = &dataset.split.train;
        let rotation = dataset.cameras[train[train.len() / 2]].rotation;
        let points = dataset.capture.points.iter();
        let points: Vec<DVec3> = points.map(|point| rotation * point.position).collect();
        let bounds = |axis: usize| {
            let mut values: Vec<f64> = points.iter().map(|point| point[axis]).collect();
            values.sort_unstable_by(f64::total_cmp);
            let least = (OUTSIDE * values.len() as f64) as usize;
            let [low, high] = [values[least], values[values.len() - 1 - least]];
            let margin = MARGIN * (high - low);
            [low - margin, high + margin]
        };
        let bounds = [0, 1, 2].map(bounds);
        let extent = DVec3::from(bounds.map(|[low, high]| high - low));
        let origin = DVec3::from(bounds.map(|[low, _]| low));
        let cell = (extent.element_product() / vertices).cbrt();
        let size = <[f64; 3]>::from(extent / cell).map(|side| side.ceil() as usize + 1);
        let mut grid = Self::empty(rotation, origin, cell, size);
        (grid.values.iter_mut().step_by(VALUES)).for_each(|density| *density = BEGIN);
        grid.live.fill(true);
        grid.occupy();
        grid
    }

    /// A grid without anything in it.
    pub fn empty(rotation: DMat3, origin: DVec3, cell: f64, size: [usize; 3]) -> Self {
        let count = size.iter().product();
        Self {
            rotation,
            origin,
            cell,
            size,
            values: vec![0.0; VALUES * count],
            live: vec![false; count],
            occupied: vec![false; count],
        }
    }

    /// The same with cells smaller by `factor`.
    pub fn finer(&self, factor: f64) -> Self {
        let cell = self.cell / factor;
        let size = (self.size).map(|n| ((n - 1) as f64 * factor).ceil() as usize + 1);
        let mut fine = Self::empty(self.rotation, self.origin, cell, size);
        for vertex in 0..fine.live.len() {
            let place = fine.coordinates(vertex).map(|c| c as Real / factor as Real);
            let (first, corners) = self.cell_of(place);
            fine.live[vertex] = self.occupied[first];
            let values = self.interpolated(first, &corners);
            fine.values[vertex * VALUES..][..VALUES].copy_from_slice(&values);
            fine.values[vertex * VALUES] /= factor as Real;
        }
        fine.occupy();
        fine
    }

    /// Lets nothing show but cells with a corner that `shows`.
    pub fn prune(&mut self, shows: impl Fn(usize) -> bool) {
        self.live = (0..self.live.len()).map(shows).collect();
        self.occupy();
        // The other corners of what shows.
        let (cells, offsets) = (self.occupied.clone(), self.offsets());
        for first in (0..cells.len()).filter(|&first| cells[first]) {
            for offset in offsets {
                self.live[first + offset] = true;
            }
        }
        let densities = self.values.iter_mut().step_by(VALUES).zip(&self.live);
        densities
            .filter(|(_, live)| !**live)
            .for_each(|(density, _)| *density = 0.0);
    }

    /// Marks the cells of which a corner is live.
    pub fn occupy(&mut self) {
        let offsets = self.offsets();
        for first in 0..self.occupied.len() {
            let inside = (self.coordinates(first).iter().zip(self.size)).all(|(&c, n)| c + 1 < n);
            let live = |offset: &usize| self.live[first + offset];
            self.occupied[first] = inside && offsets.iter().any(live);
        }
    }

    /// Steps from a vertex to its neighbors along the axes.
    pub fn strides(&self) -> [usize; 3] {
        [1, self.size[0], self.size[0] * self.size[1]]
    }

    /// Steps from a cell's first vertex to its corners.
    pub fn offsets(&self) -> [usize; 8] {
        let strides = self.strides();
        std::array::from_fn(|corner| {
            (0..3)
                .map(|axis| (corner >> axis & 1) * strides[axis])
                .sum()
        })
    }

    /// Coordinates of a vertex.
    pub fn coordinates(&self, vertex: usize) -> [usize; 3] {
        let [_, row, layer] = self.strides();
        [vertex % row, vertex % layer / row, vertex / layer]
    }

    /// Place of a vertex in the world.
    pub fn place(&self, vertex: usize) -> DVec3 {
        let coordinates = self.coordinates(vertex).map(|c| c as f64);
        self.rotation.transpose() * (self.origin + self.cell * DVec3::from(coordinates))
    }

    /// The ray through the middle of a pixel, as long as it is in the grid.
    pub fn ray(&self, camera: &Camera, [x, y]: [u32; 2]) -> Ray {
        let slopes = [
            (f64::from(x) + 0.5 - camera.cx) / camera.fx,
            (f64::from(y) + 0.5 - camera.cy) / camera.fy,
        ];
        let ahead = DVec3::new(slopes[0], slopes[1], 1.0).normalize();
        let world = camera.rotation.transpose() * ahead;
        let origin = (self.rotation * camera.center() - self.origin) / self.cell;
        let direction = f64::from(STEP) * (self.rotation * world);
        let (mut from, mut to) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let last = (self.size[axis] - 1) as f64;
            let ends = [0.0, last].map(|end| (end - origin[axis]) / direction[axis]);
            from = from.max(ends[0].min(ends[1]));
            to = to.min(ends[0].max(ends[1]));
        }
        let basis = sh::basis(DEGREE, world.into());
        Ray {
            origin: origin.to_array().map(|v| v as Real),
            direction: direction.to_array().map(|v| v as Real),
            basis: std::array::from_fn(|k| basis[k] as Real),
            steps: [from.ceil() as usize, (to.floor() + 1.0).max(0.0) as usize],
        }
    }

    /// The cell of a place, by its first vertex, and the weights of its corners.
    fn cell_of(&self, place: [Real; 3]) -> (usize, [Real; 8]) {
        let (mut first, strides) = (0, self.strides());
        let mut parts = [0.0; 3];
        for axis in 0..3 {
            let low = (place[axis].max(0.0) as usize).min(self.size[axis] - 2);
            first += low * strides[axis];
            parts[axis] = (place[axis] - low as Real).min(1.0);
        }
        let corners = std::array::from_fn(|corner| {
            let part = |axis: usize| match corner >> axis & 1 {
                0 => 1.0 - parts[axis],
                _ => parts[axis],
            };
            part(0) * part(1) * part(2)
        });
        (first, corners)
    }

    fn interpolated(&self, first: usize, corners: &[Real; 8]) -> [Real; VALUES] {
        let mut sums = [0.0; VALUES];
        for (offset, weight) in self.offsets().iter().zip(corners) {
            let values = &self.values[(first + offset) * VALUES..][..VALUES];
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += weight * value;
            }
        }
        sums
    }

    /// Luma of a pixel, by its ray's `samples`; what is behind the grid is black.
    pub fn shade(&self, ray: &Ray, samples: &mut Vec<Sample>) -> Real {
        samples.clear();
        let (mut light, mut sum) = (1.0, 0.0);
        for step in ray.steps[0]..ray.steps[1] {
            let at = |axis: usize| ray.origin[axis] + step as Real * ray.direction[axis];
            let (first, corners) = self.cell_of([0, 1, 2].map(at));
            if !self.occupied[first] {
                continue;
            }
            let values = self.interpolated(first, &corners);
            if values[0] <= 0.0 {
                continue;
            }
            let luma = values[1..]
                .iter()
                .zip(&ray.basis)
                .map(|(c, b)| c * b)
                .sum::<Real>()
                + 0.5;
            let passing = light * (-STEP * values[0]).exp();
            let weight = light - passing;
            sum += weight * luma;
            samples.push(Sample {
                first,
                corners,
                weight,
                luma,
                passing,
            });
            light = passing;
            if light < DARK {
                break;
            }
        }
        sum
    }

    /// The adjoint of [`Grid::shade`]: tells `add` the slope of each value of each vertex, `slope`
    /// being that of the luma.
    pub fn shade_back(
        &self,
        ray: &Ray,
        samples: &[Sample],
        slope: Real,
        mut add: impl FnMut(usize, [Real; VALUES]),
    ) {
        let offsets = self.offsets();
        // Luma from behind the sample.
        let mut behind = 0.0;
        for sample in samples.iter().rev() {
            let density = slope * STEP * (sample.passing * sample.luma - behind);
            behind += sample.weight * sample.luma;
            let luma = slope * sample.weight;
            for (offset, weight) in offsets.iter().zip(&sample.corners) {
                let mut slopes = [weight * density; VALUES];
                for (value, basis) in slopes[1..].iter_mut().zip(&ray.basis) {
                    *value = weight * luma * basis;
                }
                add(sample.first + offset, slopes);
            }
        }
    }

    /// What a pixel shows of each vertex, and how much, by its ray.
    pub fn weights(&self, ray: &Ray, samples: &mut Vec<Sample>) -> Vec<(usize, Real)> {
        self.shade(ray, samples);
        let offsets = self.offsets();
        let corners = samples.iter().flat_map(|sample| {
            let corners = offsets.iter().zip(&sample.corners);
            corners.map(|(offset, corner)| (sample.first + offset, corner * sample.weight))
        });
        let mut corners: Vec<(usize, Real)> = corners.collect();
        corners.sort_unstable_by_key(|&(vertex, _)| vertex);
        corners.dedup_by(|next, kept| {
            let same = next.0 == kept.0;
            kept.1 += if same { next.1 } else { 0.0 };
            same
        });
        corners
    }
}
