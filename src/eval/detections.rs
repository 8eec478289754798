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
        let cells = STRIDES.map(|stride| i64::from((size[0] / stride) * (size[1] / stride)));
        let &[1, rows, columns] = shape else {
            return None;
        };
        match () {
            () if columns > 5 && rows == cells.iter().sum::<i64>() => Some(Self::Grids),
            () if columns > 5 && rows > columns => Some(Self::Rows),
            () if rows > 4 && columns > rows => Some(Self::Columns),
            () => None,
        }
    }

    /// Objects with scores of [`LEAST_SCORE`] or more, the best first, each once.
    pub fn decode(self, shape: &[i64], values: &[f32], size: [u32; 2]) -> Vec<Detection> {
        let [height, width] = [1, 2].map(|axis| shape[axis] as usize);
        let boxes = match self {
            Self::Grids | Self::Rows => height,
            Self::Columns => width,
        };
        let found = (0..boxes).filter_map(|index| {
            let numbers: Vec<f32> = match self {
                Self::Grids | Self::Rows => values[index * width..][..width].to_vec(),
                Self::Columns => (0..height).map(|k| values[k * width + index]).collect(),
            };
            let (objectness, classes) = match self {
                Self::Grids | Self::Rows => (numbers[4], &numbers[5..]),
                Self::Columns => (1.0, &numbers[4..]),
            };
            let best = classes.iter().enumerate();
            let (class, share) = best.max_by(|(_, a), (_, b)| a.total_cmp(b))?;
            let score = objectness * share;
            let center = [numbers[0], numbers[1], numbers[2], numbers[3]];
            let [x, y, w, h] = match self {
                Self::Grids => in_pixels(center, cell(index, size)),
                Self::Rows | Self::Columns => center,
            };
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

/// Column, row and stride of a cell.
fn cell(mut index: usize, [width, height]: [u32; 2]) -> [f32; 3] {
    for stride in STRIDES {
        let [columns, rows] = [width, height].map(|side| (side / stride) as usize);
        if index < columns * rows {
            return [
                (index % columns) as f32,
                (index / columns) as f32,
                stride as f32,
            ];
        }
        index -= columns * rows;
    }
    [f32::NAN; 3]
}

fn in_pixels([x, y, w, h]: [f32; 4], [column, row, stride]: [f32; 3]) -> [f32; 4] {
    let size = [w, h].map(|side| side.exp() * stride);
    [(x + column) * stride, (y + row) * stride, size[0], size[1]]
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
    let mut count = 0;
    for one in first {
        let same = (free.iter().enumerate()).filter(|(_, other)| other.class == one.class);
        let nearest = same
            .map(|(place, other)| (place, overlap(one, other)))
            .max_by(|(_, a), (_, b)| a.total_cmp(b));
        if let Some((place, SAME_PLACE..)) = nearest {
            free.swap_remove(place);
            count += 1;
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An input with 16, 4 and 1 cells.
    const SIZE: [u32; 2] = [32, 32];

    /// Numbers of a box: center, size, objectness, three classes.
    const NUMBERS: usize = 8;

    fn output(shape: [i64; 3], boxes: &[(usize, [f32; NUMBERS])]) -> Vec<f32> {
        let mut values = vec![0.0; (shape[1] * shape[2]) as usize];
        for (row, numbers) in boxes {
            values[row * NUMBERS..][..NUMBERS].copy_from_slice(numbers);
        }
        values
    }

    #[test]
    fn shapes_tell_the_layout() {
        for (shape, size, layout) in [
            (&[1, 3549, 85][..], [416, 416], Some(BoxLayout::Grids)),
            (&[1, 10647, 85], [416, 416], Some(BoxLayout::Rows)),
            (&[1, 8400, 85], [416, 416], Some(BoxLayout::Rows)),
            (&[1, 84, 8400], [640, 640], Some(BoxLayout::Columns)),
            (&[1, 5, 21], SIZE, Some(BoxLayout::Columns)),
            (&[1, -1, 85], [416, 416], None),
            (&[1, 3549, 4], [416, 416], None),
            (&[2, 3549, 85], [416, 416], None),
            (&[1, 1000], [416, 416], None),
        ] {
            assert_eq!(BoxLayout::of(shape, size), layout, "{shape:?}");
        }
    }

    #[test]
    fn boxes_on_grids_by_hand() {
        let shape = [1, 21, NUMBERS as i64];
        let layout = BoxLayout::of(&shape, SIZE).expect("a layout");
        let ln2 = std::f32::consts::LN_2;
        let values = output(
            shape,
            &[
                // Column 1 and row 1 of the finest grid: center (12, 10), 16 by 8 pixels.
                (5, [0.5, 0.25, ln2, 0.0, 0.9, 0.1, 0.8, 0.2]),
                // The same object from the middle grid, first cell: center (12, 10), 16 by 8.
                (16, [0.75, 0.625, 0.0, -ln2, 0.9, 0.0, 0.5, 0.0]),
                // The same place, another class.
                (17, [-0.25, 0.625, 0.0, -ln2, 0.5, 0.7, 0.0, 0.0]),
                // The coarsest grid: all of the picture, too faint.
                (20, [0.5, 0.5, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0]),
            ],
        );
        let found = layout.decode(&shape, &values, SIZE);
        let wanted = [(1, 0.72), (0, 0.35)];
        assert_eq!(found.len(), 2, "{found:?}");
        for (one, (class, score)) in found.iter().zip(wanted) {
            assert_eq!(one.class, class);
            assert!((one.score - score).abs() < 1e-6, "{one:?}");
            for (side, want) in one.corners.iter().zip([4.0, 6.0, 20.0, 14.0]) {
                assert!((side - want).abs() < 1e-5, "{one:?}");
            }
        }
        // Taken for pixels, the same numbers are other boxes.
        assert_ne!(BoxLayout::Rows.decode(&shape, &values, SIZE), found);
    }

    #[test]
    fn columns_are_rows_turned_without_objectness() {
        let rows = output(
            [1, 9, NUMBERS as i64],
            &[(4, [10.0, 8.0, 4.0, 2.0, 1.0, 0.2, 0.3, 0.6])],
        );
        let columns: Vec<f32> = (0..NUMBERS)
            .filter(|&number| number != 4)
            .flat_map(|number| (0..9).map(move |row| row * NUMBERS + number))
            .map(|at| rows[at])
            .collect();
        let found = BoxLayout::Columns.decode(&[1, 7, 9], &columns, SIZE);
        let wanted = Detection {
            class: 2,
            score: 0.6,
            corners: [8.0, 7.0, 12.0, 9.0],
        };
        assert_eq!(found, [wanted.clone()]);
        let of_rows = BoxLayout::Rows.decode(&[1, 9, 8], &rows, SIZE);
        assert_eq!(of_rows, [wanted]);
        let broken = vec![f32::NAN; 63];
        assert_eq!(BoxLayout::Columns.decode(&[1, 7, 9], &broken, SIZE), []);
    }

    #[test]
    fn objects_are_kept_one_for_one() {
        let at = |class, x: f32| Detection {
            class,
            score: 0.5,
            corners: [x, 0.0, x + 30.0, 10.0],
        };
        // Moved by 10 of 30: 20 shared of 40; by 11: 19 of 41.
        assert_eq!(kept(&[at(0, 0.0)], &[at(0, 10.0)]), 1);
        assert_eq!(kept(&[at(0, 0.0)], &[at(0, 11.0)]), 0);
        assert_eq!(kept(&[at(0, 0.0)], &[at(1, 0.0)]), 0);
        assert_eq!(kept(&[at(0, 0.0), at(0, 2.0)], &[at(0, 1.0)]), 1);
        assert_eq!(kept(&[], &[at(0, 1.0)]), 0);
        // Of two that overlap by 20 of 40, which is more than 0.45, the better one is one object.
        let better = Detection {
            score: 0.9,
            ..at(0, 10.0)
        };
        assert_eq!(each_once(vec![at(0, 0.0), better.clone()]), [better]);
        assert_eq!(each_once(vec![at(0, 0.0), at(0, 12.0)]).len(), 2);
    }
}
