//! Wanted colors of each view, on the host: a word a pixel at each scale, in memory up to
//! a bound and in a temporary file beyond.

use std::{
    fs::File,
    io::{self, Read, Seek, SeekFrom, Write},
};

use super::{
    ChromaError,
    teacher::{AbImage, Filter, resample},
};
use crate::disk;

/// Bytes of wanted pictures that stay in memory by default.
const MEMORY: usize = 96 << 20;

/// Steps of a CIELAB unit that wanted a/b are rounded to.
const AB_STEPS: f32 = 256.0;

/// White, as wanted RGB are rounded.
const RGB_STEPS: f32 = 1023.0;

/// Twin of `wanted_ab`: a in the lower half, b in the upper, -128 to 127.996.
pub fn pack_ab(ab: [f32; 2]) -> u32 {
    let half = |value: f32| u32::from((value * AB_STEPS).round() as i16 as u16);
    half(ab[0]) | half(ab[1]) << 16
}

fn unpack_ab(word: u32) -> [f32; 2] {
    [word as u16, (word >> 16) as u16].map(|half| f32::from(half as i16) / AB_STEPS)
}

/// Twin of `wanted_rgb`: ten bits a channel, red lowest, 0 to 1.
pub fn pack_rgb(rgb: [f32; 3]) -> u32 {
    let [r, g, b] = rgb.map(|value| (value.clamp(0.0, 1.0) * RGB_STEPS).round() as u32);
    r | g << 10 | b << 20
}

/// A wanted picture at one scale.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Packed colors, `[height, width]`.
    pub pixels: Vec<u32>,
    /// Weight of each pixel, `[height, width]`: 0 if unknown, 1 for an ordinary pixel, more if it
    /// was painted by hand. `None`: 1 everywhere.
    pub weights: Option<Vec<f32>>,
}

impl Target {
    /// The a/b that are wanted, as far as they are known; to 1/512 of a unit.
    pub fn ab(&self) -> AbImage {
        AbImage {
            width: self.size[0],
            height: self.size[1],
            ab: self.pixels.iter().map(|&word| unpack_ab(word)).collect(),
        }
    }
}

impl Target {
    /// The same a/b at another size.
    pub(super) fn resized(self, size: [u32; 2]) -> Self {
        if size == self.size {
            return self;
        }
        let (colors, weights) = at_size(&self.ab().ab, self.weights.as_deref(), self.size, size);
        Self {
            size,
            pixels: colors.into_iter().map(pack_ab).collect(),
            weights,
        }
    }
}

/// Place of a picture: pixels, then weights, as words.
enum TargetData {
    Memory(Vec<u32>),
    File(u64),
}

struct Stored {
    size: [u32; 2],
    weighted: bool,
    place: TargetData,
}

impl Stored {
    /// Number of words.
    fn words(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize * (1 + usize::from(self.weighted))
    }
}

/// Wanted pictures of many views at 2^0, 2^1, … times smaller sizes.
pub struct Targets {
    scales: usize,
    room: usize,
    file: Option<File>,
    /// `[targets][scales]`
    stored: Vec<Vec<Stored>>,
}

impl Targets {
    /// None yet; each will be kept at so many scales.
    pub fn new(scales: usize) -> Self {
        Self::within(scales, MEMORY)
    }

    /// The same with so many bytes of memory.
    pub fn within(scales: usize, bytes: usize) -> Self {
        Self {
            scales,
            room: bytes,
            file: None,
            stored: Vec::new(),
        }
    }

    /// Number of targets.
    pub fn len(&self) -> usize {
        self.stored.len()
    }

    /// Returns true if there are no targets.
    pub fn is_empty(&self) -> bool {
        self.stored.is_empty()
    }

    /// Scales that each is kept at.
    pub fn scales(&self) -> usize {
        self.scales
    }

    /// Returns true if pixels of any target have weights.
    pub fn weighted(&self) -> bool {
        self.stored.iter().flatten().any(|stored| stored.weighted)
    }

    /// Width and height at full size.
    pub fn size(&self, index: usize) -> [u32; 2] {
        self.stored[index][0].size
    }

    /// Keeps wanted a/b and how much each pixel counts; gives the new target's index.
    ///
    /// # Errors
    /// When the temporary file cannot be written.
    pub fn push_ab(
        &mut self,
        wanted: &AbImage,
        weights: Option<&[f32]>,
    ) -> Result<usize, ChromaError> {
        let size = [wanted.width, wanted.height];
        self.put(None, size, &wanted.ab, weights, pack_ab)
    }

