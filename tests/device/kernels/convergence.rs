//! The least-squares solver from any start, with teachers of every kind.

use std::ops::ControlFlow;

use gs_chroma::{
    chroma::{ChromaSettings, IrlsSolver},
    splats::{ShField, sh},
};

use crate::kernels::wall::{
    ChromaView, Problem, cameras, chroma_view, constant_views, drawn, farthest, pictured, settings,
    six_views, wall,
};

/// Teachers that real networks are like: of a picture, hardly any color, one view
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
        ("one colored view among gray ones", one_colored),
        ("one view", six_views()[1..2].to_vec()),
    ]
}

/// Gray, and noise of 85 units around a wrong color.
fn starts(splats: usize) -> [ShField; 2] {
    let field = |of: &dyn Fn(usize) -> f32| ShField {
        degree: 0,
        channels: 2,
        coefficients: (0..2 * splats).map(of).collect(),
    };
    [
        field(&|_| 0.0),
        field(&|k| 300.0 * ((k * 37 % 101) as f32 / 50.0 - 1.0) + [-150.0, 200.0][k % 2]),
    ]
}

/// Goes on to so many rounds; no round's loss may be greater than the one before.
fn go_on(what: &str, solver: &mut IrlsSolver<'_>, until: usize) -> ShField {
    let mut losses = Vec::new();
    solver
        .run_to(until, &mut |progress| {
            losses.push(progress.loss);
            ControlFlow::Continue(())
        })
        .unwrap();
    // The loss that levels off is another, and smaller.
    assert!(
        losses.is_sorted_by(|a, b| *b <= a * 1.0002),
        "{what}: {losses:?}"
    );
    solver.chroma().unwrap()
}

const ROUNDS: usize = 60;

/// Until nothing moves, and wherever that is.
fn patient() -> ChromaSettings {
    ChromaSettings {
        rounds: ROUNDS,
        settled: 0.01,
        anchor: 0.0,
        ..settings()
    }
}

/// The same with anchors, which are where the first rounds from gray lead.
fn anchored() -> ChromaSettings {
    ChromaSettings {
        anchor: settings().anchor,
        settled: 0.0,
        ..patient()
    }
}

/// Rounds after which the colors are anchored for sure.
const ANCHORED: usize = 20;

/// Every round ends with a loss that is no greater, and all starts end with the same colors.
#[test]
fn the_end_does_not_depend_on_the_start() {
    let luma = wall();
    for (what, views) in teachers().into_iter().skip(1) {
        let problem = Problem::new(&luma, &views);
        let picture = |chroma: ShField| drawn(&chroma, &views[0].camera);
        let free = starts(luma.len()).map(|start| {
            let (targets, tasks) = (&problem.targets, problem.tasks.clone());
            let solver =
                IrlsSolver::starting_at(&problem.frozen, &patient(), targets, tasks, &start);
            picture(go_on(what, &mut solver.unwrap(), ROUNDS))
        });
        same_ends(what, &free);
    }
}

/// So do, once these are anchored, all that they are replaced by: where views agree, and where
/// one contradicts the others.
#[test]
fn the_end_does_not_depend_on_what_replaces_anchored_colors() {
    let luma = wall();
    let named = ["a picture", "one colored view among gray ones"];
    let of_both = teachers()
        .into_iter()
        .filter(|(what, _)| named.contains(what));
    let of_both: Vec<_> = of_both.collect();
    assert_eq!(of_both.len(), named.len());
    for (what, views) in of_both {
        let problem = Problem::new(&luma, &views);
        let held = starts(luma.len()).map(|start| {
            let mut solver = problem.solver(&anchored());
            go_on(what, &mut solver, ANCHORED);
            solver.objective(&start).unwrap();
            drawn(&go_on(what, &mut solver, ROUNDS), &views[0].camera)
        });
        same_ends(what, &held);
    }
}

fn same_ends(what: &str, [one, other]: &[Vec<[f64; 2]>; 2]) {
    let away = farthest(one, other);
    assert!(away < 0.5, "{what}: {away}");
}

/// Steps from few pairs are short, however far the end: they do not end a coloring.
#[test]
fn the_first_eight_rounds_never_count_as_settled() {
    let (luma, views) = (wall(), six_views());
    let problem = Problem::new(&luma, &views);
    let content = ChromaSettings {
        settled: 1e9,
        ..patient()
    };
    let mut rounds = 0;
    let mut solver = problem.solver(&content);
    solver
        .run_to(ROUNDS, &mut |progress| {
            rounds = progress.iteration;
            ControlFlow::Continue(())
        })
        .unwrap();
    // And three in a row that do.
    assert!((11..ROUNDS).contains(&rounds), "{rounds}");
}

/// A step that goes too far has colors that cannot be drawn. What is drawn after it is whole.
#[test]
fn a_color_that_cannot_be_drawn_spoils_nothing_after_it() {
    let (luma, views) = (wall(), six_views());
    let problem = Problem::new(&luma, &views);
    let mut solver = problem.solver(&settings());
    solver.run(&mut |_| ControlFlow::Continue(())).unwrap();
    let chroma = solver.chroma().unwrap();
    let before = solver.objective(&chroma).unwrap();
    let mut too_far = chroma.clone();
    too_far.coefficients.iter_mut().for_each(|c| *c += 1e6);
    let far = solver.objective(&too_far).unwrap();
    assert!(far > 2.0 * before, "{far} {before}");
    assert_eq!(solver.objective(&chroma).unwrap(), before);
}

/// Photos from one side leave open how a color changes with the view: it is made constant,
/// as far as the least change of all goes.
#[test]
fn a_color_seen_from_one_side_is_mostly_constant() {
    let ab = [40.0, -25.0];
    let problem = Problem::new(&wall(), &constant_views(&[ab; 3]));
    let settings = ChromaSettings {
        sh_degree: 3,
        ..settings()
    };
    let mut solver = problem.solver(&settings);
    solver.run(&mut |_| ControlFlow::Continue(())).unwrap();
    let (chroma, seen) = (solver.chroma().unwrap(), solver.seen().unwrap());
    let mut shown = 0;
    for (i, _) in seen.iter().enumerate().filter(|(_, seen)| **seen > 5.0) {
        let constant = sh::C0 * f64::from(chroma.of(i)[0]) / ab[0];
        assert!((0.5..1.1).contains(&constant), "{i}: {constant}");
        shown += 1;
    }
    assert!(shown > 20, "{shown}");
}
