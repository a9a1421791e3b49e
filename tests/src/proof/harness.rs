//! Runs a case on a device: error against its twin, guard zones, repeats, time. Knows no kernel by name.

use std::time::Instant;

use physvideo_gpu::kernels::{AnyBuf, KernelInfo, find as find_kernel};
use physvideo_gpu::{Buf, Command, Gpu, Recording};

use super::{Ask, Buffers, Call, Case, Report};

/// Bytes behind the contents of every buffer that no kernel may change.
const GUARD: usize = 8192;
/// What may lie there: NaN as f32 and an index no buffer has; a tiny number and an index every buffer has.
pub const PATTERNS: [u32; 2] = [0x7fc0_dead, 1];
/// Sizes around those of workgroups.
pub const SIZES: [usize; 6] = [0, 1, 63, 64, 65, 1000];

/// Runs a call on buffers longer than it may touch, with `pattern` behind their ends; their contents afterwards.
///
/// # Errors
/// A sentence naming the kernel and the buffer: written behind its end, or written though it is only read.
pub fn run(gpu: &Gpu, case: &Case, call: &Call, pattern: u32) -> Result<Buffers, String> {
    let name = case.kernel;
    let kernel = find_kernel(name).ok_or_else(|| format!("{name}: there is no such kernel"))?;
    gpu.free_arena("proof");
    let mut bufs: Vec<Buf<u8>> = Vec::new();
    for binding in kernel.bindings {
        let of = call.buffer_of(binding.name);
        if of != binding.name {
            continue;
        }
        let mut padded = call.buffers.bytes(of).to_vec();
        if !padded.len().is_multiple_of(binding.bytes as usize) {
            return Err(format!("{name}: `{}` is not a whole number of {}", binding.name, binding.element));
        }
        padded.extend(pattern.to_le_bytes().iter().cycle().take(GUARD));
        bufs.push(gpu.upload("proof", binding.name, &padded).map_err(|e| format!("{name}: {e}"))?);
    }
    let own: Vec<_> = kernel.bindings.iter().filter(|b| call.buffer_of(b.name) == b.name).collect();
    let mut recording = Recording::new(name);
    recording.commands.push(Command::Call {
        kernel,
        constants: call.constants.clone(),
        bufs: bound(kernel, call, &bufs),
        immediates: call.immediates.clone(),
        groups: call.dispatch(),
    });
    gpu.run(&recording).map_err(|e| format!("{name}: {e}"))?;
    let mut out = Buffers::default();
    for (binding, buf) in own.into_iter().zip(&bufs) {
        let bytes = gpu.read(*buf).map_err(|e| format!("{name}: {e}"))?;
        let before = call.buffers.bytes(binding.name);
        let (contents, guard) = bytes.split_at(before.len());
        if let Some(at) = guard.chunks(4).position(|word| word != pattern.to_le_bytes()) {
            return Err(format!("{name}: wrote behind the end of `{}`, {} bytes on", binding.name, at * 4));
        }
        if !binding.writes && contents != before {
            return Err(format!("{name}: changed `{}`, which it only reads", binding.name));
        }
        out.set(binding.name, contents);
    }
    Ok(out)
}

/// The buffers by binding; `own` has one for each binding that is not another's.
fn bound(kernel: &KernelInfo, call: &Call, own: &[Buf<u8>]) -> Vec<AnyBuf> {
    let names: Vec<_> = kernel.bindings.iter().map(|b| b.name).filter(|n| call.buffer_of(n) == *n).collect();
    let of = |name| names.iter().position(|n| *n == call.buffer_of(name)).map(|i| own[i].erase());
    kernel.bindings.iter().filter_map(|b| of(b.name)).collect()
}

/// Runs a case and compares it with its twin; the errors found, all within the tolerance. None are found where the
/// device's subgroups are too small for the kernel.
///
/// # Errors
/// A sentence naming the kernel, the output, the size and seed, and the tolerance with its reason.
pub fn prove(gpu: &Gpu, case: &Case, ask: Ask) -> Result<Vec<Report>, String> {
    let call = (case.inputs)(ask);
    if gpu.info.subgroup_size < call.lanes {
        return Ok(Vec::new());
    }
    let out = run(gpu, case, &call, PATTERNS[0]).map_err(|e| format!("{e} ({ask:?})"))?;
    let reports: Vec<_> = (case.compare)(&call, &out).iter().map(super::Compared::report).collect();
    match reports.iter().find(|r| r.max > case.tolerance) {
        None => Ok(reports),
        Some(bad) => Err(format!("{}: {bad}, over {:.1e} ({}); {ask:?}", case.kernel, case.tolerance, case.reason)),
    }
}

