//! Chooses and opens one device with one compute queue. Knows nothing of kernels but the features they need.

use std::cell::RefCell;
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex};

use ash::vk;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use physvideo_kernels::Feature;

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

/// Kind of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceKind {
    /// A graphics card.
    Discrete,
    /// A GPU sharing the host's memory.
    Integrated,
    /// A software device.
    Cpu,
    /// Anything else.
    Other,
}

/// What a device is and can do.
#[derive(Clone, Debug)]
pub struct DeviceInfo {
    /// Position in the driver's list.
    pub index: usize,
    /// Name.
    pub name: String,
    /// Driver and its version.
    pub driver: String,
    /// Kind.
    pub kind: DeviceKind,
    /// Features it offers.
    pub features: Vec<Feature>,
    /// Size of its largest device-local heap [bytes].
    pub memory: u64,
    /// Largest storage buffer [bytes].
    pub max_buffer: u64,
    /// Lanes of a subgroup.
    pub subgroup_size: u32,
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

struct Opened {
    entry: ash::Entry,
    instance: ash::Instance,
    found: Vec<(vk::PhysicalDevice, DeviceInfo)>,
}

/// The devices of this machine.
///
/// # Errors
/// [`GpuError::NoDevice`] when there is no loader or no device.
pub fn list_devices() -> Result<Vec<DeviceInfo>, GpuError> {
    let opened = open_instance(false)?;
    let infos = opened.found.into_iter().map(|(_, info)| info).collect();
    unsafe { opened.instance.destroy_instance(None) };
    Ok(infos)
}

/// The device that [`Gpu::new`] would open, without opening it; `asked` as in [`Options::device`].
///
/// # Errors
/// [`GpuError::NoDevice`] or [`GpuError::UnknownDevice`].
pub fn choose_device(asked: Option<&str>) -> Result<DeviceInfo, GpuError> {
    let opened = open_instance(false)?;
    let chosen = choose(&opened.found, asked).map(|index| opened.found[index].1.clone());
    unsafe { opened.instance.destroy_instance(None) };
    chosen
}

fn open_instance(validation: bool) -> Result<Opened, GpuError> {
    let entry =
        unsafe { ash::Entry::load() }.map_err(|e| GpuError::NoDevice(format!("the Vulkan loader is missing ({e})")))?;
    let app = vk::ApplicationInfo::default().application_name(c"physvideo-engine").api_version(vk::API_VERSION_1_2);
    let offered = unsafe { entry.enumerate_instance_extension_properties(None) }.named("instance extensions")?;
    let has = |name: &CStr| offered.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
    let mut extensions = Vec::new();
    let mut flags = vk::InstanceCreateFlags::empty();
    if has(ash::khr::portability_enumeration::NAME) {
        extensions.push(ash::khr::portability_enumeration::NAME.as_ptr());
        flags |= vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR;
    }
    let mut layers = Vec::new();
    if validation {
        let layer = c"VK_LAYER_KHRONOS_validation";
        let there = unsafe { entry.enumerate_instance_layer_properties() }.named("instance layers")?;
        if !there.iter().any(|l| l.layer_name_as_c_str() == Ok(layer)) {
            return Err(GpuError::NoDevice(
                "the validation layer was asked for and is not installed (vulkan-validationlayers)".into(),
            ));
        }
        layers.push(layer.as_ptr());
        extensions.push(ash::ext::debug_utils::NAME.as_ptr());
    }
    let checks = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&checks);
    let mut create = vk::InstanceCreateInfo::default()
        .application_info(&app)
        .enabled_extension_names(&extensions)
        .enabled_layer_names(&layers)
        .flags(flags);
    if validation {
        create = create.push_next(&mut features);
    }
    let instance = unsafe { entry.create_instance(&create, None) }
        .map_err(|e| GpuError::NoDevice(format!("no Vulkan instance ({e})")))?;
    let physical = unsafe { instance.enumerate_physical_devices() }.unwrap_or_default();
    let found: Vec<_> =
        physical.into_iter().enumerate().filter_map(|(i, p)| Some((p, describe(&instance, p, i)?))).collect();
    if found.is_empty() {
        unsafe { instance.destroy_instance(None) };
        return Err(GpuError::NoDevice("the loader lists no device of Vulkan 1.2 with a compute queue".into()));
    }
    Ok(Opened { entry, instance, found })
}

