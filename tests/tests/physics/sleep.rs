//! What is at rest is left out block by block, wakes before anything reaches it, and changes nothing that is seen.

use physvideo::assemble::{Inputs, assemble};
use physvideo::plan::Plan;
use physvideo::scene::{Field, Force, Material, Until, parse};
use physvideo::stages::mpm::{Method, Mpm};
use physvideo::stages::solver::{FrameStats, Solver};
use physvideo::world::{Body, World, field, ground};
use physvideo_gpu::kernels::Particle;
use physvideo_gpu::{Gpu, Options};
use physvideo_tests::device::{self, gpu};
use physvideo_tests::folder;
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

/// Largest distance between particles of the same number [cells].
fn apart(a: &[Particle], b: &[Particle]) -> f64 {
    let far = |(p, q): (&Particle, &Particle)| (0..3).map(|i| f64::from(p.x[i] - q.x[i]).powi(2)).sum::<f64>().sqrt();
    a.iter().zip(b).map(far).fold(0.0, f64::max) / DX
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
    let particles = w.bodies.iter().map(|b| b.positions.len() as u32).sum();
    assert_eq!((last.groups, last.substeps, last.asleep), (0, 0, particles), "{:?}", sleeper.left_out());
    assert!(awake[95].groups == all && awake[95].substeps > 0 && awake[95].asleep == 0);
    // Seen from outside nothing differs by more than a few hundredths of a cell, which is what is left of the swings.
    let far = apart(&gpu.read(sleeper.particles).unwrap(), &gpu.read(waker.particles).unwrap());
    assert!(far < 0.05, "{far} cells");
}

