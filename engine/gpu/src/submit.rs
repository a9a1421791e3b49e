//! Turns a recording into a command buffer that can be submitted many times, and waits for it.

use ash::vk;

use crate::device::Gpu;
use crate::error::{GpuError, Named};
use crate::hazards::{Step, schedule};
use crate::pipeline::descriptor_type;
use crate::recording::{Command, Groups, Recording};
use physvideo_kernels::Buf;

/// A recording ready to be submitted as often as wanted.
pub struct Prepared<'gpu> {
    gpu: &'gpu Gpu,
    commands: vk::CommandBuffer,
    descriptors: vk::DescriptorPool,
    queries: vk::QueryPool,
    sections: Vec<String>,
    fence: vk::Fence,
    crumbs: Option<(Buf<u32>, Vec<String>)>,
    /// Number of dispatches in it.
    pub dispatches: usize,
}

/// Device time of one section of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Timing {
    /// Name given to the section.
    pub section: String,
    /// Time on the device [ms].
    pub ms: f64,
}

impl Gpu {
    /// Compiles what a recording needs and records it.
    ///
    /// # Errors
    /// A kernel that does not compile or fit, or the driver's refusal.
    pub fn prepare(&self, recording: &Recording) -> Result<Prepared<'_>, GpuError> {
        let calls = recording.commands.iter().filter(|c| matches!(c, Command::Call { .. })).count();
        let sections: Vec<_> = recording
            .commands
            .iter()
            .filter_map(|c| if let Command::Section(n) = c { Some(n.clone()) } else { None })
            .collect();
        // Only calls leave crumbs; the crumbs' own buffer is cleared by a recording without any.
        let crumbs = if self.options.breadcrumbs && calls > 0 {
            Some((self.alloc("breadcrumbs", "breadcrumbs", 1)?, Vec::new()))
        } else {
            None
        };
        let device = &self.device;
        let bound = |texels: bool| -> usize {
            let of =
                |kernel: &physvideo_kernels::KernelInfo| kernel.bindings.iter().filter(|b| b.texels == texels).count();
            recording.commands.iter().map(|c| if let Command::Call { kernel, .. } = c { of(kernel) } else { 0 }).sum()
        };
        let small = |n: usize| u32::try_from(n).unwrap_or(u32::MAX).max(1);
        let sizes = [
            vk::DescriptorPoolSize { ty: vk::DescriptorType::STORAGE_BUFFER, descriptor_count: small(bound(false)) },
            vk::DescriptorPoolSize {
                ty: vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
                descriptor_count: small(bound(true)),
            },
        ];
        let pool = vk::DescriptorPoolCreateInfo::default().max_sets(small(calls)).pool_sizes(&sizes);
        let descriptors = unsafe { device.create_descriptor_pool(&pool, None) }.named("descriptor pool")?;
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::TIMESTAMP)
            .query_count(small(sections.len() + 1));
        let queries = unsafe { device.create_query_pool(&info, None) }.named("query pool")?;
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(self.pool)
            .level(vk::CommandBufferLevel::PRIMARY)
            .command_buffer_count(1);
        let commands = unsafe { device.allocate_command_buffers(&info) }.named("command buffer")?[0];
        let fence = unsafe { device.create_fence(&vk::FenceCreateInfo::default(), None) }.named("fence")?;
        let mut prepared =
            Prepared { gpu: self, commands, descriptors, queries, sections, fence, crumbs, dispatches: calls };
        prepared.record(recording)?;
        Ok(prepared)
    }

    /// Prepares, submits once and waits.
    ///
    /// # Errors
    /// As [`Gpu::prepare`] and [`Prepared::submit`].
    pub fn run(&self, recording: &Recording) -> Result<Vec<Timing>, GpuError> {
        self.prepare(recording)?.submit()
    }

    pub(crate) fn copy_now(
        &self,
        from: vk::Buffer,
        from_offset: u64,
        to: vk::Buffer,
        to_offset: u64,
        bytes: u64,
    ) -> Result<(), GpuError> {
        let device = &self.device;
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(self.pool)
            .level(vk::CommandBufferLevel::PRIMARY)
            .command_buffer_count(1);
        let region = [vk::BufferCopy { src_offset: from_offset, dst_offset: to_offset, size: bytes }];
        unsafe {
            let commands = device.allocate_command_buffers(&info).named("command buffer")?;
            device.begin_command_buffer(commands[0], &vk::CommandBufferBeginInfo::default()).named("begin")?;
            barrier(device, commands[0], vk::PipelineStageFlags::HOST, vk::AccessFlags::HOST_WRITE);
            device.cmd_copy_buffer(commands[0], from, to, &region);
            to_host(device, commands[0]);
            device.end_command_buffer(commands[0]).named("end")?;
            let submit = [vk::SubmitInfo::default().command_buffers(&commands)];
            device.queue_submit(self.queue, &submit, vk::Fence::null()).named("submit a copy")?;
            device.queue_wait_idle(self.queue).named("wait for a copy")?;
            device.free_command_buffers(self.pool, &commands);
        }
        Ok(())
    }
}

