//! The GPU layer on the software device, under validation with synchronization checks.

mod batch;
mod hazards;
mod limits;
mod pipeline;
mod validation;

use physvideo_gpu::{Buf, Command, Constants, Groups, KernelInfo};
use physvideo_tests::probe;

/// `after[i] = before[i] + 1`.
const NEXT: &str = "
    struct Words { d: array<u32> }
    @group(0) @binding(0) var<storage, read> before: Words;
    @group(0) @binding(1) var<storage, read_write> after: Words;
    @compute @workgroup_size(64)
    fn main(@builtin(global_invocation_id) id: vec3u) {
        if (id.x < arrayLength(&after.d)) { after.d[id.x] = before.d[id.x] + 1u; }
    }";

fn next() -> &'static KernelInfo {
    probe::kernel("probe/next", 64, NEXT, &[("before", true, false), ("after", false, true)], &[])
}

fn call(kernel: &'static KernelInfo, bufs: &[Buf<u32>], groups: Groups) -> Command {
    let bufs = bufs.iter().map(|b| b.erase()).collect();
    Command::Call { kernel, constants: Constants::none(), bufs, immediates: vec![], groups }
}
