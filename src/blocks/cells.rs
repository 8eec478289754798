//! The ground cut into cells with given shares of the work.

use std::{fmt, str::FromStr};

use super::Area;

/// Blocks of a job, at most.
pub const MOST: usize = 4096;

/// Number of blocks to cut a scene into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blocks {
    /// So many, each cut along its longer side.
    Count(usize),
    /// So many strips across the longer side of the ground, each cut into so many cells.
    Grid([usize; 2]),
}

impl Blocks {
    /// Number of blocks.
    pub fn count(self) -> usize {
        match self {
            Self::Count(count) => count,
            Self::Grid([strips, cells]) => strips * cells,
        }
    }
}

impl FromStr for Blocks {
    type Err = String;

    /// `4` or `2x3`.
    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.parse().ok().filter(|n| (1..=MOST).contains(n));
        let blocks = match text.split_once('x') {
            None => number(text).map(Self::Count),
            Some((strips, cells)) => number(strips)
                .zip(number(cells))
                .map(|(strips, cells)| Self::Grid([strips, cells])),
        };
        blocks
            .filter(|blocks| blocks.count() <= MOST)
            .ok_or_else(|| {
                format!("must be a number such as 4 or a grid such as 2x3, at most {MOST} in all")
            })
    }
}

impl fmt::Display for Blocks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count(count) => write!(f, "{count}"),
            Self::Grid([strips, cells]) => write!(f, "{strips}x{cells}"),
        }
    }
}

/// Places that decide how large cells are, at most; an even choice.
const BALANCED_ON: usize = 100_000;

/// Cells with less of the work than this part of the fullest one's grow no faster for it.
const LEAST: f64 = 1e-3;

/// Rounds of balancing the cells' sizes: by then they settle to a percent.
const BALANCE_ROUNDS: usize = 12;

/// A cell, and the two that it is cut into.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cell {
    pub area: Area,
    pub parts: Option<Box<[Cell; 2]>>,
}

/// Training work at positions on the ground.
pub(super) struct GroundWork<'a> {
    /// Along the two axes of the ground.
    pub places: &'a [[f64; 2]],
    /// Weight of the work at each position.
    pub weights: &'a [f32],
}

