//! Opens the device the tests run on. Knows nothing of kernels.

use physvideo_gpu::{DeviceInfo, DeviceKind, Gpu, Options, list_devices};

/// Names a device (index or part of its name) to run the tests on instead of the software device.
pub const DEVICE_VARIABLE: &str = "PHYSVIDEO_TEST_DEVICE";

/// The options tests use: the software device where there is one, validation with synchronization checks, and
/// indices clamped in kernels.
///
/// # Panics
/// With one sentence when this machine has no Vulkan device: tests never skip.
pub fn options() -> Options {
    let devices = devices();
    let software = devices.iter().find(|d| d.kind == DeviceKind::Cpu).map(|d| d.index.to_string());
    let device = std::env::var(DEVICE_VARIABLE).ok().or(software);
    Options { device, validation: true, bounds_checks: true, ..Default::default() }
}

/// The device the tests run on, under validation.
///
/// # Panics
/// As [`options`].
pub fn gpu() -> Gpu {
    open(options())
}

/// A device opened with other options.
///
/// # Panics
/// When it does not open.
pub fn open(options: Options) -> Gpu {
    Gpu::new(options).unwrap_or_else(|e| panic!("the tests need a Vulkan device and got none: {e}"))
}

fn devices() -> Vec<DeviceInfo> {
    list_devices().unwrap_or_else(|e| panic!("the tests need a Vulkan device and got none: {e}"))
}
