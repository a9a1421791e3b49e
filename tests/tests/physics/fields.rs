//! Fields with a known effect: a vortex spins, damping decays, noise has the mean and the variance it states.

use physvideo::scene::{Field, Force, Material};
use physvideo::world::{self, World};
use physvideo_gpu::Gpu;
use physvideo_tests::device::gpu;

use physvideo_tests::problems::setup::{Lattice, solver, world};

const STIFF: Material = Material::Elastic { young: 1e4, poisson: 0.3 };

fn field(force: Force, objects: Option<Vec<String>>) -> Field {
    Field { force, region: None, start: 0.0, end: 1e9, ramp: 0.0, objects }
}

/// A cylinder about z that nothing else acts on.
fn cylinder(force: Force) -> World {
    let dx = 1.0 / 32.0;
    let round = Lattice::of_eight(dx).fill([-0.25, -0.25, 0.0], [0.25, 0.25, 0.125], |x| x[0].hypot(x[1]) < 0.25);
    let mut w = world(
        vec![Lattice::of_eight(dx).body(STIFF, 15.0, &round, |_| [0.0; 3])],
        dx,
        [-0.5, -0.5, -0.25],
        [0.5, 0.5, 0.5],
    );
    w.fields = vec![world::field(&field(force, None), 0, 0)];
    w
}

/// Angular momentum about z after each of `frames` [s], what APIC keeps in C included.
fn spin(gpu: &Gpu, w: &World, frames: &[f32]) -> Vec<f64> {
    let mut mpm = solver(gpu, w, "updated_lagrangian").unwrap();
    let own = f64::from(w.dx).powi(2) / 4.0;
    let mut out = Vec::new();
    for length in frames {
        mpm.frame(*length).unwrap();
        let each = |p: &physvideo_gpu::kernels::Particle| {
            let [x, y, vx, vy] = [p.x[0], p.x[1], p.v[0], p.v[1]].map(f64::from);
            f64::from(p.m) * (x * vy - y * vx + own * (f64::from(p.c1[0]) - f64::from(p.c0[1])))
        };
        out.push(gpu.read(mpm.particles()).unwrap().iter().map(each).sum());
    }
    out
}

/// The torque of c e^(−r/R) along the circles on a body is Σ m r c e^(−r/R), whatever its stress does.
#[test]
fn a_vortex_spins_a_body_at_the_right_rate() {
    let gpu = gpu();
    let vortex =
        |frequency| Force::Vortex { center: [0.0; 3], axis: [0.0, 0.0, 2.0], strength: 3.0, radius: 0.2, frequency };
    let steady = cylinder(vortex(0.0));
    let torque = |radius: f64| {
        let mass = f64::from(steady.bodies[0].density * steady.bodies[0].particle_volume);
        let arms = steady.bodies[0].positions.iter().map(|x| f64::from(x[0]).hypot(f64::from(x[1])));
        arms.map(|r| mass * r * 3.0 * (-r / radius).exp()).sum::<f64>()
    };
    let l = spin(&gpu, &steady, &[0.1])[0];
    // In 0.1 s it turns by a tenth of a radian at 1 rad/s, which pulls it outward by less than 1e-3 of its radius.
    assert!((l / (0.1 * torque(0.2)) - 1.0).abs() < 2e-3, "{l} for {}", 0.1 * torque(0.2));
    // Control: another radius is told apart.
    assert!((l / (0.1 * torque(0.25)) - 1.0).abs() > 5e-2);
    // Swinging at f it has 2/(2πf) of the torque after half a period and nothing after a whole one; a sine summed at the
    // start of each of n steps is off by half a step.
    let swing = spin(&gpu, &cylinder(vortex(10.0)), &[0.05, 0.05]);
    let half = torque(0.2) / (std::f64::consts::PI * 10.0);
    assert!((swing[0] / half - 1.0).abs() < 1e-2, "{swing:?} for {half}");
    assert!(swing[1].abs() < 2e-2 * half, "{swing:?}");
}

