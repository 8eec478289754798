//! COLMAP model of photos that were taken from one place: all cameras in the origin, and points on
//! a sphere around it.

use std::{collections::BTreeMap, fmt::Write, path::Path};

use glam::{DQuat, DVec2, DVec3};

use super::{
    PrepareError,
    database::Matches,
    motion::{Still, middle},
};
use crate::store::files;

/// Radius of the sphere, in world units: any will do, for no photo shows depth.
const RADIUS: f64 = 10.0;

/// Distance in pixels, of photos 640 wide, from where it should be at which an observation is
/// left out.
const OFF: f64 = 3.0;
const WIDE: f64 = 640.0;

/// A feature of a photo, indices among those of the database.
type Feature = (usize, u32);

/// A place on the sphere, and the features that show it.
struct Track {
    place: DVec3,
    features: Vec<Feature>,
}

/// Writes the model's three text files into a folder.
///
/// # Errors
/// Those of the file system.
pub(super) fn write(still: &Still, matches: &Matches, folder: &Path) -> Result<(), PrepareError> {
    let tracks = tracks(still, matches);
    let mut of_photo: BTreeMap<usize, Vec<(u32, usize)>> = BTreeMap::new();
    for (point, track) in tracks.iter().enumerate() {
        for &(photo, feature) in &track.features {
            of_photo.entry(photo).or_default().push((feature, point));
        }
    }
    let one_lens = (still.turned.focals)
        .windows(2)
        .all(|f| (f[0] / f[1] - 1.0).abs() < 1e-6);
    let sizes = still.photos.iter().map(|&photo| matches.photos[photo].size);
    let one_camera = one_lens && sizes.collect::<Vec<_>>().windows(2).all(|s| s[0] == s[1]);
    // Writing to a string cannot fail.
    let [mut cameras, mut images, mut points] = [String::new(), String::new(), String::new()];
    for (k, &photo) in still.photos.iter().enumerate() {
        let [width, height] = matches.photos[photo].size;
        let center = middle([width, height]);
        let camera = if one_camera { 1 } else { k + 1 };
        if !one_camera || k == 0 {
            let _ = writeln!(
                cameras,
                "{camera} SIMPLE_PINHOLE {width} {height} {} {} {}",
                still.turned.focals[k], center.x, center.y
            );
        }
        let DQuat { w, x, y, z } = DQuat::from_mat3(&still.turned.rotations[k]);
        let name = &matches.photos[photo].name;
        let _ = writeln!(
            images,
            "{} {w} {x} {y} {z} 0 0 0 {camera} {name}",
            photo + 1
        );
        let observed = of_photo.get(&photo).map_or(&[][..], Vec::as_slice);
        let observed = observed.iter().map(|&(feature, point)| {
            let [x, y] = matches.photos[photo].features[feature as usize];
            format!("{x} {y} {}", point + 1)
        });
        let _ = writeln!(images, "{}", observed.collect::<Vec<_>>().join(" "));
    }
    for (point, Track { place, features }) in tracks.iter().enumerate() {
        let _ = write!(
            points,
            "{} {} {} {} 128 128 128 0",
            point + 1,
            place.x,
            place.y,
            place.z
        );
        for &(photo, feature) in features {
            let index = of_photo[&photo]
                .iter()
                .position(|&(own, of)| (own, of) == (feature, point));
            let _ = write!(points, " {} {}", photo + 1, index.unwrap_or(0));
        }
        points.push('\n');
    }
    for (name, text) in [
        ("cameras.txt", cameras),
        ("images.txt", images),
        ("points3D.txt", points),
    ] {
        files::write(&folder.join(name), text.as_bytes())?;
    }
    Ok(())
}

/// Features that match, joined, where they agree on a direction.
fn tracks(still: &Still, matches: &Matches) -> Vec<Track> {
    let mut joined: BTreeMap<Feature, Feature> = BTreeMap::new();
    fn root(joined: &mut BTreeMap<Feature, Feature>, mut of: Feature) -> Feature {
        let mut top = of;
        while let Some(&next) = joined.get(&top).filter(|&&next| next != top) {
            top = next;
        }
        while let Some(next) = joined
            .insert(of, top)
            .filter(|&next| next != of && of != top)
        {
            of = next;
        }
        top
    }
    for pair in &matches.pairs {
        for &[a, b] in &pair.matches {
            let [a, b] = [(pair.photos[0], a), (pair.photos[1], b)];
            let (a, b) = (root(&mut joined, a), root(&mut joined, b));
            joined.insert(a.max(b), a.min(b));
        }
    }
    let features: Vec<Feature> = joined.keys().copied().collect();
    let mut groups: BTreeMap<Feature, Vec<Feature>> = BTreeMap::new();
    for feature in features {
        let root = root(&mut joined, feature);
        groups.entry(root).or_default().push(feature);
    }
    groups
        .into_values()
        .filter_map(|group| track(still, matches, group))
        .collect()
}

/// The direction of a group of features, and those that show it.
fn track(still: &Still, matches: &Matches, group: Vec<Feature>) -> Option<Track> {
    let at = |photo: usize| still.photos.binary_search(&photo).ok();
    let place = |(photo, feature): Feature| {
        let photo = &matches.photos[photo];
        let [x, y] = photo.features[feature as usize].map(f64::from);
        DVec2::new(x, y) - middle(photo.size)
    };
    let mut seen: Vec<(Feature, usize, DVec3)> = (group.into_iter())
        .filter_map(|feature| {
            let k = at(feature.0)?;
            Some((feature, k, still.turned.direction(k, place(feature))))
        })
        .collect();
    // One of each photo.
    seen.dedup_by_key(|(_, k, _)| *k);
    // What agrees with the most of them: people walk off with some.
    let near = |k: usize, a: DVec3, b: DVec3| {
        let [width, height] = matches.photos[still.photos[k]].size;
        let pixel = f64::from(width.max(height)) / WIDE;
        a.angle_between(b) * still.turned.focals[k] < OFF * pixel
    };
    let center = (seen.iter())
        .map(|&(_, _, direction)| direction)
        .max_by_key(|&center| seen.iter().filter(|&&(_, k, d)| near(k, center, d)).count())?;
    seen.retain(|&(_, k, direction)| near(k, center, direction));
    (seen.len() >= 2).then(|| Track {
        place: RADIUS * seen.iter().map(|(_, _, d)| *d).sum::<DVec3>().normalize(),
        features: seen.into_iter().map(|(feature, ..)| feature).collect(),
    })
}