impl GroundWork<'_> {
    /// Cuts all of the ground so that no cell has much more work with its margin, which `near`
    /// tells, than another: one in the middle has margins on all sides, and is smaller.
    pub fn balanced(&self, blocks: Blocks, near: impl Fn(&Area) -> Area) -> Cell {
        let step = self.places.len().div_ceil(BALANCED_ON).max(1);
        let places: Vec<[f64; 2]> = self.places.iter().step_by(step).copied().collect();
        let weights: Vec<f32> = self.weights.iter().step_by(step).copied().collect();
        let some = GroundWork {
            places: &places,
            weights: &weights,
        };
        let mut shares = vec![1.0; blocks.count()];
        let mut best = (f64::INFINITY, shares.clone());
        for _ in 0..BALANCE_ROUNDS {
            let cores = some.cells(blocks, &shares).leaves();
            let found: Vec<f64> = cores.iter().map(|core| some.within(&near(core))).collect();
            let most = found.iter().copied().fold(0.0, f64::max);
            // Places in one spot are not divided, and nothing is to be balanced.
            if cores.len() < shares.len() || most <= 0.0 {
                break;
            }
            if most < best.0 {
                best = (most, shares.clone());
            }
            for (share, found) in shares.iter_mut().zip(found) {
                *share *= (most / found.max(LEAST * most)).sqrt();
            }
        }
        self.cells(blocks, &best.1)
    }

    /// Cuts all of the ground; `shares` has one number for each block: what it has of the work,
    /// against the others.
    fn cells(&self, blocks: Blocks, shares: &[f64]) -> Cell {
        let all: Vec<u32> = (0..self.places.len() as u32).collect();
        self.cell(all, Area::EVERYWHERE, blocks, shares)
    }

    /// The work at places that an area holds.
    fn within(&self, area: &Area) -> f64 {
        (self.places.iter().zip(self.weights))
            .filter(|&(&place, _)| area.holds(place))
            .map(|(_, &weight)| f64::from(weight))
            .sum()
    }

    fn cell(&self, mut here: Vec<u32>, area: Area, blocks: Blocks, shares: &[f64]) -> Cell {
        let whole = Cell { area, parts: None };
        // Along which axis, into how many, and what becomes of the parts.
        let (axis, count) = match blocks {
            Blocks::Count(count) => (self.longer_side(&here), count),
            Blocks::Grid([1, cells]) => (1, cells),
            Blocks::Grid([strips, _]) => (0, strips),
        };
        if count < 2 || here.len() < 2 {
            return whole;
        }
        let counts = [count / 2, count - count / 2];
        let parts = counts.map(|part| match blocks {
            Blocks::Count(_) => Blocks::Count(part),
            Blocks::Grid([1, _]) => Blocks::Grid([1, part]),
            Blocks::Grid([_, cells]) => Blocks::Grid([part, cells]),
        });
        let at = |i: u32| self.places[i as usize][axis];
        here.sort_unstable_by(|&a, &b| at(a).total_cmp(&at(b)));
        let (lower, upper) = shares.split_at(parts[0].count());
        let share = lower.iter().sum::<f64>() / shares.iter().sum::<f64>();
        let Some(split) = self.split(&here, at, share) else {
            return whole;
        };
        let [below, above] = [at(here[split - 1]), at(here[split])];
        let middle = 0.5 * (below + above);
        // Two floats next to each other have none between them.
        let edge = if middle > below { middle } else { above };
        let rest = here.split_off(split);
        let [low, high] = area.cut(axis, edge);
        let cells = [
            self.cell(here, low, parts[0], lower),
            self.cell(rest, high, parts[1], upper),
        ];
        Cell {
            area,
            parts: Some(Box::new(cells)),
        }
    }

    /// Number of the sorted positions that hold a share of the work; none if all lie on one line.
    fn split(&self, sorted: &[u32], at: impl Fn(u32) -> f64, share: f64) -> Option<usize> {
        let weight = |&i: &u32| f64::from(self.weights[i as usize]);
        let wanted = share * sorted.iter().map(weight).sum::<f64>();
        let mut sum = 0.0;
        let reached = sorted.iter().position(|i| {
            sum += weight(i);
            sum >= wanted
        });
        let reached = reached.unwrap_or(0) + 1;
        // Equal places stay together.
        let parts = |&k: &usize| at(sorted[k - 1]) < at(sorted[k]);
        let after = (reached..sorted.len()).find(parts);
        after.or_else(|| (1..reached.min(sorted.len())).rev().find(parts))
    }

    /// The axis along which places reach farther, the farthest hundredth at each end aside.
    fn longer_side(&self, here: &[u32]) -> usize {
        let length = |axis: usize| {
            let mut values: Vec<f64> = (here.iter())
                .map(|&i| self.places[i as usize][axis])
                .collect();
            let Some([least, most]) = ends(&mut values, 0.01) else {
                return 0.0;
            };
            most - least
        };
        usize::from(length(1) > length(0))
    }
}

/// Values below which, and above which, a share lies; none without values.
pub(super) fn ends(values: &mut [f64], share: f64) -> Option<[f64; 2]> {
    let last = values.len().checked_sub(1)?;
    let mut at = |share: f64| {
        let rank = (share * last as f64).round() as usize;
        *values.select_nth_unstable_by(rank, f64::total_cmp).1
    };
    Some([at(share), at(1.0 - share)])
}

impl Cell {
    /// The cells that are not cut, from the first to the last.
    pub fn leaves(&self) -> Vec<Area> {
        match &self.parts {
            None => vec![self.area],
            Some(parts) => parts.iter().flat_map(Self::leaves).collect(),
        }
    }

