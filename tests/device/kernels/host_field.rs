//! Stage 2 on a field that is no Gaussians: a plane of texels, without a kernel of its own.

use std::ops::ControlFlow;

use gs_chroma::{
    capture::Camera,
    chroma::{
        AdamSolver, ChromaError, ChromaSettings, FrozenField, HostField, MemoryBudget, Primitives,
        Targets, Task, choose_degree, solve,
    },
    raster::ColorKind,
    splats::{ShField, sh},
};

use crate::kernels::{
    harness::gpu,
    wall::{ChromaView, PIXELS, WIDTH, cameras, chroma_view, colors, pictured, settings, truth},
};

/// Texels a world unit, and along each side.
const FINE: f64 = 4.0;
const SIDE: usize = 18;

fn place(texel: usize) -> [f64; 2] {
    [texel % SIDE, texel / SIDE].map(|k| (k as f64 - 0.5 * (SIDE - 1) as f64) / FINE)
}

/// The plane at the distance of the wall, between texels bilinear.
fn plane(cameras: &[Camera], room: MemoryBudget) -> Result<impl FrozenField, ChromaError> {
    let texels = Primitives {
        centers: (0..SIDE * SIDE)
            .map(|k| [place(k)[0] as f32, place(k)[1] as f32, 4.0])
            .collect(),
        luma: vec![0.0; SIDE * SIDE],
        log_sizes: vec![0.0; SIDE * SIDE],
    };
    let own = cameras.to_vec();
    let weights = move |view: usize, [x, y]: [u32; 2], list: &mut Vec<(u32, f32)>| {
        let camera = &own[view];
        let at = [
            (f64::from(x) + 0.5 - camera.cx) / camera.fx * 4.0 - camera.translation.x,
            (f64::from(y) + 0.5 - camera.cy) / camera.fy * 4.0 - camera.translation.y,
        ];
        let [x, y] = at.map(|v| v * FINE + 0.5 * (SIDE - 1) as f64);
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let [column, row] = [x.floor() + dx, y.floor() + dy];
            let weight = (1.0 - (x - column).abs()) * (1.0 - (y - row).abs());
            if column >= 0.0 && row >= 0.0 && column < SIDE as f64 && row < SIDE as f64 {
                list.push((row as u32 * SIDE as u32 + column as u32, weight as f32));
            }
        }
    };
    HostField::new(gpu(), texels, cameras, room, weights)
}

fn problem(count: usize) -> (Vec<Camera>, Targets, Vec<Task>) {
    let cameras = cameras(count);
    let mut targets = Targets::new(3);
    let tasks = (0..count).map(|view| {
        let ChromaView { wanted, .. } =
            chroma_view(cameras[view].clone(), pictured(&cameras[view]));
        let target = targets.push_ab(&wanted, None).unwrap();
        Task { view, target }
    });
    let tasks = tasks.collect();
    (cameras, targets, tasks)
}

/// Mean distance from the truth of the texels that all views show.
fn miss(chroma: &ShField) -> f64 {
    let inner = |&k: &usize| place(k)[0].abs() < 1.2 && place(k)[1].abs() < 0.8;
    let found = colors(&ShField {
        coefficients: (chroma.coefficients)
            .chunks_exact(2 * sh::coefficient_count(chroma.degree))
            .flat_map(|of_texel| of_texel[..2].to_vec())
            .collect(),
        degree: 0,
        ..*chroma
    });
    let misses = (0..SIDE * SIDE).filter(inner).map(|k| {
        let wanted = truth(place(k)[0], place(k)[1]);
        (found[k][0] - wanted[0]).hypot(found[k][1] - wanted[1])
    });
    let misses: Vec<f64> = misses.collect();
    misses.iter().sum::<f64>() / misses.len() as f64
}

fn room() -> MemoryBudget {
    MemoryBudget::of(ColorKind::Chroma, 1)
}

