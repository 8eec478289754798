//! Small captures that are sound, and the same ones spoiled.

use glam::{DMat3, DVec3};

use super::{photos::ENOUGH, reprojection::project, *};
use crate::{
    capture::{Camera, Capture, Channel, Observation, Photo},
    effects::fixtures::{capture, photo},
};

const SIZE: [u32; 2] = [320, 240];

const VIEWS: usize = 6;

const POINTS: usize = 60;

/// The i-th number of a pseudorandom sequence, 0 to 1.
fn random(i: usize) -> f64 {
    ((i as f64 + 1.0) * 12.9898).sin().abs() * 43_758.545_3 % 1.0
}

/// A camera on an arc around the origin.
fn on_arc(i: usize) -> Camera {
    let turn = 0.2 * (i as f64 - 2.0);
    let rotation = DMat3::from_rotation_x(0.15) * DMat3::from_rotation_y(turn);
    Camera {
        width: SIZE[0],
        height: SIZE[1],
        fx: 300.0,
        fy: 300.0,
        cx: 160.0,
        cy: 120.0,
        rotation,
        translation: DVec3::new(0.1 * i as f64, -0.1, 6.0),
    }
}

/// Points of random grays that all views see, and photos with a spot of that gray at each.
fn sound() -> (Capture, Vec<Photo>) {
    let cameras: Vec<Camera> = (0..VIEWS).map(on_arc).collect();
    let place = |i: usize| DVec3::new(random(3 * i), random(3 * i + 1), random(3 * i + 2));
    let places = (0..POINTS).map(|i| 3.0 * place(i) - 1.5);
    let blank = cameras.iter().map(|camera| {
        let photo = photo(camera, |_, _| 90);
        (photo, camera.clone())
    });
    let blank: Vec<_> = blank.collect();
    let mut capture = capture(&blank, places);
    let mut photos: Vec<Photo> = blank.into_iter().map(|(photo, _)| photo).collect();
    for (i, point) in capture.points.iter_mut().enumerate() {
        let gray = (255.0 * random(7 * i + 5)) as u8;
        point.color = [gray; 3];
        for (view, camera) in cameras.iter().enumerate() {
            let pixel = project(camera, point.position).expect("in front");
            let noise = [0.1 * random(i + view), -0.1 * random(i * view)];
            let seen = [pixel[0] + noise[0], pixel[1] + noise[1]];
            point.track.push(Observation { view, pixel: seen });
            let [x, y] = pixel.map(|at| at as usize);
            for y in y - 1..=y + 1 {
                for x in x - 1..=x + 1 {
                    photos[view].gray[y * SIZE[0] as usize + x] = gray;
                }
            }
        }
    }
    (capture, photos)
}

/// The cameras of a capture's views.
fn cameras(capture: &Capture) -> Vec<Camera> {
    let views = capture.views.iter();
    views.map(|view| view.camera.clone()).collect()
}

/// Contradiction in a model, with photos at half the size of its cameras.
fn judged(capture: &Capture) -> Option<Contradictory> {
    let cameras: Vec<Camera> = cameras(capture).iter().map(halved).collect();
    let found = Reprojection::of(capture, &cameras).expect("observations");
    found.contradictory(capture, &cameras)
}

fn halved(camera: &Camera) -> Camera {
    camera.resized(camera.width / 2, camera.height / 2)
}

/// The cause that is found, once `spoil` has changed every view's camera.
fn cause_of(spoil: impl Fn(&mut Camera)) -> Cause {
    let (mut capture, _) = sound();
    for view in &mut capture.views {
        spoil(&mut view.camera);
    }
    found_cause(&capture)
}

#[track_caller]
fn found_cause(capture: &Capture) -> Cause {
    match judged(capture) {
        Some(Contradictory::All(Contradiction::Model { error, cause, .. })) => {
            assert!(error > 2.0, "{error}");
            cause
        }
        other => panic!("{other:?}"),
    }
}

fn invert(camera: &mut Camera) {
    camera.rotation = camera.rotation.transpose();
    camera.translation = -(camera.rotation * camera.translation);
}

fn open_gl(camera: &mut Camera) {
    let flip = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    camera.rotation = flip * camera.rotation;
    camera.translation = flip * camera.translation;
}

fn scale_intrinsics(camera: &mut Camera) {
    for value in [
        &mut camera.fx,
        &mut camera.fy,
        &mut camera.cx,
        &mut camera.cy,
    ] {
        *value *= 4.0;
    }
}

