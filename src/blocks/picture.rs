//! The plan of a job as a picture: points, cameras and cells from above.

use glam::DVec3;
use image::{Rgb, RgbImage};

use super::{Area, Job};
use crate::{capture::Capture, report::write_text};

/// Longer side in pixels.
const SIDE: f64 = 1200.0;

/// Room around the scene, as a share of its longer side: cameras may stand outside.
const MARGIN: f64 = 0.12;

const PAPER: Rgb<u8> = Rgb([255; 3]);

/// Colors that are told apart by people who see fewer (Okabe and Ito 2008).
const COLORS: [Rgb<u8>; 7] = [
    Rgb([0, 114, 178]),
    Rgb([213, 94, 0]),
    Rgb([0, 158, 115]),
    Rgb([204, 121, 167]),
    Rgb([230, 159, 0]),
    Rgb([86, 180, 233]),
    Rgb([120, 94, 240]),
];

/// Side of a camera's square, in pixels.
const CAMERA: i64 = 5;

/// Points in gray, darker where there are more; each block's cell in its color, its margin in a
/// thin line of it, its name and photos written into it; cameras in the color of the cell that
/// they stand above.
pub fn picture(capture: &Capture, job: &Job) -> RgbImage {
    let sheet = Sheet::of(job);
    let [width, height] = sheet.size;
    let mut counts = vec![0_u32; (width * height) as usize];
    let place = |position: DVec3| job.ground.place(position + capture.offset);
    for point in &capture.points {
        if let Some([x, y]) = sheet.pixel(place(point.position)) {
            counts[(y * width + x) as usize] += 1;
        }
    }
    let most = f64::from(counts.iter().copied().max().unwrap_or(0))
        .ln_1p()
        .max(1.0);
    let mut image = RgbImage::from_fn(width, height, |x, y| {
        let count = counts[(y * width + x) as usize];
        match count {
            0 => PAPER,
            _ => Rgb([(215.0 - 175.0 * f64::from(count).ln_1p() / most) as u8; 3]),
        }
    });
    let color = |index: usize| COLORS[index % COLORS.len()];
    for (index, block) in job.blocks.iter().enumerate() {
        sheet.frame(&mut image, &block.near, 1, color(index));
    }
    for (index, block) in job.blocks.iter().enumerate() {
        sheet.frame(&mut image, &block.core, 4, color(index));
    }
    for view in &capture.views {
        let at = place(view.camera.center());
        let block = job.blocks.iter().position(|block| block.core.holds(at));
        if let (Some(block), Some([x, y])) = (block, sheet.pixel(at)) {
            let half = CAMERA / 2;
            let inside = [i64::from(x), i64::from(y)];
            let from = inside.map(|c| c - half);
            let to = inside.map(|c| c + half);
            fill(
                &mut image,
                [from[0] - 1, from[1] - 1],
                [to[0] + 1, to[1] + 1],
                PAPER,
            );
            fill(&mut image, from, to, color(block));
        }
    }
    for (index, block) in job.blocks.iter().enumerate() {
        let [left, top] = sheet.corner(&block.core);
        let text = format!("{}: {} photos", block.name, block.photos);
        let end = [left + 16 * text.len() as i64 + 8, top + 24];
        fill(&mut image, [left, top], end, PAPER);
        fill(&mut image, [left, top], [left + 5, top + 24], color(index));
        let at = [left + 10, top + 4].map(|c| c.clamp(0, i64::from(u32::MAX)) as u32);
        let room = width.saturating_sub(at[0]);
        write_text(&mut image, at, room, 2, &text);
    }
    image
}

/// The paper, and where on it places of the ground are.
struct Sheet {
    size: [u32; 2],
    /// Least along and across.
    least: [f64; 2],
    /// Pixels on one world unit.
    scale: f64,
}

impl Sheet {
    fn of(job: &Job) -> Self {
        let [along, across] = job.bounds.0.map(|[least, most]| most - least);
        let longer = along.max(across).max(f64::MIN_POSITIVE);
        let margin = MARGIN * longer;
        let scale = SIDE / (longer + 2.0 * margin);
        let side = |length: f64| ((length + 2.0 * margin) * scale).round().max(1.0) as u32;
        Self {
            size: [side(along), side(across)],
            least: job.bounds.0.map(|[least, _]| least - margin),
            scale,
        }
    }

    /// In pixels, y down, before rounding.
    fn at(&self, place: [f64; 2]) -> [f64; 2] {
        let [x, y] = [0, 1].map(|axis| (place[axis] - self.least[axis]) * self.scale);
        [x, f64::from(self.size[1]) - y]
    }

    fn pixel(&self, place: [f64; 2]) -> Option<[u32; 2]> {
        let at = self.at(place);
        let inside = (0..2).all(|k| at[k] >= 0.0 && at[k] < f64::from(self.size[k]));
        inside.then(|| at.map(|c| c as u32))
    }

    /// Top left and bottom right corner of an area on the paper, in pixels.
    fn corners(&self, area: &Area) -> [[i64; 2]; 2] {
        let [[left, right], [low, high]] = area.0;
        let on_paper =
            |at: [f64; 2]| [0, 1].map(|k| at[k].clamp(0.0, f64::from(self.size[k] - 1)) as i64);
        [
            on_paper(self.at([left, high])),
            on_paper(self.at([right, low])),
        ]
    }

    fn corner(&self, area: &Area) -> [i64; 2] {
        let [[left, top], _] = self.corners(area);
        [left + 6, top + 6]
    }

    fn frame(&self, image: &mut RgbImage, area: &Area, wide: i64, color: Rgb<u8>) {
        let [[left, top], [right, bottom]] = self.corners(area);
        let wide = wide - 1;
        fill(image, [left, top], [right, top + wide], color);
        fill(image, [left, bottom - wide], [right, bottom], color);
        fill(image, [left, top], [left + wide, bottom], color);
        fill(image, [right - wide, top], [right, bottom], color);
    }
}

/// Fills a rectangle, ends included, as far as it lies on the paper.
fn fill(image: &mut RgbImage, from: [i64; 2], to: [i64; 2], color: Rgb<u8>) {
    let size = [image.width(), image.height()].map(i64::from);
    let [x, y] = [0, 1].map(|k| from[k].max(0)..(to[k] + 1).min(size[k]));
    for (x, y) in x.flat_map(|x| y.clone().map(move |y| (x, y))) {
        image.put_pixel(x as u32, y as u32, color);
    }
}
