//! Buffers in named arenas, and moving data in and out of them. One kind of memory on unified devices (mapped,
//! no copy), device-local memory with a staging copy elsewhere.

use std::sync::Arc;

use ash::vk;
use bytemuck::Pod;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator};
use physvideo_kernels::{AnyBuf, Buf};

use crate::device::Gpu;
use crate::error::{GpuError, Named};
use crate::recording::Recording;

pub(crate) struct Memory {
    device: Arc<ash::Device>,
    allocator: Option<Allocator>,
    unified: bool,
    /// Most texels of a buffer.
    max_texels: u64,
    buffers: Vec<Option<Buffer>>,
    staging: Option<Buffer>,
    in_use: u64,
    peak: u64,
}

struct Buffer {
    name: String,
    arena: &'static str,
    handle: vk::Buffer,
    allocation: Allocation,
    bytes: u64,
    /// Made when a kernel first reads it as texels.
    texels: Option<vk::BufferView>,
}

impl Memory {
    pub(crate) fn new(device: Arc<ash::Device>, allocator: Allocator, unified: bool, max_texels: u64) -> Self {
        let (allocator, buffers) = (Some(allocator), Vec::new());
        Self { device, allocator, unified, max_texels, buffers, staging: None, in_use: 0, peak: 0 }
    }

    fn make(
        &mut self,
        name: &str,
        arena: &'static str,
        bytes: u64,
        location: MemoryLocation,
    ) -> Result<Buffer, GpuError> {
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER
            | vk::BufferUsageFlags::INDIRECT_BUFFER
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST;
        let create = vk::BufferCreateInfo::default().size(bytes).usage(usage);
        let handle = unsafe { self.device.create_buffer(&create, None) }.named("create a buffer")?;
        let requirements = unsafe { self.device.get_buffer_memory_requirements(handle) };
        let allocator = self.allocator.as_mut().ok_or(GpuError::NoDevice("closed".into()))?;
        let made = allocator.allocate(&AllocationCreateDesc {
            name,
            requirements,
            location,
            linear: true,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        });
        let allocation = made.map_err(|source| {
            unsafe { self.device.destroy_buffer(handle, None) };
            GpuError::Memory { name: name.into(), source }
        })?;
        unsafe { self.device.bind_buffer_memory(handle, allocation.memory(), allocation.offset()) }
            .named("bind memory")?;
        self.in_use += bytes;
        self.peak = self.peak.max(self.in_use);
        Ok(Buffer { name: name.into(), arena, handle, allocation, bytes, texels: None })
    }

    fn release(&mut self, buffer: Buffer) {
        unsafe {
            if let Some(view) = buffer.texels {
                self.device.destroy_buffer_view(view, None);
            }
            self.device.destroy_buffer(buffer.handle, None);
        }
        self.in_use -= buffer.bytes;
        if let Some(allocator) = self.allocator.as_mut() {
            // A failed free leaks memory of a closing device; there is nobody to tell.
            let _ = allocator.free(buffer.allocation);
        }
    }

    pub(crate) fn free(&mut self, buf: AnyBuf) {
        if let Some(buffer) = self.buffers.get_mut(buf.id as usize).and_then(Option::take) {
            self.release(buffer);
        }
    }

    fn get(&self, buf: AnyBuf) -> Result<&Buffer, GpuError> {
        let found = self.buffers.get(buf.id as usize).and_then(Option::as_ref);
        found.ok_or_else(|| GpuError::Call { kernel: "memory".into(), message: format!("buffer {} was freed", buf.id) })
    }

    pub(crate) fn handle(&self, buf: AnyBuf) -> Result<vk::Buffer, GpuError> {
        self.get(buf).map(|b| b.handle)
    }