#[test]
fn a_sound_model_is_none_of_them() {
    let (capture, _) = sound();
    assert_eq!(judged(&capture), None);
    let error = Reprojection::of(&capture, &cameras(&capture)).map(|found| found.error);
    assert!(error.is_some_and(|error| (0.01..0.2).contains(&error)));
    let mut untracked = capture;
    (untracked.points.iter_mut()).for_each(|point| point.track.clear());
    let cameras = cameras(&untracked);
    assert_eq!(Reprojection::of(&untracked, &cameras), None);
}

#[test]
fn poses_of_other_conventions_are_recognized() {
    assert_eq!(cause_of(invert), Cause::CameraToWorld);
    assert_eq!(cause_of(open_gl), Cause::OpenGl);
    let both = |camera: &mut Camera| {
        open_gl(camera);
        invert(camera);
    };
    assert_eq!(cause_of(both), Cause::CameraToWorldOpenGl);
    // Behind the camera is infinitely wrong.
    let (mut capture, _) = sound();
    (capture.views.iter_mut()).for_each(|view| open_gl(&mut view.camera));
    let error = Reprojection::of(&capture, &cameras(&capture)).map(|found| found.error);
    assert_eq!(error, Some(f64::INFINITY));
}

#[test]
fn inverted_poses_are_recognized_far_from_the_origin() {
    let (mut capture, _) = sound();
    let offset = DVec3::new(3e5, -4e6, 500.0);
    for view in &mut capture.views {
        // As it was before the origin was moved, inverted, and moved.
        let mut camera = view.camera.recentered(-offset);
        invert(&mut camera);
        view.camera = camera.recentered(offset);
    }
    capture.offset = offset;
    assert_eq!(found_cause(&capture), Cause::CameraToWorld);
}

#[test]
fn intrinsics_of_other_photos_are_recognized() {
    let is = |cause: Cause, ratio: f64| match cause {
        Cause::Intrinsics(found) => assert!((found / ratio - 1.0).abs() < 0.02, "{found}"),
        other => panic!("{other:?}"),
    };
    is(cause_of(scale_intrinsics), 4.0);
    let quarter = |camera: &mut Camera| {
        [camera.fx, camera.fy, camera.cx, camera.cy] = [75.0, 75.0, 40.0, 30.0];
    };
    is(cause_of(quarter), 0.25);
    let focal = |camera: &mut Camera| {
        camera.fx *= 1.5;
        camera.fy *= 1.5;
    };
    is(cause_of(focal), 1.5);
    let corner = |camera: &mut Camera| [camera.cx, camera.cy] = [0.0; 2];
    assert_eq!(cause_of(corner), Cause::PrincipalPoint);
}

