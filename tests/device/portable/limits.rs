//! Needs of each pipeline, against limits of devices: the table in docs/gpu.md.
//!
//! `WRITE_DOCS=1 cargo test --test device limits` writes it.

use std::{collections::BTreeMap, fmt::Write, fs};

use gs_chroma::gpu::{STORAGE_BUFFERS, WORKGROUP_BYTES, WORKGROUP_THREADS, shaders};
use naga::{
    AddressSpace, Module, StorageAccess,
    valid::{Capabilities, ModuleInfo, ValidationFlags, Validator},
};

const DOCS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/gpu.md");
const BEGIN: &str = "<!-- limits: begin -->\n";
const END: &str = "<!-- limits: end -->\n";

/// Resources that an entry point needs.
#[derive(Clone, Copy)]
struct Needs {
    threads: u32,
    workgroup_bytes: u32,
    storage_buffers: u32,
    /// Storage buffers among these that are written.
    written: u32,
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
            written: 0,
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
                AddressSpace::Storage { access } => {
                    needs.storage_buffers += 1;
                    needs.written += u32::from(access.contains(StorageAccess::STORE));
                }
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

/// One row for an entry point: the most that any of its variants takes.
fn table() -> String {
    let mut rows: BTreeMap<String, Needs> = BTreeMap::new();
    for ((entry, _), needs) in all() {
        let most = rows.entry(entry).or_insert(needs);
        most.threads = most.threads.max(needs.threads);
        most.workgroup_bytes = most.workgroup_bytes.max(needs.workgroup_bytes);
        most.storage_buffers = most.storage_buffers.max(needs.storage_buffers);
        most.written = most.written.max(needs.written);
        most.uniform_buffers = most.uniform_buffers.max(needs.uniform_buffers);
    }
    let mut text = String::from(
        "| entry point | threads | workgroup memory, bytes | storage buffers | written | uniform buffers |\n\
         |---|--:|--:|--:|--:|--:|\n",
    );
    for (entry, needs) in rows {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| `{entry}` | {} | {} | {} | {} | {} |",
            needs.threads,
            needs.workgroup_bytes,
            needs.storage_buffers,
            needs.written,
            needs.uniform_buffers,
        );
    }
    text
}

#[test]
fn the_table_is_what_the_kernels_take() {
    let docs = fs::read_to_string(DOCS).expect("docs/gpu.md");
    let (before, rest) = docs.split_once(BEGIN).expect("where the table begins");
    let (written, after) = rest.split_once(END).expect("where it ends");
    let table = table();
    if std::env::var_os("WRITE_DOCS").is_some() {
        fs::write(DOCS, [before, BEGIN, &table, END, after].concat()).expect("docs are writable");
    } else {
        assert_eq!(written, table, "WRITE_DOCS=1 writes it anew");
    }
}

/// `Gpu` requests exactly the needs of the largest kernels.
#[test]
fn a_device_is_asked_for_what_the_kernels_take_and_no_more() {
    let all = all();
    let most = |of: fn(&Needs) -> u32| all.values().map(of).max();
    assert_eq!(most(|needs| needs.storage_buffers), Some(STORAGE_BUFFERS));
    assert_eq!(most(|needs| needs.workgroup_bytes), Some(WORKGROUP_BYTES));
    assert_eq!(most(|needs| needs.threads), Some(WORKGROUP_THREADS));
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
