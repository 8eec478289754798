//! The least-squares solver of stage 2 as a whole, on scenes small enough to be solved
//! by elimination or to be known.

use glam::{DMat3, DVec3};
use gs_chroma::{
    capture::Camera,
    chroma::{ChromaSettings, ChromaView, Solver, distil, teacher::AbImage},
    raster::{Field, Geometry, Renderer},
    splats::{ShField, Splats, sh},
};

use crate::{
    harness::{bits, camera, gpu, raster, splats},
    oracle::{
        chroma_loss::{curvature, smooth_l1},
        conjugate::{Matrix, solve},
        constants::SH_C0,
        random::{Random, oblique_view, random_scene_before},
        render::{decision_margin, render},
        scene::{Scene, View},
        shade::Shading,
    },
};

const WIDTH: usize = 32;
const HEIGHT: usize = 24;
const PIXELS: usize = WIDTH * HEIGHT;

fn chroma_view(camera: Camera, ab: Vec<[f64; 2]>) -> ChromaView {
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
    let mut solver = Solver::new(raster(), settings, 1.0, luma, views).unwrap();
    solver.run(&mut |_| {}).unwrap();
    solver.chroma().unwrap()
}

/// Two views of a random scene.
struct Problem {
    scene: Scene<f64, 2>,
    views: Vec<View>,
    /// `[views][pixels]`
    wanted: Vec<Vec<[f64; 2]>>,
    weights: Vec<Vec<f64>>,
}

impl Problem {
    /// Wanted a/b are a picture of the scene with noise; a tenth is far off.
    fn random(seed: u64, count: usize, degree: usize) -> Self {
        let mut random = Random::new(seed);
        let view = |shift: f64| View {
            fx: 34.0,
            fy: 31.0,
            cx: 16.5,
            cy: 11.5,
            width: WIDTH,
            height: HEIGHT,
            translation: [0.3 + shift, -0.2, 0.5 - shift],
            ..oblique_view()
        };
        let views = vec![view(0.0), view(0.25)];
        let scene = random_scene_before::<2>(&views[0], seed, count, degree);
        let (mut wanted, mut weights) = (Vec::new(), Vec::new());
        for view in &views {
            let picture = render(&scene, view, Shading::Plain);
            let noisy = picture.into_iter().map(|ab: [f64; 2]| {
                let spread = if random.range(0.0, 1.0) < 0.1 {
                    60.0
                } else {
                    3.0
                };
                let noise: [f64; 2] = random.array(-spread, spread);
                [0, 1].map(|c| f64::from((ab[c] + noise[c]) as f32))
            });
            wanted.push(noisy.collect());
            // Where f32 may decide otherwise nothing is known.
            let counts = |(p, margin): (usize, f64)| {
                if margin < 1e-4 {
                    0.0
                } else {
                    [1.0, 0.5, 1.0, 4.0][p % 4]
                }
            };
            let margins = decision_margin(&scene, view).into_iter();
            weights.push(margins.enumerate().map(counts).collect());
        }
        Self {
            scene,
            views,
            wanted,
            weights,
        }
    }

    fn chroma_views(&self) -> Vec<ChromaView> {
        (self.views.iter().zip(&self.wanted).zip(&self.weights))
            .map(|((view, wanted), weights)| ChromaView {
                weights: Some(weights.iter().map(|&w| w as f32).collect()),
                ..chroma_view(camera(view), wanted.clone())
            })
            .collect()
    }

    /// The scene's geometry; its luma plays no part.
    fn luma(&self) -> Splats {
        let mut luma = splats(&self.scene);
        luma.sh = ShField::zeros(luma.len(), 0, 1);
        luma
    }

    /// What each coefficient adds to each pixel, `[views · pixels][coefficients]`.
    fn design(&self) -> Matrix {
        let count = self.scene.sh.len();
        let mut design = vec![vec![0.0; count]; self.views.len() * PIXELS];
        let mut scene = self.scene.clone();
        for k in 0..count {
            scene.sh.fill([0.0; 2]);
            scene.sh[k] = [1.0; 2];
            let pictures = self
                .views
                .iter()
                .flat_map(|v| render(&scene, v, Shading::Plain));
            for (row, value) in design.iter_mut().zip(pictures) {
                row[k] = value[0];
            }
        }
        design
    }

