//! A device that the caller brings.

use std::{ops::ControlFlow, path::Path, sync::Arc};

use gs_chroma::{
    capture::{Dataset, LoadOptions},
    chroma::{
        self, ChromaSettings, ColorizeEvent,
        teacher::{Teacher, TeacherSettings},
    },
    gpu::{Buffer, Gpu, GpuError, STORAGE_BUFFERS, WORKGROUP_BYTES},
    luma::{self, LumaSettings},
};

/// A device of the adapter of [`Gpu::open`] with other limits.
fn brought(storage_buffers: u32, workgroup_bytes: u32) -> Result<Gpu, GpuError> {
    let instance = wgpu::Instance::default();
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).unwrap();
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_limits: wgpu::Limits {
            max_storage_buffers_per_shader_stage: storage_buffers,
            max_compute_workgroup_storage_size: workgroup_bytes,
            ..wgpu::Limits::default()
        },
        ..Default::default()
    }))
    .unwrap();
    Gpu::on(device, queue, adapter.get_info())
}

#[test]
fn a_device_that_is_brought_works_if_it_has_what_kernels_need() {
    let gpu = brought(STORAGE_BUFFERS, WORKGROUP_BYTES).unwrap();
    let buffer = Buffer::from_slice(&gpu, "numbers", &[1_u32, 2, 3]).unwrap();
    assert_eq!(buffer.read(&gpu).unwrap(), [1, 2, 3]);
    for (refused, what) in [
        (
            brought(STORAGE_BUFFERS - 1, WORKGROUP_BYTES),
            "storage buffers",
        ),
        (
            brought(STORAGE_BUFFERS, WORKGROUP_BYTES - 16),
            "workgroup memory",
        ),
    ] {
        let Err(GpuError::NoDevice { reason, .. }) = refused else {
            panic!("{what} are not missed");
        };
        assert!(reason.contains(what), "{reason}");
    }
}

fn garden() -> Arc<Dataset> {
    let options = LoadOptions {
        max_side: Some(48),
        ..LoadOptions::default()
    };
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/demo");
    Arc::new(Dataset::open(&folder, &options, &mut |_| {}).unwrap())
}

/// Whatever was on its way: no panic, no wait without end.
#[test]
fn a_device_that_is_lost_is_an_error() {
    let dataset = garden();
    for told in [1, 3, 8] {
        let gpu = Gpu::open().unwrap();
        let mut events = 0;
        let settings = LumaSettings::new(200);
        let trained = luma::fit(&gpu, &dataset, &settings, &mut |_| {
            events += 1;
            if events == told {
                gpu.device().destroy();
            }
            ControlFlow::Continue(())
        });
        let words = trained.map(drop).unwrap_err().to_string();
        assert!(words.contains("device"), "{told}: {words}");
    }
}

#[test]
fn a_device_that_is_lost_while_it_colors_is_an_error() {
    let dataset = garden();
    let gpu = Gpu::open().unwrap();
    let settings = LumaSettings::new(20);
    let scene = luma::fit(
        &gpu,
        &dataset,
        &settings,
        &mut |_| ControlFlow::Continue(()),
    );
    let scene = scene.unwrap();
    let photos = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/demo/images");
    let mut teacher = Teacher::open(&photos, None, &TeacherSettings::default()).unwrap();
    let mut rounds = 0;
    let colored = chroma::colorize(
        &scene.raster(&gpu),
        &dataset,
        &scene.splats,
        &mut teacher,
        &ChromaSettings::irls(),
        &mut |event| {
            rounds += usize::from(matches!(event, ColorizeEvent::Solving(_)));
            if rounds == 2 {
                gpu.device().destroy();
            }
            ControlFlow::Continue(())
        },
    );
    let words = colored.map(drop).unwrap_err().to_string();
    assert!(words.contains("device"), "{words}");
}

/// An allocation that the device refuses is an error of the next wait, and no panic.
#[test]
fn memory_that_is_not_there_is_an_error() {
    let gpu = Gpu::open().unwrap();
    let most = gpu.device().limits().max_buffer_size;
    let _refused = gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: most + 4,
        usage: wgpu::BufferUsages::STORAGE,
        mapped_at_creation: false,
    });
    let words = gpu.wait().unwrap_err().to_string();
    assert!(words.contains("device") && !words.contains('\n'), "{words}");
}
