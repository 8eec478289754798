//! The photos on the device: all of them, or one at a time.

use std::{collections::BTreeMap, sync::Arc};

use super::{LumaError, TrainingView, TrainingViews, prefetch::Prefetch, view};
use crate::{
    capture::in_order,
    gpu::{Buffer, Gpu, GpuError},
};

/// Gray and mask of a photo on the device: 8 bits a pixel, four pixels a word.
pub struct PackedPhoto {
    /// Gray.
    pub gray: Buffer<u32>,
    /// Weight of each pixel, 0 to 255, if some do not count.
    pub mask: Option<Buffer<u32>>,
}

/// Photos by number.
pub struct Photos {
    /// One for each photo, or one in which they take turns.
    pictures: Vec<PackedPhoto>,
    /// Photos that stay where they are until they are shown.
    stream: Option<Prefetch<Result<TrainingView, LumaError>>>,
    /// Excluded pixels of some views, one bit each.
    left_out: BTreeMap<usize, Vec<u8>>,
}

impl Photos {
    /// The photos of `views`, which are loaded now or, `streamed`, when they are shown.
    pub fn new(
        gpu: &Gpu,
        views: &Arc<dyn TrainingViews>,
        masked: bool,
        streamed: bool,
    ) -> Result<Self, LumaError> {
        let count = views.count();
        let pixels = |view: usize| {
            let camera = views.camera(view);
            camera.width as usize * camera.height as usize
        };
        if streamed {
            let words = (0..count).map(pixels).max().unwrap_or(0).div_ceil(4);
            let views = views.clone();
            let load = move |photo| view::load(&*views, photo);
            return Ok(Self {
                pictures: vec![PackedPhoto::zeros(gpu, words, masked)?],
                stream: Some(Prefetch::new(Arc::new(load))),
                left_out: BTreeMap::new(),
            });
        }
        let mut pictures = Vec::new();
        for photo in 0..count {
            pictures.push(PackedPhoto::zeros(gpu, pixels(photo).div_ceil(4), masked)?);
        }
        let all: Vec<usize> = (0..count).collect();
        in_order(
            &all,
            |&photo| view::load(&**views, photo),
            |&photo, view| {
                pictures[photo].write(gpu, view?);
                Ok::<_, LumaError>(())
            },
        )?;
        Ok(Self {
            pictures,
            stream: None,
            left_out: BTreeMap::new(),
        })
    }

    /// Buffers of the photos.
    pub fn pictures(&self) -> &[PackedPhoto] {
        &self.pictures
    }

    /// Lets only what `mask` says count of a photo.
    pub fn leave_out(&mut self, gpu: &Gpu, photo: usize, mask: &[u8]) {
        if self.stream.is_none()
            && let Some(buffer) = &self.pictures[photo].mask
        {
            buffer.write(gpu, &pack(mask));
        }
        let bits = mask.chunks(8).map(|pixels| {
            let bits = pixels.iter().enumerate();
            bits.fold(0, |bits, (bit, &count)| bits | u8::from(count == 0) << bit)
        });
        self.left_out.insert(photo, bits.collect());
    }

    /// The same with a bit for each pixel that does not count, as [`Photos::left_out`] has them.
    pub fn leave_out_bits(
        &mut self,
        gpu: &Gpu,
        views: &dyn TrainingViews,
        photo: usize,
        bits: Vec<u8>,
    ) -> Result<(), LumaError> {
        if self.stream.is_some() {
            self.left_out.insert(photo, bits);
        } else {
            let mut mask = view::load(views, photo)?.whole_mask();
            without(&mut mask, &bits);
            self.leave_out(gpu, photo, &mask);
        }
        Ok(())
    }

    /// Excluded pixels of each photo that has any, one bit each.
    pub fn left_out(&self) -> Vec<(usize, Vec<u8>)> {
        let left_out = self.left_out.iter();
        left_out
            .map(|(&photo, bits)| (photo, bits.clone()))
            .collect()
    }

    /// Readies a photo for what is submitted next, and gives its picture's place; those of
    /// `next` are loaded meanwhile.
    pub fn show(
        &mut self,
        gpu: &Gpu,
        photo: usize,
        next: impl Iterator<Item = usize>,
    ) -> Result<usize, LumaError> {
        let Some(stream) = &mut self.stream else {
            return Ok(photo);
        };
        let mut view = stream.take(photo, next)?;
        if let Some(left_out) = self.left_out.get(&photo) {
            let mut mask = view.whole_mask();
            without(&mut mask, left_out);
            view.mask = Some(mask);
        }
        self.pictures[0].write(gpu, view);
        Ok(0)
    }
}

impl PackedPhoto {
    fn zeros(gpu: &Gpu, words: usize, masked: bool) -> Result<Self, GpuError> {
        let zeros = |label| Buffer::zeros(gpu, label, words);
        Ok(Self {
            gray: zeros("photo")?,
            mask: masked.then(|| zeros("mask")).transpose()?,
        })
    }

    fn write(&self, gpu: &Gpu, mut view: TrainingView) {
        self.gray.write(gpu, &pack(&view.gray));
        if let Some(mask) = &self.mask {
            mask.write(gpu, &pack(&view.whole_mask()));
        }
    }
}

/// Lets pixels whose bit is set count no longer.
fn without(mask: &mut [u8], left_out: &[u8]) {
    for (pixel, count) in mask.iter_mut().enumerate() {
        if left_out
            .get(pixel / 8)
            .is_some_and(|bits| bits >> (pixel % 8) & 1 == 1)
        {
            *count = 0;
        }
    }
}

/// Packs 8-bit pixels four to a word, the first in the lowest byte.
fn pack(gray: &[u8]) -> Vec<u32> {
    gray.chunks(4)
        .map(|bytes| {
            let mut word = [0; 4];
            word[..bytes.len()].copy_from_slice(bytes);
            u32::from_le_bytes(word)
        })
        .collect()
}