#[test]
fn observations_of_another_scale_are_recognized() {
    for (scale, padding) in [(0.25, [0.0; 2]), (0.25, [0.0, 10.0]), (4.0, [0.0; 2])] {
        let (mut capture, _) = sound();
        for seen in capture.points.iter_mut().flat_map(|point| &mut point.track) {
            let [x, y] = seen.pixel;
            seen.pixel = [scale * x + padding[0], scale * y + padding[1]];
        }
        match found_cause(&capture) {
            Cause::Observations(found) => assert!((found / scale - 1.0).abs() < 0.02, "{found}"),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn what_is_none_of_these_is_not_guessed() {
    let (mut capture, _) = sound();
    let poses: Vec<Camera> = cameras(&capture);
    for (i, view) in capture.views.iter_mut().enumerate() {
        view.camera = poses[(i + 3) % VIEWS].clone();
    }
    assert_eq!(found_cause(&capture), Cause::Unknown);
}

#[test]
fn a_single_wrong_pose_is_named() {
    let (mut capture, _) = sound();
    invert(&mut capture.views[2].camera);
    match judged(&capture) {
        Some(Contradictory::Some(photos)) => {
            assert_eq!(photos.len(), 1, "{photos:?}");
            assert_eq!(photos[0].name, "2.png");
        }
        other => panic!("{other:?}"),
    }
    // Of few observations nothing is said.
    for point in &mut capture.points[ENOUGH - 1..] {
        point.track.retain(|seen| seen.view != 2);
    }
    assert_eq!(judged(&capture), None);
}

/// Agreement of photos with the points' colors, and the resulting contradiction.
fn compared(capture: &Capture, photos: &[Photo]) -> (Agreement, Option<Contradictory>) {
    let cameras: Vec<Camera> = cameras(capture);
    let mut colors = PointColors::of(capture, &cameras, Channel::Luma);
    for (view, photo) in photos.iter().enumerate() {
        colors.look(view, photo);
    }
    let agreement = colors.finish(capture);
    let found = agreement.contradictory(capture);
    (agreement, found)
}

/// A photo turned by 180°.
fn turn(photo: &mut Photo) {
    photo.gray.reverse();
}

#[test]
fn photos_of_the_model_agree_whatever_their_exposure() {
    let (capture, mut photos) = sound();
    for (i, photo) in photos.iter_mut().enumerate() {
        for gray in &mut photo.gray {
            *gray = (f64::from(*gray) * (0.3 + 0.1 * i as f64)) as u8 + 20;
        }
    }
    let (agreement, found) = compared(&capture, &photos);
    assert_eq!(agreement.photos.len(), VIEWS);
    assert!(agreement.photos.iter().all(|(_, found)| *found > 0.9));
    assert_eq!(found, None);
}

#[test]
fn turned_photos_are_told_one_by_one_or_all_together() {
    let (capture, mut photos) = sound();
    turn(&mut photos[4]);
    match compared(&capture, &photos).1 {
        Some(Contradictory::Some(photos)) => {
            assert_eq!(photos.len(), 1, "{photos:?}");
            assert_eq!(photos[0].name, "4.png");
        }
        other => panic!("{other:?}"),
    }
    photos[..4].iter_mut().for_each(turn);
    match compared(&capture, &photos).1 {
        Some(Contradictory::All(Contradiction::Photos { photos, judged, .. })) => {
            assert_eq!((photos.len(), judged), (5, VIEWS));
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn points_without_colors_masks_and_few_points_say_nothing() {
    let (mut capture, mut photos) = sound();
    photos.iter_mut().for_each(turn);
    let mut masked = photos.clone();
    for photo in &mut masked {
        photo.mask = Some(vec![0; photo.gray.len()]);
    }
    assert_eq!(compared(&capture, &masked).1, None);
    let mut few = capture.clone();
    few.points.truncate(ENOUGH - 1);
    assert_eq!(compared(&few, &photos).1, None);
    (capture.points.iter_mut()).for_each(|point| point.color = [0; 3]);
    let (agreement, found) = compared(&capture, &photos);
    assert_eq!((agreement.photos, found), (Vec::new(), None));
}

#[test]
fn points_tell_where_observations_do_not() {
    let (mut capture, photos) = sound();
    for seen in capture.points.iter_mut().flat_map(|point| &mut point.track) {
        seen.pixel = seen.pixel.map(|along| 0.25 * along);
    }
    let seen = compared(&capture, &photos).1;
    assert!(matches!(seen, Some(Contradictory::All(_))), "{seen:?}");
    observe_where_projected(&mut capture);
    assert_eq!(compared(&capture, &photos).1, None);
    let error = Reprojection::of(&capture, &cameras(&capture)).map(|found| found.error);
    assert!(error.is_some_and(|error| error < 1e-9), "{error:?}");
    // Not outside the photos.
    capture.views[0].camera.cx = -2000.0;
    observe_where_projected(&mut capture);
    let mut seen = capture.points.iter().flat_map(|point| &point.track);
    assert!(seen.all(|seen| seen.view != 0));
}

#[test]
fn photos_before_which_nothing_lies_are_told() {
    let (mut capture, _) = sound();
    assert_eq!(SparsePhotos::of(&capture, &cameras(&capture)), None);
    open_gl(&mut capture.views[1].camera);
    let found = SparsePhotos::of(&capture, &cameras(&capture)).expect("one sees nothing");
    assert_eq!((found.photos, found.total), (vec!["1.png".to_owned()], 6));
    assert!(!found.center_outside);
    for view in &mut capture.views {
        view.camera.cx = -2000.0;
    }
    let found = SparsePhotos::of(&capture, &cameras(&capture)).expect("none sees anything");
    assert!(found.photos.len() == VIEWS && found.center_outside);
    // A crop's principal point may lie outside, where there is something to see.
    let (mut crop, _) = sound();
    for view in &mut crop.views {
        view.camera.cx = -10.0;
    }
    assert_eq!(SparsePhotos::of(&crop, &cameras(&crop)), None);
}

#[test]
fn long_lists_end() {
    assert_eq!(listed(["b", "a", "b"]), "a, b");
    assert_eq!(
        listed(["a", "b", "c", "d", "e", "f", "g"]),
        "a, b, c, d, e, 2 more"
    );
}
