use super::*;

/// A canvas of two halves, dark and light, with the edge at `edge`.
fn halves(width: u32, height: u32, edge: u32) -> Canvas {
    Canvas {
        width,
        height,
        gray: (0..width * height)
            .map(|i| if i % width < edge { 60 } else { 190 })
            .collect(),
        mask: None,
        stance: Default::default(),
    }
}

fn flat(canvas: &Canvas, ab: [f32; 2], weight: f32) -> WeightedColors {
    WeightedColors {
        ab: vec![ab; canvas.len()],
        weight: vec![weight; canvas.len()],
    }
}

fn near(found: [f32; 2], wanted: [f32; 2], within: f32) -> bool {
    (0..2).all(|k| (found[k] - wanted[k]).abs() <= within)
}

#[test]
fn where_the_scene_covers_all_a_constant_stays() {
    let canvas = halves(24, 10, 11);
    let teacher = vec![[-30.0, 50.0]; canvas.len()];
    let found = blend(
        &canvas,
        &flat(&canvas, [20.0, -8.0], 1.0),
        Some(&teacher),
        None,
    );
    assert!(found.iter().all(|&ab| near(ab, [20.0, -8.0], 0.05)));
}

#[test]
fn where_it_covers_nothing_the_teacher_is_taken_as_it_is() {
    let canvas = halves(24, 10, 11);
    let teacher: Vec<[f32; 2]> = (0..canvas.len()).map(|i| [(i % 24) as f32, 5.0]).collect();
    let found = blend(
        &canvas,
        &flat(&canvas, [90.0, 90.0], 0.0),
        Some(&teacher),
        None,
    );
    for (found, teacher) in found.iter().zip(&teacher) {
        assert!(near(*found, *teacher, 0.1), "{found:?} {teacher:?}");
    }
}

#[test]
fn beside_the_scene_the_teacher_is_moved_in_line_with_it_and_keeps_its_detail() {
    let (width, height) = (40, 12);
    let canvas = Canvas {
        gray: vec![128; (width * height) as usize],
        ..halves(width, height, 0)
    };
    // The teacher is 12 units too red everywhere, and has a stripe of its own on the right.
    let stripe = |i: usize| if i % 40 >= 30 { 15.0 } else { 0.0 };
    let teacher: Vec<[f32; 2]> = (0..canvas.len()).map(|i| [22.0, stripe(i)]).collect();
    let mut scene = flat(&canvas, [10.0, 0.0], 1.0);
    for (i, weight) in scene.weight.iter_mut().enumerate() {
        *weight = if i % 40 < 20 { 1.0 } else { 0.0 };
    }
    let found = blend(&canvas, &scene, Some(&teacher), None);
    for (i, ab) in found.iter().enumerate() {
        let x = i % 40;
        assert!((ab[0] - 10.0).abs() < 0.3, "{x}: {ab:?}");
        if (22..27).contains(&x) || x > 32 {
            assert!((ab[1] - stripe(i)).abs() < 1.5, "{x}: {ab:?}");
        }
    }
    // No seam: neighbors across the border of what is covered hardly differ.
    for y in 0..12 {
        let [a, b] = [19, 20].map(|x| found[y * 40 + x]);
        assert!(near(a, b, 0.3), "{a:?} {b:?}");
    }
}

#[test]
fn colors_stop_at_edges() {
    let canvas = halves(40, 16, 20);
    // Two blurred columns about the edge are not believed.
    let mut scene = flat(&canvas, [0.0; 2], 1.0);
    for i in 0..canvas.len() {
        let x = i % 40;
        scene.ab[i] = if x < 20 { [40.0, 0.0] } else { [-40.0, 0.0] };
        if (17..23).contains(&x) {
            scene.ab[i] = [0.0; 2];
            scene.weight[i] = 0.01;
        }
    }
    let found = blend(&canvas, &scene, None, None);
    for (x, wanted) in [(18, 40.0), (19, 40.0), (20, -40.0), (21, -40.0)] {
        let ab = found[8 * 40 + x];
        assert!(near(ab, [wanted, 0.0], 9.0), "{x}: {ab:?}");
    }
}

#[test]
fn what_nothing_covers_takes_the_colors_around_and_the_photo_before_steadies_it() {
    let canvas = halves(16, 8, 16);
    let mut scene = flat(&canvas, [30.0, 10.0], 0.0);
    scene.weight[..16].fill(1.0);
    let found = blend(&canvas, &scene, None, None);
    assert!(found.iter().all(|&ab| near(ab, [30.0, 10.0], 0.2)));
    // A teacher that flickers by 20 units between photos, where the scene says nothing.
    let nothing = WeightedColors::nothing(canvas.len());
    let teachers = [10.0, -10.0].map(|a| vec![[a, 0.0]; canvas.len()]);
    let first = blend(&canvas, &nothing, Some(&teachers[0]), None);
    let before = WeightedColors {
        weight: vec![1.0; canvas.len()],
        ab: first.clone(),
    };
    let second = blend(&canvas, &nothing, Some(&teachers[1]), Some(&before));
    let moved = first[50][0] - second[50][0];
    assert!(moved > 0.0 && moved < 4.0, "{moved}");
}

#[test]
fn whatever_the_size_and_nothing_known_it_ends() {
    for (width, height) in [(1, 1), (1, 9), (7, 1), (3, 5)] {
        let canvas = halves(width, height, 2);
        let nothing = WeightedColors::nothing(canvas.len());
        let found = blend(&canvas, &nothing, None, None);
        assert!(found.iter().all(|&ab| ab == [0.0; 2]));
        let found = blend(&canvas, &flat(&canvas, [7.0, 7.0], 1.0), None, None);
        assert!(found.iter().all(|&ab| near(ab, [7.0, 7.0], 0.05)));
    }
}

#[test]
fn where_the_teacher_is_plainly_wrong_nothing_of_it_is_left_and_a_cast_costs_no_detail() {
    let (width, height) = (60, 40);
    let canvas = Canvas {
        gray: vec![128; (width * height) as usize],
        ..halves(width, height, 0)
    };
    let at = |i: usize| (i % 60, i / 60);
    // Stripes that blurred geometry has lost; a cast of 9 units; a patch of another color.
    let stripe = |x: usize| if x.is_multiple_of(2) { 6.0 } else { -6.0 };
    let patch = |i: usize| (35..50).contains(&at(i).0) && (10..30).contains(&at(i).1);
    let scene = flat(&canvas, [20.0, 0.0], 1.0);
    let teacher: Vec<[f32; 2]> = (0..canvas.len())
        .map(|i| match patch(i) {
            true => [-45.0, -50.0],
            false => [29.0, stripe(at(i).0)],
        })
        .collect();
    let found = blend(&canvas, &scene, Some(&teacher), None);
    let (mut seams, mut detail) = (0.0_f32, 0.0_f32);
    for (i, ab) in found.iter().enumerate() {
        let (x, y) = at(i);
        assert!((ab[0] - 20.0).abs() < 5.0, "{x} {y}: {ab:?}");
        if (30..55).contains(&x) && (5..35).contains(&y) {
            seams = seams.max((ab[0] - 20.0).abs());
        } else if (4..24).contains(&x) && (4..36).contains(&y) {
            detail += ab[1] * stripe(x) / 36.0;
        }
    }
    // At the patch's corners a thirteenth of the step of 65 units, and nearly all of the stripes.
    assert!(seams < 5.0, "{seams}");
    assert!(detail / 640.0 > 0.85, "{}", detail / 640.0);
}
