use physvideo::scene::Pressure;
use physvideo::stages::solver::Solver;
use physvideo::stages::sph::Sph;
use physvideo_gpu::kernels::Field;
use physvideo_tests::liquid::*;
fn main() {
    let what = std::env::args().nth(1).unwrap();
    let pressure = if std::env::args().nth(2).as_deref() == Some("dfsph") { Pressure::Dfsph } else { Pressure::Wcsph };
    let gpu = physvideo_gpu::Gpu::new(physvideo_gpu::Options { bounds_checks: true, ..Default::default() }).unwrap();
    let h = 0.013;
    if what == "fall" {
        let body = liquid(1000.0, 0.0, h, lattice(h, [0.0; 3], [8.0 * h; 3]));
        let mut w = world(pressure, h, vec![body], [-0.2, -0.2, -0.8], [0.4; 3]);
        w.gravity = [0.0, 0.0, -9.81];
        let mut s = Sph::new(&gpu, &w).unwrap();
        let m0 = s.measure(0).unwrap();
        for _ in 0..4 {
            let st = s.frame(0.05).unwrap();
            let m = s.measure(0).unwrap();
            println!(
                "{st:?} fallen {} want {} P {:?} L {:?}",
                (m0.height - m.height) / m.mass,
                0.5 * 9.81 * s.time() * s.time(),
                m.momentum,
                m.spin
            );
            println!("v {} want {}", m.momentum[2] / m.mass, 9.81 * s.time());
        }
    }
    if what == "channel" {
        use physvideo_tests::problems::sph::*;
        for n in [6, 8, 12, 16] {
            let (u, r) = channel(&gpu, n, pressure, 0.75, true).unwrap();
            println!(
                "{n}: {u:.4?} want {:.4?} error {:.2e} steps {} wall {:.2}",
                TIMES.map(poiseuille),
                off_the_series(&u, n),
                r.frames.iter().map(|s| s.substeps).sum::<u32>(),
                r.wall_s
            );
        }
    }
    if what == "front" {
        let n: u32 = std::env::args().nth(3).unwrap().parse().unwrap();
        let (f, r) = physvideo_tests::problems::sph::dam(&gpu, n, pressure, 0.75, 9.81).unwrap();
        for (z, w) in f.iter().zip(physvideo_tests::problems::sph::FRONT) {
            println!("T {} Z {z:.3} band {} {}", w.0, w.1, w.2);
        }
        println!(
            "{:?} steps {} its {} wall {} n {} densest {}",
            physvideo_tests::problems::sph::off_the_band(&f),
            r.frames.iter().map(|s| s.substeps).sum::<u32>(),
            r.frames.iter().map(|s| s.iterations).sum::<u32>(),
            r.wall_s,
            r.particles,
            r.densest
        );
    }
    if what == "dam" {
        let nu: f32 = std::env::args().nth(3).unwrap().parse().unwrap();
        let body = liquid(1000.0, nu, h, lattice(h, [0.0; 3], [12.0 * h, 6.0 * h, 24.0 * h]));
        let mut w = world(pressure, h, vec![body], [-0.1; 3], [0.7, 0.2, 0.8]);
        w.gravity = [0.0, 0.0, -9.81];
        w.colliders = vec![room([0.0; 3], [46.0 * h, 6.0 * h, 46.0 * h])];
        let mut s = Sph::new(&gpu, &w).unwrap();
        let began = std::time::Instant::now();
        for _ in 0..15 {
            let st = s.frame(0.04).unwrap();
            let m = s.measure(0).unwrap();
            let p = gpu.read(s.particles).unwrap();
            let s_max = p.iter().map(|q| q.s[0]).fold(0.0, f32::max);
            let over = p.iter().map(|q| (q.s[0] - 1.0).max(0.0) as f64).sum::<f64>() / p.len() as f64;
            let front = p.iter().map(|q| q.x[0]).fold(0.0, f32::max);
            println!(
                "t {:.2} {} steps dt {:?} it {} uns {} rej {} clamp {} {} E {:.3} (kin {:.3}) vmax {:.2} smax {:.3} mean over {:.1e} front {:.3} wall {:.1}",
                s.time(),
                st.substeps,
                st.dt,
                st.iterations,
                st.unsolved,
                st.rejected,
                st.clamped_velocity,
                st.clamped_volume,
                m.kinetic + 9.81 * m.height,
                m.kinetic,
                m.speed,
                s_max,
                over,
                front,
                began.elapsed().as_secs_f64()
            );
        }
    }
    if what == "tank" {
        let n = 10.0;
        let nu: f32 = std::env::args().nth(3).unwrap().parse().unwrap();
        let body = liquid(1000.0, nu, h, lattice(h, [0.0; 3], [6.0 * h, 6.0 * h, n * h]));
        let mut w = world(pressure, h, vec![body], [-0.1; 3], [0.3; 3]);
        w.gravity = [0.0, 0.0, -9.81];
        w.colliders = vec![room([0.0; 3], [6.0 * h, 6.0 * h, 1.0])];
        w.fields = vec![Field { kind: 2, end: 1e9, p0: 40.0, ..Default::default() }];
        let mut s = Sph::new(&gpu, &w).unwrap();
        for _ in 0..6 {
            let st = s.frame(0.1).unwrap();
            let p = gpu.read(s.particles).unwrap();
            println!(
                "{} steps dt {:?} it {} unsolved {} clamps {} {}",
                st.substeps, st.dt, st.iterations, st.unsolved, st.clamped_velocity, st.quarantined
            );
            for k in 0..10 {
                let layer = &p[k * 36..(k + 1) * 36];
                let mean = |f: &dyn Fn(&physvideo_gpu::kernels::Particle) -> f32| {
                    layer.iter().map(|q| f(q) as f64).sum::<f64>() / 36.0
                };
                let want = 9810.0 * h * (n - k as f64 - 0.5);
                println!(
                    "{k}: z/h {:.4} s {:.5} p {:.2} want {:.2} ({:+.3} %) v {:.2e}",
                    mean(&|q| q.x[2]) / h,
                    mean(&|q| q.s[0]),
                    mean(&|q| q.s[1]),
                    want,
                    100.0 * (mean(&|q| q.s[1]) / want - 1.0),
                    mean(&|q| q.v.iter().map(|c| c * c).sum::<f32>().sqrt())
                );
            }
        }
        println!("max s {}", gpu.read(s.particles).unwrap().iter().map(|q| q.s[0]).fold(0.0, f32::max));
    }
}
