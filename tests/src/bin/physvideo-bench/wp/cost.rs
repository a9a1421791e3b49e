//! Time of the latent's kernels on 0.9 million floats, without handing anything to or from the host.

use physvideo_gpu::kernels::{self, latent};
use physvideo_gpu::{Buf, Constants, GpuError, Kernel, Recording};

use super::{Bench, cell};

/// Numbers: 16 channels of 57,600 cells, a chunk of FramePack's.
const NUMBERS: u32 = 921_600;
const CELLS: u32 = NUMBERS / 16;
const REPEATS: usize = 21;

/// One line a kernel.
pub fn run(bench: &mut Bench) -> Result<(), String> {
    let rows = time(bench).map_err(|e| e.to_string())?;
    println!("{:<34} {:>10} {:>8}", "kernel, 0.9 M floats", "ns/float", "GB/s");
    for (name, ns, gigabytes) in &rows {
        println!("{name:<34} {ns:>10.3} {gigabytes:>8.2}");
    }
    let device = format!("\"{}\"", bench.gpu.info.name);
    let row = |(name, ns, gb): &(String, f64, f64)| vec![device.clone(), format!("\"{name}\""), cell(*ns), cell(*gb)];
    let rows: Vec<_> = rows.iter().map(row).collect();
    bench.csv("cost", "device,kernel,ns_per_float,gigabytes_per_second", &rows)
}

fn time(bench: &Bench) -> Result<Vec<(String, f64, f64)>, GpuError> {
    let gpu = bench.gpu;
    let numbers = |seed: u32| -> Vec<[f32; 4]> {
        let one = |i: u32| ((i.wrapping_mul(2_654_435_761).wrapping_add(seed) >> 8) as f32 / 8_388_608.0) - 1.0;
        (0..NUMBERS / 4).map(|i| std::array::from_fn(|k| one(4 * i + k as u32))).collect()
    };
    let z: Buf<[f32; 4]> = gpu.upload("cost", "cost/z", &numbers(1))?;
    let v = gpu.upload("cost", "cost/v", &numbers(2))?;
    let w = gpu.upload("cost", "cost/w", &numbers(3))?;
    let weights = gpu.upload("cost", "cost/weights", &vec![1f32; CELLS as usize])?;
    // Small factors, so that the numbers stay small however often a step is repeated.
    let sde = latent::SdeStep {
        z,
        v,
        mu: w,
        update: weights,
        immediates: kernels::SdeStep {
            count: NUMBERS,
            cells: CELLS,
            a: -0.2,
            b: 0.007,
            s0: 0.6,
            s1: 0.3,
            ..Default::default()
        },
    };
    let flow = latent::FlowStep {
        z,
        v,
        w,
        free: weights,
        immediates: kernels::FlowStep { count: NUMBERS, cells: CELLS, a: 0.01, b: -0.01 },
    };
    let mix = latent::Mix {
        z,
        base: v,
        mask: weights,
        immediates: kernels::Mix { count: NUMBERS, cells: CELLS, sigma: 0.9, ..Default::default() },
    };
    let flag = |name: &'static str, on: bool| (name, f64::from(u8::from(on)));
    let with = |flags: &[(&'static str, f64)]| flags.iter().fold(Constants::none(), |c, (name, v)| c.with(name, *v));
    let bytes = |whole: f64, cells: f64| 4.0 * whole + 4.0 * cells / 16.0;
    let rows = vec![
        one(bench, "sde_step, no noise", &sde, &with(&[flag("NOISE", false)]), bytes(3.0, 0.0))?,
        one(bench, "sde_step, noise", &sde, &with(&[flag("NOISE", true)]), bytes(3.0, 0.0))?,
        one(bench, "sde_step, noise, masked", &sde, &with(&[flag("MASKED", true)]), bytes(3.0, 1.0))?,
        one(
            bench,
            "sde_step, two noises, masked",
            &sde,
            &with(&[flag("TWO", true), flag("MASKED", true)]),
            bytes(3.0, 1.0),
        )?,
        one(bench, "flow_step, Euler", &flow, &with(&[]), bytes(3.0, 0.0))?,
        one(bench, "flow_step, AB2 or Heun", &flow, &with(&[flag("TWO", true)]), bytes(4.0, 0.0))?,
        one(bench, "mix, all forward", &mix, &with(&[]), bytes(2.0, 0.0))?,
        one(bench, "mix, masked", &mix, &with(&[flag("MASKED", true)]), bytes(3.0, 1.0))?,
    ];
    gpu.free_arena("cost");
    Ok(rows)
}

/// Median device time over several calls: ns a float, and GB/s of what must be read and written.
fn one<K: Kernel>(
    bench: &Bench,
    name: &str,
    call: &K,
    constants: &Constants,
    bytes: f64,
) -> Result<(String, f64, f64), GpuError> {
    let mut rec = Recording::new("cost");
    rec.section(name);
    rec.each(call, constants, u64::from(NUMBERS / 4));
    let prepared = bench.gpu.prepare(&rec)?;
    prepared.submit()?; // drivers compile at the first dispatch
    let mut ms = Vec::new();
    for _ in 0..REPEATS {
        ms.extend(prepared.submit()?.iter().map(|t| t.ms));
    }
    ms.sort_by(f64::total_cmp);
    let ns = ms[ms.len() / 2] * 1e6 / f64::from(NUMBERS);
    Ok((name.into(), ns, bytes / ns))
}
