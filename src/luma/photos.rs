//! The photos on the device: all of them, or one at a time.

use super::loss;
use crate::gpu::{Buffer, Gpu, GpuError};

/// Photos by number, 8-bit gray, four pixels a word.
pub enum Photos {
    /// Each has a buffer of its own.
    Resident(Vec<Buffer<u32>>),
    /// They stay with the host and take turns in one buffer.
    Streamed {
        /// The photos.
        packed: Vec<Vec<u32>>,
        /// Room for the largest.
        buffer: Buffer<u32>,
    },
}

impl Photos {
    /// Photos as bytes, `[height, width]` each.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new<'a>(
        gpu: &Gpu,
        photos: impl Iterator<Item = &'a [u8]>,
        streamed: bool,
    ) -> Result<Self, GpuError> {
        let packed = photos.map(loss::pack);
        if !streamed {
            let buffers = packed.map(|photo| Buffer::from_slice(gpu, "photo", &photo));
            return Ok(Self::Resident(buffers.collect::<Result<_, _>>()?));
        }
        let packed: Vec<Vec<u32>> = packed.collect();
        let largest = packed.iter().map(Vec::len).max().unwrap_or(0);
        Ok(Self::Streamed {
            packed,
            buffer: Buffer::zeros(gpu, "photo", largest)?,
        })
    }

    /// The buffers that a photo may stand in.
    pub fn buffers(&self) -> &[Buffer<u32>] {
        match self {
            Self::Resident(buffers) => buffers,
            Self::Streamed { buffer, .. } => std::slice::from_ref(buffer),
        }
    }

    /// Puts another picture of the same size in a photo's place.
    pub fn replace(&mut self, gpu: &Gpu, index: usize, picture: &[u8]) {
        let words = loss::pack(picture);
        match self {
            Self::Resident(buffers) => buffers[index].write(gpu, &words),
            Self::Streamed { packed, .. } => packed[index] = words,
        }
    }

    /// Readies a photo for what is submitted next, and gives its buffer's place.
    pub fn show(&self, gpu: &Gpu, index: usize) -> usize {
        match self {
            Self::Resident(_) => index,
            Self::Streamed { packed, buffer } => {
                buffer.write(gpu, &packed[index]);
                0
            }
        }
    }
}
