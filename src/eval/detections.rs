//! Boxes out of a detector's numbers.

/// Scores from which on something counts as detected.
const LEAST_SCORE: f32 = 0.3;

/// Overlap beyond which two boxes of one class are one object.
const SAME_OBJECT: f32 = 0.45;

/// Overlap from which on an object is at the same place in the next frame.
const SAME_PLACE: f32 = 0.5;

/// Pixels between cells of the grids of YOLOX.
const STRIDES: [u32; 3] = [8, 16, 32];

/// A detected object.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    pub class: usize,
    /// In [0, 1].
    pub score: f32,
    /// Left, top, right and bottom in pixels of the detector's input.
    pub corners: [f32; 4],
}

/// Layout of a detector's output; the center and size of a box come first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoxLayout {
    /// YOLOX: `[1, N, 5 + classes]` with objectness, a row for each cell of the three grids, relative
    /// to it; sizes as logarithms.
    Grids,
    /// `[1, N, 5 + classes]` with objectness, in pixels.
    Rows,
    /// `[1, 4 + classes, N]`, in pixels.
    Columns,
}

impl BoxLayout {
    /// The layout of an output of this shape for an input of this width and height.
    pub fn of(shape: &[i64], size: [u32; 2]) -> Option<Self> {
        let &[1, rows, columns] = shape else {
            return None;
        };
        match () {
            () if columns > 5 && rows == cells(size).len() as i64 => Some(Self::Grids),
            () if columns > 5 && rows > columns => Some(Self::Rows),
            () if rows > 4 && columns > rows => Some(Self::Columns),
            () => None,
        }
    }

    /// Objects with scores of [`LEAST_SCORE`] or more, the best first, each once.
    pub fn decode(self, shape: &[i64], values: &[f32], size: [u32; 2]) -> Vec<Detection> {
        let [rows, columns] = [1, 2].map(|axis| shape[axis] as usize);
        let is_turned = self == Self::Columns;
        let (boxes, numbers, classes) = match is_turned {
            true => (columns, rows, 4),
            false => (rows, columns, 5),
        };
        let cells = cells(size);
        let found = (0..boxes).filter_map(|index| {
            let number = |k: usize| match is_turned {
                true => values[k * columns + index],
                false => values[index * columns + k],
            };
            let shares = (classes..numbers).map(number).enumerate();
            let (class, share) = shares.max_by(|(_, a), (_, b)| a.total_cmp(b))?;
            let score = if is_turned { share } else { share * number(4) };
            let [mut x, mut y, mut w, mut h] = [0, 1, 2, 3].map(number);
            if self == Self::Grids {
                let [column, row, stride] = cells[index];
                (x, y) = ((x + column) * stride, (y + row) * stride);
                (w, h) = (w.exp() * stride, h.exp() * stride);
            }
            // NaN fails the comparison.
            (score >= LEAST_SCORE).then_some(Detection {
                class,
                score,
                corners: [x - w / 2.0, y - h / 2.0, x + w / 2.0, y + h / 2.0],
            })
        });
        each_once(found.collect())
    }
}

/// Column, row and stride of the cells of all grids.
fn cells([width, height]: [u32; 2]) -> Vec<[f32; 3]> {
    let grid = |stride: u32| {
        let rows = (0..height / stride).map(|row| row as f32);
        let columns = move || (0..width / stride).map(|column| column as f32);
        rows.flat_map(move |row| columns().map(move |column| [column, row, stride as f32]))
    };
    STRIDES.into_iter().flat_map(grid).collect()
}

/// Those that no better one of their class overlaps by more than [`SAME_OBJECT`], the best first.
fn each_once(mut found: Vec<Detection>) -> Vec<Detection> {
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut kept: Vec<Detection> = Vec::new();
    for one in found {
        let is_known =
            |other: &Detection| other.class == one.class && overlap(other, &one) > SAME_OBJECT;
        if !kept.iter().any(is_known) {
            kept.push(one);
        }
    }
    kept
}

/// Intersection over union.
fn overlap(a: &Detection, b: &Detection) -> f32 {
    let ([l, t, r, d], [m, u, s, e]) = (a.corners, b.corners);
    let area = |[l, t, r, d]: [f32; 4]| (r - l).max(0.0) * (d - t).max(0.0);
    let shared = area([l.max(m), t.max(u), r.min(s), d.min(e)]);
    match area(a.corners) + area(b.corners) - shared {
        union if union > 0.0 => shared / union,
        _ => 0.0,
    }
}

