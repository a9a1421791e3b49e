//! Bodies at rest are left out, wake before anything reaches them, and change nothing that is seen.

use physvideo::scene::{Field, Force, Material};
use physvideo::stages::mpm::{Method, Mpm};
use physvideo::stages::solver::{FrameStats, Solver};
use physvideo::world::{Body, World, field, ground};
use physvideo_gpu::Gpu;
use physvideo_tests::device::gpu;
use physvideo_tests::problems::setup::{Lattice, world};

const DX: f64 = 1.0 / 16.0;
const FRAME: f32 = 1.0 / 24.0;

fn cube(at: [f64; 3], velocity: [f64; 3]) -> Body {
    let lattice = Lattice::of_eight(DX);
    let soft = Material::Elastic { young: 2e4, poisson: 0.3 };
    let positions = lattice.fill(at, at.map(|c| c + 4.0 * DX), |_| true);
    lattice.body(soft, 500.0, &positions, |_| velocity)
}

/// Two cubes on top of each other on the ground, one far from them, all with some drag, which nothing at rest feels, so
/// that their swings are over soon; and one without that may fly towards the stack along x.
fn stack(flies: Option<f64>) -> World {
    let mut bodies =
        vec![cube([0.0, 0.0, 0.0], [0.0; 3]), cube([0.0, 0.0, 4.5 * DX], [0.0; 3]), cube([0.0, 2.0, 0.0], [0.0; 3])];
    if let Some(speed) = flies {
        let weightless = Body { gravity: Some([0.0; 3]), fields: 0, ..cube([-2.5, 0.0, 0.2], [speed, 0.0, 0.0]) };
        bodies.push(weightless);
    }
    let mut w = world(bodies, DX, [-3.0, -1.0, -0.25], [2.0, 3.0, 1.5]);
    w.gravity = [0.0, 0.0, -9.81];
    w.colliders = vec![ground(0.0, 0.5)];
    let force = Force::Damping { rate: [10.0; 3] };
    let drag = Field { force, region: None, start: 0.0, end: 1e9, ramp: 0.0, objects: None };
    w.fields = vec![field(&drag, 0, 0)];
    w
}

fn solver<'g>(gpu: &'g Gpu, w: &World, sleep: bool) -> Mpm<'g> {
    Mpm::new(gpu, w, Method { sleep, ..Method::default() }).unwrap()
}

fn play(mpm: &mut Mpm, frames: usize) -> Vec<FrameStats> {
    (0..frames).map(|_| mpm.frame(FRAME).unwrap()).collect()
}

/// Largest distance between the particles of two solvers [cells].
fn apart(gpu: &Gpu, a: &Mpm, b: &Mpm) -> f64 {
    let (a, b) = (gpu.read(a.particles).unwrap(), gpu.read(b.particles).unwrap());
    let far = |(p, q): (&physvideo_gpu::kernels::Particle, &physvideo_gpu::kernels::Particle)| {
        (0..3).map(|i| f64::from(p.x[i] - q.x[i]).powi(2)).sum::<f64>().sqrt()
    };
    a.iter().zip(&b).map(far).fold(0.0, f64::max) / DX
}

#[test]
fn a_stack_at_rest_is_left_out_and_looks_the_same() {
    let gpu = gpu();
    let w = stack(None);
    let (mut sleeper, mut waker) = (solver(&gpu, &w, true), solver(&gpu, &w, false));
    let (slept, awake) = (play(&mut sleeper, 96), play(&mut waker, 96));
    let all = w.bodies.iter().map(|b| b.positions.len()).sum::<usize>().div_ceil(64) as u32;
    assert_eq!((slept[0].groups, slept[0].asleep), (all, 0));
    let last = slept[95];
    assert_eq!((last.groups, last.substeps, last.asleep), (0, 0, 3), "{:?}", sleeper.left_out());
    assert!(awake[95].groups == all && awake[95].substeps > 0 && awake[95].asleep == 0);
    // The stack sleeps as one: what touches nothing at rest may not rest alone.
    let naps = sleeper.left_out();
    assert_eq!(naps[0], naps[1], "{naps:?}");
    // Seen from outside nothing differs by more than a few hundredths of a cell, which is what is left of the swings.
    let far = apart(&gpu, &sleeper, &waker);
    assert!(far < 0.05, "{far} cells");
}

#[test]
fn what_flies_into_a_stack_wakes_it_in_time() {
    let gpu = gpu();
    let w = stack(Some(0.6));
    let (mut sleeper, mut waker) = (solver(&gpu, &w, true), solver(&gpu, &w, false));
    // It reaches the stack after (2.5 − 0.25) / 0.6 = 3.75 s, frame 90.
    let (slept, _) = (play(&mut sleeper, 84), play(&mut waker, 84));
    assert!(slept.iter().any(|s| s.asleep == 3), "the stack never slept: {:?}", sleeper.left_out());
    let before = gpu.read(sleeper.particles).unwrap();
    let (met, _) = (play(&mut sleeper, 24), play(&mut waker, 24));
    // The stack is awake, the body far from it is still asleep.
    assert_eq!(met[23].asleep, 1, "{:?}", sleeper.left_out());
    let naps = sleeper.left_out();
    assert!(naps[0][0][1] < 3.75 && naps[2][0][1] > 4.4, "{naps:?}");
    // The collision goes as it does without sleep: the same momentum, to what a swing of a hundredth of a cell a frame is.
    let momentum = |mpm: &Mpm| {
        let each = |i| mpm.measure(i).unwrap();
        let (stack, flier) = ([each(0), each(1)], each(3));
        (stack[0].momentum[0] + stack[1].momentum[0], flier.momentum[0])
    };
    let ((stack, flier), (stack_awake, flier_awake)) = (momentum(&sleeper), momentum(&waker));
    let size = 0.6 * sleeper.measure(3).unwrap().mass;
    assert!(flier_awake < 0.5 * size, "they have met: {flier_awake} of {size} is left");
    assert!((stack - stack_awake).abs() < 0.02 * size, "{stack} for {stack_awake}");
    assert!((flier - flier_awake).abs() < 0.02 * size, "{flier} for {flier_awake}");
    // The one that stayed asleep has not moved by a bit.
    let range = sleeper.ranges()[2].clone();
    let after = gpu.read(sleeper.particles).unwrap();
    let (a, b) = (range.start as usize, range.end as usize);
    assert_eq!(before[a..b], after[a..b]);
    assert!(gpu.messages().is_empty());
}