fn describe(instance: &ash::Instance, physical: vk::PhysicalDevice, index: usize) -> Option<DeviceInfo> {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver).push_next(&mut subgroup);
    unsafe { instance.get_physical_device_properties2(physical, &mut properties) };
    let base = properties.properties;
    if base.api_version < vk::API_VERSION_1_2 {
        return None;
    }
    queue_family(instance, physical)?;
    let mut features12 = vk::PhysicalDeviceVulkan12Features::default();
    let mut atomic = vk::PhysicalDeviceShaderAtomicFloatFeaturesEXT::default();
    let has_atomic = has_extension(instance, physical, ash::ext::shader_atomic_float::NAME);
    let mut zero = vk::PhysicalDeviceZeroInitializeWorkgroupMemoryFeatures::default();
    let has_zero = has_extension(instance, physical, ash::khr::zero_initialize_workgroup_memory::NAME);
    let mut features2 = vk::PhysicalDeviceFeatures2::default().push_next(&mut features12);
    if has_zero {
        features2 = features2.push_next(&mut zero);
    }
    if has_atomic {
        features2 = features2.push_next(&mut atomic);
    }
    unsafe { instance.get_physical_device_features2(physical, &mut features2) };
    let base_features = features2.features;
    let wanted = vk::SubgroupFeatureFlags::BASIC
        | vk::SubgroupFeatureFlags::VOTE
        | vk::SubgroupFeatureFlags::ARITHMETIC
        | vk::SubgroupFeatureFlags::BALLOT
        | vk::SubgroupFeatureFlags::SHUFFLE
        | vk::SubgroupFeatureFlags::SHUFFLE_RELATIVE;
    let mut features = Vec::new();
    if subgroup.supported_operations.contains(wanted)
        && subgroup.supported_stages.contains(vk::ShaderStageFlags::COMPUTE)
    {
        features.push(Feature::Subgroup);
    }
    if base_features.shader_int64 == vk::TRUE {
        features.push(Feature::Int64);
    }
    if base_features.shader_int64 == vk::TRUE && features12.shader_buffer_int64_atomics == vk::TRUE {
        features.push(Feature::Int64Atomic);
    }
    if atomic.shader_buffer_float32_atomic_add == vk::TRUE {
        features.push(Feature::FloatAtomic);
    }
    if features12.shader_float16 == vk::TRUE {
        features.push(Feature::Float16);
    }
    if zero.shader_zero_initialize_workgroup_memory == vk::TRUE {
        features.push(Feature::ZeroedWorkgroup);
    }
    let heaps = unsafe { instance.get_physical_device_memory_properties(physical) };
    let memory = heaps.memory_heaps[..heaps.memory_heap_count as usize]
        .iter()
        .filter(|h| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))
        .map(|h| h.size)
        .max()
        .unwrap_or(0);
    let text = |raw: &[std::ffi::c_char]| {
        let bytes: Vec<u8> = raw.iter().map(|c| c.cast_unsigned()).take_while(|c| *c != 0).collect();
        String::from_utf8_lossy(&bytes).into_owned()
    };
    Some(DeviceInfo {
        index,
        name: text(&base.device_name),
        driver: format!("{} {}", text(&driver.driver_name), text(&driver.driver_info)),
        kind: match base.device_type {
            vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
            vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
            vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
            _ => DeviceKind::Other,
        },
        features,
        memory,
        max_buffer: u64::from(base.limits.max_storage_buffer_range),
        subgroup_size: subgroup.subgroup_size,
    })
}

fn has_extension(instance: &ash::Instance, physical: vk::PhysicalDevice, name: &CStr) -> bool {
    unsafe { instance.enumerate_device_extension_properties(physical) }
        .is_ok_and(|list| list.iter().any(|e| e.extension_name_as_c_str() == Ok(name)))
}

fn queue_family(instance: &ash::Instance, physical: vk::PhysicalDevice) -> Option<u32> {
    let families = unsafe { instance.get_physical_device_queue_family_properties(physical) };
    families.iter().position(|f| f.queue_flags.contains(vk::QueueFlags::COMPUTE)).and_then(|i| u32::try_from(i).ok())
}

fn choose(found: &[(vk::PhysicalDevice, DeviceInfo)], asked: Option<&str>) -> Result<usize, GpuError> {
    let Some(asked) = asked else {
        return Ok(found.iter().position(|(_, d)| d.kind == DeviceKind::Discrete).unwrap_or(0));
    };
    let by_index = asked.parse::<usize>().ok().and_then(|i| found.iter().position(|(_, d)| d.index == i));
    let lower = asked.to_lowercase();
    let by_name = || found.iter().position(|(_, d)| !lower.is_empty() && d.name.to_lowercase().contains(&lower));
    by_index.or_else(by_name).ok_or_else(|| GpuError::UnknownDevice {
        asked: asked.into(),
        found: found.iter().map(|(_, d)| format!("{} {}", d.index, d.name)).collect::<Vec<_>>().join(", "),
    })
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
            memory: RefCell::new(Memory::new(device.clone(), allocator, unified)),
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
