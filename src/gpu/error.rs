//! Errors of the device.

/// Error of the device.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// There is no adapter to run on.
    #[error(
        "no Vulkan, Metal or DirectX 12 adapter found ({0}): install the graphics driver, or a software one \
         (Debian, Ubuntu: apt-get install mesa-vulkan-drivers libvulkan1; Fedora: dnf install \
         mesa-vulkan-drivers vulkan-loader; macOS and Windows bring theirs, virtual machines may lack it)"
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
