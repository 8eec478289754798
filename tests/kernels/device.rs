//! A device that the caller brings.

use gs_chroma::gpu::{Buffer, Gpu, GpuError, STORAGE_BUFFERS};

/// A device of the adapter of [`Gpu::open`] with other limits.
fn brought(storage_buffers: u32) -> Result<Gpu, GpuError> {
    let instance = wgpu::Instance::default();
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).unwrap();
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_limits: wgpu::Limits {
            max_storage_buffers_per_shader_stage: storage_buffers,
            ..wgpu::Limits::default()
        },
        ..Default::default()
    }))
    .unwrap();
    Gpu::on(device, queue, adapter.get_info())
}

#[test]
fn a_device_that_is_brought_works_if_kernels_can_bind_enough() {
    let gpu = brought(STORAGE_BUFFERS).unwrap();
    let buffer = Buffer::from_slice(&gpu, "numbers", &[1_u32, 2, 3]).unwrap();
    assert_eq!(buffer.read(&gpu).unwrap(), [1, 2, 3]);
    let refused = brought(STORAGE_BUFFERS - 1);
    assert!(matches!(refused, Err(GpuError::NoDevice { .. })));
}
