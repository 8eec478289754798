//! Shots of known cameras.

use super::*;

const WIDE: u32 = 640;

/// Photos turned by so many degrees each, with these focal lengths, that see places on a sphere
/// around their camera; `moves` by so much of the places' distance from photo to photo.
fn shot(angles: &[f64], focals: &[f64], moves: f64) -> (Turned, Vec<Seen>) {
    let rotations = angles.iter().enumerate().map(|(k, angle)| {
        let roll = DMat3::from_rotation_z((0.3 * k as f64).to_radians());
        roll * DMat3::from_rotation_y(-angle.to_radians())
    });
    let truth = Turned {
        rotations: rotations.collect(),
        focals: focals.to_vec(),
    };
    let mut random = fastrand::Rng::with_seed(7);
    let places: Vec<DVec3> = (0..4_000)
        .map(|_| {
            let [x, y, z] = [(); 3].map(|()| random.f64() - 0.5);
            DVec3::new(x, y, z).normalize() * (1.0 + random.f64())
        })
        .collect();
    let pixel = |photo: usize, place: &DVec3| {
        let at = truth.rotations[photo] * (place - DVec3::X * moves * photo as f64);
        let pixel = truth.focals[photo] * at.truncate() / at.z;
        let inside = pixel.x.abs() < 320.0 && pixel.y.abs() < 240.0;
        (at.z > 0.0 && inside).then_some(pixel)
    };
    let mut seen = Vec::new();
    for i in 0..angles.len() {
        for j in i + 1..angles.len().min(i + 4) {
            let mut noise = || random.f64() - 0.5;
            let both = places.iter().filter_map(|place| {
                let noise = DVec2::new(noise(), noise());
                Some([pixel(i, place)?, pixel(j, place)? + noise])
            });
            seen.push(Seen {
                photos: [i, j],
                places: both.collect(),
            });
        }
    }
    (truth, seen)
}

/// Largest angle between found and true rotations, in degrees, the first photos' being alike.
fn off(found: &Turned, truth: &Turned) -> f64 {
    let of = |t: &Turned, k: usize| t.rotations[k] * t.rotations[0].transpose();
    let angles = (0..truth.rotations.len()).map(|k| {
        let between = of(found, k) * of(truth, k).transpose();
        DQuat::from_mat3(&between)
            .to_scaled_axis()
            .length()
            .to_degrees()
    });
    angles.fold(0.0, f64::max)
}

fn solve(seen: &[Seen], count: usize, zooms: bool) -> (Turned, Residuals) {
    let found = Turned::of(count, seen, (768.0, WIDE), zooms);
    let residuals = found.residuals(seen, WIDE).expect("matches");
    (found, residuals)
}

#[test]
fn a_pan_has_its_rotations_and_focal_length_back() {
    let angles: Vec<f64> = (0..12).map(|k| 2.5 * f64::from(k)).collect();
    let (truth, seen) = shot(&angles, &[600.0; 12], 0.0);
    let (found, residuals) = solve(&seen, 12, false);
    assert!(
        residuals.median < 0.5 && residuals.most < 1.0,
        "{residuals:?}"
    );
    assert!(
        (found.focals[0] / 600.0 - 1.0).abs() < 0.01,
        "{:?}",
        found.focals
    );
    assert!(off(&found, &truth) < 0.2, "{}", off(&found, &truth));
}

#[test]
fn what_moves_before_the_camera_is_left_out() {
    let angles: Vec<f64> = (0..8).map(|k| 3.0 * f64::from(k)).collect();
    let (truth, mut seen) = shot(&angles, &[600.0; 8], 0.0);
    for pair in &mut seen {
        let third = pair.places.len() / 3;
        for [_, to] in &mut pair.places[..third] {
            *to += DVec2::new(14.0, -3.0);
        }
    }
    let (found, residuals) = solve(&seen, 8, false);
    assert!(
        residuals.median < 0.6 && residuals.most > 10.0,
        "{residuals:?}"
    );
    assert!(off(&found, &truth) < 0.3, "{}", off(&found, &truth));
}

