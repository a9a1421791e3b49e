//! Compiles kernels to SPIR-V with their overrides at run time, once per variant, and keeps the pipelines.

use std::collections::HashMap;
use std::sync::Arc;

use ash::vk;
use physvideo_kernels::{BindingInfo, Feature, KernelInfo};

use crate::device::Gpu;
use crate::error::{GpuError, Named};

/// Values of a kernel's overrides, by name; those not named keep their defaults.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Constants(Vec<(String, f64)>);

impl Constants {
    /// All defaults.
    pub fn none() -> Self {
        Self::default()
    }

    /// With one more value; booleans are 0 and 1.
    #[must_use]
    pub fn with(mut self, name: &str, value: f64) -> Self {
        self.0.retain(|(n, _)| n != name);
        self.0.push((name.into(), value));
        self.0.sort_by(|a, b| a.0.cmp(&b.0));
        self
    }

    /// Only those a kernel declares, so that one set can serve several kernels.
    fn of(&self, kernel: &KernelInfo) -> Self {
        Self(self.0.iter().filter(|(n, _)| kernel.overrides.iter().any(|(o, _)| o == n)).cloned().collect())
    }

    fn key(&self) -> Vec<(String, u64)> {
        self.0.iter().map(|(n, v)| (n.clone(), v.to_bits())).collect()
    }
}

type Key = (&'static str, Vec<(String, u64)>);

#[derive(Clone, Copy)]
pub(crate) struct Pipeline {
    pub(crate) handle: vk::Pipeline,
    pub(crate) layout: vk::PipelineLayout,
    pub(crate) set_layout: vk::DescriptorSetLayout,
}

pub(crate) struct Pipelines {
    device: Arc<ash::Device>,
    made: HashMap<Key, Pipeline>,
    cache: vk::PipelineCache,
}

impl Pipelines {
    pub(crate) fn new(device: Arc<ash::Device>, data: &[u8]) -> Result<Self, GpuError> {
        // A driver ignores data of another driver or version.
        let info = vk::PipelineCacheCreateInfo::default().initial_data(data);
        let cache = unsafe { device.create_pipeline_cache(&info, None) }.named("pipeline cache")?;
        Ok(Self { device, made: HashMap::new(), cache })
    }

    pub(crate) fn destroy(&mut self) {
        unsafe {
            for (_, p) in self.made.drain() {
                self.device.destroy_pipeline(p.handle, None);
                self.device.destroy_pipeline_layout(p.layout, None);
                self.device.destroy_descriptor_set_layout(p.set_layout, None);
            }
            self.device.destroy_pipeline_cache(self.cache, None);
        }
    }
}

/// SPIR-V of a kernel's text with its overrides replaced. `zeroed`: the driver zeroes workgroup memory; else the kernel
/// does, in a loop that takes drivers up to a second to compile.
///
/// # Errors
/// [`GpuError::Compile`] with what naga said and where.
pub fn compile(
    kernel: &KernelInfo,
    text: &str,
    constants: &Constants,
    bounds_checks: bool,
    zeroed: bool,
) -> Result<Vec<u32>, GpuError> {
    use naga::back::spv::{self, ZeroInitializeWorkgroupMemoryMode as Zero};
    use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
    let fail = |message: String| GpuError::Compile { kernel: kernel.name.into(), message };
    let module = naga::front::wgsl::parse_str(text).map_err(|e| fail(e.emit_to_string_with_path(text, kernel.name)))?;
    let mut validator =
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::all());
    let info = validator.validate(&module).map_err(|e| fail(e.emit_to_string_with_path(text, kernel.name)))?;
    let values = constants.0.iter().cloned().collect();
    let entry = (naga::ShaderStage::Compute, "main");
    let (module, info) = naga::back::pipeline_constants::process_overrides(&module, &info, Some(entry), &values)
        .map_err(|e| fail(e.to_string()))?;
    let policy = if bounds_checks { BoundsCheckPolicy::Restrict } else { BoundsCheckPolicy::Unchecked };
    let options = spv::Options {
        lang_version: (1, 4),
        // Names, for validation messages and debuggers.
        flags: if cfg!(debug_assertions) { spv::WriterFlags::DEBUG } else { spv::WriterFlags::empty() },
        bounds_check_policies: BoundsCheckPolicies { index: policy, buffer: policy, ..Default::default() },
        zero_initialize_workgroup_memory: if zeroed { Zero::Native } else { Zero::Polyfill },
        // Costs 30 % in arithmetic loops and several times the compile time; kernels here have bounded loops.
        force_loop_bounding: false,
        use_storage_input_output_16: false,
        ..Default::default()
    };
    let pipeline = spv::PipelineOptions { shader_stage: entry.0, entry_point: entry.1.into() };
    let spirv = spv::write_vec(&module, &info, &options, Some(&pipeline)).map_err(|e| fail(e.to_string()))?;
    Ok(crate::texel::from_1d_textures(&spirv))
}

