//! The least-squares solver of stage 2 as a whole, on scenes whose colors are known.

use std::ops::ControlFlow;

use glam::{DMat3, DVec3};
use gs_chroma::{
    capture::Camera,
    chroma::{
        ChromaError, ChromaSettings, FrozenViews, IrlsSolver, Room, Targets, Task, bake,
        match_saturation, solve, teacher::AbImage,
    },
    raster::{ColorKind, Field, Geometry, Renderer},
    splats::{ShField, Splats, sh},
};

use crate::{
    harness::{bits, gpu, raster},
    oracle::view_correction::{Affine, center_of},
};

pub const WIDTH: usize = 32;
pub const HEIGHT: usize = 24;
pub const PIXELS: usize = WIDTH * HEIGHT;

/// A camera and what is wanted in its picture.
#[derive(Clone)]
pub struct ChromaView {
    pub camera: Camera,
    pub wanted: AbImage,
    pub weights: Option<Vec<f32>>,
}

/// Frozen views, what is wanted in them, and all of it to do.
pub struct Problem {
    pub frozen: FrozenViews,
    pub targets: Targets,
    pub tasks: Vec<Task>,
}

impl Problem {
    pub fn new(luma: &Splats, views: &[ChromaView]) -> Self {
        Self::within(None, usize::MAX, luma, views).unwrap()
    }

    /// Within so many bytes of the device and of the host.
    pub fn within(
        limit: Option<u64>,
        host: usize,
        luma: &Splats,
        views: &[ChromaView],
    ) -> Result<Self, ChromaError> {
        let mut targets = Targets::within(3, host);
        let tasks = (0..)
            .zip(views)
            .map(
                |(
                    view,
                    ChromaView {
                        wanted, weights, ..
                    },
                )| {
                    let target = targets.push_ab(wanted, weights.as_deref())?;
                    Ok(Task { view, target })
                },
            )
            .collect::<Result<_, ChromaError>>()?;
        let cameras: Vec<Camera> = views.iter().map(|view| view.camera.clone()).collect();
        let room = Room {
            limit,
            color: ColorKind::Chroma,
            sh_degree: 1,
            weighted: targets.weighted(),
            streams: false,
        };
        let frozen = FrozenViews::new(&raster(), luma, 1.0, &cameras, 3, room)?;
        Ok(Self {
            frozen,
            targets,
            tasks,
        })
    }

    pub fn solver(&self, settings: &ChromaSettings) -> IrlsSolver<'_> {
        IrlsSolver::new(&self.frozen, settings, &self.targets, self.tasks.clone()).unwrap()
    }
}

pub fn chroma_view(camera: Camera, ab: Vec<[f64; 2]>) -> ChromaView {
    let wanted = AbImage {
        width: camera.width,
        height: camera.height,
        ab: ab.into_iter().map(|ab| ab.map(|v| v as f32)).collect(),
    };
    ChromaView {
        camera,
        wanted,
        weights: None,
    }
}

fn solved(settings: &ChromaSettings, luma: &Splats, views: &[ChromaView]) -> ShField {
    let problem = Problem::new(luma, views);
    let mut solver = problem.solver(settings);
    solver.run(&mut |_| ControlFlow::Continue(())).unwrap();
    solver.chroma().unwrap()
}

/// Spacing of the wall's Gaussians in world units.
const STEP: f64 = 0.5;
const COLUMNS: usize = 8;
const ROWS: usize = 5;

/// A wall of Gaussians that all views show; hardly anything shows through.
pub fn wall() -> Splats {
    let mut wall = Splats::default();
    for i in 0..COLUMNS * ROWS {
        let x = STEP * ((i % COLUMNS) as f64 - 0.5 * (COLUMNS - 1) as f64);
        let y = STEP * ((i / COLUMNS) as f64 - 0.5 * (ROWS - 1) as f64);
        wall.means.push([x as f32, y as f32, 4.0]);
        wall.quats.push([1.0, 0.0, 0.0, 0.0]);
        wall.log_scales.push([(0.8 * STEP).ln() as f32; 3]);
        wall.opacity_logits.push(6.0);
    }
    wall.sh = ShField::zeros(wall.len(), 0, 1);
    wall
}

