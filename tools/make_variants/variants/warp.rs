//! Photos as another lens would have taken them.

use super::lens::{Camera, Lens};
use super::resample::remap;
use super::scene::Scene;

/// Shift of the corners by `barrel`, as a share of their distance to the center: the part that
/// grows with the third power of it, and with the fifth. Real wide lenses have as much.
const BARREL: [f64; 2] = [-0.11, 0.02];

/// Tangential distortion at the corners, in the same unit: a lens not quite centered.
const TANGENTIAL: [f64; 2] = [0.002, -0.001];

/// Shift of the corners by `barrel-control`, in pixels.
const CONTROL_SHIFT: f64 = 0.25;

/// An ordinary fisheye, a little off from an angle's proportional radius.
const FISHEYE: [f64; 4] = [-0.02, 0.004, -0.001, 0.0];

/// The series of the tangent: with it a fisheye is a pinhole, up to 1e-5 at 30° and 6e-4
/// at 45°.
const TANGENT: [f64; 4] = [1.0 / 3.0, 2.0 / 15.0, 17.0 / 315.0, 62.0 / 2835.0];

/// Keeps bicubic samples inside the source, in pixels.
const MARGIN: f64 = 0.5;

/// OPENCV, strong or (as control) next to nothing.
pub fn barrel(scene: &mut Scene, strong: bool) -> String {
    warp(scene, |pinhole| {
        let corner = corner(pinhole);
        let [a, b] = BARREL.map(|part| part / corner.powi(2));
        let [p1, p2] = TANGENTIAL.map(|part| part / corner);
        let target = enlarged(pinhole, Lens::OpenCv([a, b / corner.powi(2), p1, p2]));
        if strong {
            return target;
        }
        let half = 0.5 * f64::from(target.size[0]).hypot(f64::from(target.size[1]));
        let k1 = -CONTROL_SHIFT / half / self::corner(&target).powi(2);
        Camera {
            lens: Lens::OpenCv([k1, 0.0, 0.0, 0.0]),
            ..target
        }
    })
}

/// OPENCV_FISHEYE, or (as control) a pinhole in its terms.
pub fn fisheye(scene: &mut Scene, strong: bool) -> String {
    warp(scene, |pinhole| {
        let target = enlarged(pinhole, Lens::Fisheye(FISHEYE));
        match strong {
            true => target,
            false => enlarged(pinhole, Lens::Fisheye(TANGENT)),
        }
    })
}

/// The farthest corner's distance from the axis at unit depth.
fn corner(pinhole: &Camera) -> f64 {
    let distance = |[x, y]: [f64; 2]| {
        let [x, y] = [
            (x - pinhole.center[0]) / pinhole.focal[0],
            (y - pinhole.center[1]) / pinhole.focal[1],
        ];
        x.hypot(y)
    };
    pinhole.border().map(distance).fold(0.0, f64::max)
}

/// The camera with a lens, and the shortest focal length at which all its pixels lie in
/// the pinhole's image.
fn enlarged(pinhole: &Camera, lens: Lens) -> Camera {
    let zoomed = |zoom: f64| Camera {
        focal: pinhole.focal.map(|f| f * zoom),
        lens,
        ..pinhole.clone()
    };
    let fits = |zoom: f64| {
        let camera = zoomed(zoom);
        let inside = |pixel| pinhole.contains(pinhole.pixel(camera.ray(pixel)), MARGIN);
        camera.border().all(inside)
    };
    // Bisection between a zoom that is too small and one that is not.
    let (mut small, mut large) = (0.5, 2.0);
    while !fits(large) {
        (small, large) = (large, 2.0 * large);
    }
    for _ in 0..30 {
        let middle = 0.5 * (small + large);
        match fits(middle) {
            true => large = middle,
            false => small = middle,
        }
    }
    zoomed(large)
}

/// Gives each view the camera made of its own.
fn warp(scene: &mut Scene, made: impl Fn(&Camera) -> Camera) -> String {
    let mut shift: f64 = 0.0;
    let mut cameras: Vec<[Camera; 2]> = Vec::new();
    for view in &mut scene.views {
        let source = view.camera.clone();
        let known = cameras.iter().find(|[from, _]| *from == source);
        let target = known.map_or_else(|| made(&source), |[_, to]| to.clone());
        view.picture = remap(&view.picture, target.size, |pixel| {
            source.pixel(target.ray(pixel))
        });
        shift = shift.max(target.largest_shift());
        view.camera = target.clone();
        cameras.push([source, target]);
    }
    scene.move_observations(|view, pixel| {
        let [source, target] = &cameras[view];
        let moved = target.pixel(source.ray(pixel));
        target.contains(moved, 0.0).then_some(moved)
    });
    format!("the lens moves pixels by up to {shift:.2}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pinhole() -> Camera {
        Camera {
            size: [320, 240],
            focal: [300.0, 305.0],
            center: [161.0, 118.0],
            lens: Lens::Pinhole,
        }
    }

    #[test]
    fn no_larger_than_needed() {
        for lens in [Lens::OpenCv([-0.2, 0.05, 0.0, 0.0]), Lens::Fisheye(FISHEYE)] {
            let camera = enlarged(&pinhole(), lens);
            let sources = camera.border().map(|p| pinhole().pixel(camera.ray(p)));
            let sources: Vec<_> = sources.collect();
            assert!(sources.iter().all(|&p| pinhole().contains(p, MARGIN)));
            assert!(
                !sources
                    .iter()
                    .all(|&p| pinhole().contains(p, MARGIN + 0.01))
            );
        }
    }

    #[test]
    fn the_series_makes_a_pinhole() {
        let control = enlarged(&pinhole(), Lens::Fisheye(TANGENT));
        assert!(
            control.largest_shift() < 0.05,
            "{}",
            control.largest_shift()
        );
        let strong = enlarged(&pinhole(), Lens::Fisheye(FISHEYE));
        assert!(strong.largest_shift() > 8.0, "{}", strong.largest_shift());
    }
}