    /// Puts other wanted a/b in the place of a target.
    ///
    /// # Errors
    /// When the temporary file cannot be written; the target is lost then.
    pub fn replace_ab(
        &mut self,
        index: usize,
        wanted: &AbImage,
        weights: Option<&[f32]>,
    ) -> Result<(), ChromaError> {
        let size = [wanted.width, wanted.height];
        self.put(Some(index), size, &wanted.ab, weights, pack_ab)?;
        Ok(())
    }

    /// The same of sRGB-encoded colors from 0 to 1.
    ///
    /// # Errors
    /// When the temporary file cannot be written.
    pub fn push_rgb(
        &mut self,
        size: [u32; 2],
        wanted: &[[f32; 3]],
        weights: Option<&[f32]>,
    ) -> Result<usize, ChromaError> {
        self.put(None, size, wanted, weights, pack_rgb)
    }

    fn put<const C: usize>(
        &mut self,
        index: Option<usize>,
        size: [u32; 2],
        wanted: &[[f32; C]],
        weights: Option<&[f32]>,
        pack: impl Fn([f32; C]) -> u32,
    ) -> Result<usize, ChromaError> {
        let mut of_target = Vec::with_capacity(self.scales);
        let old = index.map(|index| std::mem::take(&mut self.stored[index]));
        let mut old = old.into_iter().flatten();
        for scale in 0..self.scales {
            let smaller = size.map(|side| (side >> scale).max(1));
            let (colors, weights) = match scale {
                0 => (wanted.to_vec(), weights.map(<[f32]>::to_vec)),
                _ => at_size(wanted, weights, size, smaller),
            };
            let weighted = weights.is_some();
            let weights = weights.unwrap_or_default().into_iter().map(f32::to_bits);
            let words = colors.into_iter().map(&pack).chain(weights).collect();
            of_target.push(Stored {
                size: smaller,
                weighted,
                place: self.place(words, old.next())?,
            });
        }
        let index = index.unwrap_or(self.stored.len());
        match self.stored.get_mut(index) {
            Some(stored) => *stored = of_target,
            None => self.stored.push(of_target),
        }
        Ok(index)
    }

    /// Keeps words, where those of `old` were if there is no other room.
    fn place(&mut self, words: Vec<u32>, old: Option<Stored>) -> io::Result<TargetData> {
        let bytes = 4 * words.len();
        let hole = match old {
            Some(Stored {
                place: TargetData::Memory(held),
                ..
            }) => {
                self.room += 4 * held.len();
                None
            }
            Some(old) => Some(old).filter(|old| old.words() == words.len()),
            None => None,
        };
        if bytes <= self.room {
            self.room -= bytes;
            return Ok(TargetData::Memory(words));
        }
        let file = match &mut self.file {
            Some(file) => file,
            none => none.insert(disk::scratch()?),
        };
        let at = file.seek(match hole.map(|old| old.place) {
            Some(TargetData::File(at)) => SeekFrom::Start(at),
            _ => SeekFrom::End(0),
        })?;
        disk::step()?;
        file.write_all(bytemuck::cast_slice(&words))?;
        Ok(TargetData::File(at))
    }

    /// A target at a scale.
    ///
    /// # Errors
    /// When the temporary file cannot be read.
    pub fn read(&self, index: usize, scale: usize) -> Result<Target, ChromaError> {
        let Stored {
            size,
            weighted,
            place,
        } = &self.stored[index][scale];
        let count = size[0] as usize * size[1] as usize;
        let mut pixels = match (place, &self.file) {
            (TargetData::Memory(words), _) => words.clone(),
            (TargetData::File(at), Some(file)) => {
                let mut words = vec![0; count * (1 + usize::from(*weighted))];
                let mut file = file;
                file.seek(SeekFrom::Start(*at))?;
                file.read_exact(bytemuck::cast_slice_mut(&mut words))?;
                words
            }
            (TargetData::File(_), None) => {
                return Err(io::Error::from(io::ErrorKind::NotFound).into());
            }
        };
        let weights = pixels.split_off(count).into_iter().map(f32::from_bits);
        Ok(Target {
            size: *size,
            weights: weighted.then(|| weights.collect()),
            pixels,
        })
    }
}

