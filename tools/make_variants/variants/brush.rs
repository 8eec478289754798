//! Painting soft-edged shapes over photos.

use image::{GrayImage, Luma, RgbImage};

use super::resample::byte;

/// A line with round ends through a chain of places; with one place, a disc.
pub struct Stroke {
    /// In pixels; at least one.
    pub places: Vec<[f64; 2]>,
    /// Half the width in pixels.
    pub radius: f64,
    /// Encoded gray, 0 to 255.
    pub tone: f64,
    /// 0 to 1.
    pub opacity: f64,
}

impl Stroke {
    /// Paints the stroke, and says how many pixels it covers.
    pub fn paint(&self, picture: &mut RgbImage) -> f64 {
        let mut covered = 0.0;
        self.touch([picture.width(), picture.height()], |x, y, coverage| {
            covered += coverage;
            let alpha = self.opacity * coverage;
            for value in &mut picture.get_pixel_mut(x, y).0 {
                *value = byte(f64::from(*value) * (1.0 - alpha) + self.tone * alpha);
            }
        });
        covered
    }

    /// Blackens a mask wherever [`paint`](Self::paint) changes anything.
    pub fn mask(&self, mask: &mut GrayImage) {
        self.touch([mask.width(), mask.height()], |x, y, _| {
            mask.put_pixel(x, y, Luma([0]));
        });
    }

    /// Calls for each pixel that is covered, with how much of it is.
    fn touch(&self, [width, height]: [u32; 2], mut at: impl FnMut(u32, u32, f64)) {
        let reach = self.radius + 1.0;
        let range = |axis: usize, size: u32| {
            let along = self.places.iter().map(|place| place[axis]);
            let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                (low.min(v), high.max(v))
            });
            // Saturates at 0.
            ((low - reach).floor() as u32)..((high + reach).ceil() as u32).min(size)
        };
        for y in range(1, height) {
            for x in range(0, width) {
                let distance = self.distance([f64::from(x) + 0.5, f64::from(y) + 0.5]);
                let coverage = (self.radius - distance + 0.5).clamp(0.0, 1.0);
                if coverage > 0.0 {
                    at(x, y, coverage);
                }
            }
        }
    }

    /// From the line through the places, in pixels.
    fn distance(&self, [x, y]: [f64; 2]) -> f64 {
        let to_segment = |a: [f64; 2], b: [f64; 2]| {
            let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
            let length = (dx * dx + dy * dy).max(f64::MIN_POSITIVE);
            let t = (((x - a[0]) * dx + (y - a[1]) * dy) / length).clamp(0.0, 1.0);
            (a[0] + t * dx - x).hypot(a[1] + t * dy - y)
        };
        let first = self.places[0];
        let pairs = self.places.windows(2);
        pairs.fold((first[0] - x).hypot(first[1] - y), |least, pair| {
            least.min(to_segment(pair[0], pair[1]))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stroke_covers_its_area_and_is_masked_where_it_paints() {
        let stroke = Stroke {
            places: vec![[10.0, 12.0], [30.0, 12.0]],
            radius: 3.0,
            tone: 200.0,
            opacity: 1.0,
        };
        let mut picture = RgbImage::new(40, 24);
        let covered = stroke.paint(&mut picture);
        let area = 20.0 * 6.0 + std::f64::consts::PI * 9.0;
        assert!((covered / area - 1.0).abs() < 0.03, "{covered} {area}");
        let mut mask = GrayImage::from_pixel(40, 24, Luma([255]));
        stroke.mask(&mut mask);
        for (x, y, pixel) in picture.enumerate_pixels() {
            let hidden = mask.get_pixel(x, y).0 == [0];
            assert_eq!(hidden, pixel.0 != [0; 3], "{x} {y}");
        }
    }
}