    /// Joins the uncut cell that is number `leaf` with the one that it was cut from.
    pub fn join(&mut self, leaf: usize) {
        let Some(parts) = &mut self.parts else { return };
        let first = parts[0].leaves().len();
        let (part, leaf) = match leaf < first {
            true => (0, leaf),
            false => (1, leaf - first),
        };
        match parts[part].parts {
            None => self.parts = None,
            Some(_) => parts[part].join(leaf),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places on a rectangle, denser on its left.
    fn places() -> Vec<[f64; 2]> {
        let mut random = fastrand::Rng::with_seed(4);
        (0..4000)
            .map(|_| [30.0 * random.f64().powi(2), 10.0 * random.f64()])
            .collect()
    }

    fn counts(areas: &[Area], places: &[[f64; 2]]) -> Vec<usize> {
        let held = |area: &Area| places.iter().filter(|&&p| area.holds(p)).count();
        areas.iter().map(held).collect()
    }

    fn evenly(places: &[[f64; 2]]) -> GroundWork<'_> {
        let weights = &[1.0; 4000];
        GroundWork { places, weights }
    }

    #[test]
    fn cells_have_equal_work_and_cover_the_ground_once() {
        let places = places();
        let weights = vec![1.0; places.len()];
        let work = GroundWork {
            places: &places,
            weights: &weights,
        };
        for (text, cells) in [("1", 1), ("4", 4), ("5", 5), ("2x3", 6), ("3x1", 3)] {
            let blocks: Blocks = text.parse().unwrap();
            let areas = work.cells(blocks, &vec![1.0; cells]).leaves();
            assert_eq!((areas.len(), blocks.to_string()), (cells, text.to_owned()));
            let counts = counts(&areas, &places);
            assert_eq!(counts.iter().sum::<usize>(), places.len());
            let equal = places.len() / cells;
            assert!(
                counts.iter().all(|count| count.abs_diff(equal) <= cells),
                "{counts:?}"
            );
            let far = [[-1e9, 1e9], [1e9, -1e9], [1e9, 1e9]];
            for place in far {
                assert_eq!(areas.iter().filter(|area| area.holds(place)).count(), 1);
            }
        }
    }

    #[test]
    fn cells_have_the_work_that_is_asked() {
        let places = places();
        let work = evenly(&places);
        let shares = [1.0, 2.0, 4.0, 3.0];
        for blocks in [Blocks::Count(4), Blocks::Grid([2, 2])] {
            let areas = work.cells(blocks, &shares).leaves();
            for (area, share) in areas.iter().zip(shares) {
                let found = work.within(area);
                assert!((found - 400.0 * share).abs() <= 3.0, "{found}, {share}");
            }
        }
    }

    #[test]
    fn cells_are_balanced_with_their_margins() {
        let places = places();
        let work = evenly(&places);
        let bounds = Area([[0.0, 30.0], [0.0, 10.0]]);
        let near = |core: &Area| core.within(&bounds).grown(0.2);
        // How much more the fullest has than the emptiest.
        let ratio = |cell: Cell| {
            let cores = cell.leaves();
            let found: Vec<f64> = cores.iter().map(|core| work.within(&near(core))).collect();
            let [least, most] = [f64::min, f64::max].map(|f| found.iter().copied().reduce(f));
            most.unwrap() / least.unwrap()
        };
        for (blocks, uneven) in [(Blocks::Grid([4, 1]), 1.15), (Blocks::Count(5), 1.1)] {
            let equal = ratio(work.cells(blocks, &vec![1.0; blocks.count()]));
            let balanced = ratio(work.balanced(blocks, near));
            assert!(equal > uneven && balanced < 1.05, "{equal}, {balanced}");
        }
    }

    #[test]
    fn the_longer_side_is_cut_and_a_grid_is_cut_as_asked() {
        let places = places();
        let work = evenly(&places);
        let [left, right] = work.cells(Blocks::Count(2), &[1.0; 2]).leaves()[..] else {
            panic!("two");
        };
        assert!(left.0[0][1] == right.0[0][0] && left.0[1] == Area::EVERYWHERE.0[1]);
        let rows = work.cells(Blocks::Grid([1, 2]), &[1.0; 2]).leaves();
        assert!(rows[0].0[1][1] == rows[1].0[1][0]);
    }

    #[test]
    fn places_in_one_spot_are_one_cell() {
        let work = GroundWork {
            places: &[[1.0, 2.0]; 50],
            weights: &[1.0; 50],
        };
        let cells = work.cells(Blocks::Count(4), &[1.0; 4]);
        assert_eq!(cells.leaves(), [Area::EVERYWHERE]);
        let two = [[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [1.0, 0.0]];
        let work = GroundWork {
            places: &two,
            weights: &[1.0; 4],
        };
        assert_eq!(
            counts(&work.cells(Blocks::Count(2), &[1.0; 2]).leaves(), &two),
            [3, 1]
        );
    }

    #[test]
    fn a_cell_is_joined_with_its_neighbor() {
        let places = places();
        let work = evenly(&places);
        let mut cell = work.cells(Blocks::Count(4), &[1.0; 4]);
        let four = cell.leaves();
        cell.join(3);
        let three = cell.leaves();
        assert_eq!((three.len(), &three[..2]), (3, &four[..2]));
        (0..3).for_each(|_| cell.join(0));
        assert_eq!(cell.leaves(), [Area::EVERYWHERE]);
    }

    #[test]
    fn numbers_of_blocks_are_checked() {
        for text in ["0", "", "x", "2x", "2x0", "-1", "5000", "100x100", "2x2x2"] {
            assert!(text.parse::<Blocks>().is_err(), "{text}");
        }
    }
}
