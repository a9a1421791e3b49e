//! Every kernel against its f64 twin on the device, under validation.

use physvideo_gpu::kernels::KERNELS;
use physvideo_gpu::{Feature, Gpu, Options};
use physvideo_tests::device;
use physvideo_tests::proof::harness::{SIZES, prove, repeat, time};
use physvideo_tests::proof::{Ask, CASES, find};

#[test]
fn every_kernel_has_a_case() {
    let without: Vec<_> = KERNELS.iter().map(|k| k.name).filter(|name| find(name).is_none()).collect();
    assert!(without.is_empty(), "kernels without a case in tests/src/proof: {}", without.join(", "));
    let unknown: Vec<_> = CASES.iter().map(|c| c.kernel).filter(|n| KERNELS.iter().all(|k| k.name != *n)).collect();
    assert!(unknown.is_empty(), "cases of no kernel: {}", unknown.join(", "));
}

#[test]
fn every_kernel_agrees_with_its_twin() {
    let gpu = device::gpu();
    agree(&gpu);
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Without clamped indices and validation, as the program runs.
#[test]
fn every_kernel_agrees_with_its_twin_with_the_flags_that_ship() {
    agree(&device::open(Options { device: device::options().device, ..Options::default() }));
}

/// Sizes around those of workgroups, each with a seed of its own, so that every variant of a kernel comes by.
fn agree(gpu: &Gpu) {
    println!("subgroup size {}", gpu.info.subgroup_size);
    let mut wrong = Vec::new();
    for case in CASES {
        let (mut worst, mut numbers) = (0.0f64, 0);
        for (turn, items) in SIZES.into_iter().chain([1000, 1000, 1000]).enumerate() {
            match prove(gpu, case, Ask { items, seed: turn as u64, poison: false }) {
                Ok(reports) => {
                    worst = reports.iter().map(|r| r.max).fold(worst, f64::max);
                    numbers += reports.iter().map(|r| r.items).sum::<usize>();
                }
                Err(e) => wrong.push(e),
            }
        }
        println!("{}: error {worst:.1e} of {:.1e} over {numbers} numbers", case.kernel, case.tolerance);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The software driver has subgroups of as many lanes as its vectors: the proofs again with 4, 8 and 16.
#[test]
fn every_kernel_agrees_with_its_twin_at_every_subgroup_size() {
    for (bits, lanes) in [(128, 4), (256, 8), (512, 16)] {
        let cache = format!("{}/shaders{bits}", env!("CARGO_TARGET_TMPDIR"));
        std::fs::create_dir_all(&cache).unwrap();
        let out = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "--nocapture", "--test-threads=1"])
            .args(["every_kernel_agrees_with_its_twin_with_the_flags_that_ship", "two_runs_have_the_same_bits"])
            .env("LP_NATIVE_VECTOR_WIDTH", bits.to_string())
            // A cache each, so that no width is served what another compiled.
            .env("MESA_SHADER_CACHE_DIR", cache)
            .env_remove(device::DEVICE_VARIABLE)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&[out.stdout, out.stderr].concat()).into_owned();
        assert!(said.contains(&format!("subgroup size {lanes}\n")), "not the size asked for ({bits} bits):\n{said}");
        assert!(out.status.success() && said.contains("2 passed"), "with subgroups of {lanes}:\n{said}");
    }
}

#[test]
fn poison_stays_where_it_is() {
    let gpu = device::gpu();
    let mut wrong = Vec::new();
    for case in CASES {
        for seed in 0..4 {
            wrong.extend(prove(&gpu, case, Ask { items: 400 + seed as usize, seed, poison: true }).err());
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn two_runs_have_the_same_bits() {
    let gpu = device::gpu();
    let wrong: Vec<_> =
        CASES.iter().filter_map(|case| repeat(&gpu, case, Ask { items: 1000, seed: 2, poison: true }).err()).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The clock has many branches and costs nothing: all of them, often.
#[test]
fn the_clock_ticks_right_in_every_branch() {
    let gpu = device::gpu();
    let clock = find("mpm/clock").unwrap();
    let wrong: Vec<_> =
        (0..300).filter_map(|seed| prove(&gpu, clock, Ask { items: 100, seed, poison: seed % 5 == 0 }).err()).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_case_can_be_timed() {
    let gpu = device::gpu();
    let row = time(&gpu, find("mpm/p2g").unwrap(), 1000, 3).unwrap();
    assert!(row.ms > 0.0 && row.ns > 0.0 && row.gigabytes > 0.0 && row.gigaflops > 0.0, "{row:?}");
    assert!(row.error > 0.0, "an f32 kernel without any error was not compared: {row:?}");
}

/// Where the driver does not zero workgroup memory, the kernels do.
#[test]
fn workgroup_memory_starts_at_zero_either_way() {
    let without = vec![Feature::ZeroedWorkgroup];
    let gpu = device::open(Options { without, ..device::options() });
    for name in ["cells/range", "mpm/g2p", "mpm/grid", "mpm/grid_rows", "mpm/p2g_fixed", "sph/advance", "sph/relax"] {
        let case = find(name).unwrap();
        for seed in 0..2 {
            prove(&gpu, case, Ask { items: 1000, seed, poison: false }).unwrap();
        }
    }
}
