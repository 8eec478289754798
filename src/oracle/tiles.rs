//! Tiles that a Gaussian touches: its visible ellipse against the rectangle of each tile's pixel
//! centers, exactly.

use super::project::Projected;

/// Grid of square tiles over an image.
#[derive(Clone, Copy, Debug)]
pub struct TileGrid {
    /// Side of a tile in pixels.
    pub tile: usize,
    /// Image width in pixels.
    pub width: usize,
    /// Image height in pixels.
    pub height: usize,
}

impl TileGrid {
    /// Number of tile columns.
    pub fn columns(&self) -> usize {
        self.width.div_ceil(self.tile)
    }

    /// Number of tile rows.
    pub fn rows(&self) -> usize {
        self.height.div_ceil(self.tile)
    }

    /// First and last pixel centers of a tile, `[[left, right], [top, bottom]]`.
    /// Tiles at the border end with the image.
    pub fn centers(&self, column: usize, row: usize) -> [[f64; 2]; 2] {
        let span = |index: usize, size: usize| {
            let last = ((index + 1) * self.tile).min(size);
            [(index * self.tile) as f64 + 0.5, last as f64 - 0.5]
        };
        [span(column, self.width), span(row, self.height)]
    }
}

/// `½ (A dx² + C dy²) + B dx dy`, the exponent that blending uses.
fn power([a, b, c]: [f64; 3], dx: f64, dy: f64) -> f64 {
    0.5 * (a * dx * dx + c * dy * dy) + b * dx * dy
}

/// The smallest exponent anywhere in a rectangle `[[left, right], [top, bottom]]`.
///
/// The exponent is convex: its minimum is at the mean if that lies within,
/// else on one of the four edges.
pub fn min_power(projected: &Projected<f64>, rectangle: [[f64; 2]; 2]) -> f64 {
    let conic = projected.conic;
    // Relative to the mean.
    let [[left, right], [top, bottom]] =
        [0, 1].map(|i| rectangle[i].map(|edge| edge - projected.mean2d[i]));
    if left <= 0.0 && right >= 0.0 && top <= 0.0 && bottom >= 0.0 {
        return 0.0;
    }
    let [a, b, c] = conic;
    // Along a vertical edge the slope a·0 + b·dx + c·dy vanishes at dy = -b·dx/c.
    let vertical = [left, right].map(|dx| power(conic, dx, (-b * dx / c).clamp(top, bottom)));
    let horizontal = [top, bottom].map(|dy| power(conic, (-b * dy / a).clamp(left, right), dy));
    (vertical.into_iter().chain(horizontal)).fold(f64::INFINITY, f64::min)
}

/// Returns true if a Gaussian touches a tile.
pub fn touches(projected: &Projected<f64>, grid: &TileGrid, column: usize, row: usize) -> bool {
    min_power(projected, grid.centers(column, row)) <= projected.cutoff
}

/// Per tile, in row order, the positions in `projected` that touch it. Given
/// in depth order, each list is in depth order.
pub fn tiles(projected: &[Projected<f64>], grid: &TileGrid) -> Vec<Vec<usize>> {
    let mut lists = Vec::with_capacity(grid.columns() * grid.rows());
    for row in 0..grid.rows() {
        for column in 0..grid.columns() {
            let touching = |&i: &usize| touches(&projected[i], grid, column, row);
            lists.push((0..projected.len()).filter(touching).collect());
        }
    }
    lists
}

#[cfg(test)]
mod tests {
    use super::super::blend::{blend, blend_pixel};
    use super::super::constants::TILE;
    use super::super::numerics::Numerics;
    use super::super::random::random_scene;
    use super::super::render::visible;
    use super::super::shade::Shading;
    use super::*;

    const GRID: TileGrid = TileGrid {
        tile: TILE,
        width: 48,
        height: 40,
    };

    fn scene(seed: u64) -> Vec<super::super::render::Visible<f64, 1>> {
        let (scene, view) = random_scene::<1>(seed, 40, 0);
        visible(&scene, &view, Shading::Offset)
    }

    #[test]
    fn grid_covers_the_image() {
        assert_eq!((GRID.columns(), GRID.rows()), (3, 3));
        assert_eq!(GRID.centers(0, 0), [[0.5, 15.5], [0.5, 15.5]]);
        assert_eq!(GRID.centers(2, 2), [[32.5, 47.5], [32.5, 39.5]]);
    }

    #[test]
    fn minimum_equals_a_dense_search() {
        for visible in scene(21) {
            let p = &visible.projected;
            for tile in 0..9 {
                let [[left, right], [top, bottom]] = GRID.centers(tile % 3, tile / 3);
                let mut least = f64::INFINITY;
                for i in 0..=300 {
                    for j in 0..=300 {
                        let x = left + (right - left) * f64::from(i) / 300.0;
                        let y = top + (bottom - top) * f64::from(j) / 300.0;
                        least = least.min(power(p.conic, x - p.mean2d[0], y - p.mean2d[1]));
                    }
                }
                let exact = min_power(p, [[left, right], [top, bottom]]);
                assert!(exact <= least + 1e-12);
                assert!(least - exact < 0.02 + 0.02 * exact, "{exact} or {least}");
            }
        }
    }

    #[test]
    fn tiles_do_not_change_the_picture() {
        for tile in [4, 16, 64] {
            let grid = TileGrid { tile, ..GRID };
            let list = scene(22);
            let projected: Vec<_> = list.iter().map(|v| v.projected).collect();
            let splats: Vec<_> = list.iter().map(|v| v.splat).collect();
            let lists = tiles(&projected, &grid);
            for (index, expected) in blend(&splats, &Numerics::DEFAULT, 48, 40)
                .into_iter()
                .enumerate()
            {
                let (i, j) = (index % 48, index / 48);
                let members = &lists[j / tile * grid.columns() + i / tile];
                let tiled = blend_pixel(
                    members.iter().map(|&m| &splats[m]),
                    &Numerics::DEFAULT,
                    i as f64 + 0.5,
                    j as f64 + 0.5,
                );
                assert_eq!(tiled.color, expected.color);
                assert_eq!(tiled.transmittance, expected.transmittance);
            }
        }
    }

    #[test]
    fn the_test_is_tighter_than_the_box() {
        let list = scene(23);
        let projected: Vec<_> = list.iter().map(|v| v.projected).collect();
        let grid = TileGrid { tile: 4, ..GRID };
        let exact: usize = tiles(&projected, &grid).iter().map(Vec::len).sum();
        let mut boxes = 0;
        for p in &projected {
            for tile in 0..grid.columns() * grid.rows() {
                let spans = grid.centers(tile % grid.columns(), tile / grid.columns());
                boxes += usize::from((0..2).all(|i| {
                    p.mean2d[i] + p.half_extent[i] >= spans[i][0]
                        && p.mean2d[i] - p.half_extent[i] <= spans[i][1]
                }));
            }
        }
        assert!(exact < boxes, "{exact} of {boxes}");
        assert!(exact > boxes / 2);
    }
}
