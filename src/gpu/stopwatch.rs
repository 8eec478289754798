//! Device time of every dispatch.
//!
//! With timestamp queries each dispatch becomes a compute pass of its own, whose beginning and end
//! the device records without waiting. Devices without them are timed from the host, which submits
//! each dispatch alone and waits for it.

use super::readback::RawReadback;

/// Timestamps of one query set: WebGPU's limit.
const QUERIES: u32 = wgpu::QUERY_SET_MAX_QUERIES;

/// Queries that one recording may need; the set is read when fewer are left.
const SPARE: u32 = QUERIES / 2;

/// Time of one kernel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KernelTime {
    /// Name of the kernel, as in `shaders/`.
    pub kernel: &'static str,
    /// Number of dispatches.
    pub dispatches: u64,
    /// Seconds in all.
    pub seconds: f64,
}

/// Times the dispatches of a device and its clones.
pub(super) struct Stopwatch {
    clock: Clock,
    times: Vec<KernelTime>,
}

enum Clock {
    Device {
        queries: wgpu::QuerySet,
        resolved: wgpu::Buffer,
        /// Kernels whose two timestamps stand in the set, in order.
        claimed: Vec<&'static str>,
        /// Sets that were full, on their way.
        pending: Vec<(Vec<&'static str>, RawReadback)>,
    },
    Host,
}

/// Method of timing a dispatch.
pub(super) enum Timing {
    /// By these two queries.
    Device(wgpu::QuerySet, u32),
    /// Alone, by the host.
    Host,
    /// Not at all: the set is full.
    None,
}

impl Stopwatch {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let clock = if device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            Clock::Device {
                queries: device.create_query_set(&wgpu::QuerySetDescriptor {
                    label: Some("stopwatch"),
                    ty: wgpu::QueryType::Timestamp,
                    count: QUERIES,
                }),
                resolved: device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("timestamps"),
                    size: u64::from(QUERIES) * size_of::<u64>() as u64,
                    usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                    mapped_at_creation: false,
                }),
                claimed: Vec::new(),
                pending: Vec::new(),
            }
        } else {
            Clock::Host
        };
        Self {
            clock,
            times: Vec::new(),
        }
    }

    /// Claims two queries for a dispatch of `kernel`.
    pub(super) fn claim(&mut self, kernel: &'static str) -> Timing {
        match &mut self.clock {
            Clock::Host => Timing::Host,
            Clock::Device {
                queries, claimed, ..
            } => {
                let first = 2 * claimed.len() as u32;
                if first >= QUERIES {
                    return Timing::None;
                }
                claimed.push(kernel);
                Timing::Device(queries.clone(), first)
            }
        }
    }

    /// Returns true if the queries should be read after the current recording.
    pub(super) fn is_filling(&self) -> bool {
        matches!(&self.clock, Clock::Device { claimed, .. } if 2 * claimed.len() as u32 > SPARE)
    }

    /// Orders the timestamps taken so far and makes room for others.
    pub(super) fn read_later(&mut self, device: &wgpu::Device, queue: &wgpu::Queue) {
        let Clock::Device {
            queries,
            resolved,
            claimed,
            pending,
        } = &mut self.clock
        else {
            return;
        };
        if claimed.is_empty() {
            return;
        }
        let mut encoder = device.create_command_encoder(&Default::default());
        let taken = 2 * claimed.len() as u32;
        encoder.resolve_query_set(queries, 0..taken, resolved, 0);
        queue.submit([encoder.finish()]);
        let times = RawReadback::order(device, queue, resolved);
        pending.push((std::mem::take(claimed), times));
    }

    /// Adds the time of a dispatch.
    pub(super) fn add(&mut self, kernel: &'static str, seconds: f64) {
        match self.times.iter_mut().find(|time| time.kernel == kernel) {
            Some(time) => {
                time.dispatches += 1;
                time.seconds += seconds;
            }
            None => self.times.push(KernelTime {
                kernel,
                dispatches: 1,
                seconds,
            }),
        }
    }

    /// Gives the times by kernel in order of first use, and forgets them; the device was waited
    /// for, and its clock ticks every `period` nanoseconds.
    pub(super) fn take(&mut self, period: f32) -> Result<Vec<KernelTime>, String> {
        let sets = match &mut self.clock {
            Clock::Device { pending, .. } => std::mem::take(pending),
            Clock::Host => Vec::new(),
        };
        let period = 1e-9 * f64::from(period);
        for (kernels, readback) in sets {
            let bytes = readback.bytes()?;
            let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&bytes);
            for (kernel, ticks) in kernels.into_iter().zip(ticks.chunks_exact(2)) {
                // A driver may reset its clock in between.
                self.add(kernel, ticks[1].saturating_sub(ticks[0]) as f64 * period);
            }
        }
        Ok(std::mem::take(&mut self.times))
    }
}
