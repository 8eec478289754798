//! Compiled entry points of shaders.

/// One compiled entry point; clones share it.
#[derive(Clone)]
pub struct Kernel {
    pub(super) pipeline: wgpu::ComputePipeline,
    pub(super) layout: wgpu::BindGroupLayout,
    pub(super) name: &'static str,
    pub(super) source: &'static str,
    pub(super) constants: Vec<(String, f64)>,
}

/// Key of a compiled entry point: its name, its source, and the bits of its overridable constants.
pub(super) type Recipe = (&'static str, &'static str, Vec<(String, u64)>);

impl Kernel {
    /// Compiles `broken` in the place of `source`, if there is one.
    pub fn compile(
        device: &wgpu::Device,
        name: &'static str,
        source: &'static str,
        broken: Option<String>,
        constants: &[(&str, f64)],
    ) -> Self {
        let describe = |source| wgpu::ShaderModuleDescriptor {
            label: Some(name),
            source: wgpu::ShaderSource::Wgsl(source),
        };
        let module = match broken {
            Some(broken) => device.create_shader_module(describe(broken.into())),
            // SAFETY: without loop bounding a shader must not loop for ever, without
            // division checks it must not divide an integer by zero. The sources are
            // this crate's own: every loop counts towards a bound that its body does
            // not move, and every integer divisor is a constant or a size that the
            // host makes at least 1. Bounds checks stay on.
            None => unsafe {
                device.create_shader_module_trusted(
                    describe(source.into()),
                    wgpu::ShaderRuntimeChecks {
                        force_loop_bounding: false,
                        int_div_checks: false,
                        ..wgpu::ShaderRuntimeChecks::checked()
                    },
                )
            },
        };
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(name),
            layout: None,
            module: &module,
            entry_point: Some(name),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants,
                // Every kernel writes its workgroup memory before it reads it.
                zero_initialize_workgroup_memory: false,
            },
            cache: None,
        });
        Self {
            layout: pipeline.get_bind_group_layout(0),
            pipeline,
            name,
            source,
            constants: (constants.iter())
                .map(|&(name, value)| (name.to_owned(), value))
                .collect(),
        }
    }
}
