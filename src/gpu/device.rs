//! Adapter and device.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError},
};

use super::{
    Kernel,
    kernel::Recipe,
    stopwatch::{KernelTime, Stopwatch},
    tape::TapeMode,
};

/// Error of the device.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// There is no adapter to run on.
    #[error(
        "no Vulkan, Metal or DirectX 12 adapter found ({0}): install a graphics driver, or a software one \
         (Debian: apt-get install mesa-vulkan-drivers)"
    )]
    NoAdapter(String),
    /// No adapter has the name in the environment variable.
    #[error(
        "WGPU_ADAPTER_NAME: no adapter's name contains {wanted:?} (there is: {found}): choose one of these, or unset it"
    )]
    NoSuchAdapter {
        /// Requested name.
        wanted: String,
        /// Names of the adapters.
        found: String,
    },
    /// The adapter refused a device.
    #[error(
        "adapter {adapter}: no device ({reason}): update its driver or choose another with WGPU_ADAPTER_NAME"
    )]
    NoDevice {
        /// The adapter's name.
        adapter: String,
        /// Reason from the driver.
        reason: String,
    },
    /// A field that no kernel shades.
    #[error("no color has {0} channels: gray has 1, a/b 2, RGB 3")]
    NoColor(usize),
    /// A buffer is larger than the adapter can bind.
    #[error("buffer `{label}` needs {needed} bytes but the adapter binds at most {limit}")]
    TooLarge {
        /// Label of the buffer.
        label: String,
        /// Bytes wanted.
        needed: u64,
        /// Bytes that one binding may have.
        limit: u64,
    },
    /// A set of Gaussians needs a buffer that the adapter cannot bind.
    #[error(
        "{splats} Gaussians: buffer `{label}` exceeds the {limit} bytes that the adapter binds; about {fits} would fit"
    )]
    TooManySplats {
        /// Number of Gaussians.
        splats: usize,
        /// Number of Gaussians that would fit, roughly.
        fits: usize,
        /// Label of the buffer.
        label: String,
        /// Bytes that one binding may have.
        limit: u64,
    },
    /// A training needs more than it was allowed.
    #[error(
        "{splats} Gaussians and their tile lists need {} MiB of the device but may take {}", needed.div_ceil(1 << 20), limit >> 20
    )]
    OverLimit {
        /// Number of Gaussians.
        splats: usize,
        /// Bytes wanted.
        needed: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// The device was lost or a read-back failed.
    #[error(
        "device {0}: work on it failed ({1}): its memory may be full or the driver may have reset; run again with fewer splats or smaller images"
    )]
    Lost(String, String),
    /// A training that had no room is asked to go on.
    #[error(
        "the training had no room on the device and cannot continue: start it again with fewer Gaussians"
    )]
    NoWorkspace,
}

impl GpuError {
    /// Adds the number of Gaussians to an error of a buffer that grows with the set, and how many
    /// of these `splats` would fit.
    #[must_use]
    pub fn of_splats(self, splats: usize) -> Self {
        match self {
            Self::TooLarge {
                label,
                needed,
                limit,
            } => Self::TooManySplats {
                splats,
                fits: (splats as f64 * limit as f64 / needed as f64) as usize,
                label,
                limit,
            },
            other => other,
        }
    }
}

/// Storage buffers that a kernel binds, at most. WebGPU promises 8, and every Metal, D3D12 and
/// desktop Vulkan device has more; browsers offer 10.
pub const STORAGE_BUFFERS: u32 = 9;

/// Workgroup memory of a kernel in bytes, at most, each variable rounded up to 16: the shares of
/// a batch in `blend_backward` for RGB. WebGPU promises 16,384; Metal and D3D12 have 32,768.
pub const WORKGROUP_BYTES: u32 = 23_344;

/// Threads of a workgroup, at most: what WebGPU promises.
pub const WORKGROUP_THREADS: u32 = 256;

/// Tiles that one dispatch of blending or its adjoint takes on a device of this kind, so that
/// none comes near the two seconds after which Windows resets a GPU (docs/gpu.md has the
/// estimate). As many as fill a large GPU; fewer on one that shares the processor's memory or
/// that nothing is known of. Nobody watches a processor.
pub const fn default_tiles_at_once(device: wgpu::DeviceType) -> usize {
    match device {
        wgpu::DeviceType::Cpu => usize::MAX,
        wgpu::DeviceType::DiscreteGpu => 8192,
        _ => 2048,
    }
}

/// A device and its queue, cheap to clone.
#[derive(Clone)]
pub struct Gpu {
    inner: Arc<Inner>,
    patch: Option<Patch>,
    stopwatch: Option<Arc<Mutex<Stopwatch>>>,
    tape_mode: Option<Arc<TapeMode>>,
    tiles_at_once: usize,
    most_bound: u64,
}

/// A kernel changed on purpose.
#[derive(Clone, Copy)]
struct Patch {
    kernel: &'static str,
    from: &'static str,
    to: &'static str,
}