    /// A buffer seen as texels of four words.
    pub(crate) fn texels(&mut self, buf: AnyBuf) -> Result<vk::BufferView, GpuError> {
        let (handle, bytes) = self.get(buf).map(|b| (b.handle, b.bytes))?;
        let found = &mut self.buffers[buf.id as usize].as_mut().ok_or(GpuError::NoDevice("closed".into()))?.texels;
        if let Some(view) = found {
            return Ok(*view);
        }
        if bytes > self.max_texels.saturating_mul(16) {
            let name = self.get(buf).map(|b| b.name.clone()).unwrap_or_default();
            return Err(GpuError::TooLarge { name, need: bytes, available: self.max_texels.saturating_mul(16) });
        }
        let info =
            vk::BufferViewCreateInfo::default().buffer(handle).format(vk::Format::R32G32B32A32_UINT).range(bytes);
        let view = unsafe { self.device.create_buffer_view(&info, None) }.named("view of a buffer")?;
        *found = Some(view);
        Ok(view)
    }

    pub(crate) fn destroy(&mut self) {
        let all: Vec<Buffer> = self.buffers.iter_mut().filter_map(Option::take).chain(self.staging.take()).collect();
        for buffer in all {
            self.release(buffer);
        }
        self.allocator = None;
    }
}

impl Gpu {
    /// A zeroed buffer of `len` elements in an arena (`"run"` lives as long as the run, `"scratch"` is freed between
    /// stages). A length of zero is rounded up to one element, since Vulkan has no empty buffers.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] before anything is allocated, or the allocator's refusal.
    pub fn alloc<T: Pod>(&self, arena: &'static str, name: &str, len: u64) -> Result<Buf<T>, GpuError> {
        let len = len.max(1);
        let bytes = (size_of::<T>() as u64).saturating_mul(len);
        let available = self.info.max_buffer.min(self.info.memory);
        if bytes > available {
            return Err(GpuError::TooLarge { name: name.into(), need: bytes, available });
        }
        let mut memory = self.memory.borrow_mut();
        let location = if memory.unified { MemoryLocation::CpuToGpu } else { MemoryLocation::GpuOnly };
        let buffer = memory.make(name, arena, bytes.next_multiple_of(16), location)?;
        let id = u32::try_from(memory.buffers.len()).unwrap_or(u32::MAX);
        memory.buffers.push(Some(buffer));
        drop(memory);
        let buf = Buf::new(id, len);
        let mut clear = Recording::new("clear");
        clear.fill(buf, 0);
        self.run(&clear)?;
        Ok(buf)
    }

    /// A buffer holding `data`.
    ///
    /// # Errors
    /// As [`Gpu::alloc`].
    pub fn upload<T: Pod>(&self, arena: &'static str, name: &str, data: &[T]) -> Result<Buf<T>, GpuError> {
        let buf = self.alloc(arena, name, data.len() as u64)?;
        self.write(buf, 0, data)?;
        Ok(buf)
    }

    /// Writes `data` from element `offset` on. The device must not be using the buffer.
    ///
    /// # Errors
    /// When it does not fit.
    pub fn write<T: Pod>(&self, buf: Buf<T>, offset: u64, data: &[T]) -> Result<(), GpuError> {
        self.touch(
            buf.erase(),
            offset.saturating_mul(size_of::<T>() as u64),
            size_of_val(data) as u64,
            |mapped| {
                mapped.copy_from_slice(bytemuck::cast_slice(data));
            },
            true,
        )
    }

    /// Reads the whole buffer.
    ///
    /// # Errors
    /// When the buffer was freed or the device refuses.
    pub fn read<T: Pod>(&self, buf: Buf<T>) -> Result<Vec<T>, GpuError> {
        self.read_range(buf, 0, buf.len())
    }

