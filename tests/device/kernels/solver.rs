//! The least-squares solver of stage 2 as a whole, on scenes whose colors are known.

use std::ops::ControlFlow;

use glam::DMat3;
use gs_chroma::{
    capture::Camera,
    chroma::{ChromaError, ChromaSettings, FrozenField, bake, match_saturation, solve},
    splats::{ShField, Splats},
};

use crate::kernels::{
    harness::bits,
    oracle::view_correction::{Affine, center_of},
    wall::{
        COLUMNS, ChromaView, HEIGHT, PIXELS, Problem, STEP, WIDTH, cameras, chroma_view, colors,
        constant_views, drawn, farthest, inner, pictured, settings, six_views, wall,
    },
};
fn solved(settings: &ChromaSettings, luma: &Splats, views: &[ChromaView]) -> ShField {
    let problem = Problem::new(luma, views);
    let mut solver = problem.solver(settings);
    solver.run(&mut |_| ControlFlow::Continue(())).unwrap();
    solver.chroma().unwrap()
}

/// Results are equal if all views stay on the device, some, or none, and if targets wait in memory
/// or in a file.
#[test]
#[ignore = "25 to 40 seconds; the program colors within a memory limit elsewhere: make test-all"]
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
            let solved = solve(frozen, &settings, targets, tasks, quiet).unwrap();
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
    let filled = solve(frozen, &settings(), targets, tasks, &mut |_| {
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
