use physvideo::scene::Material;
use physvideo::stages::mpm::{Method, Mpm, P2g};
use physvideo::world::{Body, World, ground};
use physvideo_gpu::{Gpu, Options};

fn cube(n: usize, s: f32, low: [f32; 3]) -> Vec<[f32; 3]> {
    let mut out = Vec::new();
    for k in 0..n {
        for j in 0..n {
            for i in 0..n {
                out.push([low[0] + (i as f32 + 0.5) * s, low[1] + (j as f32 + 0.5) * s, low[2] + (k as f32 + 0.5) * s]);
            }
        }
    }
    out
}

#[test]
fn speed() {
    let validation = std::env::var("VALID").is_ok();
    let gpu = Gpu::new(Options { validation, ..Default::default() }).unwrap();
    let dx = 1.0 / 128.0;
    let n = 37;
    let positions = cube(n, dx / 2.0, [0.4, 0.4, 0.002]);
    let count = positions.len();
    let world = World {
        bodies: vec![Body {
            name: "cube".into(),
            material: Material::Elastic { young: 8e4, poisson: 0.32 },
            density: 40.0,
            velocities: vec![[0.0; 3]; count],
            pinned: vec![],
            prestress: false,
            particle_volume: (dx / 2.0f32).powi(3),
            fields: 0,
            positions,
        }],
        gravity: [0.0, 0.0, -9.81],
        fields: vec![],
        colliders: vec![ground(0.0, 0.2)],
        domain: ([0.0; 3], [1.0; 3]),
        dx,
        courant: 0.75,
        force_dt: Some(1e-4),
    };
    let all = std::env::var("ALL").is_ok();
    for p2g in if all { vec![P2g::Cell, P2g::Fixed, P2g::Float] } else { vec![P2g::Cell] } {
        let mut mpm = Mpm::new(&gpu, &world, Method { p2g: Some(p2g), ..Default::default() }).unwrap();
        mpm.frame(3.2e-3).unwrap();
        for _ in 0..3 {
            let t = std::time::Instant::now();
            let s = mpm.frame(6.4e-3).unwrap();
            let ns = t.elapsed().as_secs_f64() * 1e9 / f64::from(s.substeps) / count as f64;
            println!("{p2g:?} {count} {ns:.0} ns {s:?}");
        }
        println!("{:?}", mpm.measure(0).unwrap());
        let mut rec = physvideo_gpu::Recording::new("x");
        mpm.record_substep(&mut rec);
        let mut timed = physvideo_gpu::Recording::new("t");
        for c in rec.commands {
            if let physvideo_gpu::Command::Call { kernel, .. } = &c {
                timed.section(kernel.name);
            }
            timed.commands.push(c);
        }
        // restart the clock
        mpm.restart();
        let prepared = gpu.prepare(&timed).unwrap();
        let mut sum: std::collections::BTreeMap<String, f64> = Default::default();
        for _ in 0..10 {
            for t in prepared.submit().unwrap() {
                *sum.entry(t.section).or_default() += t.ms / 10.0;
            }
        }
        for (k, v) in sum {
            println!("  {k} {:.1} ns", v * 1e6 / count as f64);
        }
    }
    println!("{:?}", gpu.messages().first());
}
