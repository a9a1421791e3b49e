//! What the GPU runs: every kernel of `wgsl/`, its reflected interface and its plain data. Knows no Vulkan and
//! does no I/O (but for [`reload`], which debug builds use to read edited WGSL).

use std::marker::PhantomData;

use bytemuck::Pod;

#[path = "../build/expand.rs"]
mod expand;

include!(concat!(env!("OUT_DIR"), "/kernels.rs"));

/// A buffer on the device as plain data: an index the GPU layer knows, and its length in elements.
#[derive(Debug)]
pub struct Buf<T> {
    id: u32,
    len: u64,
    element: PhantomData<fn() -> T>,
}

impl<T> Clone for Buf<T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T> Copy for Buf<T> {}

impl<T: Pod> Buf<T> {
    /// For the GPU layer, which hands out ids.
    pub fn new(id: u32, len: u64) -> Self {
        Self { id, len, element: PhantomData }
    }
    /// Length in elements.
    pub fn len(self) -> u64 {
        self.len
    }
    /// True when it holds no element.
    pub fn is_empty(self) -> bool {
        self.len == 0
    }
    /// Without its element type.
    pub fn erase(self) -> AnyBuf {
        AnyBuf { id: self.id, bytes: self.len * size_of::<T>() as u64 }
    }
    /// The same memory seen as elements of another type; the size in bytes must be a whole number of them.
    pub fn cast<U: Pod>(self) -> Buf<U> {
        Buf::new(self.id, self.erase().bytes / size_of::<U>() as u64)
    }
}

/// A buffer without its element type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AnyBuf {
    /// Index in the GPU layer.
    pub id: u32,
    /// Size [bytes].
    pub bytes: u64,
}

/// A feature a device may lack.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Feature {
    /// Subgroup arithmetic and shuffles.
    Subgroup,
    /// 64-bit integers.
    Int64,
    /// 64-bit atomics in storage buffers.
    Int64Atomic,
    /// Native f32 atomic addition in storage buffers.
    FloatAtomic,
    /// 16-bit floats.
    Float16,
    /// Workgroup memory that the driver sets to zero; without it kernels do so themselves, and compile longer.
    ZeroedWorkgroup,
}

/// A member of a family of functions (`material`, `field`, `shape`), of which a scene compiles those it uses.
#[derive(Clone, Copy, Debug)]
pub struct Member {
    /// The family.
    pub family: &'static str,
    /// Its number, by which data choose it.
    pub kind: u32,
    /// The override that compiles it in.
    pub flag: &'static str,
}

/// What the build read from a kernel's WGSL file.
#[derive(Debug)]
pub struct KernelInfo {
    /// Path under `wgsl/` without ending, for example `mpm/p2g`.
    pub name: &'static str,
    /// Whole WGSL text, imports included.
    pub source: &'static str,
    /// Workgroup size.
    pub workgroup: [u32; 3],
    /// Buffers of group 0 by binding number.
    pub bindings: &'static [BindingInfo],
    /// Overrides: name and WGSL type.
    pub overrides: &'static [(&'static str, &'static str)],
    /// Size of the immediates [bytes], 0 when there are none.
    pub immediates: u32,
    /// Features without which it cannot run.
    pub needs: &'static [Feature],
}

/// One buffer of a kernel, with the access the code really makes.
#[derive(Debug)]
pub struct BindingInfo {
    /// Name in WGSL.
    pub name: &'static str,
    /// Loaded from, or used atomically.
    pub reads: bool,
    /// Stored to, or used atomically.
    pub writes: bool,
    /// Rust type of an element.
    pub element: &'static str,
    /// Size of an element [bytes].
    pub bytes: u32,
    /// Read as texels of four words (declared as `texture_1d<u32>`).
    pub texels: bool,
}

/// A call of a kernel: which buffers, which constants.
pub trait Kernel {
    /// What is called.
    const INFO: &'static KernelInfo;
    /// Its buffers, by binding number.
    fn bufs(&self) -> Vec<AnyBuf>;
    /// Its constants.
    fn immediates(&self) -> &[u8];
}

/// The kernel called `name`.
pub fn find(name: &str) -> Option<&'static KernelInfo> {
    KERNELS.iter().copied().find(|k| k.name == name)
}

/// The text of a kernel read anew from a folder of WGSL files, imports included.
///
/// # Errors
/// A sentence naming the file that could not be read.
pub fn reload(folder: &std::path::Path, name: &str) -> Result<String, String> {
    expand::expand(folder, name).map(|source| source.text)
}
