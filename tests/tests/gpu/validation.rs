//! The layer is silent where all is well, and not where it is not: each silence has its negative control.

use physvideo_gpu::{Command, Gpu, Groups, Options, Recording};
use physvideo_tests::device;

use super::{call, next};

/// A chain in which every command needs the one before: fill, kernel, copy, kernel.
fn chain(gpu: &Gpu) -> (Recording, physvideo_gpu::Buf<u32>) {
    let [a, b, c, d] = ["a", "b", "c", "d"].map(|name| gpu.alloc::<u32>("run", name, 200).unwrap());
    let mut rec = Recording::new("chain");
    rec.section("first");
    rec.fill(a, 5);
    rec.commands.push(call(next(), &[a, b], Groups::Direct([4, 1, 1])));
    rec.section("second");
    rec.copy(b, c);
    rec.commands.push(call(next(), &[c, d], Groups::Direct([4, 1, 1])));
    (rec, d)
}

#[test]
fn a_chain_of_dependent_commands_is_silent_and_right() {
    for staged in [false, true] {
        let gpu = device::open(Options { staged, ..device::options() });
        let (rec, d) = chain(&gpu);
        let prepared = gpu.prepare(&rec).unwrap();
        for _ in 0..3 {
            prepared.submit().unwrap();
            assert_eq!(gpu.read(d).unwrap(), vec![7; 200]);
        }
        drop(prepared);
        assert_eq!(gpu.messages(), Vec::<String>::new());
    }
}

#[test]
fn the_layer_hears_a_missing_barrier() {
    let gpu = device::open(Options { without_barriers: true, ..device::options() });
    let (rec, _) = chain(&gpu);
    gpu.run(&rec).unwrap();
    let messages = gpu.messages();
    assert!(messages.iter().any(|m| m.contains("SYNC-HAZARD-READ-AFTER-WRITE")), "{messages:?}");
}

/// Kernel after kernel, the case that matters most, by itself.
#[test]
fn the_layer_hears_a_missing_barrier_between_two_kernels() {
    for without_barriers in [false, true] {
        let gpu = device::open(Options { without_barriers, ..device::options() });
        let [a, b, c] = ["a", "b", "c"].map(|name| gpu.alloc::<u32>("run", name, 64).unwrap());
        let mut rec = Recording::new("two kernels");
        rec.commands.push(call(next(), &[a, b], Groups::Direct([1, 1, 1])));
        rec.commands.push(call(next(), &[b, c], Groups::Direct([1, 1, 1])));
        gpu.run(&rec).unwrap();
        let heard = gpu.messages().iter().any(|m| m.contains("SYNC-HAZARD"));
        assert_eq!(heard, without_barriers, "{:?}", gpu.messages());
    }
}

#[test]
fn the_layer_hears_wrong_usage() {
    let gpu = device::gpu();
    let [a, b] = ["a", "b"].map(|name| gpu.alloc::<u32>("run", name, 64).unwrap());
    let mut rec = Recording::new("an indirect size where none can lie");
    rec.commands.push(call(next(), &[a, b], Groups::Indirect(a.erase(), 2)));
    let _ = gpu.prepare(&rec);
    let messages = gpu.messages();
    assert!(messages.iter().any(|m| m.contains("VUID-vkCmdDispatchIndirect-offset")), "{messages:?}");
    let mut rec = Recording::new("a copy past the end");
    rec.commands.push(Command::Copy(a.erase(), b.erase(), 300));
    let _ = gpu.prepare(&rec);
    let messages = gpu.messages();
    assert!(messages.iter().any(|m| m.contains("VUID-vkCmdCopyBuffer")), "{messages:?}");
}
