//! Needs of each pipeline, against limits of devices and docs/gpu.md.

use std::{collections::BTreeMap, fs};

use gs_chroma::gpu::{STORAGE_BUFFERS, WORKGROUP_BYTES, WORKGROUP_THREADS, shaders};
use naga::{
    AddressSpace, Module,
    valid::{Capabilities, ModuleInfo, ValidationFlags, Validator},
};

/// Resources that an entry point needs.
#[derive(Clone, Copy)]
struct Needs {
    threads: u32,
    workgroup_bytes: u32,
    storage_buffers: u32,
    uniform_buffers: u32,
    /// The highest binding number.
    last_binding: u32,
}

impl Needs {
    fn of(module: &Module, info: &ModuleInfo, entry: usize) -> Self {
        let point = &module.entry_points[entry];
        let mut layouter = naga::proc::Layouter::default();
        layouter.update(module.to_ctx()).expect("types have sizes");
        let mut needs = Self {
            threads: point.workgroup_size.iter().product(),
            workgroup_bytes: 0,
            storage_buffers: 0,
            uniform_buffers: 0,
            last_binding: 0,
        };
        for (handle, global) in module.global_variables.iter() {
            if info.get_entry_point(entry)[handle].is_empty() {
                continue;
            }
            match global.space {
                // Rounded as WebGPU counts it.
                AddressSpace::WorkGroup => {
                    needs.workgroup_bytes += layouter[global.ty].size.next_multiple_of(16);
                }
                AddressSpace::Storage { .. } => needs.storage_buffers += 1,
                AddressSpace::Uniform => needs.uniform_buffers += 1,
                _ => {}
            }
            if let Some(binding) = &global.binding {
                assert_eq!(binding.group, 0);
                needs.last_binding = needs.last_binding.max(binding.binding);
            }
        }
        needs
    }
}

/// Every entry point of every kernel, in order of their names.
fn all() -> BTreeMap<(String, &'static str), Needs> {
    let mut all = BTreeMap::new();
    for (name, source) in shaders::ALL {
        let module = naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{name}: {e}"));
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        let info = validator.validate(&module).expect("valid");
        for (entry, point) in module.entry_points.iter().enumerate() {
            let needs = Needs::of(&module, &info, entry);
            all.insert((point.name.clone(), *name), needs);
        }
    }
    all
}

/// `Gpu` requests exactly the needs of the largest kernels, and the page lists them.
#[test]
fn a_device_is_asked_for_what_the_kernels_take_and_no_more() {
    let all = all();
    let most = |of: fn(&Needs) -> u32| all.values().map(of).max().expect("kernels");
    let [storage, bytes, threads, uniform] = [
        most(|needs| needs.storage_buffers),
        most(|needs| needs.workgroup_bytes),
        most(|needs| needs.threads),
        most(|needs| needs.uniform_buffers),
    ];
    assert_eq!(storage, STORAGE_BUFFERS);
    assert_eq!(bytes, WORKGROUP_BYTES);
    assert_eq!(threads, WORKGROUP_THREADS);

    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/gpu.md");
    let page = fs::read_to_string(page).expect("the page");
    let (thousands, rest) = (bytes / 1_000, bytes % 1_000);
    let row =
        format!("a kernel takes** | {threads} | {thousands},{rest:03} | {storage} | {uniform} |");
    assert!(page.contains(&row), "docs/gpu.md lacks {row}");
}

/// Beyond what WebGPU promises are storage buffers and workgroup memory, and no more; both
/// stay below what Metal and D3D12 have.
#[test]
fn limits_of_other_devices_hold() {
    let promised = wgpu::Limits::default();
    for ((entry, variant), needs) in all() {
        let name = format!("{entry} of {variant}");
        assert!(
            needs.threads <= promised.max_compute_invocations_per_workgroup,
            "{name}"
        );
        assert!(
            needs.uniform_buffers <= promised.max_uniform_buffers_per_shader_stage,
            "{name}"
        );
        assert!(
            needs.last_binding < promised.max_bindings_per_bind_group,
            "{name}"
        );
        // wgpu on Metal: 31 buffers of all kinds but two of its own; 32 KiB.
        assert!(
            needs.storage_buffers + needs.uniform_buffers <= 29,
            "{name}"
        );
        // wgpu on D3D12: half of 64 views for each of two stages, half of these for buffers.
        assert!(
            needs.storage_buffers <= 16 && needs.uniform_buffers <= 14,
            "{name}"
        );
        assert!(needs.workgroup_bytes <= 32 << 10, "{name}");
    }
}
