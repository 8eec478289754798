//! Strokes on a photo: a transparent picture that `colorize` reads as a hint.

use std::io::Cursor;

use image::{
    ExtendedColorType, ImageEncoder, Rgba, RgbaImage,
    codecs::png::{CompressionType, FilterType, PngEncoder},
    imageops,
};
use serde::Deserialize;

use crate::capture::{Orientation, decode_image};

/// Points of a stroke at most, and the largest radius, in pixels.
const POINTS: usize = 20_000;
const RADIUS: f32 = 1000.0;

/// What a brush leaves.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Paint {
    /// sRGB.
    Color([u8; 3]),
    /// What the teachers want there: no other stroke colors it.
    Teacher,
    /// Takes paint away.
    Nothing,
}

/// Way of a round brush: its center and radius in pixels, x, y, r.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub struct Way(pub Vec<[f32; 3]>);

/// The share of the pixels of a region that paint covers, 0 to 1, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Mask {
    pub region: Region,
    pub shares: Vec<f32>,
}

impl Mask {
    /// The share of a pixel of the picture, 0 outside.
    pub fn at(&self, x: u32, y: u32) -> f32 {
        let [left, top, width, height] = self.region;
        let [x, y] = [x.wrapping_sub(left), y.wrapping_sub(top)];
        match x < width && y < height {
            true => self.shares[(y * width + x) as usize],
            false => 0.0,
        }
    }
}

impl Way {
    /// Returns true if a brush can be moved so.
    pub fn is_sound(&self) -> bool {
        let sound = |&[x, y, r]: &[f32; 3]| {
            [x, y].iter().all(|v| v.abs() < 1e5) && (0.1..=RADIUS).contains(&r)
        };
        (1..=POINTS).contains(&self.0.len()) && self.0.iter().all(sound)
    }

    /// The pixels of a picture that the brush covers; none where it passes outside.
    pub fn mask(&self, size: [u32; 2]) -> Option<Mask> {
        let region = reach(&self.0, size)?;
        let [left, top, width, height] = region;
        let mut shares = vec![0.0_f32; width as usize * height as usize];
        for k in 0..self.0.len() {
            let piece = [k.saturating_sub(1), k].map(|k| self.0[k]);
            let Some([x0, y0, w, h]) = reach(&piece, size) else {
                continue;
            };
            for (y, x) in (y0..y0 + h).flat_map(|y| (x0..x0 + w).map(move |x| (y, x))) {
                let share = Self::share(piece, [x as f32 + 0.5, y as f32 + 0.5]);
                let own = &mut shares[((y - top) * width + x - left) as usize];
                *own = own.max(share);
            }
        }
        Some(Mask { region, shares })
    }

    /// The brush's share of a pixel, 0 to 1, along one piece of the way.
    fn share([a, b]: [[f32; 3]; 2], [x, y]: [f32; 2]) -> f32 {
        let along = [b[0] - a[0], b[1] - a[1]];
        let length = along[0] * along[0] + along[1] * along[1];
        let at = ((x - a[0]) * along[0] + (y - a[1]) * along[1]) / length.max(1e-9);
        let at = at.clamp(0.0, 1.0);
        let far = (x - a[0] - at * along[0]).hypot(y - a[1] - at * along[1]);
        (a[2] + at * (b[2] - a[2]) - far + 0.5).clamp(0.0, 1.0)
    }
}

/// Left, top, width and height in pixels.
pub type Region = [u32; 4];

/// Pixels of a picture that a brush may reach on its way.
fn reach(points: &[[f32; 3]], size: [u32; 2]) -> Option<Region> {
    let side = |k: usize, size: u32| {
        let low = points.iter().map(|p| p[k] - p[2] - 1.0);
        let high = points.iter().map(|p| p[k] + p[2] + 1.0);
        let low = low.fold(f32::INFINITY, f32::min).max(0.0).floor() as u32;
        let high = high.fold(0.0, f32::max).ceil().min(size as f32) as u32;
        (low < high).then(|| [low, high - low])
    };
    let [[left, width], [top, height]] = [side(0, size[0])?, side(1, size[1])?];
    Some([left, top, width, height])
}

/// Transparent picture of the strokes on a photo, upright.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer(pub RgbaImage);

impl Layer {
    /// An empty one.
    pub fn new([width, height]: [u32; 2]) -> Self {
        Self(RgbaImage::new(width, height))
    }

    /// Lays paint over what a mask covers; `color` is that of a pixel, none takes paint away.
    pub fn lay(&mut self, mask: &Mask, color: &dyn Fn(u32, u32) -> Option<[u8; 3]>) {
        let [left, top, width, _] = mask.region;
        for (k, &share) in (0..).zip(&mask.shares) {
            let (x, y) = (left + k % width, top + k / width);
            let pixel = self.0.get_pixel_mut(x, y);
            *pixel = laid_over(*pixel, color(x, y), share);
        }
    }

    /// Pixels of a region.
    pub fn cut(&self, [left, top, width, height]: Region) -> RgbaImage {
        imageops::crop_imm(&self.0, left, top, width, height).to_image()
    }

    /// Puts pixels back.
    pub fn put(&mut self, [left, top, ..]: Region, pixels: &RgbaImage) {
        imageops::replace(&mut self.0, pixels, left.into(), top.into());
    }

