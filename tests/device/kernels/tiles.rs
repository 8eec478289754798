//! `compact`, `tile_lists`, `tile_ranges`: who is blended in which tile, and
//! in which order.

use crate::kernels::{
    harness::{Stage, splats},
    oracle::{
        constants::TILE,
        random::{oblique_view, random_scene, random_scene_before, random_view},
        render::visible,
        scene::Scene,
        shade::Shading,
        tiles::{TileGrid, min_power},
        view::View,
    },
};

/// Error of `f32`, relative to the cutoff, within which a tile may be misjudged as touched.
const SLACK: f64 = 1e-4;

/// Checks all tiles; gives the entries beyond the oracle's.
fn check(scene: &Scene<f64, 1>, view: &View) -> usize {
    let stage = Stage::new(&splats(scene), view);
    stage.forward();
    let lists = stage.tiles();
    let shown = visible(scene, view, Shading::Offset);
    let grid = TileGrid {
        tile: TILE,
        width: view.width,
        height: view.height,
    };
    assert_eq!(lists.len(), grid.columns() * grid.rows());
    let entries: usize = lists.iter().map(Vec::len).sum();
    assert_eq!(stage.status().instances, entries);
    assert_eq!(stage.status().overflow, None);
    let mut surplus = 0;
    for (tile, list) in lists.iter().enumerate() {
        let clipped = grid.centers(tile % grid.columns(), tile / grid.columns());
        // At the border the kernel goes on to the tile's own end.
        let whole = clipped.map(|[first, _]| [first, first + TILE as f64 - 1.0]);
        let mut wanted = Vec::new();
        for splat in &shown {
            let (index, cutoff) = (splat.index, splat.projected.cutoff);
            let listed = list.contains(&index);
            let power = min_power(&splat.projected, clipped);
            if power <= cutoff * (1.0 - SLACK) {
                assert!(listed, "tile {tile} lacks Gaussian {index}");
            }
            if listed {
                wanted.push(index);
                surplus += usize::from(power > cutoff);
                let power = min_power(&splat.projected, whole);
                let justified = power <= cutoff * (1.0 + SLACK);
                assert!(justified, "tile {tile} has Gaussian {index} for nothing");
            }
        }
        // `shown` is in depth order, ties by index; nothing is listed twice.
        assert_eq!(*list, wanted, "order in tile {tile}");
    }
    surplus
}

#[test]
fn lists_hold_the_oracles_entries_in_depth_order() {
    let mut border = 0;
    for seed in 1..7 {
        let view = random_view(seed);
        border += check(&random_scene_before(&view, seed, 300, 0), &view);
    }
    assert!(border > 0, "no view ended within a tile");
}

#[test]
fn where_tiles_end_with_the_image_there_is_no_surplus() {
    for seed in 1..4 {
        let mut view = oblique_view();
        (view.width, view.height) = (64, 48);
        let surplus = check(&random_scene_before(&view, seed, 300, 0), &view);
        assert_eq!(surplus, 0, "seed {seed}");
    }
}

#[test]
fn ties_keep_the_order_of_the_array() {
    // Equal places, so equal depths, in several workgroups of 256.
    let (scene, view) = random_scene::<1>(3, 30, 0);
    let crowd = (0..600).map(|i| scene.gaussian(i * 7 % 30));
    check(&Scene::of(0, crowd), &view);
}

#[test]
fn what_does_not_fit_is_counted_and_nothing_is_drawn() {
    let (scene, view) = random_scene::<1>(4, 100, 0);
    let splats = splats(&scene);
    let whole = Stage::new(&splats, &view);
    let picture = whole.forward();
    let needed = whole.status().instances;

    let short = Stage::with_capacity(&splats, &view, needed - 1);
    assert!(short.forward().iter().all(|&value| value == 0.0));
    assert_eq!(short.status().overflow, Some(needed));
    assert_eq!(short.status().instances, 0);

    let exact = Stage::with_capacity(&splats, &view, needed);
    assert_eq!(exact.forward(), picture);
    assert_eq!(exact.status().overflow, None);
}
