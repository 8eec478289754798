//! Range in which a distortion is one-to-one, and its inverse there.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec2;

use super::distortion::{Distortion, determinant};
use super::projection::Projection;

/// Angles from the axis at which a distortion is looked at: 0.18° apart.
const ANGLES: usize = 512;

/// Directions around the axis, where it is not radial only.
const DIRECTIONS: usize = 24;

/// Halvings of an interval until its ends are neighbors: about 60, and at most as
/// many as lead from the largest f64 to the smallest.
const HALVINGS: usize = 2100;

/// Newton's steps after the radial part, which converge in four or not at all.
const NEWTON_STEPS: usize = 30;

/// Largest residual of the inverse, as a part of the radius and at least absolute.
const TOLERANCE: f64 = 1e-11;

/// The largest radius on the plane up to which the distortion neither folds back
/// nor turns over.
pub(super) fn limit(projection: Projection, distortion: &Distortion) -> f64 {
    if projection == Projection::Equirectangular {
        return f64::INFINITY;
    }
    let directions = if distortion.is_radial() {
        1
    } else {
        DIRECTIONS
    };
    let mut limit = 0.0;
    for step in 1..ANGLES {
        let radius = projection.radius(FRAC_PI_2 * step as f64 / ANGLES as f64);
        let sound = (0..directions).all(|direction| {
            let around = DVec2::from_angle(TAU * direction as f64 / directions as f64);
            let columns = distortion.derivative(radius * around);
            // NaN fails both comparisons. A place must stay on its side of the axis.
            determinant(columns) > 0.0 && around.dot(distortion.apply(radius * around)) > 0.0
        });
        if !sound {
            break;
        }
        limit = radius;
    }
    limit
}

/// The place of at most the radius `limit` that the distortion moves to
/// `distorted`; none where there is none.
pub(super) fn undistorted(distortion: &Distortion, limit: f64, distorted: DVec2) -> Option<DVec2> {
    if distortion.is_none() {
        return (distorted.length() <= limit).then_some(distorted);
    }
    let length = distorted.length();
    if length == 0.0 && distortion.is_radial() {
        return Some(DVec2::ZERO);
    }
    let radius = undistorted_radius(distortion, limit, length);
    if distortion.is_radial() {
        return Some(distorted * (radius? / length));
    }
    // What is not radial is small: its inverse begins where the radial part's ends.
    let start = match (length > 0.0, radius) {
        (true, radius) => distorted * (radius.unwrap_or(limit) / length),
        (false, _) => DVec2::ZERO,
    };
    newton(distortion, limit, distorted, start)
}

/// The radius that the radial part moves to `distorted`, by bisection: it grows
/// with the radius up to `limit`.
fn undistorted_radius(distortion: &Distortion, limit: f64, distorted: f64) -> Option<f64> {
    let moved = |radius: f64| radius * distortion.radial(radius * radius);
    // NaN fails the comparison.
    let reached = moved(limit) >= distorted;
    let (mut low, mut high) = (0.0, limit);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if moved(middle) < distorted {
            low = middle;
        } else {
            high = middle;
        }
    }
    reached.then_some(0.5 * (low + high))
}

/// Newton's method with steps halved until the residual shrinks.
fn newton(distortion: &Distortion, limit: f64, distorted: DVec2, start: DVec2) -> Option<DVec2> {
    let tolerance = TOLERANCE * (1.0 + distorted.length());
    let residual = |place: DVec2| distortion.apply(place) - distorted;
    let mut place = start;
    let mut left = residual(place);
    for _ in 0..NEWTON_STEPS {
        if left.length() <= tolerance {
            break;
        }
        let [x, y] = distortion.derivative(place);
        let determinant = determinant([x, y]);
        let step = DVec2::new(left.perp_dot(y), x.perp_dot(left)) / determinant;
        if !step.is_finite() {
            return None;
        }
        let mut share = 1.0;
        loop {
            let next = place - share * step;
            let rest = residual(next);
            if rest.length() < left.length() {
                (place, left) = (next, rest);
                break;
            }
            share *= 0.5;
            if share < 1e-6 {
                return None;
            }
        }
    }
    (left.length() <= tolerance && place.length() <= limit).then_some(place)
}