#[test]
fn texels_take_the_colors_of_their_pictures() {
    let (cameras, targets, tasks) = problem(6);
    let plane = plane(&cameras, room()).unwrap();
    let quiet = &mut |_| ControlFlow::Continue(());
    let found = solve(&plane, &settings(), &targets, tasks.clone(), quiet).unwrap();
    let off = miss(&found.chroma);
    assert!(off < 1.0, "off by {off}");
    // Texels that no view shows have their neighbors' colors.
    assert_eq!(found.seen.as_ref().map(Vec::len), Some(SIDE * SIDE));
    assert!(found.seen.unwrap()[0] < 0.5);
    assert!(found.chroma.of(0)[0] != 0.0);

    let by_adam = ChromaSettings::adam(600);
    let adam = AdamSolver::new(&plane, by_adam, &targets, tasks.clone());
    let mut adam = adam.unwrap();
    adam.run(quiet).unwrap();
    let off = miss(&adam.harmonics().unwrap());
    assert!(off < 4.0, "Adam, coarse to fine: off by {off}");

    let choice = choose_degree(&plane, &settings(), &targets, &tasks, &mut |_, _| {
        ControlFlow::Continue(())
    });
    let losses = choice.unwrap().losses;
    // Texels do not follow the truth wholly: held-back views gain by harmonics.
    assert!(losses[1] < losses[0], "{losses:?}");
}

/// As of Gaussians in `gather.rs`, and by harmonics that depend on the direction.
#[test]
fn the_adjoint_is_that_of_drawing() {
    let (cameras, ..) = problem(2);
    let plane = plane(&cameras, room()).unwrap();
    let mut random = fastrand::Rng::with_seed(5);
    let figures: Vec<[f32; 4]> = (0..PIXELS)
        .map(|_| [(); 4].map(|()| 2.0 * random.f32() - 1.0))
        .collect();
    let gathered = plane.gather(1, &figures).unwrap();
    let mut chroma = ShField::zeros(SIDE * SIDE, 0, 2);
    chroma
        .coefficients
        .iter_mut()
        .for_each(|c| *c = random.f32());
    let field = plane.colors(&chroma).unwrap();
    let drawn = plane.draw(1, &[&field]).unwrap().remove(0);
    let drawn = drawn.pixels.as_chunks::<2>().0;
    for figure in 0..4 {
        let of_pixels: f64 = (drawn.iter().zip(&figures))
            .map(|(ab, figures)| f64::from(ab[figure % 2] * figures[figure]))
            .sum();
        let of_texels: f64 = (gathered.iter().enumerate())
            .map(|(i, sums)| {
                let color = sh::C0 * f64::from(chroma.of(i)[figure % 2]);
                color * f64::from(sums[figure])
            })
            .sum();
        assert!(
            (of_pixels - of_texels).abs() < 1e-4,
            "{of_pixels}, {of_texels}"
        );
    }
    let depth = plane.depth(0).unwrap();
    assert!((depth[PIXELS / 2 + WIDTH / 2] - 4.0).abs() < 1e-6);
}

/// Targets of views without room take turns, and colors are the same.
#[test]
fn a_limit_keeps_targets_on_the_host() {
    let (cameras, targets, tasks) = problem(6);
    let quiet = &mut |_| ControlFlow::Continue(());
    let within = |limit| plane(&cameras, MemoryBudget { limit, ..room() });
    let whole = within(None).unwrap();
    let limit = whole.demand() - 3 * 4 * PIXELS as u64;
    let part = within(Some(limit)).unwrap();
    assert_eq!((whole.pinned(), part.pinned()), (6, 2));
    let [a, b] = [&whole as &dyn FrozenField, &part].map(|field| {
        let solved = solve(field, &settings(), &targets, tasks.clone(), quiet);
        solved.unwrap().chroma
    });
    assert!(a == b, "the same colors");
    let error = within(Some(1000)).map(drop).unwrap_err();
    assert!(matches!(error, ChromaError::OverLimit { .. }), "{error}");
}
