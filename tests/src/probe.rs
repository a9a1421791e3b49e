//! Kernels made by tests on the spot: library functions alone, or small programs for the GPU layer. Knows no kernel
//! that ships.

use physvideo_gpu::kernels::BindingInfo;
use physvideo_gpu::{Feature, KernelInfo};

/// A kernel from WGSL text; `bindings` are name, reads, writes, in the order of their numbers. It lives for ever.
pub fn kernel(
    name: &'static str,
    workgroup: u32,
    source: &str,
    bindings: &[(&'static str, bool, bool)],
    needs: &[Feature],
) -> &'static KernelInfo {
    let bindings = bindings
        .iter()
        .map(|&(name, reads, writes)| BindingInfo { name, reads, writes, element: "u32", bytes: 4, texels: false })
        .collect::<Vec<_>>();
    Box::leak(Box::new(KernelInfo {
        name,
        source: Box::leak(source.to_string().into_boxed_str()),
        workgroup: [workgroup, 1, 1],
        bindings: bindings.leak(),
        overrides: &[],
        immediates: 0,
        needs: needs.to_vec().leak(),
    }))
}