    /// Returns true if nothing is painted.
    pub fn is_empty(&self) -> bool {
        self.0.pixels().all(|pixel| pixel.0[3] == 0)
    }

    /// The layer as a PNG that lies as the photo's file does, `upright` making both upright.
    pub fn to_png(&self, upright: Orientation) -> Result<Vec<u8>, String> {
        let lying = upright.inverse().image(self.0.clone().into()).into_rgba8();
        encoded(
            &lying,
            lying.dimensions().into(),
            ExtendedColorType::Rgba8,
            upright.exif(),
        )
    }

    /// The layer of a PNG at a size; `None` of what is no picture.
    pub fn from_png(bytes: Vec<u8>, [width, height]: [u32; 2]) -> Option<Self> {
        let painting = decode_image(bytes).ok()?;
        let image = painting.orientation.image(painting.image).into_rgba8();
        Some(Self(match image.dimensions() == (width, height) {
            true => image,
            false => imageops::resize(&image, width, height, imageops::FilterType::Nearest),
        }))
    }
}

/// A picture as PNG, quickly.
pub fn encoded(
    pixels: &[u8],
    [width, height]: [u32; 2],
    kind: ExtendedColorType,
    exif: Option<Vec<u8>>,
) -> Result<Vec<u8>, String> {
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder =
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive);
    let noted = exif.map_or(Ok(()), |exif| encoder.set_exif_metadata(exif));
    noted.map_err(|error| error.to_string())?;
    let written = encoder.write_image(pixels, width, height, kind);
    written.map_err(|error| error.to_string())?;
    Ok(bytes.into_inner())
}

/// A pixel under a share of paint, or with a share less of its own.
fn laid_over(Rgba([r, g, b, alpha]): Rgba<u8>, paint: Option<[u8; 3]>, share: f32) -> Rgba<u8> {
    let own = f32::from(alpha) / 255.0 * (1.0 - share);
    let byte = |value: f32| value.round() as u8;
    let Some(paint) = paint else {
        let alpha = byte(255.0 * own);
        return Rgba(if alpha == 0 { [0; 4] } else { [r, g, b, alpha] });
    };
    let all = own + share;
    if all <= 0.0 {
        return Rgba([r, g, b, alpha]);
    }
    let mixed = |own_color: u8, paint: u8| {
        byte((own * f32::from(own_color) + share * f32::from(paint)) / all)
    };
    let [red, green, blue] = paint;
    Rgba([
        mixed(r, red),
        mixed(g, green),
        mixed(b, blue),
        byte(255.0 * all),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    const RED: Option<[u8; 3]> = Some([200, 30, 20]);

    fn draw(layer: &mut Layer, color: Option<[u8; 3]>, points: &[[f32; 3]]) -> Option<Region> {
        let mask = Way(points.to_vec()).mask(layer.0.dimensions().into())?;
        layer.lay(&mask, &|_, _| color);
        Some(mask.region)
    }

    #[test]
    fn a_stroke_is_as_wide_as_its_brush_and_an_eraser_takes_it_away() {
        let mut layer = Layer::new([40, 20]);
        let across = [[5.0, 10.0, 3.0], [35.0, 10.0, 3.0]];
        assert_eq!(draw(&mut layer, RED, &across), Some([1, 6, 38, 8]));
        for (y, alpha) in [(5, 0), (7, 255), (10, 255), (12, 255), (14, 0)] {
            assert_eq!(layer.0.get_pixel(20, y).0[3], alpha, "{y}");
        }
        assert_eq!(layer.0.get_pixel(20, 10).0, [200, 30, 20, 255]);
        let before = layer.clone();
        let region = draw(&mut layer, None, &[[20.0, 10.0, 5.0]]).unwrap();
        assert_eq!(layer.0.get_pixel(20, 10).0, [0; 4]);
        assert_eq!(layer.0.get_pixel(10, 10).0[3], 255);
        layer.put(region, &before.cut(region));
        assert_eq!(layer, before);
        draw(&mut layer, None, &[[20.0, 10.0, 50.0]]);
        assert!(layer.is_empty());
    }

    #[test]
    fn strokes_outside_and_unsound_ones_change_nothing() {
        let mut layer = Layer::new([10, 10]);
        assert_eq!(draw(&mut layer, RED, &[[-50.0, 5.0, 3.0]]), None);
        assert!(layer.is_empty());
        for points in [
            vec![],
            vec![[f32::NAN, 0.0, 1.0]],
            vec![[0.0, 0.0, 1e9]],
            vec![[0.0, 0.0, 0.0]],
            vec![[1e6, 0.0, 1.0]],
            vec![[1.0; 3]; POINTS + 1],
        ] {
            assert!(!Way(points).is_sound());
        }
        assert!(Way(vec![[1.0, 2.0, 3.0]]).is_sound());
    }

    #[test]
    fn a_file_gives_back_the_layer_however_its_photo_lies() {
        let mut layer = Layer::new([12, 7]);
        draw(&mut layer, RED, &[[3.0, 2.0, 2.0], [8.0, 2.5, 1.0]]);
        for tag in 1..=8 {
            let upright = Orientation::of_tag(tag);
            let png = layer.to_png(upright).unwrap();
            assert_eq!(Layer::from_png(png, [12, 7]), Some(layer.clone()), "{tag}");
        }
        assert_eq!(Layer::from_png(b"no picture".to_vec(), [12, 7]), None);
    }
}
