//! The camera's motion: whether a shot has parallax, or one place in its middle.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::{
    database::{Matches, Pair},
    rotations::{Residuals, Seen, Turned},
};

/// Matches that a pair needs to count.
const LEAST_MATCHES: usize = 15;

/// Median distance, in pixels of photos 640 wide, up to which matches agree with rotations: twice
/// what features are off. The 80th percentile may be farther, for people move in front of cameras: a
/// pan with a person has 1.8, a dolly 10 (`tools/check_shots.py`).
const AGREE: f64 = 1.0;
const MOST_AGREE: f64 = 4.0;

/// Turn in degrees that is no more than a camera's shaking or a gate's weave.
const SHAKES: f64 = 1.5;

/// Change of the focal length up to which a camera does not zoom.
const ZOOMS: f64 = 1.02;

/// Focal length of a photo of unknown optics, of its longer side: COLMAP's.
const FOCAL: f64 = 1.2;

/// Photos at most whose camera's motion is found out: equations grow with their square, and
/// nobody takes more from one place.
const MOST_PHOTOS: usize = 300;

/// Motion of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum CameraMotion {
    /// From place to place: photos have parallax, and depth can be found.
    Moves,
    /// About one place, or it zooms: photos have no parallax.
    Turns,
    /// It stands still.
    Stands,
}

serde_plain::derive_display_from_serialize!(CameraMotion);

/// A camera's motion, and the evidence for it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Motion {
    /// Motion that poses were found for.
    pub camera: CameraMotion,
    /// Pairs of photos with matches.
    pub pairs: usize,
    /// Median distance in pixels, of photos 640 wide, that matches are from where rotations about
    /// one place put them.
    pub off: f64,
    /// 80th percentile of these distances.
    pub off_at_most: f64,
    /// Largest angle between two photos, in degrees, if the camera does not move.
    pub turned: f64,
    /// Longest focal length by shortest, if the camera does not move.
    pub zoomed: f64,
}

impl Motion {
    /// The evidence, in words.
    pub fn in_words(&self) -> String {
        let Self {
            pairs,
            off,
            turned,
            zoomed,
            ..
        } = self;
        let agree =
            format!("matches of {pairs} pairs are {off:.1} pixels off a rotation about one place");
        let zoom = match *zoomed > ZOOMS {
            true => format!(" and zooms {zoomed:.2} times"),
            false => String::new(),
        };
        match self.camera {
            CameraMotion::Moves => format!("the camera moves: {agree}"),
            CameraMotion::Turns => format!("the camera turns by {turned:.0}°{zoom}: {agree}"),
            CameraMotion::Stands => format!("the camera stands: {agree}"),
        }
    }
}

/// Photos of a camera that does not move, if they were taken by such a one.
pub(super) struct Still {
    /// Indices of the photos among those of the database, in order.
    pub photos: Vec<usize>,
    /// Their rotations and focal lengths.
    pub turned: Turned,
}

/// Principal point, which is taken to be the middle.
pub(super) fn middle([width, height]: [u32; 2]) -> DVec2 {
    DVec2::new(f64::from(width), f64::from(height)) * 0.5
}

/// Finds out how the camera moved, or finds rotations for the motion that is `told`; `None`
/// where no photos match, or too many.
pub(super) fn found(matches: &Matches, told: Option<CameraMotion>) -> Option<(Motion, Still)> {
    let (photos, pairs) = connected(matches);
    if told.is_none() && photos.len() > MOST_PHOTOS {
        return None;
    }
    let size = matches.photos[*photos.first()?].size;
    let side = size[0].max(size[1]);
    let at = |photo: usize| photos.binary_search(&photo).ok();
    let seen: Vec<Seen> = (pairs.iter())
        .filter_map(|pair| {
            let [first, second] = pair.photos;
            let place = |photo: usize, feature: u32| {
                let photo = &matches.photos[photo];
                let [x, y] = photo.features[feature as usize].map(f64::from);
                DVec2::new(x, y) - middle(photo.size)
            };
            Some(Seen {
                photos: [at(first)?, at(second)?],
                places: (pair.matches.iter())
                    .map(|&[a, b]| [place(first, a), place(second, b)])
                    .collect(),
            })
        })
        .collect();
    let focal = FOCAL * f64::from(side);
    let solve = |zooms| {
        let turned = Turned::of(photos.len(), &seen, (focal, side), zooms);
        let residuals = turned.residuals(&seen, side);
        residuals.map(|residuals| (turned, residuals))
    };
    let (mut turned, mut off) = solve(false)?;
    if !agrees(off) {
        let zoomed = solve(true)?;
        if agrees(zoomed.1) || told.is_some_and(|told| told != CameraMotion::Moves) {
            (turned, off) = zoomed;
        }
    }
    let angle = largest_angle(&turned);
    let lengths = || turned.focals.iter().copied();
    let zoomed = lengths().fold(0.0, f64::max) / lengths().fold(f64::INFINITY, f64::min);
    let camera = told.unwrap_or(match agrees(off) {
        false => CameraMotion::Moves,
        true if angle > SHAKES || zoomed > ZOOMS => CameraMotion::Turns,
        true => CameraMotion::Stands,
    });
    let motion = Motion {
        camera,
        pairs: seen.len(),
        off: off.median,
        off_at_most: off.most,
        turned: angle,
        zoomed,
    };
    Some((motion, Still { photos, turned }))
}

fn agrees(off: Residuals) -> bool {
    off.median <= AGREE && off.most <= MOST_AGREE
}

/// Largest angle between the viewing directions of two photos, in degrees.
fn largest_angle(turned: &Turned) -> f64 {
    let axes: Vec<_> = turned
        .rotations
        .iter()
        .map(|r| r.transpose().z_axis)
        .collect();
    let least = (axes.iter().enumerate())
        .flat_map(|(k, a)| axes[k + 1..].iter().map(|b| a.dot(*b)))
        .fold(1.0, f64::min);
    least.clamp(-1.0, 1.0).acos().to_degrees()
}

/// The most photos that are joined by pairs with enough matches, and these pairs.
fn connected(matches: &Matches) -> (Vec<usize>, Vec<&Pair>) {
    let pairs: Vec<&Pair> = (matches.pairs.iter())
        .filter(|pair| pair.matches.len() >= LEAST_MATCHES)
        .collect();
    let mut group: Vec<usize> = (0..matches.photos.len()).collect();
    loop {
        let mut changed = false;
        for pair in &pairs {
            let [a, b] = pair.photos;
            let least = group[a].min(group[b]);
            changed |= group[a] != least || group[b] != least;
            (group[a], group[b]) = (least, least);
        }
        if !changed {
            break;
        }
    }
    let size = |of: usize| group.iter().filter(|&&other| other == of).count();
    let Some(most) = (0..group.len()).max_by_key(|&of| (size(of), std::cmp::Reverse(of))) else {
        return (Vec::new(), Vec::new());
    };
    let photos: Vec<usize> = (0..group.len())
        .filter(|&photo| group[photo] == most)
        .collect();
    if photos.len() < 2 {
        return (Vec::new(), Vec::new());
    }
    let pairs = pairs
        .into_iter()
        .filter(|pair| group[pair.photos[0]] == most);
    (photos, pairs.collect())
}
