//! Batches: recorded once, submitted often, cut short by the device itself, timed and followed by breadcrumbs.

use std::time::Instant;

use physvideo_gpu::{Buf, Groups, Options, Recording};
use physvideo_tests::{device, probe};

use super::{call, next};

/// Counts its calls and leaves no workgroups to what follows from the fourth call on.
const TICK: &str = "
    struct Size { x: u32, y: u32, z: u32, ticks: u32 }
    @group(0) @binding(0) var<storage, read_write> size: Size;
    @compute @workgroup_size(1)
    fn main() {
        size.ticks += 1u;
        size.x = select(2u, 0u, size.ticks > 3u);
        size.y = 1u;
        size.z = 1u;
    }";

/// Counts its invocations.
const WORK: &str = "
    struct Total { count: atomic<u32> }
    @group(0) @binding(0) var<storage, read_write> total: Total;
    @compute @workgroup_size(64)
    fn main() { atomicAdd(&total.count, 1u); }";

#[test]
fn the_device_ends_a_batch_by_a_size_of_zero() {
    let gpu = device::gpu();
    let tick = probe::kernel("probe/tick", 1, TICK, &[("size", true, true)], &[]);
    let work = probe::kernel("probe/work", 64, WORK, &[("total", true, true)], &[]);
    let size = gpu.alloc::<u32>("run", "size", 4).unwrap();
    let total = gpu.alloc::<u32>("run", "total", 1).unwrap();
    let mut rec = Recording::new("substeps");
    for _ in 0..8 {
        rec.commands.push(call(tick, &[size], Groups::Direct([1, 1, 1])));
        rec.commands.push(call(work, &[total], Groups::Indirect(size.erase(), 0)));
    }
    let prepared = gpu.prepare(&rec).unwrap();
    assert_eq!(prepared.dispatches, 16);
    for round in 1..=3 {
        prepared.submit().unwrap();
        assert_eq!(gpu.read(size).unwrap(), [0, 1, 1, 8 * round]);
        assert_eq!(gpu.read(total).unwrap(), [3 * 2 * 64], "work was done after the device had said stop");
    }
    drop(prepared);
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn sections_are_timed_one_by_one() {
    let gpu = device::gpu();
    let [a, b] = ["a", "b"].map(|name| gpu.alloc::<u32>("run", name, 1 << 20).unwrap());
    let mut rec = Recording::new("timed");
    for (name, calls) in [("none", 0), ("one", 1), ("many", 12)] {
        rec.section(name);
        for _ in 0..calls {
            rec.commands.push(call(next(), &[a, b], Groups::Direct([1 << 14, 1, 1])));
        }
    }
    let prepared = gpu.prepare(&rec).unwrap();
    prepared.submit().unwrap();
    let begin = Instant::now();
    let times = prepared.submit().unwrap();
    let wall = begin.elapsed().as_secs_f64() * 1e3;
    assert_eq!(times.iter().map(|t| t.section.as_str()).collect::<Vec<_>>(), ["none", "one", "many"]);
    assert!(times.iter().all(|t| t.ms >= 0.0 && t.ms.is_finite()), "{times:?}");
    let sum: f64 = times.iter().map(|t| t.ms).sum();
    // A device may run a little before the host begins to look; far more would be a wrong unit.
    assert!(sum > 0.0 && sum < 1.5 * wall + 1.0, "{sum} ms on the device in {wall} ms");
    assert!(times[2].ms > times[0].ms, "twelve calls took less than none: {times:?}");
    assert!(gpu.run(&Recording::new("no sections")).unwrap().is_empty());
    drop(prepared);
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn breadcrumbs_number_the_dispatches_and_change_nothing() {
    let gpu = device::open(Options { breadcrumbs: true, ..device::options() });
    let [a, b, c] = ["a", "b", "c"].map(|name| gpu.alloc::<u32>("run", name, 64).unwrap());
    let mut rec = Recording::new("followed");
    rec.commands.push(call(next(), &[a, b], Groups::Direct([1, 1, 1])));
    rec.fill(a, 9);
    rec.commands.push(call(next(), &[b, c], Groups::Direct([1, 1, 1])));
    let prepared = gpu.prepare(&rec).unwrap();
    // The crumb is the next buffer made.
    let crumb = Buf::<u32>::new(c.erase().id + 1, 1);
    prepared.submit().unwrap();
    assert_eq!(gpu.read(c).unwrap(), vec![2; 64]);
    assert_eq!(gpu.read(crumb).unwrap(), [2], "the last of two dispatches was begun");
    drop(prepared);
    assert!(gpu.buffers().iter().all(|b| b.1 != "breadcrumbs"), "crumbs outlive their recording");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}