    /// Reads `len` elements from `offset` on.
    ///
    /// # Errors
    /// When the range is outside the buffer.
    pub fn read_range<T: Pod>(&self, buf: Buf<T>, offset: u64, len: u64) -> Result<Vec<T>, GpuError> {
        let bytes = size_of::<T>() as u64;
        let mut out = Vec::new();
        self.touch(
            buf.erase(),
            offset.saturating_mul(bytes),
            len.saturating_mul(bytes),
            |mapped| out = bytemuck::pod_collect_to_vec(mapped),
            false,
        )?;
        Ok(out)
    }

    /// Looks at `len` elements from `offset` on: in place where the host and the device share memory, else at a copy.
    /// `look` must not use the device.
    ///
    /// # Errors
    /// When the range is outside the buffer.
    pub fn view<T: Pod, R>(
        &self,
        buf: Buf<T>,
        offset: u64,
        len: u64,
        look: impl FnOnce(&[T]) -> R,
    ) -> Result<Option<R>, GpuError> {
        let bytes = size_of::<T>() as u64;
        let mut seen = None;
        self.touch(
            buf.erase(),
            offset.saturating_mul(bytes),
            len.saturating_mul(bytes),
            |mapped| seen = Some(look(bytemuck::cast_slice(mapped))),
            false,
        )?;
        Ok(seen)
    }

    fn touch(
        &self,
        buf: AnyBuf,
        offset: u64,
        bytes: u64,
        act: impl FnOnce(&mut [u8]),
        write: bool,
    ) -> Result<(), GpuError> {
        if bytes == 0 {
            return Ok(());
        }
        let mut memory = self.memory.borrow_mut();
        let memory = &mut *memory;
        let buffer = memory.buffers.get_mut(buf.id as usize).and_then(Option::as_mut);
        let Some(buffer) = buffer.filter(|b| offset.checked_add(bytes).is_some_and(|end| end <= b.bytes)) else {
            return Err(GpuError::Call {
                kernel: "memory".into(),
                message: format!("{bytes} bytes at {offset} are outside buffer {}", buf.id),
            });
        };
        let lost = || GpuError::Call { kernel: "memory".into(), message: "memory is not mapped".into() };
        let size = usize::try_from(bytes).map_err(|_| lost())?;
        if memory.unified {
            let start = usize::try_from(offset).map_err(|_| lost())?;
            act(&mut buffer.allocation.mapped_slice_mut().ok_or_else(lost)?[start..start + size]);
            return Ok(());
        }
        let device_buffer = buffer.handle;
        if memory.staging.as_ref().is_none_or(|s| s.bytes < bytes) {
            if let Some(old) = memory.staging.take() {
                memory.release(old);
            }
            memory.staging =
                Some(memory.make("staging", "staging", bytes.next_power_of_two(), MemoryLocation::GpuToCpu)?);
        }
        let staging = memory.staging.as_mut().ok_or_else(lost)?;
        let host = staging.handle;
        let mapped = &mut staging.allocation.mapped_slice_mut().ok_or_else(lost)?[..size];
        if write {
            act(mapped);
            return self.copy_now(host, 0, device_buffer, offset, bytes);
        }
        self.copy_now(device_buffer, offset, host, 0, bytes)?;
        act(mapped);
        Ok(())
    }

    /// Frees every buffer of an arena; nothing recorded over them may run again.
    pub fn free_arena(&self, arena: &str) {
        let mut memory = self.memory.borrow_mut();
        for i in 0..memory.buffers.len() {
            if memory.buffers[i].as_ref().is_some_and(|b| b.arena == arena)
                && let Some(buffer) = memory.buffers[i].take()
            {
                memory.release(buffer);
            }
        }
    }

    /// Bytes in use now and at most so far.
    pub fn memory_used(&self) -> (u64, u64) {
        let memory = self.memory.borrow();
        (memory.in_use, memory.peak)
    }

    /// Name, arena and size of every buffer, for reports and tests.
    pub fn buffers(&self) -> Vec<(String, &'static str, u64)> {
        self.memory.borrow().buffers.iter().flatten().map(|b| (b.name.clone(), b.arena, b.bytes)).collect()
    }
}