/// Runs a case twice, with other things behind its buffers; every output but the unordered ones has the same bits.
///
/// # Errors
/// A sentence naming the kernel and the buffer.
pub fn repeat(gpu: &Gpu, case: &Case, ask: Ask) -> Result<(), String> {
    let call = (case.inputs)(ask);
    if gpu.info.subgroup_size < call.lanes {
        return Ok(());
    }
    let (first, second) = (run(gpu, case, &call, PATTERNS[0])?, run(gpu, case, &call, PATTERNS[1])?);
    let kernel = find_kernel(case.kernel).ok_or_else(|| format!("{}: there is no such kernel", case.kernel))?;
    let own = kernel.bindings.iter().filter(|b| call.buffer_of(b.name) == b.name);
    for binding in own.filter(|b| !case.unordered.contains(&b.name)) {
        if first.bytes(binding.name) != second.bytes(binding.name) {
            return Err(format!("{}: two runs differ in `{}` ({ask:?})", case.kernel, binding.name));
        }
    }
    Ok(())
}

/// One row of a bench table.
#[derive(Clone, Debug)]
pub struct Row {
    /// Kernel.
    pub kernel: &'static str,
    /// Items in a call.
    pub items: usize,
    /// Median device time of a call [ms].
    pub ms: f64,
    /// The same for an item [ns].
    pub ns: f64,
    /// Traffic reached [GB/s].
    pub gigabytes: f64,
    /// Arithmetic reached [GFLOP/s].
    pub gigaflops: f64,
    /// Largest error against the twin, relative to its scale.
    pub error: f64,
}

/// Times a case and proves it at the same size. The first call is not counted (drivers compile there).
///
/// # Errors
/// As [`prove`].
pub fn time(gpu: &Gpu, case: &Case, items: usize, repeats: usize) -> Result<Row, String> {
    let ask = Ask { items, seed: 1, poison: false };
    let error = prove(gpu, case, ask)?.iter().map(|r| r.max).fold(0.0, f64::max);
    let call = (case.inputs)(ask);
    let name = case.kernel;
    let kernel = find_kernel(name).ok_or_else(|| format!("{name}: there is no such kernel"))?;
    let say = |e: physvideo_gpu::GpuError| format!("{name}: {e}");
    let mut bufs: Vec<Buf<u8>> = Vec::new();
    let own: Vec<_> = kernel.bindings.iter().filter(|b| call.buffer_of(b.name) == b.name).collect();
    for binding in &own {
        bufs.push(gpu.upload("bench", binding.name, call.buffers.bytes(binding.name)).map_err(say)?);
    }
    let mut recording = Recording::new(name);
    recording.section(name);
    recording.commands.push(Command::Call {
        kernel,
        constants: call.constants.clone(),
        bufs: bound(kernel, &call, &bufs),
        immediates: call.immediates.clone(),
        groups: call.dispatch(),
    });
    let prepared = gpu.prepare(&recording).map_err(say)?;
    let mut times = Vec::new();
    for i in 0..=repeats.max(1) {
        // Kernels change their inputs: every call starts from the same ones.
        for (binding, buf) in own.iter().zip(&bufs) {
            gpu.write(*buf, 0, call.buffers.bytes(binding.name)).map_err(say)?;
        }
        let begin = Instant::now();
        let timing = prepared.submit().map_err(say)?;
        let wall = begin.elapsed().as_secs_f64() * 1e3;
        if i > 0 {
            times.push(timing.first().map_or(wall, |t| t.ms));
        }
    }
    drop(prepared);
    gpu.free_arena("bench");
    times.sort_by(f64::total_cmp);
    let ms = times[times.len() / 2];
    let per_second = items as f64 / (ms * 1e-3).max(1e-9) * 1e-9;
    Ok(Row {
        kernel: name,
        items,
        ms,
        ns: ms * 1e6 / items.max(1) as f64,
        gigabytes: per_second * case.bytes,
        gigaflops: per_second * case.flops,
        error,
    })
}
