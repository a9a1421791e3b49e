//! Which devices there are, what each offers, and which one is taken. Opens none.

use std::ffi::CStr;

use ash::vk;
use physvideo_kernels::Feature;

use crate::error::{GpuError, Named};

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

pub(crate) struct Opened {
    pub(crate) entry: ash::Entry,
    pub(crate) instance: ash::Instance,
    pub(crate) found: Vec<(vk::PhysicalDevice, DeviceInfo)>,
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

/// The device that [`crate::Gpu::new`] would open, without opening it; `asked` as in [`crate::Options::device`].
///
/// # Errors
/// [`GpuError::NoDevice`] or [`GpuError::UnknownDevice`].
pub fn choose_device(asked: Option<&str>) -> Result<DeviceInfo, GpuError> {
    let opened = open_instance(false)?;
    let chosen = choose(&opened.found, asked).map(|index| opened.found[index].1.clone());
    unsafe { opened.instance.destroy_instance(None) };
    chosen
}

pub(crate) fn open_instance(validation: bool) -> Result<Opened, GpuError> {
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

pub(crate) fn has_extension(instance: &ash::Instance, physical: vk::PhysicalDevice, name: &CStr) -> bool {
    unsafe { instance.enumerate_device_extension_properties(physical) }
        .is_ok_and(|list| list.iter().any(|e| e.extension_name_as_c_str() == Ok(name)))
}

pub(crate) fn queue_family(instance: &ash::Instance, physical: vk::PhysicalDevice) -> Option<u32> {
    let families = unsafe { instance.get_physical_device_queue_family_properties(physical) };
    families.iter().position(|f| f.queue_flags.contains(vk::QueueFlags::COMPUTE)).and_then(|i| u32::try_from(i).ok())
}

pub(crate) fn choose(found: &[(vk::PhysicalDevice, DeviceInfo)], asked: Option<&str>) -> Result<usize, GpuError> {
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