/// Views of the wall from places beside each other.
pub fn cameras(count: usize) -> Vec<Camera> {
    (0..count)
        .map(|k| Camera {
            width: WIDTH as u32,
            height: HEIGHT as u32,
            fx: 40.0,
            fy: 40.0,
            cx: 16.0,
            cy: 12.0,
            rotation: DMat3::IDENTITY,
            translation: DVec3::new(0.05 * k as f64 - 0.2, 0.03 * (k % 3) as f64, 0.0),
        })
        .collect()
}

/// The same a/b in every pixel of each view.
pub fn constant_views(colors: &[[f64; 2]]) -> Vec<ChromaView> {
    (cameras(colors.len()).into_iter().zip(colors))
        .map(|(camera, &ab)| chroma_view(camera, vec![ab; PIXELS]))
        .collect()
}

/// A smooth field of color on the wall.
fn truth(x: f64, y: f64) -> [f64; 2] {
    [
        35.0 * (1.5 * x).sin() + 5.0,
        30.0 * (1.2 * x + 2.0 * y).cos(),
    ]
}

/// That field in the pixels of a camera before the wall.
pub fn pictured(camera: &Camera) -> Vec<[f64; 2]> {
    (0..PIXELS)
        .map(|p| {
            let [u, v] = [p % WIDTH, p / WIDTH].map(|side| side as f64 + 0.5);
            let x = (u - camera.cx) / camera.fx * 4.0 - camera.translation.x;
            let y = (v - camera.cy) / camera.fy * 4.0 - camera.translation.y;
            truth(x, y)
        })
        .collect()
}

/// a/b of each Gaussian.
fn colors(chroma: &ShField) -> Vec<[f64; 2]> {
    (chroma.coefficients.chunks_exact(2))
        .map(|ab| [0, 1].map(|c| sh::C0 * f64::from(ab[c])))
        .collect()
}

/// The wall's picture.
pub fn drawn(chroma: &ShField, camera: &Camera) -> Vec<[f64; 2]> {
    let geometry = Geometry::upload(gpu(), &wall()).unwrap();
    let field = Field::upload(gpu(), chroma).unwrap();
    let mut renderer = Renderer::new(raster(), geometry, vec![field], 0.01).unwrap();
    let picture = renderer.render(camera).unwrap().remove(0);
    (picture.pixels.chunks_exact(2))
        .map(|ab| [0, 1].map(|c| f64::from(ab[c])))
        .collect()
}

/// Those of the Gaussians in the middle, which every view shows whole.
fn inner(chroma: &ShField) -> Vec<[f64; 2]> {
    let inner = |i: &usize| {
        let (column, row) = (i % COLUMNS, i / COLUMNS);
        (2..COLUMNS - 2).contains(&column) && (1..ROWS - 1).contains(&row)
    };
    let colors = colors(chroma);
    (0..colors.len()).filter(inner).map(|i| colors[i]).collect()
}