struct Inner {
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: wgpu::AdapterInfo,
    /// Error reported by the device, such as memory exhaustion.
    failed: Arc<OnceLock<String>>,
    /// Compiled kernels: drivers without a cache take up to a second for one.
    kernels: Mutex<HashMap<Recipe, Kernel>>,
}

impl Gpu {
    /// Opens the fastest adapter, or the one that `WGPU_ADAPTER_NAME` names.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`], [`GpuError::NoSuchAdapter`] or [`GpuError::NoDevice`].
    pub fn open() -> Result<Self, GpuError> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
        // What is dispatched indirectly is folded below the limits by the kernel that counts it
        // (`shaders/common/groups.wgsl`); the check would put a kernel before each dispatch.
        descriptor
            .flags
            .remove(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL);
        let instance = wgpu::Instance::new(descriptor);
        let adapter = pollster::block_on(Self::adapter(&instance))?;
        let info = adapter.get_info();
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("gs-chroma"),
            // The adapter's own limits: large scenes need large bindings.
            required_limits: adapter.limits(),
            // For `--timings`; nothing else needs it.
            required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
            ..Default::default()
        }))
        .map_err(|error| GpuError::NoDevice {
            adapter: info.name.clone(),
            reason: error.to_string(),
        })?;
        let failed = Arc::<OnceLock<String>>::default();
        let told = failed.clone();
        // wgpu would panic. What it says here is an error of whoever reads next.
        device.on_uncaptured_error(Arc::new(move |error| {
            let words = error.to_string().replace('\n', " ");
            let _first = told.set(words);
        }));
        Self::with(device, queue, info, failed)
    }

    /// The device of a program that has one already, such as a viewer's; `info` is its
    /// adapter's. It should have been made with the adapter's own limits: large scenes need
    /// large bindings.
    ///
    /// # Errors
    /// [`GpuError::NoDevice`] when it was made for less than kernels need: [`STORAGE_BUFFERS`],
    /// [`WORKGROUP_BYTES`], [`WORKGROUP_THREADS`].
    pub fn on(
        device: wgpu::Device,
        queue: wgpu::Queue,
        info: wgpu::AdapterInfo,
    ) -> Result<Self, GpuError> {
        // Its program hears of errors that nobody waits for.
        Self::with(device, queue, info, Arc::default())
    }

    fn with(
        device: wgpu::Device,
        queue: wgpu::Queue,
        info: wgpu::AdapterInfo,
        failed: Arc<OnceLock<String>>,
    ) -> Result<Self, GpuError> {
        let limits = device.limits();
        let needs = [
            (
                "storage buffers",
                STORAGE_BUFFERS,
                limits.max_storage_buffers_per_shader_stage,
            ),
            (
                "bytes of workgroup memory",
                WORKGROUP_BYTES,
                limits.max_compute_workgroup_storage_size,
            ),
            (
                "threads in a workgroup",
                WORKGROUP_THREADS,
                limits.max_compute_invocations_per_workgroup,
            ),
        ];
        let lacking = needs.into_iter().find(|(_, need, allowed)| allowed < need);
        if let Some((what, need, allowed)) = lacking {
            return Err(GpuError::NoDevice {
                adapter: info.name,
                reason: format!("kernels need {need} {what}, it allows {allowed}"),
            });
        }
        Ok(Self {
            tiles_at_once: default_tiles_at_once(info.device_type),
            most_bound: u64::MAX,
            inner: Arc::new(Inner {
                device,
                queue,
                info,
                failed,
                kernels: Mutex::default(),
            }),
            patch: None,
            stopwatch: None,
            tape_mode: None,
        })
    }

    /// The same device with another name and driver.
    pub(super) fn named(&self, name: &str) -> Self {
        let Inner {
            device,
            queue,
            info,
            failed,
            ..
        } = &*self.inner;
        let info = wgpu::AdapterInfo {
            name: name.to_owned(),
            driver: String::new(),
            driver_info: String::new(),
            ..info.clone()
        };
        Self {
            inner: Arc::new(Inner {
                device: device.clone(),
                queue: queue.clone(),
                info,
                failed: failed.clone(),
                kernels: Mutex::default(),
            }),
            ..self.clone()
        }
    }

    pub(super) fn with_tape_mode(&self, tape_mode: TapeMode) -> Self {
        Self {
            tape_mode: Some(Arc::new(tape_mode)),
            ..self.clone()
        }
    }

    pub(super) fn tape_mode(&self) -> Option<&TapeMode> {
        self.tape_mode.as_deref()
    }

    /// Compiled kernels.
    pub(super) fn kernels(&self) -> MutexGuard<'_, HashMap<Recipe, Kernel>> {
        let kernels = self.inner.kernels.lock();
        kernels.unwrap_or_else(PoisonError::into_inner)
    }

    /// Tiles that one dispatch of blending or its adjoint takes.
    pub fn tiles_at_once(&self) -> usize {
        self.tiles_at_once
    }

    /// The same device, whose dispatches take so many tiles: for tests that show that it makes
    /// no difference.
    #[doc(hidden)]
    #[must_use]
    pub fn with_tiles_at_once(&self, tiles_at_once: usize) -> Self {
        Self {
            tiles_at_once,
            ..self.clone()
        }
    }

    /// The same device as if it bound no more than so many bytes: for tests of what is larger.
    #[doc(hidden)]
    #[must_use]
    pub fn with_binding_limit(&self, most_bound: u64) -> Self {
        Self {
            most_bound,
            ..self.clone()
        }
    }

    /// The same device, on which every dispatch recorded from now on is timed.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn timed(&self) -> Result<Self, GpuError> {
        let stopwatch = Stopwatch::new(self)?;
        Ok(Self {
            stopwatch: Some(Arc::new(Mutex::new(stopwatch))),
            ..self.clone()
        })
    }

    /// [`Self::open`], and [`Self::timed`] where that is asked for.
    ///
    /// # Errors
    /// As these.
    pub fn open_timed(timed: bool) -> Result<Self, GpuError> {
        let gpu = Self::open()?;
        if timed { gpu.timed() } else { Ok(gpu) }
    }

    /// Time of each kernel since the last call, in order of first use; empty unless the device is
    /// [`Self::timed`]. Waits for the device.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn timings(&self) -> Result<Vec<KernelTime>, GpuError> {
        match self.stopwatch() {
            Some(mut stopwatch) => stopwatch.take(self),
            None => Ok(Vec::new()),
        }
    }

    pub(super) fn stopwatch(&self) -> Option<MutexGuard<'_, Stopwatch>> {
        let stopwatch = self.stopwatch.as_ref()?;
        Some(stopwatch.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The same device, on which kernel `kernel` will be compiled with `from`
    /// replaced by `to`: for tests that show that a broken kernel is noticed.
    #[doc(hidden)]
    pub fn with_broken(&self, kernel: &'static str, from: &'static str, to: &'static str) -> Self {
        Self {
            patch: Some(Patch { kernel, from, to }),
            ..self.clone()
        }
    }

    /// The source of `kernel` as [`Self::with_broken`] wants it, if it wants it changed.
    pub(super) fn broken(&self, kernel: &str, source: &str) -> Option<String> {
        let patch = self.patch.as_ref()?;
        let concerned = patch.kernel == kernel && source.contains(patch.from);
        concerned.then(|| source.replace(patch.from, patch.to))
    }

    async fn adapter(instance: &wgpu::Instance) -> Result<wgpu::Adapter, GpuError> {
        if let Some(wanted) = std::env::var_os("WGPU_ADAPTER_NAME") {
            // wgpu's own helper panics where none matches.
            let wanted = wanted.to_string_lossy().into_owned();
            let adapters = instance.enumerate_adapters(wgpu::Backends::all()).await;
            let name = |adapter: &wgpu::Adapter| adapter.get_info().name;
            let matches = |adapter: &&wgpu::Adapter| {
                name(adapter)
                    .to_lowercase()
                    .contains(&wanted.to_lowercase())
            };
            return match adapters.iter().find(matches) {
                Some(adapter) => Ok(adapter.clone()),
                None => Err(GpuError::NoSuchAdapter {
                    found: adapters.iter().map(name).collect::<Vec<_>>().join(", "),
                    wanted,
                }),
            };
        }
        instance
            .request_adapter(&wgpu::RequestAdapterOptions {
                power_preference: wgpu::PowerPreference::HighPerformance,
                ..Default::default()
            })
            .await
            .map_err(|error| GpuError::NoAdapter(error.to_string()))
    }

    /// The wgpu device.
    pub fn device(&self) -> &wgpu::Device {
        &self.inner.device
    }

    /// The wgpu queue.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.inner.queue
    }

    /// The adapter's name, driver and kind.
    pub fn info(&self) -> &wgpu::AdapterInfo {
        &self.inner.info
    }

    /// The adapter's name and driver on one line.
    pub fn describe(&self) -> String {
        let info = self.info();
        format!("{} ({} {})", info.name, info.driver, info.driver_info)
    }

    /// Returns true if the adapter is a software one.
    pub fn is_software(&self) -> bool {
        self.inner.info.device_type == wgpu::DeviceType::Cpu
    }

    /// The largest buffer that one binding may have, in bytes.
    pub fn binding_limit(&self) -> u64 {
        let limits = self.inner.device.limits();
        limits
            .max_storage_buffer_binding_size
            .min(limits.max_buffer_size)
            .min(self.most_bound)
    }

    /// Bytes that live buffers take on the device at present, where the backend tells.
    pub fn allocated_bytes(&self) -> Option<u64> {
        let report = self.inner.device.generate_allocator_report()?;
        Some(report.total_allocated_bytes)
    }

    /// Waits until all submitted work is done.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn wait(&self) -> Result<(), GpuError> {
        self.inner
            .device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|error| GpuError::Lost(self.describe(), error.to_string()))?;
        match self.inner.failed.get() {
            None => Ok(()),
            Some(words) => Err(GpuError::Lost(self.describe(), words.clone())),
        }
    }
}
