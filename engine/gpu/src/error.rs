//! Everything that can go wrong on the device, in words a user can act on.

use ash::vk;

/// An error of the GPU layer.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// No loader or no device.
    #[error(
        "no Vulkan device: {0}. Install a driver; `apt-get install mesa-vulkan-drivers libvulkan1` gives a software device"
    )]
    NoDevice(String),
    /// `--device` names nothing that is there.
    #[error("no Vulkan device matches {asked:?}; there are: {found}")]
    UnknownDevice {
        /// What was asked for.
        asked: String,
        /// What there is.
        found: String,
    },
    /// More memory asked for than there is; nothing was allocated.
    #[error("buffer `{name}` needs {need} bytes, the device offers {available} at once")]
    TooLarge {
        /// Name of the buffer.
        name: String,
        /// Bytes asked for.
        need: u64,
        /// Bytes available.
        available: u64,
    },
    /// The allocator said no.
    #[error("device memory for buffer `{name}`: {source}")]
    Memory {
        /// Name of the buffer.
        name: String,
        /// What the allocator said.
        #[source]
        source: gpu_allocator::AllocationError,
    },
    /// A kernel needs what the device lacks.
    #[error("kernel `{kernel}` needs {feature}, which {device} does not offer")]
    MissingFeature {
        /// Name of the kernel.
        kernel: String,
        /// Name of the feature.
        feature: String,
        /// Name of the device.
        device: String,
    },
    /// A kernel did not compile.
    #[error("kernel `{kernel}` does not compile: {message}")]
    Compile {
        /// Name of the kernel.
        kernel: String,
        /// What the compiler said.
        message: String,
    },
    /// The device was lost.
    #[error("the device was lost in kernel `{last}` (the last one begun); a watchdog or a driver fault")]
    Lost {
        /// Name of the last kernel begun.
        last: String,
    },
    /// Any other refusal of the driver.
    #[error("Vulkan: {what}: {code}")]
    Vulkan {
        /// The call that failed.
        what: &'static str,
        /// Its code.
        code: vk::Result,
    },
    /// A call that does not fit its kernel: an empty buffer, a wrong override.
    #[error("call of `{kernel}`: {message}")]
    Call {
        /// Name of the kernel.
        kernel: String,
        /// What does not fit.
        message: String,
    },
}

/// Names the failed call.
pub(crate) trait Named<T> {
    fn named(self, what: &'static str) -> Result<T, GpuError>;
}

impl<T> Named<T> for Result<T, vk::Result> {
    fn named(self, what: &'static str) -> Result<T, GpuError> {
        self.map_err(|code| GpuError::Vulkan { what, code })
    }
}
