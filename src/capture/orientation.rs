//! Orientation of photos: EXIF's tag, and the sides that COLMAP saw.

use image::{DynamicImage, metadata::Orientation as Exif};

/// Rotation or mirroring that makes pixels upright.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Orientation(Exif);

impl Default for Orientation {
    fn default() -> Self {
        Self(Exif::NoTransforms)
    }
}

impl Orientation {
    /// Orientation of an EXIF block; the identity if the block is invalid.
    pub(super) fn of_exif(exif: Option<&[u8]>) -> Self {
        let told = exif.and_then(Exif::from_exif_chunk);
        told.map_or_else(Self::default, Self)
    }

    /// Orientation of a value of EXIF's tag, 1 to 8.
    pub(crate) fn of_tag(value: u16) -> Self {
        let known = u8::try_from(value).ok().and_then(Exif::from_exif);
        known.map_or_else(Self::default, Self)
    }

    /// EXIF block with nothing but its tag; none of the identity.
    pub(crate) fn exif(self) -> Option<Vec<u8>> {
        // Big endian, one entry: tag 0x0112, a short.
        let head = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0";
        let tag = [self.0.to_exif(), 0, 0, 0, 0, 0, 0];
        (!self.is_none()).then(|| [&head[..], &tag].concat())
    }

    /// True for the identity, which moves no pixel.
    pub fn is_none(self) -> bool {
        self == Self::default()
    }

    /// Number of clockwise turns by 90°; `None` if it mirrors.
    pub fn quarter_turns(self) -> Option<u32> {
        match self.0 {
            Exif::NoTransforms => Some(0),
            Exif::Rotate90 => Some(1),
            Exif::Rotate180 => Some(2),
            Exif::Rotate270 => Some(3),
            _ => None,
        }
    }

    /// The same, or nothing where it mirrors.
    pub fn without_mirrors(self) -> Self {
        self.quarter_turns().map_or_else(Self::default, |_| self)
    }

    fn swaps_sides(self) -> bool {
        self.0.to_exif() >= 5
    }

    /// Width and height afterwards.
    pub fn size(self, [width, height]: [u32; 2]) -> [u32; 2] {
        match self.swaps_sides() {
            true => [height, width],
            false => [width, height],
        }
    }

    /// Inverse orientation.
    pub fn inverse(self) -> Self {
        Self(match self.0 {
            Exif::Rotate90 => Exif::Rotate270,
            Exif::Rotate270 => Exif::Rotate90,
            other => other,
        })
    }

    /// A picture, `[height, width, channels]`, turned; `size` is its width and height before.
    pub fn turned<T: Copy>(self, picture: Vec<T>, channels: usize, size: [u32; 2]) -> Vec<T> {
        if self.is_none() {
            return picture;
        }
        let [width, height] = size.map(|side| side as usize);
        let [across, down] = self.size(size).map(|side| side as usize);
        let mut turned = Vec::with_capacity(picture.len());
        for y in 0..down {
            for x in 0..across {
                let [from_x, from_y] = match self.0 {
                    Exif::NoTransforms => [x, y],
                    Exif::FlipHorizontal => [width - 1 - x, y],
                    Exif::Rotate180 => [width - 1 - x, height - 1 - y],
                    Exif::FlipVertical => [x, height - 1 - y],
                    Exif::Rotate90FlipH => [y, x],
                    Exif::Rotate90 => [y, height - 1 - x],
                    Exif::Rotate270FlipH => [width - 1 - y, height - 1 - x],
                    Exif::Rotate270 => [width - 1 - y, x],
                };
                let at = channels * (from_y * width + from_x);
                turned.extend_from_slice(&picture[at..at + channels]);
            }
        }
        turned
    }

    /// An image turned.
    pub fn image(self, mut image: DynamicImage) -> DynamicImage {
        image.apply_orientation(self.0);
        image
    }