#[test]
fn a_zoom_needs_focal_lengths_of_its_own() {
    let focals: Vec<f64> = (0..10).map(|k| 600.0 * 1.05_f64.powi(k)).collect();
    let angles: Vec<f64> = (0..10).map(f64::from).collect();
    let (truth, seen) = shot(&angles, &focals, 0.0);
    let [(_, one), (found, own)] = [false, true].map(|zooms| solve(&seen, 10, zooms));
    assert!(one.median > 3.0 && own.median < 0.6, "{one:?} {own:?}");
    let [ours, true_one] = [&found, &truth].map(|t| t.focals[9] / t.focals[0]);
    assert!((ours / true_one - 1.0).abs() < 0.02, "{ours} {true_one}");
}

#[test]
fn held_frames_are_no_evidence_of_a_camera_that_stands() {
    let (_, mut seen) = shot(&[0.0, 0.0, 3.0, 3.0], &[600.0; 4], 0.03);
    for pair in &mut seen {
        // Photos 0 and 1, and 2 and 3, are the same.
        if pair.photos[0] / 2 == pair.photos[1] / 2 {
            pair.places.iter_mut().for_each(|[from, to]| *to = *from);
        }
    }
    // Held frames match best.
    let held: Vec<usize> = (0..seen.len())
        .filter(|&k| seen[k].photos[0] / 2 == seen[k].photos[1] / 2)
        .collect();
    for k in held {
        for _ in 0..6 {
            let places = seen[k].places.clone();
            seen[k].places.extend(places.into_iter().take(2_000));
        }
    }
    let (found, residuals) = solve(&seen, 4, false);
    assert!(residuals.median > 2.0, "{residuals:?}");
    let all: Vec<f64> = (seen.iter().flat_map(|seen| {
        let distance =
            |[from, to]: &[DVec2; 2]| found.moved(seen.photos, *from).unwrap().distance(*to);
        seen.places.iter().map(distance)
    }))
    .collect();
    let small = all.iter().filter(|&&distance| distance < 1.0).count();
    assert!(
        2 * small > all.len(),
        "held frames are most: {small} of {}",
        all.len()
    );
}

#[test]
fn a_camera_that_moves_does_not_turn_about_one_place() {
    let (_, seen) = shot(&[0.0, 1.0, 2.0, 3.0], &[600.0; 4], 0.06);
    let (_, residuals) = solve(&seen, 4, true);
    assert!(residuals.median > 3.0, "{residuals:?}");
}

#[test]
fn a_camera_that_stands_keeps_its_focal_length() {
    let (truth, seen) = shot(&[0.0; 6], &[600.0; 6], 0.0);
    let (found, residuals) = solve(&seen, 6, false);
    assert!(residuals.median < 0.5, "{residuals:?}");
    assert!((found.focals[0] / 768.0 - 1.0).abs() < 0.5);
    assert!(off(&found, &truth) < 0.2);
}

/// Slopes against differences, in a pose where none vanishes.
#[test]
fn slopes_are_those_of_differences() {
    let (truth, _) = shot(&[0.0, 9.0], &[500.0, 640.0], 0.0);
    let (from, to) = (DVec2::new(120.0, -70.0), DVec2::ZERO);
    let (_, slopes) = truth.slopes([0, 1], from, to).expect("in front");
    for parameter in 0..2 * OF_PHOTO {
        let at = |by: f64| {
            let mut step = vec![0.0; 2 * OF_PHOTO];
            step[parameter] = by;
            truth
                .stepped(0..2, &step)
                .moved([0, 1], from)
                .expect("in front")
        };
        let by = 1e-6;
        let numeric = (at(by) - at(-by)) / (2.0 * by);
        let slope = slopes[parameter / OF_PHOTO][parameter % OF_PHOTO];
        assert!(
            numeric.distance(slope) < 1e-4 * slope.length().max(1.0),
            "{parameter}: {numeric} {slope}"
        );
    }
}