/// How a binding is bound.
pub(crate) fn descriptor_type(binding: &BindingInfo) -> vk::DescriptorType {
    if binding.texels { vk::DescriptorType::UNIFORM_TEXEL_BUFFER } else { vk::DescriptorType::STORAGE_BUFFER }
}

impl Gpu {
    pub(crate) fn pipeline(&self, kernel: &'static KernelInfo, constants: &Constants) -> Result<Pipeline, GpuError> {
        let constants = constants.of(kernel);
        let key = (kernel.name, constants.key());
        if let Some(found) = self.pipelines.borrow().made.get(&key) {
            return Ok(*found);
        }
        if let Some(missing) = kernel.needs.iter().find(|f| !self.has(**f)) {
            return Err(GpuError::MissingFeature {
                kernel: kernel.name.into(),
                feature: format!("{missing:?}"),
                device: self.info.name.clone(),
            });
        }
        let spirv = compile(
            kernel,
            &self.text(kernel)?,
            &constants,
            self.options.bounds_checks,
            self.has(Feature::ZeroedWorkgroup),
        )?;
        let device = &self.device;
        let bindings: Vec<_> = kernel
            .bindings
            .iter()
            .enumerate()
            .map(|(i, binding)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(u32::try_from(i).unwrap_or(0))
                    .descriptor_type(descriptor_type(binding))
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        let set_layout = unsafe { device.create_descriptor_set_layout(&info, None) }.named("descriptor set layout")?;
        let sets = [set_layout];
        let ranges =
            [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::COMPUTE).size(kernel.immediates)];
        let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
        if kernel.immediates > 0 {
            info = info.push_constant_ranges(&ranges);
        }
        let layout = unsafe { device.create_pipeline_layout(&info, None) }.named("pipeline layout")?;
        let module = vk::ShaderModuleCreateInfo::default().code(&spirv);
        let module = unsafe { device.create_shader_module(&module, None) }.named("shader module")?;
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(c"main");
        let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout)];
        let cache = self.pipelines.borrow().cache;
        let made = unsafe { device.create_compute_pipelines(cache, &info, None) };
        unsafe { device.destroy_shader_module(module, None) };
        let handle = made.map_err(|(_, code)| GpuError::Compile {
            kernel: kernel.name.into(),
            message: format!("the driver says {code}"),
        })?[0];
        let pipeline = Pipeline { handle, layout, set_layout };
        self.pipelines.borrow_mut().made.insert(key, pipeline);
        Ok(pipeline)
    }

    /// The kernel's text: built in, or from the folder of [`crate::Options::wgsl`] in debug builds.
    fn text(&self, kernel: &KernelInfo) -> Result<String, GpuError> {
        match &self.options.wgsl {
            Some(folder) if cfg!(debug_assertions) => physvideo_kernels::reload(folder, kernel.name)
                .map_err(|message| GpuError::Compile { kernel: kernel.name.into(), message }),
            _ => Ok(kernel.source.to_string()),
        }
    }

    /// Names of the kernels compiled so far, once per variant; what a scene does not need is not among them.
    pub fn compiled(&self) -> Vec<&'static str> {
        let mut names: Vec<_> = self.pipelines.borrow().made.keys().map(|k| k.0).collect();
        names.sort_unstable();
        names
    }

    /// The driver's pipeline cache, to be given back as [`crate::Options::pipeline_cache`] next time.
    ///
    /// # Errors
    /// The driver's refusal.
    pub fn pipeline_cache(&self) -> Result<Vec<u8>, GpuError> {
        unsafe { self.device.get_pipeline_cache_data(self.pipelines.borrow().cache) }.named("read the pipeline cache")
    }
}