    /// This one, and another after it.
    fn then(self, after: Self) -> Self {
        let size = [2, 3];
        let turned = |by: Self| (by.size(size), by.turned(vec![0, 1, 2, 3, 4, 5], 1, size));
        let (between, picture) = turned(self);
        let wanted = (after.size(between), after.turned(picture, 1, between));
        let mut all = (1..=8).map(Self::of_tag);
        // There are no others.
        all.find(|&by| turned(by) == wanted).unwrap_or_default()
    }
}

/// Orientations that relate a photo's file, the image that COLMAP saw of it and the upright one.
///
/// COLMAP ignores the orientation; where photos were turned for it and the files were not, its
/// cameras have the turned sides. One of the two is nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SensorOrientation {
    /// From the file's pixels to those that COLMAP saw.
    pub from_file: Orientation,
    /// From those that COLMAP saw to upright ones.
    pub upright: Orientation,
}

impl SensorOrientation {
    /// From the file's pixels to upright ones.
    pub(crate) fn of_file(self) -> Orientation {
        self.from_file.then(self.upright)
    }

    /// A photo that COLMAP saw as its file has it, or `turned`.
    pub(super) fn new(orientation: Orientation, turned: bool) -> Self {
        let as_it_is = Orientation::default();
        match turned {
            true => Self {
                from_file: orientation,
                upright: as_it_is,
            },
            false => Self {
                from_file: as_it_is,
                upright: orientation,
            },
        }
    }

    /// Turns that may take another image of the photo, such as its mask, to the one that COLMAP
    /// saw, the likeliest first; `own` is the orientation in that image's file.
    pub(crate) fn ways(self, own: Orientation) -> impl Iterator<Item = Orientation> {
        let from_upright = self.upright.inverse();
        let by_its_tag = (!own.is_none()).then(|| own.then(from_upright));
        by_its_tag.into_iter().chain([self.from_file, from_upright])
    }
}

#[cfg(test)]
mod tests {
    use image::RgbImage;

    use super::*;

    #[test]
    fn pixels_are_turned_as_viewers_turn_them_and_back() {
        let pixels: Vec<u8> = (0..3 * 3 * 2).collect();
        let image = RgbImage::from_raw(3, 2, pixels.clone()).unwrap();
        for tag in 0..=9 {
            let ours = Orientation::of_tag(tag);
            let turned = ours.image(image.clone().into()).into_rgb8();
            let by_hand = ours.turned(pixels.clone(), 3, [3, 2]);
            assert_eq!(turned.as_raw(), &by_hand, "{tag}");
            assert_eq!(<[u32; 2]>::from(turned.dimensions()), ours.size([3, 2]));
            let back = ours.inverse().image(turned.into());
            assert_eq!(back, image.clone().into(), "{tag}");
            assert!(ours.then(ours.inverse()).is_none());
            assert_eq!(ours.is_none(), !(2..=8).contains(&tag));
        }
    }

    #[test]
    fn masks_may_lie_like_the_photo_or_stand() {
        let (quarter, none) = (Orientation::of_tag(6), Orientation::default());
        let pixels = || (0..6).collect::<Vec<u8>>();
        // COLMAP saw the photo lying, 3 × 2, and turned.
        for turned in [false, true] {
            let stance = SensorOrientation::new(quarter, turned);
            let lying = [3, 2];
            let wanted = match turned {
                false => pixels(),
                true => quarter.turned(pixels(), 1, lying),
            };
            let size = if turned { [2, 3] } else { lying };
            let found = |own, pixels: Vec<u8>, from| {
                let mut ways = stance.ways(own);
                let way = ways.find(|way| way.size(from) == size).unwrap();
                way.turned(pixels, 1, from)
            };
            assert_eq!(found(none, pixels(), lying), wanted);
            let standing = quarter.turned(pixels(), 1, lying);
            assert_eq!(found(none, standing, [2, 3]), wanted);
            assert_eq!(found(quarter, pixels(), lying), wanted);
        }
    }
}