/// A smaller picture: each pixel's color is the mean of what is known in it.
fn at_size<const C: usize>(
    wanted: &[[f32; C]],
    weights: Option<&[f32]>,
    size: [u32; 2],
    smaller: [u32; 2],
) -> (Vec<[f32; C]>, Option<Vec<f32>>) {
    let Some(weights) = weights else {
        return (resample(wanted, size, smaller, Filter::Average), None);
    };
    let known: Vec<[f32; C]> = (wanted.iter().zip(weights))
        .map(|(color, &w)| color.map(|value| w * value))
        .collect();
    let known = resample(&known, size, smaller, Filter::Average);
    let weights: Vec<[f32; 1]> = weights.iter().map(|&w| [w]).collect();
    let weights = resample(&weights, size, smaller, Filter::Average);
    let colors = (known.iter().zip(&weights))
        .map(|(color, &[w])| color.map(|value| if w > 0.0 { value / w } else { 0.0 }))
        .collect();
    (colors, Some(weights.into_iter().flatten().collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colors_survive_packing() {
        for ab in [
            [0.0, -0.0],
            [12.5, -127.996_09],
            [-128.0, 127.996_09],
            [0.003, 54.321],
        ] {
            let again = unpack_ab(pack_ab(ab));
            for (a, b) in ab.iter().zip(again) {
                assert!((a - b).abs() <= 0.5 / AB_STEPS, "{ab:?} became {again:?}");
            }
        }
        // Beyond any color of the sRGB gamut.
        assert_eq!(unpack_ab(pack_ab([1e9, -1e9])), [32767.0 / 256.0, -128.0]);
        assert_eq!(pack_rgb([0.0, 1.0, 2.0]), 1023 << 10 | 1023 << 20);
        assert_eq!(pack_rgb([0.5, -1.0, 0.0]), 512);
    }

    fn filled(bytes: usize) -> Targets {
        let mut targets = Targets::within(2, bytes);
        let ab: Vec<[f32; 2]> = (0..15).map(|k| [k as f32, -0.5 * k as f32]).collect();
        let image = AbImage {
            width: 5,
            height: 3,
            ab,
        };
        let weights: Vec<f32> = (0..15).map(|k| [1.0, 0.0, 50.0][k % 3]).collect();
        targets.push_ab(&image, None).unwrap();
        targets.push_ab(&image, Some(&weights)).unwrap();
        targets
            .push_rgb([2, 2], &[[1.0, 0.5, 0.0]; 4], None)
            .unwrap();
        targets
    }

    #[test]
    fn a_file_gives_back_what_memory_would() {
        let kept = filled(1 << 20);
        assert!(kept.file.is_none() && kept.weighted() && kept.len() == 3);
        for bytes in [0, 100] {
            let spilt = filled(bytes);
            assert!(spilt.file.is_some());
            for index in 0..3 {
                for scale in 0..2 {
                    let (a, b) = (kept.read(index, scale), spilt.read(index, scale));
                    assert_eq!(a.unwrap(), b.unwrap(), "{index} at scale {scale}");
                }
            }
        }
        // Other colors take the place of the first ones, and no more room.
        for bytes in [1 << 20, 0] {
            let mut targets = filled(bytes);
            let size = |targets: &Targets| {
                let file = targets.file.as_ref();
                (
                    targets.room,
                    file.map(|file| file.metadata().unwrap().len()),
                )
            };
            let before = size(&targets);
            let second = targets.read(1, 0).unwrap();
            let other = AbImage {
                ab: vec![[7.0, 8.0]; 15],
                ..second.ab()
            };
            targets.replace_ab(1, &other, Some(&[2.0; 15])).unwrap();
            assert_eq!(size(&targets), before);
            let found = targets.read(1, 0).unwrap();
            assert_eq!((found.ab(), found.weights), (other, Some(vec![2.0; 15])));
            for index in [0, 2] {
                assert_eq!(
                    targets.read(index, 0).unwrap(),
                    kept.read(index, 0).unwrap()
                );
            }
        }
        let smaller = kept.read(1, 1).unwrap();
        assert_eq!((smaller.size, smaller.pixels.len()), ([2, 1], 2));
        assert_eq!(kept.read(0, 0).unwrap().ab().ab[3], [3.0, -1.5]);
    }

    #[test]
    fn what_is_unknown_does_not_blur_into_what_is_known() {
        let mut targets = Targets::new(2);
        let image = AbImage {
            width: 2,
            height: 1,
            ab: vec![[40.0, -8.0], [-100.0, 100.0]],
        };
        targets.push_ab(&image, Some(&[0.5, 0.0])).unwrap();
        let smaller = targets.read(0, 1).unwrap();
        assert_eq!(smaller.ab().ab, [[40.0, -8.0]]);
        assert_eq!(smaller.weights, Some(vec![0.25]));
    }
}