    /// The least loss of one channel, by reweighting and elimination until nothing moves.
    fn least(&self, design: &Matrix, channel: usize) -> Vec<f64> {
        let count = design[0].len();
        let mean = 0.5 / PIXELS as f64;
        // A hundredth of a pixel.
        let ridge = 0.01 * mean * SH_C0 * SH_C0;
        let wanted: Vec<f64> = self.wanted.iter().flatten().map(|ab| ab[channel]).collect();
        let weights: Vec<f64> = self.weights.iter().flatten().copied().collect();
        let mut x = vec![0.0; count];
        for _ in 0..100 {
            let mut matrix = vec![vec![0.0; count]; count];
            let mut right = vec![0.0; count];
            for ((row, t), w) in design.iter().zip(&wanted).zip(&weights) {
                let drawn: f64 = row.iter().zip(&x).map(|(a, x)| a * x).sum();
                let weight = w * mean * curvature(drawn - t, 0.0);
                for (i, a) in row.iter().enumerate().filter(|(_, a)| **a != 0.0) {
                    right[i] += weight * a * t;
                    for (m, b) in matrix[i].iter_mut().zip(row) {
                        *m += weight * a * b;
                    }
                }
            }
            (0..count).for_each(|k| matrix[k][k] += ridge);
            x = solve(matrix, &right);
        }
        x
    }

    /// The plain loss of coefficients `[coefficients][2]`, the mean over the views.
    fn loss(&self, design: &Matrix, x: &[[f64; 2]]) -> f64 {
        let wanted = self.wanted.iter().flatten();
        let weights = self.weights.iter().flatten();
        let terms = design.iter().zip(wanted).zip(weights).map(|((row, t), w)| {
            let drawn = |c: usize| row.iter().zip(x).map(|(a, x)| a * x[c]).sum::<f64>();
            w * [0, 1]
                .map(|c| smooth_l1(drawn(c) - t[c]))
                .iter()
                .sum::<f64>()
        });
        terms.sum::<f64>() * 0.5 / (PIXELS * self.views.len()) as f64
    }
}

/// Eight rounds from gray come within a thousandth of the least loss there is; more of
/// them get there.
#[test]
fn the_least_loss_is_reached() {
    for (seed, count, degree) in [(3, 40, 0), (4, 12, 1)] {
        let problem = Problem::random(seed, count, degree);
        let design = problem.design();
        let channels = [0, 1].map(|c| problem.least(&design, c));
        let least: Vec<[f64; 2]> = (0..channels[0].len())
            .map(|k| [channels[0][k], channels[1][k]])
            .collect();
        let least = problem.loss(&design, &least);
        let views = problem.chroma_views();
        for (rounds, steps, near) in [(8, 5, 1e-3), (40, 10, 1e-7)] {
            let settings = ChromaSettings {
                sh_degree: degree as u32,
                warm_scales: 0,
                rounds,
                steps,
                ..ChromaSettings::exact()
            };
            let mut solver =
                Solver::new(raster(), &settings, 1.0, &problem.luma(), &views).unwrap();
            solver.run(&mut |_| {}).unwrap();
            let chroma = solver.chroma().unwrap();
            let x: Vec<[f64; 2]> = (chroma.coefficients.chunks_exact(2))
                .map(|ab| [f64::from(ab[0]), f64::from(ab[1])])
                .collect();
            let loss = problem.loss(&design, &x);
            let above = loss / least - 1.0;
            println!("degree {degree}, {rounds} × {steps}: {loss} above {least} by {above:.2e}");
            assert!(above.abs() < near, "{loss} instead of {least}: {above:e}");
            let told = solver.objective(&chroma).unwrap();
            assert!((told / loss - 1.0).abs() < 1e-5, "{told} is not {loss}");
        }
    }
}

/// Spacing of the wall's Gaussians in world units.
const STEP: f64 = 0.5;
const COLUMNS: usize = 8;
const ROWS: usize = 5;

