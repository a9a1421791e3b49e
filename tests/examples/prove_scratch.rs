use physvideo_tests::proof::harness::*;
use physvideo_tests::proof::*;
fn main() {
    let only = std::env::args().nth(1).unwrap();
    let gpu = physvideo_tests::device::gpu();
    for case in CASES.iter().filter(|c| c.kernel.contains(&only)) {
        let mut worst = 0.0f64;
        for (turn, items) in SIZES.into_iter().chain([1000, 1000, 1000]).enumerate() {
            match prove(&gpu, case, Ask { items, seed: turn as u64, poison: false }) {
                Ok(r) => worst = r.iter().map(|r| r.max).fold(worst, f64::max),
                Err(e) => println!("{e}"),
            }
        }
        for seed in 0..4 {
            if let Err(e) = prove(&gpu, case, Ask { items: 400 + seed as usize, seed, poison: true }) {
                println!("poison {e}");
            }
        }
        if let Err(e) = repeat(&gpu, case, Ask { items: 1000, seed: 2, poison: true }) {
            println!("{e}");
        }
        println!("{} {worst:.1e} of {:.1e}", case.kernel, case.tolerance);
    }
    println!("{:?}", gpu.messages());
}
