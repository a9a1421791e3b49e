//! What the layer refuses, in which words, and what it leaves behind.

use physvideo_gpu::kernels::KERNELS;
use physvideo_gpu::{Command, Constants, Feature, Gpu, GpuError, Groups, KernelInfo, Options, Recording};
use physvideo_tests::device;

#[test]
fn an_unknown_device_is_named_beside_those_there_are() {
    let there = device::gpu().info.name.clone();
    let error = Gpu::new(Options { device: Some("abacus".into()), ..Default::default() }).err().unwrap();
    let said = error.to_string();
    assert!(
        matches!(error, GpuError::UnknownDevice { .. }) && said.contains("\"abacus\"") && said.contains(&there),
        "{said}"
    );
    assert!(Gpu::new(Options { device: Some("99".into()), ..Default::default() }).is_err());
    assert!(Gpu::new(Options { device: Some(String::new()), ..Default::default() }).is_err());
}

#[test]
fn a_device_is_found_by_number_and_by_part_of_its_name() {
    let info = device::gpu().info.clone();
    let part = info.name[..5].to_uppercase();
    for device in [info.index.to_string(), part] {
        let gpu = Gpu::new(Options { device: Some(device), ..Default::default() }).unwrap();
        assert_eq!((gpu.info.index, &gpu.info.name), (info.index, &info.name));
    }
}

/// Calls a kernel with no workgroups, on buffers of one element.
fn compile_by_running(gpu: &Gpu, kernel: &'static KernelInfo) -> Result<(), GpuError> {
    let mut bufs = Vec::new();
    for b in kernel.bindings {
        bufs.push(gpu.alloc::<u8>("run", b.name, u64::from(b.bytes))?.erase());
    }
    let mut rec = Recording::new("none");
    let (constants, immediates) = (Constants::none(), vec![0; kernel.immediates as usize]);
    rec.commands.push(Command::Call { kernel, constants, bufs, immediates, groups: Groups::Direct([0, 1, 1]) });
    gpu.run(&rec).map(|_| ())
}

/// A device of the smallest sort: every kernel runs on it, or is refused by name before the driver sees it.
#[test]
fn a_device_without_optional_features_runs_or_refuses() {
    let all = vec![
        Feature::Subgroup,
        Feature::Int64,
        Feature::Int64Atomic,
        Feature::FloatAtomic,
        Feature::Float16,
        Feature::ZeroedWorkgroup,
    ];
    let gpu = device::open(Options { without: all.clone(), ..device::options() });
    assert!(gpu.info.features.is_empty());
    let mut refused = 0;
    for kernel in KERNELS {
        match (compile_by_running(&gpu, kernel), kernel.needs.first()) {
            (Ok(()), None) => assert!(gpu.can_run(kernel)),
            (Err(GpuError::MissingFeature { kernel: name, feature, device }), Some(first)) => {
                assert_eq!((name.as_str(), feature), (kernel.name, format!("{first:?}")));
                assert!(!gpu.can_run(kernel) && device == gpu.info.name);
                refused += 1;
            }
            (outcome, needs) => panic!("{}: {outcome:?}, needs {needs:?}", kernel.name),
        }
    }
    assert!(refused > 0, "no kernel needs anything: this test tests nothing");
    assert_eq!(gpu.messages(), Vec::<String>::new());
    // One at a time, only kernels that need it are refused.
    for feature in all {
        let gpu = device::open(Options { without: vec![feature], ..device::options() });
        for kernel in KERNELS {
            assert_eq!(gpu.can_run(kernel), !kernel.needs.contains(&feature), "{} without {feature:?}", kernel.name);
        }
    }
}

#[test]
fn a_buffer_too_large_is_refused_before_anything_is_allocated() {
    let gpu = device::gpu();
    let before = (gpu.memory_used(), gpu.buffers());
    let available = gpu.info.max_buffer.min(gpu.info.memory);
    for (len, need) in
        [(available / 4 + 1, (available / 4 + 1) * 4), (10_000_000_000, 40_000_000_000), (u64::MAX, u64::MAX)]
    {
        let error = gpu.alloc::<u32>("run", "huge", len).unwrap_err();
        let expected = format!("buffer `huge` needs {need} bytes, the device offers {available} at once");
        assert_eq!(error.to_string(), expected);
        assert!(matches!(error, GpuError::TooLarge { .. }));
    }
    assert_eq!((gpu.memory_used(), gpu.buffers()), before);
}

#[test]
fn an_arena_is_freed_whole_and_alone() {
    let gpu = device::gpu();
    let kept = gpu.upload("run", "kept", &[1u32, 2, 3]).unwrap();
    let used = gpu.memory_used().0;
    let gone = gpu.alloc::<u32>("scratch", "gone", 1000).unwrap();
    let _more = gpu.alloc::<u8>("scratch", "more", 5).unwrap();
    assert_eq!(gpu.memory_used().0, used + 4000 + 16, "sizes are whole texels");
    gpu.free_arena("scratch");
    assert_eq!(gpu.memory_used(), (used, used + 4016));
    assert_eq!(gpu.buffers(), [("kept".to_string(), "run", 16)]);
    assert_eq!(gpu.read(kept).unwrap(), [1, 2, 3]);
    assert!(gpu.read(gone).is_err() && gpu.write(gone, 0, &[1]).is_err());
    let mut rec = Recording::new("late");
    rec.fill(gone, 0);
    assert!(gpu.run(&rec).is_err(), "a recording over freed memory ran");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// With memory the host maps, and by way of a staging buffer as on a discrete GPU.
#[test]
fn ranges_are_read_and_written_and_checked() {
    for staged in [false, true] {
        let gpu = device::open(Options { staged, ..device::options() });
        check_ranges(&gpu);
        assert_eq!(gpu.messages(), Vec::<String>::new());
    }
}

fn check_ranges(gpu: &Gpu) {
    let buf = gpu.alloc::<[f32; 4]>("run", "rows", 10).unwrap();
    assert_eq!(gpu.read(buf).unwrap(), vec![[0.0; 4]; 10], "memory comes zeroed");
    gpu.write(buf, 7, &[[7.0; 4], [8.0; 4]]).unwrap();
    assert_eq!(gpu.read_range(buf, 6, 3).unwrap(), [[0.0; 4], [7.0; 4], [8.0; 4]]);
    assert_eq!(gpu.read_range(buf, 10, 0).unwrap(), Vec::<[f32; 4]>::new());
    gpu.write(buf, 10, &[]).unwrap();
    for (offset, len) in [(9, 2), (11, 1), (0, 11), (u64::MAX, 1), (1, u64::MAX), (u64::MAX / 16, 2)] {
        assert!(gpu.read_range(buf, offset, len).is_err(), "read {len} at {offset}");
    }
    for offset in [10, u64::MAX, u64::MAX / 16] {
        assert!(gpu.write(buf, offset, &[[1.0; 4]]).is_err(), "wrote at {offset}");
    }
    let empty = gpu.upload::<u32>("run", "empty", &[]).unwrap();
    assert_eq!(empty.len(), 1, "Vulkan has no empty buffers");
}
