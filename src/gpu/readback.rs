//! Copies of buffers on their way from the device.

use std::sync::mpsc;

/// The bytes of a buffer as they were when it was made.
pub(super) struct RawReadback {
    staging: wgpu::Buffer,
    done: mpsc::Receiver<Result<(), wgpu::BufferAsyncError>>,
}

impl RawReadback {
    /// Orders a copy of the present content; the device goes on meanwhile.
    pub fn order(device: &wgpu::Device, queue: &wgpu::Queue, from: &wgpu::Buffer) -> Self {
        let size = from.size();
        let staging = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read-back"),
            size,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(from, 0, &staging, 0, size);
        queue.submit([encoder.finish()]);
        let (sender, done) = mpsc::channel();
        staging.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver is gone when nobody wants the answer any more.
            let _ = sender.send(result);
        });
        Self { staging, done }
    }

    /// The bytes, once the device was waited for; else the reason why there are none.
    pub fn bytes(&self) -> Result<wgpu::BufferView, String> {
        let mapped = self.done.recv().map_err(|error| error.to_string())?;
        mapped.map_err(|error| error.to_string())?;
        let view = self.staging.get_mapped_range(..);
        view.map_err(|error| error.to_string())
    }
}