impl Prepared<'_> {
    fn record(&mut self, recording: &Recording) -> Result<(), GpuError> {
        let gpu = self.gpu;
        let device = &gpu.device;
        let commands = self.commands;
        unsafe { device.begin_command_buffer(commands, &vk::CommandBufferBeginInfo::default()) }.named("begin")?;
        if !self.sections.is_empty() {
            unsafe {
                device.cmd_reset_query_pool(
                    commands,
                    self.queries,
                    0,
                    u32::try_from(self.sections.len() + 1).unwrap_or(1),
                )
            };
        }
        // Host writes and whatever earlier submissions did come first.
        barrier(device, commands, vk::PipelineStageFlags::HOST, vk::AccessFlags::HOST_WRITE);
        let mut section = 0;
        for step in schedule(&recording.commands) {
            let command = match step {
                Step::Barrier if gpu.options.without_barriers => continue,
                Step::Barrier => {
                    barrier(device, commands, vk::PipelineStageFlags::empty(), vk::AccessFlags::empty());
                    continue;
                }
                Step::Run(i) => &recording.commands[i],
            };
            match command {
                Command::Section(name) => {
                    if section > 0 {
                        self.end_label()
                    }
                    self.begin_label(name);
                    self.stamp(section);
                    section += 1;
                }
                Command::Fill(buf, word) => {
                    let handle = gpu.memory.borrow().handle(*buf)?;
                    unsafe { device.cmd_fill_buffer(commands, handle, 0, vk::WHOLE_SIZE, *word) };
                }
                Command::Copy(from, to, bytes) => {
                    let memory = gpu.memory.borrow();
                    let region = [vk::BufferCopy { src_offset: 0, dst_offset: 0, size: *bytes }];
                    unsafe { device.cmd_copy_buffer(commands, memory.handle(*from)?, memory.handle(*to)?, &region) };
                }
                Command::Call { .. } => self.dispatch(command)?,
            }
        }
        if section > 0 {
            self.end_label();
            self.stamp(section);
        }
        to_host(device, commands);
        unsafe { device.end_command_buffer(commands) }.named("end")
    }

    fn stamp(&self, index: usize) {
        let at = vk::PipelineStageFlags::BOTTOM_OF_PIPE;
        unsafe {
            self.gpu.device.cmd_write_timestamp(self.commands, at, self.queries, u32::try_from(index).unwrap_or(0))
        };
    }

    fn begin_label(&self, name: &str) {
        if let (Some(labels), Ok(name)) = (&self.gpu.labels, std::ffi::CString::new(name)) {
            unsafe {
                labels.cmd_begin_debug_utils_label(self.commands, &vk::DebugUtilsLabelEXT::default().label_name(&name))
            };
        }
    }

    fn end_label(&self) {
        if let Some(labels) = &self.gpu.labels {
            unsafe { labels.cmd_end_debug_utils_label(self.commands) };
        }
    }

    fn dispatch(&mut self, command: &Command) -> Result<(), GpuError> {
        let Command::Call { kernel, constants, bufs, immediates, groups } = command else { return Ok(()) };
        let gpu = self.gpu;
        let device = &gpu.device;
        let pipeline = gpu.pipeline(kernel, constants)?;
        let layouts = [pipeline.set_layout];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.descriptors).set_layouts(&layouts);
        let sets = unsafe { device.allocate_descriptor_sets(&info) }.named("descriptor set")?;
        let mut memory = gpu.memory.borrow_mut();
        let infos = bufs
            .iter()
            .zip(kernel.bindings)
            .map(|(b, binding)| {
                let view = if binding.texels { memory.texels(*b)? } else { vk::BufferView::null() };
                Ok(([vk::DescriptorBufferInfo { buffer: memory.handle(*b)?, offset: 0, range: b.bytes }], [view]))
            })
            .collect::<Result<Vec<_>, GpuError>>()?;
        let writes: Vec<_> = infos
            .iter()
            .zip(kernel.bindings)
            .enumerate()
            .map(|(i, ((info, view), binding))| {
                let write = vk::WriteDescriptorSet::default()
                    .dst_set(sets[0])
                    .dst_binding(u32::try_from(i).unwrap_or(0))
                    .descriptor_type(descriptor_type(binding));
                if binding.texels { write.texel_buffer_view(view) } else { write.buffer_info(info) }
            })
            .collect();
        let breadcrumb = match &mut self.crumbs {
            Some((buf, names)) => {
                names.push(kernel.name.into());
                Some((memory.handle(buf.erase())?, u32::try_from(names.len()).unwrap_or(u32::MAX)))
            }
            None => None,
        };
        unsafe {
            device.update_descriptor_sets(&writes, &[]);
            if let Some((crumb, number)) = breadcrumb {
                barrier(device, self.commands, vk::PipelineStageFlags::empty(), vk::AccessFlags::empty());
                device.cmd_fill_buffer(self.commands, crumb, 0, 4, number);
            }
            device.cmd_bind_pipeline(self.commands, vk::PipelineBindPoint::COMPUTE, pipeline.handle);
            device.cmd_bind_descriptor_sets(
                self.commands,
                vk::PipelineBindPoint::COMPUTE,
                pipeline.layout,
                0,
                &sets,
                &[],
            );
            if !immediates.is_empty() {
                device.cmd_push_constants(self.commands, pipeline.layout, vk::ShaderStageFlags::COMPUTE, 0, immediates);
            }
            match groups {
                Groups::Direct([x, y, z]) => device.cmd_dispatch(self.commands, *x, *y, *z),
                Groups::Indirect(buf, offset) => {
                    device.cmd_dispatch_indirect(self.commands, memory.handle(*buf)?, *offset)
                }
            }
        }
        Ok(())
    }

    /// Submits and waits; device times of its sections.
    ///
    /// # Errors
    /// [`GpuError::Lost`] names the last kernel begun when breadcrumbs are on.
    pub fn submit(&self) -> Result<Vec<Timing>, GpuError> {
        let device = &self.gpu.device;
        let buffers = [self.commands];
        let submit = [vk::SubmitInfo::default().command_buffers(&buffers)];
        let done = unsafe {
            device
                .queue_submit(self.gpu.queue, &submit, self.fence)
                .and_then(|()| device.wait_for_fences(&[self.fence], true, u64::MAX))
                .and_then(|()| device.reset_fences(&[self.fence]))
        };
        if done == Err(vk::Result::ERROR_DEVICE_LOST) {
            return Err(GpuError::Lost { last: self.last_begun() });
        }
        done.named("submit")?;
        if self.sections.is_empty() {
            return Ok(Vec::new());
        }
        let mut ticks = vec![0u64; self.sections.len() + 1];
        unsafe {
            device.get_query_pool_results(
                self.queries,
                0,
                &mut ticks,
                vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT,
            )
        }
        .named("timestamps")?;
        let period = f64::from(self.gpu.timestamp_period) * 1e-6;
        #[expect(clippy::cast_precision_loss, reason = "differences of ticks stay far below 2^53")]
        let times = self
            .sections
            .iter()
            .zip(ticks.windows(2))
            .map(|(name, t)| Timing { section: name.clone(), ms: t[1].wrapping_sub(t[0]) as f64 * period });
        Ok(times.collect())
    }

    fn last_begun(&self) -> String {
        let Some((buf, names)) = &self.crumbs else { return "unknown: run again with breadcrumbs".into() };
        let number = self.gpu.read(*buf).ok().and_then(|v| v.first().copied()).unwrap_or(0) as usize;
        names.get(number.wrapping_sub(1)).cloned().unwrap_or_else(|| "none".into())
    }
}