#[test]
fn what_flies_into_a_stack_wakes_it_in_time() {
    let gpu = gpu();
    let w = stack(Some(0.6));
    let (mut sleeper, mut waker) = (solver(&gpu, &w, true), solver(&gpu, &w, false));
    // It reaches the stack after (2.5 − 0.25) / 0.6 = 3.75 s, frame 90.
    let (slept, _) = (play(&mut sleeper, 84), play(&mut waker, 84));
    let each = w.bodies[0].positions.len() as u32;
    assert!(slept.iter().any(|s| s.asleep == 3 * each), "the stack never slept: {:?}", sleeper.left_out());
    let before = gpu.read(sleeper.particles).unwrap();
    let (met, _) = (play(&mut sleeper, 24), play(&mut waker, 24));
    // The stack is awake, the body far from it is still asleep.
    let naps = sleeper.left_out();
    assert_eq!(met[23].asleep, each, "{naps:?}");
    assert!(naps[0][0].to < 3.75 && naps[2][0].to > 4.4, "{naps:?}");
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

/// A long bar on the ground with much drag, and a ball that comes down on one end of it after 1.3 s.
fn bar() -> World {
    let lattice = Lattice::of_eight(DX);
    let soft = || Material::Elastic { young: 2e4, poisson: 0.3 };
    let (length, width) = (48.0 * DX, 4.0 * DX);
    let long = lattice.body(soft(), 500.0, &lattice.fill([0.0; 3], [length, width, width], |_| true), |_| [0.0; 3]);
    let center = [3.0 * DX, 2.0 * DX, 4.0 * DX + 1.3 * 3.0];
    let inside = |x: [f64; 3]| (0..3).map(|a| (x[a] - center[a]).powi(2)).sum::<f64>() < (2.0 * DX).powi(2);
    let corner = |way: f64| center.map(|c| c + way * 2.0 * DX);
    let places = lattice.fill(corner(-1.0), corner(1.0), inside);
    let ball = lattice.body(soft(), 500.0, &places, |_| [0.0, 0.0, -3.0]);
    let ball = Body { gravity: Some([0.0; 3]), fields: 0, ..ball };
    let mut w = world(vec![long, ball], DX, [-0.5, -0.5, -0.25], [3.5, 0.75, 5.0]);
    w.gravity = [0.0, 0.0, -9.81];
    w.colliders = vec![ground(0.0, 0.5)];
    let force = Force::Damping { rate: [30.0; 3] };
    let drag = Field { force, region: None, start: 0.0, end: 1e9, ramp: 0.0, objects: None };
    w.fields = vec![field(&drag, 0, 0)];
    w
}

/// Its waves come further in a frame than the ball: watching tells of them before they meet what sleeps.
#[test]
fn a_blow_on_one_end_wakes_that_end() {
    let gpu = gpu();
    let w = bar();
    let long = w.bodies[0].positions.len() as u32;
    let (mut sleeper, mut waker) = (solver(&gpu, &w, true), solver(&gpu, &w, false));
    let repeat = &mut solver(&gpu, &w, true);
    // Control: with nobody to tell, waves are thrown back where sleep begins, until the frame is over.
    let copy = tempfile::tempdir().unwrap();
    folder::copy_kernels(copy.path());
    folder::edit(copy.path(), "mpm/g2p", "atomicAdd(&clock.stirred, 1u);", "");
    let deaf_gpu = device::open(Options { wgsl: Some(copy.path().into()), ..device::options() });
    let mut deaf = solver(&deaf_gpu, &w, true);
    let (mut far, mut far_deaf, mut woken, mut least) = (0.0f64, 0.0f64, 0, long);
    for frame in 0..60 {
        let (stats, _, _) = (sleeper.frame(FRAME).unwrap(), waker.frame(FRAME).unwrap(), deaf.frame(FRAME).unwrap());
        assert_eq!(stats, repeat.frame(FRAME).unwrap());
        assert_eq!((stats.rejected, stats.gained), (0, 0));
        let awake = gpu.read(waker.particles).unwrap();
        let a = apart(&awake, &gpu.read(sleeper.particles).unwrap());
        let b = apart(&awake, &deaf_gpu.read(deaf.particles).unwrap());
        (far, far_deaf) = (far.max(a), far_deaf.max(b));
        woken += stats.woken;
        if frame == 25 {
            assert_eq!(stats.asleep, long, "all of the bar rests before it is hit");
        } else if frame > 25 {
            least = least.min(stats.asleep);
        }
    }
    assert!(woken > 0, "no wave came to what was watched: this test tests nothing");
    assert!(least < long * 3 / 4 && least > long / 4, "{least} of {long} slept on");
    assert!(far < 0.01, "{far} cells");
    assert!(far_deaf > 1.5 * far, "{far_deaf} cells where waking is broken, {far} as it is");
    assert_eq!(gpu.read(sleeper.particles).unwrap(), gpu.read(repeat.particles).unwrap());
    assert!(gpu.messages().is_empty());
}

/// A wind that begins while a stack sleeps moves it as it would have moved it awake.
#[test]
fn a_wind_wakes_what_it_blows_on() {
    let gpu = gpu();
    let mut w = stack(None);
    let force = Force::Wind { velocity: [6.0, 0.0, 0.0], drag: 4.0, gust: 0.0, frequency: 0.0 };
    let wind = Field { force, region: None, start: 3.51, end: 1e9, ramp: 0.0, objects: None };
    w.fields.push(field(&wind, 1, 0));
    w.bodies[2].fields = 1;
    let (mut sleeper, mut waker) = (solver(&gpu, &w, true), solver(&gpu, &w, false));
    let (slept, _) = (play(&mut sleeper, 84), play(&mut waker, 84));
    let each = w.bodies[0].positions.len() as u32;
    assert_eq!(slept[83].asleep, 3 * each, "{:?}", sleeper.left_out());
    let (blown, _) = (play(&mut sleeper, 24), play(&mut waker, 24));
    // It does not blow on the third.
    assert!(blown.iter().all(|s| s.asleep == each), "{:?}", blown[23]);
    let speed = |mpm: &Mpm| mpm.measure(1).unwrap().momentum[0] / mpm.measure(1).unwrap().mass;
    let (a, b) = (speed(&sleeper), speed(&waker));
    assert!(b > 0.3 && (a - b).abs() < 0.02 * b, "{a} for {b} m/s");
}

/// A long frame in which a field throws a ball at a sleeping bed: nothing near the bed moves when the frame begins, and the
/// ball is through it before the frame ends. How far fields may push counts in who is woken.
#[test]
fn a_field_throws_a_ball_into_a_bed_that_sleeps() {
    let gpu = gpu();
    let scene = parse(
        "[ground]
         friction = 0.4
         [simulation]
         grid_density = 32
         domain = { min = [-0.9, -0.2, -0.05], max = [0.9, 0.2, 1.2] }
         [[collider]]
         shape.room = { center = [0.3, 0.0, 0.6], half = [0.3, 0.0625, 0.6] }
         [[object]]
         name = 'bed'
         source.box = { min = [0.0, -0.0625, 0.0], max = [0.6, 0.0625, 0.09375] }
         material.sand = {}
         density = 1600.0
         [[object]]
         name = 'ball'
         source.ball = { center = [0.3, 0.0, 0.6], radius = 0.05 }
         material.elastic = { young = 1e6 }
         density = 3000.0
         gravity = [0.0, 0.0, 0.0]
         [[field]]
         force.uniform = { acceleration = [0.0, 0.0, -60] }
         objects = ['ball']
         start = 0.992
         [output]
         fps = 8",
        "thrown.toml",
    )
    .unwrap();
    let world = assemble(&scene, &Inputs::default(), &Plan::new(&scene, Until::State)).unwrap().world;
    let ends = |sleep: bool| {
        let mut mpm = solver(&gpu, &world, sleep);
        let slept = (0..10).map(|_| mpm.frame(0.125).unwrap().asleep).max().unwrap();
        let ball = mpm.measure(1).unwrap();
        (slept, ball.height / ball.mass)
    };
    let ((slept, asleep), (_, awake)) = (ends(true), ends(false));
    assert!(slept > 1000, "{slept} slept: this test tests nothing");
    // Rounding; where fields did not count it came to lie 4 mm higher.
    assert!((asleep - awake).abs() < 1e-3, "the ball lies at {asleep} m, and at {awake} m where nothing sleeps");
}