/// The largest difference of a channel.
pub fn farthest(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

pub fn settings() -> ChromaSettings {
    ChromaSettings {
        correct_views: false,
        ..ChromaSettings::irls()
    }
}

/// Six views of the wall, every other one with weights.
pub fn six_views() -> Vec<ChromaView> {
    (cameras(6).into_iter().enumerate())
        .map(|(k, camera)| {
            let mut view = chroma_view(camera.clone(), pictured(&camera));
            let weights = (0..PIXELS).map(|p| [1.0, 0.5, 50.0][p % 3]);
            view.weights = (k % 2 == 0).then(|| weights.collect());
            view
        })
        .collect()
}

/// Whether all views stay on the device, some, or none, and whether what is wanted waits
/// in memory or in a file.
#[test]
fn results_do_not_depend_on_the_budget() {
    let (luma, views) = (wall(), six_views());
    let within = |limit, host| {
        let problem = Problem::within(limit, host, &luma, &views).unwrap();
        let (frozen, targets) = (&problem.frozen, &problem.targets);
        let mut found = Vec::new();
        for settings in [
            ChromaSettings::irls(),
            ChromaSettings {
                sh_degree: 1,
                rounds: 3,
                ..ChromaSettings::irls()
            },
            ChromaSettings::adam(12),
        ] {
            let (tasks, quiet) = (problem.tasks.clone(), &mut |_| ControlFlow::Continue(()));
            let solved = solve(frozen, &settings, targets, tasks, &luma, quiet).unwrap();
            found.extend(bits(&solved.chroma.coefficients));
            if settings.sh_degree == 0 {
                let baked = bake(frozen, &luma, &solved.chroma, &mut |_| {
                    ControlFlow::Continue(())
                })
                .unwrap();
                found.extend(bits(&baked.sh.coefficients));
            }
        }
        (found, frozen.pinned(), frozen.demand())
    };
    let (all, pinned, demand) = within(None, usize::MAX);
    assert_eq!(pinned, views.len());
    assert!(all == within(None, usize::MAX).0, "two runs differ");
    assert!(all == within(None, 0).0, "targets wait in a file");
    // The least that there is, as the error tells.
    let Err(ChromaError::OverLimit { needed, .. }) =
        Problem::within(Some(1), 0, &luma, &views).map(|_| ())
    else {
        panic!("a byte is enough");
    };
    assert!(needed < demand, "{needed} {demand}");
    let (one, pinned, _) = within(Some(needed), 0);
    assert_eq!(pinned, 0);
    assert!(all == one, "one view at a time differs");
    let (some, pinned, _) = within(Some((needed + demand) / 2), 5_000);
    assert!((1..views.len()).contains(&pinned), "{pinned} stay");
    assert!(all == some, "some views at a time differ");
}

#[test]
fn views_of_one_color_give_that_color() {
    let ab = [21.0, -34.0];
    let chroma = solved(&ChromaSettings::irls(), &wall(), &constant_views(&[ab; 3]));
    assert!(chroma.coefficients.iter().all(|c| c.is_finite()));
    let inner = inner(&chroma);
    let away = farthest(&inner, &vec![ab; inner.len()]);
    assert!(away < 0.5, "{away}");
}

#[test]
fn what_no_view_sees_takes_its_neighbors_color() {
    let ab = [40.0, 25.0];
    let mut luma = wall();
    // More of the wall, beside all pictures and behind the cameras.
    let hidden = luma.len()..luma.len() + 6;
    for k in 0..6 {
        let z = if k < 3 { 4.0 } else { -3.0 };
        let beside = STEP * (0.5 * (COLUMNS + 1) as f64 + 6.0 + (k % 3) as f64);
        luma.means.push([beside as f32, 0.0, z]);
        luma.quats.push([1.0, 0.0, 0.0, 0.0]);
        luma.log_scales.push([(0.3 * STEP).ln() as f32; 3]);
        luma.opacity_logits.push(4.0);
    }
    luma.sh = ShField::zeros(luma.len(), 0, 1);
    let views = constant_views(&[ab; 3]);
    let problem = Problem::new(&luma, &views);
    let mut solver = problem.solver(&settings());
    solver.run(&mut |_| ControlFlow::Continue(())).unwrap();
    let (chroma, seen) = (solver.chroma().unwrap(), solver.seen().unwrap());
    for i in hidden.clone() {
        assert_eq!((chroma.of(i), seen[i]), (&[0.0; 2][..], 0.0), "{i}");
    }
    let (frozen, targets, tasks) = (&problem.frozen, &problem.targets, problem.tasks.clone());
    let filled = solve(frozen, &settings(), targets, tasks, &luma, &mut |_| {
        ControlFlow::Continue(())
    })
    .unwrap();
    let away = farthest(&colors(&filled.chroma)[hidden], &[ab; 6]);
    assert!(away < 1.0, "{away}");
}

/// Colors that are right are left alone, paler ones become right, as far as views agree.
#[test]
fn pale_colors_become_as_strong_as_the_teachers() {
    let (luma, views) = (wall(), six_views());
    let problem = Problem::new(&luma, &views);
    let (frozen, targets, tasks) = (&problem.frozen, &problem.targets, &problem.tasks);
    // Twelve rounds with nothing held: a little paler than wanted, not a little stronger.
    let mut solver = problem.solver(&ChromaSettings {
        anchor: 0.0,
        ..settings()
    });
    solver.run(&mut |_| ControlFlow::Continue(())).unwrap();
    let right = solver.chroma().unwrap();
    let after = |share: f32, agreed: f64| {
        let mut chroma = right.clone();
        chroma.coefficients.iter_mut().for_each(|c| *c *= share);
        let factor = match_saturation(frozen, targets, tasks, agreed, &mut chroma, &mut |_, _| {
            ControlFlow::Continue(())
        })
        .unwrap();
        for (found, right) in chroma.coefficients.iter().zip(&right.coefficients) {
            let expected = f64::from(right * share) * factor;
            assert!(
                (f64::from(*found) - expected).abs() < 1e-4,
                "{found} {expected}"
            );
        }
        factor
    };
    let whole = after(1.0, 1.0);
    assert!((1.0..1.03).contains(&whole), "{whole}");
    let pale = after(1.0 / 1.15, 1.0);
    assert!((pale / (1.15 * whole) - 1.0).abs() < 1e-3, "{pale} {whole}");
    // Half of what the views say is contradiction.
    assert_eq!(after(1.0 / 1.15, 0.5), 1.0);
    assert_eq!(after(0.5, 1.0), 1.25);
    assert_eq!(after(0.0, 1.0), 1.0);
}

/// Somebody painted the right of one of eleven views.
#[test]
fn a_hint_wins_over_ten_views() {
    let (said, painted) = ([40.0, 30.0], [-35.0, 20.0]);
    let mut views = constant_views(&[said; 11]);
    let brush = |p: usize| p % WIDTH >= 18;
    let view = &mut views[4];
    let weights = (0..PIXELS).map(|p| if brush(p) { 50.0 } else { 1.0 });
    view.weights = Some(weights.collect());
    for p in (0..PIXELS).filter(|&p| brush(p)) {
        view.wanted.ab[p] = painted.map(|v| v as f32);
    }
    for correct_views in [false, true] {
        let settings = ChromaSettings {
            correct_views,
            ..settings()
        };
        let chroma = solved(&settings, &wall(), &views);
        let [elsewhere, there] = [
            drawn(&chroma, &cameras(1)[0]),
            drawn(&chroma, &views[4].camera),
        ];
        let (left, right) = (
            elsewhere[HEIGHT / 2 * WIDTH + 4],
            there[HEIGHT / 2 * WIDTH + 26],
        );
        let away = [farthest(&[right], &[painted]), farthest(&[left], &[said])];
        println!("corrects {correct_views}: {right:?} where it was painted, {left:?} elsewhere");
        assert!(away[0] < 2.0 && away[1] < 2.0, "{away:?}");
    }
}

/// One view in eight is plainly wrong about half of the wall; the others differ by a few
/// units, so that a median would move.
#[test]
fn a_wrong_view_moves_nothing_unless_it_counts() {
    let spread: Vec<[f64; 2]> = (0..8)
        .map(|k| {
            [
                20.0 + f64::from((k * 3) % 8),
                -10.0 - f64::from((k * 5) % 8),
            ]
        })
        .collect();
    let right = constant_views(&spread);
    let mut wrong = right.clone();
    wrong[3].wanted.ab[..PIXELS].fill([-70.0, 80.0]);
    // Without the one there are seven.
    let mut seven = right;
    seven.remove(3);
    let moved = |robust| {
        // Until all has settled.
        let settings = ChromaSettings {
            robust,
            rounds: 80,
            settled: 0.0,
            ..settings()
        };
        let of = |views| inner(&solved(&settings, &wall(), views));
        farthest(&of(&seven), &of(&wrong))
    };
    let (doubted, counted) = (moved(Some(10.0)), moved(None));
    println!("moved by {doubted} where it is doubted, by {counted} where it counts");
    // Anchors hold a little of what the first rounds believed; without them it is below 0.1.
    assert!(doubted < 0.2, "{doubted}");
    assert!(counted > 0.5, "{counted}");
}

/// Teachers that are each too pale or too strong and tinted come out as one: where they gather.
#[test]
fn views_with_gains_and_tints_agree() {
    let gains = [0.6, 1.1, 0.9, 0.7, 1.0, 0.8];
    let tints = [
        [4.0, -3.0],
        [-6.0, 2.0],
        [0.0, 5.0],
        [3.0, -4.0],
        [-2.0, 1.0],
        [1.0, -1.0],
    ];
    let views: Vec<ChromaView> = (cameras(gains.len()).into_iter().zip(gains).zip(tints))
        .map(|((camera, gain), tint)| {
            let ab = pictured(&camera).into_iter();
            let ab = ab.map(|ab| [0, 1].map(|c| gain * ab[c] + tint[c]));
            chroma_view(camera.clone(), ab.collect())
        })
        .collect();
    let steady: Vec<ChromaView> = (cameras(gains.len()).into_iter())
        .map(|camera| chroma_view(camera.clone(), pictured(&camera)))
        .collect();
    let of = |correct_views, views: &[ChromaView]| {
        let settings = ChromaSettings {
            correct_views,
            ..ChromaSettings::irls()
        };
        let mut last = 0.0;
        let problem = Problem::new(&wall(), views);
        let mut solver = problem.solver(&settings);
        solver
            .run(&mut |progress| {
                last = progress.loss;
                ControlFlow::Continue(())
            })
            .unwrap();
        (inner(&solver.chroma().unwrap()), last)
    };
    let (one, floor) = of(false, &steady);
    let maps = gains.iter().zip(tints).map(|(&gain, offset)| Affine {
        gain: [[gain, 0.0], [0.0, gain]],
        offset,
    });
    let center = center_of(&maps.collect::<Vec<_>>());
    let expected: Vec<[f64; 2]> = one.iter().map(|&ab| center.of(ab)).collect();
    let ((corrected, loss), (raw, raw_loss)) = (of(true, &views), of(false, &views));
    let spread = |colors: &[[f64; 2]]| {
        let mean = |c: usize| colors.iter().map(|ab| ab[c]).sum::<f64>() / colors.len() as f64;
        let means = [mean(0), mean(1)];
        let squares = colors
            .iter()
            .map(|ab| (0..2).map(|c| (ab[c] - means[c]).powi(2)).sum::<f64>());
        (squares.sum::<f64>() / colors.len() as f64).sqrt()
    };
    let kept = spread(&corrected) / spread(&expected);
    let (away, raw_away) = (farthest(&corrected, &expected), farthest(&raw, &expected));
    println!(
        "loss {loss} (raw {raw_loss}, without tints {floor}); away {away} (raw {raw_away}), spread kept {kept}"
    );
    assert!(loss < 0.5 * raw_loss, "{loss} {raw_loss}");
    assert!(away < 2.0, "{away}");
    assert!((kept - 1.0).abs() < 0.05, "{kept}");
}

/// A photo of the sky, where no Gaussian is, says nothing about the others' tints.
#[test]
fn a_view_that_shows_nothing_tints_nothing() {
    let ab = [30.0, -10.0];
    let mut views = constant_views(&[ab; 5]);
    let away = Camera {
        rotation: DMat3::from_rotation_y(std::f64::consts::PI),
        ..views[0].camera.clone()
    };
    views.push(chroma_view(away, vec![[-60.0, 70.0]; PIXELS]));
    let inner = inner(&solved(&ChromaSettings::irls(), &wall(), &views));
    let away = farthest(&inner, &vec![ab; inner.len()]);
    assert!(away < 1.0, "{away}");
}
