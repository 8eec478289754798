//! The solver's end against the least loss that there is, found by elimination in f64.

use std::ops::ControlFlow;

use gs_chroma::{
    chroma::{ChromaSettings, REST},
    splats::{ShField, Splats},
};

use crate::kernels::{
    harness::{camera, splats},
    oracle::{
        chroma_loss::{curvature, smooth_l1},
        constants::SH_C0,
        lbfgs::{Matrix, solve},
        random::{Random, oblique_view, random_scene_before},
        render::{decision_margin, render},
        scene::Scene,
        shade::Shading,
        view::View,
    },
    wall::{self, ChromaView, HEIGHT, PIXELS, WIDTH, chroma_view},
};

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
                // As wanted colors are kept.
                [0, 1].map(|c| {
                    ((ab[c] + noise[c]) * 256.0)
                        .round()
                        .clamp(-32768.0, 32767.0)
                        / 256.0
                })
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

    /// Design matrix: weight of each coefficient at each pixel, `[views · pixels][coefficients]`.
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
            let harmonics = count / self.scene.len();
            for (k, row) in matrix.iter_mut().enumerate() {
                row[k] += if k % harmonics == 0 {
                    ridge
                } else {
                    REST * ridge
                };
            }
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

/// Two dozen rounds from gray come within a thousandth of the least loss there is; more of
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
        for (rounds, near) in [(24, 1e-3), (150, 1e-7)] {
            let settings = ChromaSettings {
                sh_degree: degree as u32,
                rounds,
                ..ChromaSettings::exact()
            };
            let on_device = wall::Problem::new(&problem.luma(), &views);
            let mut solver = on_device.solver(&settings);
            solver.run(&mut |_| ControlFlow::Continue(())).unwrap();
            let chroma = solver.chroma().unwrap();
            let x: Vec<[f64; 2]> = (chroma.coefficients.chunks_exact(2))
                .map(|ab| [f64::from(ab[0]), f64::from(ab[1])])
                .collect();
            let loss = problem.loss(&design, &x);
            let above = loss / least - 1.0;
            println!("degree {degree}, {rounds} rounds: {loss} above {least} by {above:.2e}");
            assert!(above.abs() < near, "{loss} instead of {least}: {above:e}");
            let told = solver.objective(&chroma).unwrap();
            assert!((told / loss - 1.0).abs() < 1e-5, "{told} is not {loss}");
        }
    }
}
