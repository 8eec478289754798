//! The photos on the device: all of them, or one at a time.

use std::{collections::HashMap, sync::Arc};

use super::{
    LumaError, TrainingView, TrainingViews,
    prefetch::Prefetch,
    view::{self, halved},
};
use crate::{
    capture::in_order,
    gpu::{Buffer, Gpu, GpuError},
};

/// What a photo shows and what counts of it: 8 bits a pixel, four pixels a word.
pub struct Picture {
    /// Gray.
    pub gray: Buffer<u32>,
    /// What each pixel counts, where some do not.
    pub mask: Option<Buffer<u32>>,
}

/// Photos by number; behind those of the views come, where training begins coarse, the same
/// at half the size.
pub struct Photos {
    /// One for each photo, or one in which they take turns.
    pictures: Vec<Picture>,
    stream: Option<Stream>,
}

/// Photos that stay where they are.
struct Stream {
    prefetch: Prefetch<Result<TrainingView, LumaError>>,
    /// Of some views the pixels that no longer count, a bit each.
    left_out: HashMap<usize, Vec<u8>>,
}

impl Photos {
    /// The photos of `views`, which are loaded now or, `streamed`, when they are shown.
    ///
    /// # Errors
    /// [`LumaError`].
    pub fn new(
        gpu: &Gpu,
        views: &Arc<dyn TrainingViews>,
        coarse: bool,
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
                pictures: vec![Picture::zeros(gpu, words, masked)?],
                stream: Some(Stream {
                    prefetch: Prefetch::new(Arc::new(load)),
                    left_out: HashMap::new(),
                }),
            });
        }
        let mut pictures = Vec::new();
        for photo in 0..count {
            pictures.push(Picture::zeros(gpu, pixels(photo).div_ceil(4), masked)?);
        }
        for photo in (0..count).filter(|_| coarse) {
            let camera = halved(views.camera(photo));
            let pixels = camera.width as usize * camera.height as usize;
            pictures.push(Picture::zeros(gpu, pixels.div_ceil(4), masked)?);
        }
        let all: Vec<usize> = (0..count).collect();
        in_order(
            &all,
            |&photo| view::load(&**views, photo),
            |&photo, view| {
                let view = view?;
                if coarse {
                    pictures[count + photo].write(gpu, view.halved());
                }
                pictures[photo].write(gpu, view);
                Ok::<_, LumaError>(())
            },
        )?;
        Ok(Self {
            pictures,
            stream: None,
        })
    }

    /// What a photo may stand in.
    pub fn pictures(&self) -> &[Picture] {
        &self.pictures
    }

    /// Lets only what `mask` says count of a photo.
    pub fn leave_out(&mut self, gpu: &Gpu, photo: usize, mask: &[u8]) {
        match &mut self.stream {
            None => {
                if let Some(buffer) = &self.pictures[photo].mask {
                    buffer.write(gpu, &pack(mask));
                }
            }
            Some(stream) => {
                let bits = mask.chunks(8).map(|pixels| {
                    let bits = pixels.iter().enumerate();
                    bits.fold(0, |bits, (bit, &count)| bits | u8::from(count == 0) << bit)
                });
                stream.left_out.insert(photo, bits.collect());
            }
        }
    }

    /// Readies a photo for what is submitted next, and gives its picture's place; those of
    /// `next` are loaded meanwhile.
    ///
    /// # Errors
    /// [`LumaError`] of the photo.
    pub fn show(
        &mut self,
        gpu: &Gpu,
        photo: usize,
        next: impl Iterator<Item = usize>,
    ) -> Result<usize, LumaError> {
        let Some(stream) = &mut self.stream else {
            return Ok(photo);
        };
        let mut view = stream.prefetch.take(photo, next)?;
        if let Some(left_out) = stream.left_out.get(&photo) {
            let mut mask = view.counts();
            for (pixel, count) in mask.iter_mut().enumerate() {
                if left_out[pixel / 8] >> (pixel % 8) & 1 == 1 {
                    *count = 0;
                }
            }
            view.mask = Some(mask);
        }
        self.pictures[0].write(gpu, view);
        Ok(0)
    }
}

impl Picture {
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
            mask.write(gpu, &pack(&view.counts()));
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