/// Everything before finishes and is seen by everything after; `stage` and `access` add the host's writes.
fn barrier(device: &ash::Device, commands: vk::CommandBuffer, stage: vk::PipelineStageFlags, access: vk::AccessFlags) {
    let both = vk::PipelineStageFlags::COMPUTE_SHADER | vk::PipelineStageFlags::TRANSFER;
    let memory = [vk::MemoryBarrier::default()
        .src_access_mask(vk::AccessFlags::SHADER_WRITE | vk::AccessFlags::TRANSFER_WRITE | access)
        .dst_access_mask(
            vk::AccessFlags::SHADER_READ
                | vk::AccessFlags::SHADER_WRITE
                | vk::AccessFlags::INDIRECT_COMMAND_READ
                | vk::AccessFlags::TRANSFER_READ
                | vk::AccessFlags::TRANSFER_WRITE,
        )];
    let to = both | vk::PipelineStageFlags::DRAW_INDIRECT;
    // Indirect sizes are read before the dispatch; a later write must wait for that read as well.
    let from = both | vk::PipelineStageFlags::DRAW_INDIRECT | stage;
    unsafe { device.cmd_pipeline_barrier(commands, from, to, vk::DependencyFlags::empty(), &memory, &[], &[]) };
}

/// What the device wrote is seen by the host once it has waited.
fn to_host(device: &ash::Device, commands: vk::CommandBuffer) {
    let memory = [vk::MemoryBarrier::default()
        .src_access_mask(vk::AccessFlags::SHADER_WRITE | vk::AccessFlags::TRANSFER_WRITE)
        .dst_access_mask(vk::AccessFlags::HOST_READ)];
    let from = vk::PipelineStageFlags::COMPUTE_SHADER | vk::PipelineStageFlags::TRANSFER;
    let none = vk::DependencyFlags::empty();
    unsafe { device.cmd_pipeline_barrier(commands, from, vk::PipelineStageFlags::HOST, none, &memory, &[], &[]) };
}

impl Drop for Prepared<'_> {
    fn drop(&mut self) {
        let device = &self.gpu.device;
        unsafe {
            let _ = device.queue_wait_idle(self.gpu.queue);
            device.free_command_buffers(self.gpu.pool, &[self.commands]);
            device.destroy_descriptor_pool(self.descriptors, None);
            device.destroy_query_pool(self.queries, None);
            device.destroy_fence(self.fence, None);
        }
        if let Some((buf, _)) = &self.crumbs {
            self.gpu.memory.borrow_mut().free(buf.erase());
        }
    }
}
