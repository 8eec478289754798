//! The least-squares solver from any start, with teachers of every kind.

use std::ops::ControlFlow;

use gs_chroma::{
    chroma::{ChromaSettings, IrlsSolver},
    splats::ShField,
};

use crate::solver::{
    ChromaView, Problem, cameras, chroma_view, constant_views, drawn, farthest, pictured, settings,
    six_views, wall,
};

/// Teachers that real networks are like: of a picture, hardly any color, one color, one view
/// of a color of its own, one view alone.
fn teachers() -> Vec<(&'static str, Vec<ChromaView>)> {
    let gray = constant_views(&[[0.0; 2]; 8]);
    let mut one_colored = gray.clone();
    one_colored[5].wanted.ab.fill([30.0, 20.0]);
    let pale = cameras(6).into_iter().map(|camera| {
        let ab = pictured(&camera).into_iter();
        chroma_view(camera.clone(), ab.map(|ab| ab.map(|v| 0.05 * v)).collect())
    });
    vec![
        ("a picture", six_views()),
        ("hardly any color", pale.collect()),
        ("one color", constant_views(&[[60.0, -45.0]; 5])),
        ("one colored view among gray ones", one_colored),
        ("one view", six_views()[1..2].to_vec()),
    ]
}

/// Every round ends with a loss that is no greater, and all starts end with the same colors.
#[test]
fn the_end_does_not_depend_on_the_start() {
    let luma = wall();
    let field = |of: &dyn Fn(usize) -> f32| ShField {
        degree: 0,
        channels: 2,
        coefficients: (0..2 * luma.len()).map(of).collect(),
    };
    let starts = [
        field(&|_| 0.0),
        field(&|k| 300.0 * ((k * 37 % 101) as f32 / 50.0 - 1.0)),
        field(&|k| [-150.0, 200.0][k % 2]),
    ];
    for (what, views) in teachers() {
        let problem = Problem::new(&luma, &views);
        let ends = starts.each_ref().map(|start| {
            let (targets, tasks) = (&problem.targets, problem.tasks.clone());
            let frozen = &problem.frozen;
            let settings = ChromaSettings {
                rounds: 60,
                settled: 0.01,
                ..settings()
            };
            let mut solver =
                IrlsSolver::starting_at(frozen, &settings, targets, tasks, start).unwrap();
            let mut losses = Vec::new();
            solver
                .run(&mut |progress| {
                    losses.push(progress.loss);
                    ControlFlow::Continue(())
                })
                .unwrap();
            // The loss that levels off is another, and smaller.
            assert!(
                losses.is_sorted_by(|a, b| *b <= a * 1.0002),
                "{what}: {losses:?}"
            );
            drawn(&solver.chroma().unwrap(), &views[0].camera)
        });
        for end in &ends[1..] {
            let away = farthest(&ends[0], end);
            assert!(away < 0.5, "{what}: {away}");
        }
    }
}
