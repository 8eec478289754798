//! Constant black borders around the picture of a film: letterbox, pillarbox, the gate.

use crate::capture::Photo;

/// A border is no lighter than this, of 255: transfers raise black, and compression adds noise.
const BLACK: u8 = 32;

/// The content beside a border is lighter by at least this, in levels of 255: the edge of darker
/// content cannot be located, and no features would match there.
const STEP: u8 = 24;

/// Share of a line's pixels that may be dust or hairs and still leave the line black.
const DUST: f64 = 0.02;

/// Share of the frames in which a border line may be lighter.
const FEW: f64 = 0.1;

/// Pixels by which the mask exceeds a border: compression smears its edge.
const MARGIN: u32 = 2;

/// A border of one pixel belongs to the margin of any camera.
const THINNEST: u32 = 2;

/// A border takes at most this share of the picture's side; more is a dark picture.
const WIDEST: f64 = 0.35;

/// Pictures of one size, looked at one by one.
#[derive(Default)]
pub(super) struct Borders {
    size: [u32; 2],
    /// Brightness of each row, 0 to 255, by picture.
    rows: Vec<Vec<u8>>,
    /// Brightness of each column, by picture.
    columns: Vec<Vec<u8>>,
}

/// Width of the black border on each side, in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Frame {
    pub left: u32,
    pub right: u32,
    pub top: u32,
    pub bottom: u32,
}

impl Borders {
    /// Takes a picture; one of another size than the first is not looked at.
    pub fn look(&mut self, picture: &Photo) {
        let size = [picture.width, picture.height];
        if self.rows.is_empty() {
            self.size = size;
        }
        if size == self.size {
            let [width, height] = size.map(|side| side as usize);
            let at = |x: usize, y: usize| picture.gray[y * width + x];
            self.rows.push(
                (0..height)
                    .map(|y| light((0..width).map(|x| at(x, y)).collect()))
                    .collect(),
            );
            self.columns.push(
                (0..width)
                    .map(|x| light((0..height).map(|y| at(x, y)).collect()))
                    .collect(),
            );
        }
    }

    /// The borders of all pictures, if there are any.
    pub fn found(&self) -> Option<Frame> {
        let [left, right] = ends(&usual(&self.columns));
        let [top, bottom] = ends(&usual(&self.rows));
        let frame = Frame {
            left,
            right,
            top,
            bottom,
        };
        (frame != Frame::default()).then_some(frame)
    }
}

impl Frame {
    /// Mask of a picture of this size, `[height, width]`: 255 inside, 0 on the border.
    pub fn mask(self, [width, height]: [u32; 2]) -> Vec<u8> {
        let inside =
            |at: u32, before: u32, after: u32, side: u32| at >= before && at + after < side;
        (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| {
                let shown = inside(x, self.left, self.right, width)
                    && inside(y, self.top, self.bottom, height);
                if shown { u8::MAX } else { 0 }
            })
            .collect()
    }
}

/// Brightness of a line apart from dust: a high quantile of its pixels, 0 to 255.
fn light(mut line: Vec<u8>) -> u8 {
    quantile(&mut line, 1.0 - DUST)
}

/// Brightness of each line in most pictures: a high quantile over the pictures.
fn usual(pictures: &[Vec<u8>]) -> Vec<u8> {
    let lines = pictures.first().map_or(0, Vec::len);
    let of_all = |line: usize| pictures.iter().map(|lines| lines[line]).collect();
    let usual = |mut values: Vec<u8>| quantile(&mut values, 1.0 - FEW);
    (0..lines).map(|line| usual(of_all(line))).collect()
}

fn quantile(values: &mut [u8], share: f64) -> u8 {
    let Some(last) = values.len().checked_sub(1) else {
        return 0;
    };
    *values
        .select_nth_unstable((share * last as f64).floor() as usize)
        .1
}

/// Border widths at both ends, in lines; 0 without a border.
fn ends(lines: &[u8]) -> [u32; 2] {
    let begins = border(lines.iter().copied(), lines.len());
    let ends = border(lines.iter().rev().copied(), lines.len());
    [begins, ends]
}

fn border(lines: impl Iterator<Item = u8> + Clone, count: usize) -> u32 {
    let dark = lines.clone().take_while(|&light| light <= BLACK).count();
    let mean = lines.clone().take(dark).map(u32::from).sum::<u32>() / dark.max(1) as u32;
    // Its edge may be smeared over a few lines.
    let beyond = lines
        .skip(dark)
        .take(2 * MARGIN as usize)
        .max()
        .unwrap_or(0);
    let plain = dark >= THINNEST as usize && dark as f64 <= WIDEST * count as f64;
    match plain && u32::from(beyond) >= mean + u32::from(STEP) {
        true => dark as u32 + MARGIN,
        false => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of texture within borders of some level.
    fn picture(frame: Frame, black: u8, seed: u32) -> Photo {
        let (width, height) = (100, 60);
        let counts = frame.mask([width, height]);
        let texture = |p: u32| 40 + ((p.wrapping_mul(2_654_435_761) ^ seed) >> 8) as u8 % 200;
        let gray = (0..width * height)
            .map(|p| match counts[p as usize] {
                0 => black + (p % 3) as u8,
                _ => texture(p),
            })
            .collect();
        Photo {
            width,
            height,
            gray,
            rgb: None,
            mask: None,
        }
    }

    fn found(pictures: &[Photo]) -> Option<Frame> {
        let mut borders = Borders::default();
        pictures.iter().for_each(|picture| borders.look(picture));
        borders.found()
    }

    #[test]
    fn letterbox_and_pillarbox() {
        let bars = Frame {
            left: 12,
            right: 9,
            top: 6,
            bottom: 0,
        };
        let pictures: Vec<_> = (0..12).map(|n| picture(bars, 14, n)).collect();
        let wider = Frame {
            left: 14,
            right: 11,
            top: 8,
            bottom: 0,
        };
        assert_eq!(found(&pictures), Some(wider));
        let mask = wider.mask([100, 60]);
        let shown = mask.iter().filter(|&&count| count == 255).count();
        assert_eq!(shown, (100 - 25) * (60 - 8));
    }

    #[test]
    fn pictures_without_borders_and_dark_ones() {
        let whole: Vec<_> = (0..12).map(|n| picture(Frame::default(), 0, n)).collect();
        assert_eq!(found(&whole), None);
        assert_eq!(found(&[]), None);
        // A night scene that grows lighter by and by.
        let mut night = whole.clone();
        for picture in &mut night {
            for (p, value) in picture.gray.iter_mut().enumerate() {
                *value = (p % 100) as u8;
            }
        }
        assert_eq!(found(&night), None);
    }

    #[test]
    fn one_dark_picture_is_no_border_of_all() {
        let bars = Frame {
            left: 10,
            ..Frame::default()
        };
        let mut pictures: Vec<_> = (0..11).map(|n| picture(Frame::default(), 0, n)).collect();
        pictures.push(picture(bars, 0, 99));
        assert_eq!(found(&pictures), None);
    }
}
