//! Adapter and device.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError},
};

use super::{
    error::GpuError,
    pipeline::{Kernel, Recipe},
    stopwatch::{KernelTime, Stopwatch},
    tape::{Tape, TapeMode},
};

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
    simd: bool,
    most_bound: u64,
}

/// A kernel changed on purpose.
#[derive(Clone, Copy)]
struct Patch {
    kernel: &'static str,
    from: &'static str,
    to: &'static str,
}

#[derive(Clone)]
struct Inner {
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: wgpu::AdapterInfo,
    /// Error reported by the device, such as memory exhaustion.
    failed: Arc<OnceLock<String>>,
    /// Compiled kernels: drivers without a cache take up to a second for one.
    kernels: Arc<Mutex<HashMap<Recipe, Kernel>>>,
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
            simd: info.device_type == wgpu::DeviceType::Cpu,
            most_bound: u64::MAX,
            inner: Arc::new(Inner {
                device,
                queue,
                info,
                failed,
                kernels: Arc::default(),
            }),
            patch: None,
            stopwatch: None,
            tape_mode: None,
        })
    }

    /// The same device with another name and driver.
    fn named(&self, name: &str) -> Self {
        let mut inner = (*self.inner).clone();
        inner.info.name = name.to_owned();
        inner.info.driver.clear();
        inner.info.driver_info.clear();
        Self {
            inner: Arc::new(inner),
            ..self.clone()
        }
    }

    /// The same device, on which everything from now on is written down.
    #[doc(hidden)]
    #[must_use]
    pub fn taped(&self) -> Self {
        Self {
            tape_mode: Some(Arc::new(TapeMode::Recording(Mutex::default()))),
            ..self.clone()
        }
    }

    /// Takes the recording so far; empty unless the device is [`Self::taped`].
    #[doc(hidden)]
    pub fn take_tape(&self) -> Tape {
        self.tape()
            .map(|mut tape| std::mem::take(&mut *tape))
            .unwrap_or_default()
    }

    /// The same device under another name, whose reads give `answers`, one after the other:
    /// what another device answered to a tape of the same requests.
    #[doc(hidden)]
    #[must_use]
    pub fn answering(&self, name: &str, answers: Vec<Vec<u8>>) -> Self {
        let answers = TapeMode::Answering(Mutex::new(answers.into()));
        Self {
            tape_mode: Some(Arc::new(answers)),
            ..self.named(name)
        }
    }

    pub(super) fn tape(&self) -> Option<MutexGuard<'_, Tape>> {
        match self.tape_mode.as_deref()? {
            TapeMode::Recording(tape) => Some(tape.lock().unwrap_or_else(PoisonError::into_inner)),
            TapeMode::Answering(_) => None,
        }
    }

    /// Returns true if another device's answers replace computation on this one.
    pub(super) fn answers(&self) -> bool {
        matches!(self.tape_mode.as_deref(), Some(TapeMode::Answering(_)))
    }

    /// The next answer in the device's place, empty where there is none left.
    pub(super) fn answer(&self) -> Option<Vec<u8>> {
        match self.tape_mode.as_deref()? {
            TapeMode::Recording(_) => None,
            TapeMode::Answering(answers) => {
                let mut answers = answers.lock().unwrap_or_else(PoisonError::into_inner);
                Some(answers.pop_front().unwrap_or_default())
            }
        }
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

    /// Returns true if blending and its adjoint run as suits the vector registers of a processor:
    /// on software devices.
    pub fn simd(&self) -> bool {
        self.simd
    }

    /// The same device with the kernels for a processor or those for a GPU: for tests of both.
    #[doc(hidden)]
    #[must_use]
    pub fn with_simd(&self, simd: bool) -> Self {
        Self {
            simd,
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
    #[must_use]
    pub fn timed(&self) -> Self {
        let stopwatch = Stopwatch::new(self.device());
        Self {
            stopwatch: Some(Arc::new(Mutex::new(stopwatch))),
            ..self.clone()
        }
    }

    /// [`Self::open`], and [`Self::timed`] where that is asked for.
    ///
    /// # Errors
    /// As there.
    pub fn open_timed(timed: bool) -> Result<Self, GpuError> {
        let gpu = Self::open()?;
        Ok(if timed { gpu.timed() } else { gpu })
    }

    /// Time of each kernel since the last call, in order of first use; empty unless the device is
    /// [`Self::timed`]. Waits for the device.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn timings(&self) -> Result<Vec<KernelTime>, GpuError> {
        match self.stopwatch() {
            Some(mut stopwatch) => {
                stopwatch.read_later(self.device(), self.queue());
                self.wait()?;
                let times = stopwatch.take(self.queue().get_timestamp_period());
                times.map_err(|reason| self.lost(reason))
            }
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
            .map_err(|error| self.lost(error))?;
        match self.inner.failed.get() {
            None => Ok(()),
            Some(words) => Err(self.lost(words)),
        }
    }

    pub(super) fn lost(&self, reason: impl ToString) -> GpuError {
        GpuError::Lost(self.describe(), reason.to_string())
    }
}
