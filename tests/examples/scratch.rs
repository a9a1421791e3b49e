use physvideo_gpu::kernels::{self, latent};
use physvideo_gpu::*;
use std::time::Instant;
fn main() {
    let gpu = Gpu::new(Options::default()).unwrap();
    let n = 10240u64;
    let z: Buf<[f32; 4]> = gpu.alloc("a", "z", n / 4).unwrap();
    let v: Buf<[f32; 4]> = gpu.alloc("a", "v", n / 4).unwrap();
    let m: Buf<f32> = gpu.alloc("a", "m", 640).unwrap();
    let (mut a, mut b, mut c, mut d, mut e) = (0., 0., 0., 0., 0.);
    for i in 0..300 {
        let t = Instant::now();
        let mut rec = Recording::new("x");
        rec.section("s");
        rec.each(
            &latent::FlowStep {
                z,
                v,
                w: v,
                free: m,
                immediates: kernels::FlowStep { count: n as u32, cells: 640, a: 0.1, b: 0.0 },
            },
            &Constants::none().with("TWO", 0.0).with("HELD", 0.0),
            n / 4,
        );
        let t1 = Instant::now();
        let p = gpu.prepare(&rec).unwrap();
        let t2 = Instant::now();
        let r = p.submit().unwrap();
        let t3 = Instant::now();
        drop(p);
        let t4 = Instant::now();
        let p: Vec<f32> = vec![0.5; n as usize];
        gpu.write(v.cast::<f32>(), 0, &p).unwrap();
        let t5 = Instant::now();
        if i >= 50 {
            a += (t1 - t).as_secs_f64();
            b += (t2 - t1).as_secs_f64();
            c += (t3 - t2).as_secs_f64();
            d += (t4 - t3).as_secs_f64();
            e += (t5 - t4).as_secs_f64();
            if i == 299 {
                println!("device {:?}", r);
            }
        }
    }
    println!(
        "record {:.1} prepare {:.1} submit {:.1} drop {:.1} write {:.1} us",
        a / 250. * 1e6,
        b / 250. * 1e6,
        c / 250. * 1e6,
        d / 250. * 1e6,
        e / 250. * 1e6
    );
}
