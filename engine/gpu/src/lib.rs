//! Vulkan once: device, memory, pipelines, recordings, hazards, submission. Knows kernels, and nothing of
//! what they simulate.

mod choice;
mod device;
mod error;
mod hazards;
mod memory;
mod pipeline;
mod recording;
mod submit;
mod texel;

pub use choice::{DeviceInfo, DeviceKind, choose_device, list_devices};
pub use device::{Gpu, Options};
pub use error::GpuError;
pub use hazards::{Step, schedule};
pub use physvideo_kernels as kernels;
pub use physvideo_kernels::{AnyBuf, Buf, Feature, Kernel, KernelInfo};
pub use pipeline::Constants;
#[doc(hidden)]
pub use pipeline::compile;
pub use recording::{Command, Groups, Recording};
pub use submit::{Prepared, Timing};
