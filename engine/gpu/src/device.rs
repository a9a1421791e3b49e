//! Opens one device with one compute queue. Knows nothing of kernels but the features they need.

use std::cell::RefCell;
use std::ffi::c_void;
use std::sync::{Arc, Mutex};

use ash::vk;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use physvideo_kernels::Feature;

use crate::choice::{DeviceInfo, DeviceKind, Opened, choose, has_extension, open_instance, queue_family};
use crate::error::{GpuError, Named};
use crate::memory::Memory;
use crate::pipeline::Pipelines;

/// How to open a device.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Index or part of a name; absent: the first discrete GPU, else the first device.
    pub device: Option<String>,
    /// Validation layer with synchronization checks; its messages are kept in [`Gpu::messages`].
    pub validation: bool,
    /// Write a marker before every dispatch, so that a lost device can be blamed on a kernel.
    pub breadcrumbs: bool,
    /// Clamp out-of-range indices in kernels (tests); release runs trust them.
    pub bounds_checks: bool,
    /// Features to act as if they were missing, to test fallbacks.
    pub without: Vec<Feature>,
    /// Read kernels from this folder instead of the built-in text (debug builds only).
    pub wgsl: Option<std::path::PathBuf>,
    /// Contents of an earlier [`Gpu::pipeline_cache`].
    pub pipeline_cache: Vec<u8>,
    /// Leave out every derived barrier: for tests that show what the validation layer then says.
    #[doc(hidden)]
    pub without_barriers: bool,
    /// Keep buffers where the host cannot reach them, as on a discrete GPU, on any device: for tests.
    #[doc(hidden)]
    pub staged: bool,
}

/// An open device.
pub struct Gpu {
    /// What it is.
    pub info: DeviceInfo,
    pub(crate) options: Options,
    pub(crate) memory: RefCell<Memory>,
    pub(crate) pipelines: RefCell<Pipelines>,
    pub(crate) timestamp_period: f32,
    pub(crate) labels: Option<ash::ext::debug_utils::Device>,
    pub(crate) device: Arc<ash::Device>,
    pub(crate) queue: vk::Queue,
    pub(crate) pool: vk::CommandPool,
    messages: Arc<Mutex<Vec<String>>>,
    messenger: Option<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    instance: ash::Instance,
    _entry: ash::Entry,
}

impl Gpu {
    /// Opens a device.
    ///
    /// # Errors
    /// [`GpuError::NoDevice`], [`GpuError::UnknownDevice`] or the driver's refusal.
    pub fn new(options: Options) -> Result<Self, GpuError> {
        let Opened { entry, instance, found } = open_instance(options.validation)?;
        let chosen = match choose(&found, options.device.as_deref()) {
            Ok(chosen) => chosen,
            Err(e) => {
                unsafe { instance.destroy_instance(None) };
                return Err(e);
            }
        };
        let (physical, mut info) = found[chosen].clone();
        info.features.retain(|f| !options.without.contains(f));
        let messages = Arc::new(Mutex::new(Vec::new()));
        let messenger = if options.validation { Some(listen(&entry, &instance, &messages)?) } else { None };
        let family = queue_family(&instance, physical).unwrap_or(0);
        let device = Arc::new(open_device(&instance, physical, family, &info)?);
        let labels = options.validation.then(|| ash::ext::debug_utils::Device::new(&instance, &device));
        let queue = unsafe { device.get_device_queue(family, 0) };
        let pool = vk::CommandPoolCreateInfo::default()
            .queue_family_index(family)
            .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
        let pool = unsafe { device.create_command_pool(&pool, None) }.named("command pool")?;
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.clone(),
            device: (*device).clone(),
            physical_device: physical,
            debug_settings: gpu_allocator::AllocatorDebugSettings::default(),
            buffer_device_address: false,
            allocation_sizes: gpu_allocator::AllocationSizes::default(),
        })
        .map_err(|source| GpuError::Memory { name: "allocator".into(), source })?;
        let unified = info.kind != DeviceKind::Discrete && !options.staged;
        let limits = unsafe { instance.get_physical_device_properties(physical) }.limits;
        let pipelines = Pipelines::new(device.clone(), &options.pipeline_cache)?;
        Ok(Self {
            memory: RefCell::new(Memory::new(
                device.clone(),
                allocator,
                unified,
                u64::from(limits.max_texel_buffer_elements),
            )),
            pipelines: RefCell::new(pipelines),
            timestamp_period: limits.timestamp_period,
            info,
            options,
            labels,
            device,
            queue,
            pool,
            messages,
            messenger,
            instance,
            _entry: entry,
        })
    }

    /// Messages of the validation layer so far; empty without `validation`.
    pub fn messages(&self) -> Vec<String> {
        self.messages.lock().map(|m| m.clone()).unwrap_or_default()
    }

    /// True when the device offers a feature (and it is not masked by [`Options::without`]).
    pub fn has(&self, feature: Feature) -> bool {
        self.info.features.contains(&feature)
    }

    /// True when every feature a kernel needs is there.
    pub fn can_run(&self, kernel: &physvideo_kernels::KernelInfo) -> bool {
        kernel.needs.iter().all(|f| self.has(*f))
    }
}