/// v_z = v_0 e^(−kt), and the other components stay.
#[test]
fn damping_decays_the_component_it_is_given() {
    let gpu = gpu();
    let mut w = cylinder(Force::Damping { rate: [0.0, 0.0, 8.0] });
    w.bodies[0].velocities.fill([0.3, -0.2, 0.4]);
    // The drag limits the step as the wind's does: 0.5/8 s is longer than the waves allow, 0.5/8000 s is not.
    assert_eq!(w.longest_step(), 0.0625);
    let mut strong = w.clone();
    strong.fields[0].a[2] = 8000.0;
    assert_eq!(strong.step(), 0.5 / 8000.0);
    let step = f64::from(w.step());
    let mut mpm = solver(&gpu, &w, "updated_lagrangian").unwrap();
    mpm.frame(0.125).unwrap();
    let m = mpm.measure(0).unwrap();
    let v = m.momentum.map(|p| p / m.mass);
    let exact = 0.4 * (-8.0_f64 * 0.125).exp();
    // Explicit Euler is off by k² dt t/2 relative, here 1.3 %.
    let tolerance = 1.1 * 8.0 * 8.0 * step * 0.125 / 2.0;
    assert!((v[2] / exact - 1.0).abs() < tolerance && tolerance < 0.02, "{v:?} for {exact}, {tolerance}");
    // f32 rounding of some dozen steps.
    assert!((v[0] - 0.3).abs() < 1e-5 && (v[1] + 0.2).abs() < 1e-5, "{v:?}");
    // Control: without a field nothing decays.
    w.fields.clear();
    let mut free = solver(&gpu, &w, "updated_lagrangian").unwrap();
    free.frame(0.125).unwrap();
    let m = free.measure(0).unwrap();
    assert!((m.momentum[2] / m.mass - 0.4).abs() < 1e-5);
}

/// Particles too far apart to feel one another, each pushed on its own: what a field gives them is read off directly.
#[test]
fn noise_has_the_mean_and_the_variance_it_states() {
    let gpu = gpu();
    let dx = 1.0 / 16.0;
    let mut apart = Vec::new();
    for i in 0..1000 {
        // Five cells and a bit apart, so that every place of a cell of the noise is met.
        apart.push([i % 10, i / 10 % 10, i / 100].map(|k| f64::from(k) * 5.37 * dx));
    }
    // So soft that a step of a frame is far below its limit.
    let soft = Material::Elastic { young: 1.0, poisson: 0.3 };
    let mut w = world(vec![Lattice::of_eight(dx).body(soft, 15.0, &apart, |_| [0.0; 3])], dx, [-0.5; 3], [4.0; 3]);
    // As strong at z = 0 as 1, at the top 3.4 times.
    let noise =
        Force::Noise { amplitude: 1.0, growth: 0.8, from: 0.0, length: 0.29, time: 0.013, axes: [1.0, 0.5, 0.0] };
    let dt = 1.0 / 128.0;
    w.force_dt = Some(dt);
    let run = |w: &World, seed: u64| {
        let mut w = w.clone();
        w.fields = vec![world::field(&field(noise, None), seed, 0)];
        let mut mpm = solver(&gpu, &w, "updated_lagrangian").unwrap();
        let mut pushes = Vec::new();
        let mut before = vec![[0.0; 3]; 1000];
        for _ in 0..12 {
            mpm.frame(dt).unwrap();
            for (p, v) in gpu.read(mpm.particles()).unwrap().iter().zip(&mut before) {
                let size = 1.0 + 0.8 * f64::from(p.x[2]);
                let push: [f64; 3] = std::array::from_fn(|a| f64::from(p.v[a] - v[a]) / f64::from(dt) / size);
                pushes.push((push, size));
                *v = p.v;
            }
        }
        pushes
    };
    let pushes = run(&w, 7);
    let n = pushes.len() as f64;
    let mean = |axis: usize| pushes.iter().map(|(a, _)| a[axis]).sum::<f64>() / n;
    let variance = |axis: usize, keep: &dyn Fn(f64) -> bool| {
        let some: Vec<f64> = pushes.iter().filter(|(_, s)| keep(*s)).map(|(a, _)| a[axis].powi(2)).collect();
        some.iter().sum::<f64>() / some.len() as f64
    };
    // Twelve thousand pushes, correlated in time over about two steps and hardly in space: 5000 independent ones, so
    // the mean is known to 1.4 % of a deviation and the variance to 2 %; four of each are allowed.
    assert!(mean(0).abs() < 0.06 && mean(1).abs() < 0.03, "mean {} {}", mean(0), mean(1));
    let all = |_| true;
    assert!((variance(0, &all) - 1.0).abs() < 0.08, "variance {}", variance(0, &all));
    assert!((variance(1, &all) - 0.25).abs() < 0.02, "variance {}", variance(1, &all));
    // No push at all, but for the rounding of weights.
    assert!(variance(2, &all) < 1e-20, "variance {}", variance(2, &all));
    // Growth: with the stated size taken out, low and high places have the same variance.
    let (low, high) = (variance(0, &|s| s < 1.5), variance(0, &|s| s > 2.2));
    assert!((low / high - 1.0).abs() < 0.2, "{low} low, {high} high");
    // The same seed gives the same bits, another one other pushes.
    assert_eq!(pushes, run(&w, 7));
    let other = run(&w, 8);
    let together: f64 = pushes.iter().zip(&other).map(|(a, b)| a.0[0] * b.0[0]).sum::<f64>() / n;
    assert!(together.abs() < 0.06, "seeds 7 and 8 are correlated by {together}");
}