/// Number of the first frame's objects that are in the next as well: of the same class at the same
/// place, each there for one here.
pub fn kept(first: &[Detection], next: &[Detection]) -> usize {
    let mut free: Vec<&Detection> = next.iter().collect();
    let is_kept = |one: &&Detection| {
        let same = free
            .iter()
            .enumerate()
            .filter(|(_, b)| b.class == one.class);
        let same = same.map(|(place, other)| (place, overlap(one, other)));
        let nearest = same.max_by(|(_, a), (_, b)| a.total_cmp(b));
        let found = nearest.filter(|(_, overlap)| *overlap >= SAME_PLACE);
        found.map(|(place, _)| free.swap_remove(place)).is_some()
    };
    first.iter().filter(is_kept).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An input with 16, 4 and 1 cells.
    const SIZE: [u32; 2] = [32, 32];

    #[test]
    fn boxes_by_hand() {
        const NUMBERS: usize = 8;
        let ln2 = std::f32::consts::LN_2;
        let mut values = vec![0.0; 21 * NUMBERS];
        for (row, numbers) in [
            // Column 1 and row 1 of the finest grid: center (12, 10), 16 by 8 pixels.
            (5, [0.5, 0.25, ln2, 0.0, 0.9, 0.1, 0.8, 0.2]),
            // The same from the middle grid, whose first cell it is; then another class.
            (16, [0.75, 0.625, 0.0, -ln2, 0.9, 0.0, 0.5, 0.0]),
            (17, [-0.25, 0.625, 0.0, -ln2, 0.5, 0.7, 0.0, 0.0]),
            // Too faint.
            (20, [0.5, 0.5, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0]),
        ] {
            values[row * NUMBERS..][..NUMBERS].copy_from_slice(&numbers);
        }
        let shape = [1, 21, NUMBERS as i64];
        assert_eq!(BoxLayout::of(&shape, SIZE), Some(BoxLayout::Grids));
        assert_eq!(BoxLayout::of(&[1, 63, 8], SIZE), Some(BoxLayout::Rows));
        assert_eq!(BoxLayout::of(&[1, 7, 21], SIZE), Some(BoxLayout::Columns));
        assert_eq!(BoxLayout::of(&[1, -1, 8], SIZE), None);
        let found = BoxLayout::Grids.decode(&shape, &values, SIZE);
        let [(1, first), (0, second)] = [0, 1].map(|k| (found[k].class, &found[k])) else {
            panic!("{found:?}");
        };
        for (one, score) in [(first, 0.72), (second, 0.35)] {
            let wanted = [4.0, 6.0, 20.0, 14.0, score];
            let figures = one.corners.iter().chain([&one.score]);
            assert!(
                figures.zip(wanted).all(|(a, b)| (a - b).abs() < 1e-5),
                "{one:?}"
            );
        }
        // In pixels the first is 0.69 pixels wide and 0 high; turned and without objectness, its
        // score is that of the class.
        let score = |found: Vec<Detection>| found.first().map(|one| one.score);
        assert_eq!(
            score(BoxLayout::Rows.decode(&shape, &values, SIZE)),
            Some(0.9 * 0.8)
        );
        let turned: Vec<f32> = ([0, 1, 2, 3, 5, 6, 7].into_iter())
            .flat_map(|k| (0..21).map(move |row| row * NUMBERS + k))
            .map(|at| values[at])
            .collect();
        assert_eq!(
            score(BoxLayout::Columns.decode(&[1, 7, 21], &turned, SIZE)),
            Some(0.8)
        );
        let broken = [f32::NAN; 7 * 21];
        assert_eq!(BoxLayout::Columns.decode(&[1, 7, 21], &broken, SIZE), []);
    }

    #[test]
    fn objects_are_kept_one_for_one() {
        let at = |class, x: f32| Detection {
            class,
            score: 0.5,
            corners: [x, 0.0, x + 30.0, 10.0],
        };
        // Moved by 10 of 30: 20 shared of 40; by 11: 19 of 41.
        for (first, next, count) in [
            (vec![at(0, 0.0)], vec![at(0, 10.0)], 1),
            (vec![at(0, 0.0)], vec![at(0, 11.0)], 0),
            (vec![at(0, 0.0)], vec![at(1, 0.0)], 0),
            (vec![at(0, 0.0), at(0, 2.0)], vec![at(0, 1.0)], 1),
        ] {
            assert_eq!(kept(&first, &next), count, "{first:?} {next:?}");
        }
        // 20 of 40 are more than 0.45, 18 of 42 are not.
        assert_eq!(each_once(vec![at(0, 0.0), at(0, 10.0)]).len(), 1);
        assert_eq!(each_once(vec![at(0, 0.0), at(0, 12.0)]).len(), 2);
    }
}