fn open_device(
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
    family: u32,
    info: &DeviceInfo,
) -> Result<ash::Device, GpuError> {
    let has = |f: Feature| info.features.contains(&f);
    let priorities = [1.0];
    let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&priorities)];
    let mut extensions = Vec::new();
    let portability = c"VK_KHR_portability_subset";
    if has_extension(instance, physical, portability) {
        extensions.push(portability.as_ptr());
    }
    let base = vk::PhysicalDeviceFeatures::default().shader_int64(has(Feature::Int64));
    let mut zero = vk::PhysicalDeviceZeroInitializeWorkgroupMemoryFeatures::default()
        .shader_zero_initialize_workgroup_memory(true);
    let mut features12 = vk::PhysicalDeviceVulkan12Features::default()
        .shader_buffer_int64_atomics(has(Feature::Int64Atomic))
        .shader_float16(has(Feature::Float16));
    let mut atomic = vk::PhysicalDeviceShaderAtomicFloatFeaturesEXT::default()
        .shader_buffer_float32_atomics(true)
        .shader_buffer_float32_atomic_add(true);
    let mut create =
        vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_features(&base).push_next(&mut features12);
    if has(Feature::FloatAtomic) {
        extensions.push(ash::ext::shader_atomic_float::NAME.as_ptr());
        create = create.push_next(&mut atomic);
    }
    if has(Feature::ZeroedWorkgroup) {
        extensions.push(ash::khr::zero_initialize_workgroup_memory::NAME.as_ptr());
        create = create.push_next(&mut zero);
    }
    create = create.enabled_extension_names(&extensions);
    unsafe { instance.create_device(physical, &create, None) }.named("open the device")
}

type Messenger = (ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT);

fn listen(entry: &ash::Entry, instance: &ash::Instance, into: &Arc<Mutex<Vec<String>>>) -> Result<Messenger, GpuError> {
    let utils = ash::ext::debug_utils::Instance::new(entry, instance);
    let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR | vk::DebugUtilsMessageSeverityFlagsEXT::WARNING)
        .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE)
        .pfn_user_callback(Some(on_message))
        .user_data(Arc::as_ptr(into).cast_mut().cast());
    let made = unsafe { utils.create_debug_utils_messenger(&info, None) }.named("debug messenger")?;
    Ok((utils, made))
}

unsafe extern "system" fn on_message(
    _: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // The Arc this points to lives as long as the Gpu, which destroys the messenger first.
    let list = unsafe { &*user.cast::<Mutex<Vec<String>>>() };
    let text = unsafe { (*data).message_as_c_str() }.map_or_else(String::new, |c| c.to_string_lossy().into_owned());
    tracing::warn!(target: "vulkan", "{text}");
    if let Ok(mut list) = list.lock() {
        list.push(text);
    }
    vk::FALSE
}

impl Drop for Gpu {
    fn drop(&mut self) {
        unsafe {
            let _ = self.device.device_wait_idle();
            self.memory.get_mut().destroy();
            self.pipelines.get_mut().destroy();
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
            if let Some((utils, messenger)) = self.messenger.take() {
                utils.destroy_debug_utils_messenger(messenger, None);
            }
            self.instance.destroy_instance(None);
        }
    }
}