/// A wall of Gaussians that all views show; hardly anything shows through.
fn wall() -> Splats {
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
fn cameras(count: usize) -> Vec<Camera> {
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
fn constant_views(colors: &[[f64; 2]]) -> Vec<ChromaView> {
    (cameras(colors.len()).into_iter().zip(colors))
        .map(|(camera, &ab)| chroma_view(camera, vec![ab; PIXELS]))
        .collect()
}

/// A smooth field of colour on the wall.
fn truth(x: f64, y: f64) -> [f64; 2] {
    [
        35.0 * (1.5 * x).sin() + 5.0,
        30.0 * (1.2 * x + 2.0 * y).cos(),
    ]
}

/// That field in the pixels of a camera before the wall.
fn pictured(camera: &Camera) -> Vec<[f64; 2]> {
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
fn drawn(chroma: &ShField, camera: &Camera) -> Vec<[f64; 2]> {
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
fn farthest(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn settings() -> ChromaSettings {
    ChromaSettings {
        corrects_views: false,
        ..ChromaSettings::irls()
    }
}

#[test]
fn the_same_bytes_with_lists_of_their_own_and_shared() {
    let views: Vec<ChromaView> = (cameras(3).into_iter())
        .map(|camera| chroma_view(camera.clone(), pictured(&camera)))
        .collect();
    let of = |cache_bytes| {
        let settings = ChromaSettings {
            cache_bytes,
            coarser_scales: 1,
            rounds: 2,
            ..ChromaSettings::irls()
        };
        bits(&solved(&settings, &wall(), &views).coefficients)
    };
    let own = of(usize::MAX);
    assert!(own == of(usize::MAX), "two runs differ");
    assert!(own == of(0), "all views share one set of lists");
    // Room for some of them.
    assert!(own == of(12_000), "some views share one set of lists");
}

#[test]
fn views_of_one_colour_give_that_colour() {
    let ab = [21.0, -34.0];
    let chroma = solved(&ChromaSettings::irls(), &wall(), &constant_views(&[ab; 3]));
    assert!(chroma.coefficients.iter().all(|c| c.is_finite()));
    let inner = inner(&chroma);
    let away = farthest(&inner, &vec![ab; inner.len()]);
    assert!(away < 0.5, "{away}");
}

#[test]
fn what_no_view_sees_takes_its_neighbours_colour() {
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
    let mut solver = Solver::new(raster(), &settings(), 1.0, &luma, &views).unwrap();
    solver.run(&mut |_| {}).unwrap();
    let (chroma, seen) = (solver.chroma().unwrap(), solver.seen().unwrap());
    for i in hidden.clone() {
        assert_eq!((chroma.of(i), seen[i]), (&[0.0; 2][..], 0.0), "{i}");
    }
    let filled = distil(&raster(), &settings(), 1.0, &luma, views, &mut |_| {}).unwrap();
    let away = farthest(&colors(&filled.chroma)[hidden], &[ab; 6]);
    assert!(away < 1.0, "{away}");
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
    for corrects_views in [false, true] {
        let settings = ChromaSettings {
            corrects_views,
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
        println!("corrects {corrects_views}: {right:?} where it was painted, {left:?} elsewhere");
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
            rounds: 15,
            steps: 8,
            ..settings()
        };
        let of = |views| inner(&solved(&settings, &wall(), views));
        farthest(&of(&seven), &of(&wrong))
    };
    let (doubted, counted) = (moved(Some(10.0)), moved(None));
    println!("moved by {doubted} where it is doubted, by {counted} where it counts");
    assert!(doubted < 0.1, "{doubted}");
    assert!(counted > 0.5, "{counted}");
}

/// Teachers that are each too pale or too strong and tinted come out as one: their mean.
#[test]
fn views_with_gains_and_tints_agree_on_their_mean() {
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
    let of = |corrects_views, views: &[ChromaView]| {
        let settings = ChromaSettings {
            corrects_views,
            ..ChromaSettings::irls()
        };
        let mut last = 0.0;
        let mut solver = Solver::new(raster(), &settings, 1.0, &wall(), views).unwrap();
        solver.run(&mut |progress| last = progress.loss).unwrap();
        (inner(&solver.chroma().unwrap()), last)
    };
    let (one, floor) = of(false, &steady);
    let mean = gains.iter().sum::<f64>() / 6.0;
    let expected: Vec<[f64; 2]> = (one.iter())
        .map(|ab| [0, 1].map(|c| mean * ab[c] + tints.iter().map(|t| t[c]).sum::<f64>() / 6.0))
        .collect();
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
