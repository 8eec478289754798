//! Typed storage buffers and reading them back.

use std::marker::PhantomData;

use bytemuck::Pod;

use super::{device::Gpu, error::GpuError, readback::RawReadback};

/// A storage buffer of `len` elements of `T`, zeroed when made. Clones share it.
#[derive(Clone)]
pub struct Buffer<T> {
    raw: wgpu::Buffer,
    len: usize,
    element: PhantomData<T>,
}

impl<T: Pod> Buffer<T> {
    /// A buffer of zeros. An empty one still has room for one element, because
    /// a binding may not be empty.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] when the adapter cannot bind it.
    pub fn zeros(gpu: &Gpu, label: &str, len: usize) -> Result<Self, GpuError> {
        Self::with_usage(gpu, label, len, wgpu::BufferUsages::STORAGE)
    }

    /// A buffer that holds `data`.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] when the adapter cannot bind it.
    pub fn from_slice(gpu: &Gpu, label: &str, data: &[T]) -> Result<Self, GpuError> {
        let buffer = Self::zeros(gpu, label, data.len())?;
        buffer.write(gpu, data);
        Ok(buffer)
    }

    /// A uniform buffer that holds `value`.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] when the adapter cannot bind it.
    pub fn uniform(gpu: &Gpu, label: &str, value: &T) -> Result<Self, GpuError> {
        let buffer = Self::with_usage(gpu, label, 1, wgpu::BufferUsages::UNIFORM)?;
        buffer.write(gpu, std::slice::from_ref(value));
        Ok(buffer)
    }

    /// A buffer of zeros that tells dispatches how many workgroups run.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] when the adapter cannot bind it.
    pub fn indirect(gpu: &Gpu, label: &str, len: usize) -> Result<Self, GpuError> {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDIRECT;
        Self::with_usage(gpu, label, len, usage)
    }

    fn with_usage(
        gpu: &Gpu,
        label: &str,
        len: usize,
        usage: wgpu::BufferUsages,
    ) -> Result<Self, GpuError> {
        let size = (len.max(1) * size_of::<T>()).next_multiple_of(4) as u64;
        let limit = gpu.binding_limit();
        if size > limit {
            return Err(GpuError::TooLarge {
                label: label.to_owned(),
                needed: size,
                limit,
            });
        }
        let raw = gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage: usage | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        if let Some(mut tape) = gpu.tape() {
            tape.made(&raw);
        }
        Ok(Self {
            raw,
            len,
            element: PhantomData,
        })
    }

    /// The number of elements.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns true if there are no elements.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The buffer that a binding takes.
    pub fn raw(&self) -> &wgpu::Buffer {
        &self.raw
    }

    /// Writes elements from the front, before the next submission runs.
    ///
    /// # Panics
    /// When `data` is longer than the buffer.
    pub fn write(&self, gpu: &Gpu, data: &[T]) {
        assert!(
            data.len() <= self.len,
            "write of {} into {}",
            data.len(),
            self.len
        );
        self.write_at(gpu, 0, data);
    }

    /// Writes elements from index `first` on, before the next submission runs.
    ///
    /// # Panics
    /// When they reach beyond the buffer.
    pub fn write_at(&self, gpu: &Gpu, first: usize, data: &[T]) {
        assert!(first + data.len() <= self.len, "write beyond the buffer");
        if !data.is_empty() {
            let offset = (first * size_of::<T>()) as u64;
            let bytes = bytemuck::cast_slice(data);
            gpu.queue().write_buffer(&self.raw, offset, bytes);
            if let Some(mut tape) = gpu.tape() {
                tape.wrote(&self.raw, offset, bytes);
            }
        }
    }

    /// Reads all elements, waiting for the device.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn read(&self, gpu: &Gpu) -> Result<Vec<T>, GpuError> {
        self.read_later(gpu).wait(gpu)
    }

    /// Orders a copy of the present content; the device goes on meanwhile.
    pub fn read_later(&self, gpu: &Gpu) -> Readback<T> {
        let copy = RawReadback::order(gpu.device(), gpu.queue(), &self.raw);
        if let Some(mut tape) = gpu.tape() {
            tape.read(&self.raw);
        }
        Readback {
            copy,
            answer: gpu.answer(),
            len: self.len,
            element: PhantomData,
        }
    }
}

/// A copy on its way from the device.
pub struct Readback<T> {
    copy: RawReadback,
    /// Answer of another device, used instead.
    answer: Option<Vec<u8>>,
    len: usize,
    element: PhantomData<T>,
}

impl<T: Pod> Readback<T> {
    /// Waits for the copy.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn wait(self, gpu: &Gpu) -> Result<Vec<T>, GpuError> {
        gpu.wait()?;
        let view = self.copy.bytes().map_err(|reason| gpu.lost(reason))?;
        let bytes = self.len * size_of::<T>();
        match self.answer {
            None => Ok(bytemuck::pod_collect_to_vec(&view[..bytes])),
            Some(answer) => (answer.get(..bytes))
                .map(bytemuck::pod_collect_to_vec)
                .ok_or_else(|| gpu.lost("its tape has no such answer")),
        }
    }
}
