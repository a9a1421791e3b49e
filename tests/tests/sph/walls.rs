//! Obstacles that coincide, that come down on each other, and that leave no room.

use physvideo::fluid::Fluid;
use physvideo::scene::Pressure;
use physvideo::stages::solver::FrameStats;
use physvideo::stages::sph::Sph;
use physvideo::world::World;
use physvideo_gpu::kernels::Collider;
use physvideo_gpu::kernels::family::shape::BOX;
use physvideo_gpu::{Gpu, Options};
use physvideo_tests::device::{self, gpu};
use physvideo_tests::folder;
use physvideo_tests::liquid::{lattice, liquid, room, world};
use physvideo_tests::problems::sph::{Tank, tank};

const H: f64 = 0.02;
const BOTH: [Pressure; 2] = [Pressure::Wcsph, Pressure::Dfsph];

/// A device whose kernels have another line, and the folder that they are read from.
fn without(file: &str, from: &str, to: &str) -> (tempfile::TempDir, Gpu) {
    let copy = tempfile::tempdir().unwrap();
    folder::copy_kernels(copy.path());
    folder::edit(copy.path(), file, from, to);
    let gpu = device::open(Options { wgsl: Some(copy.path().into()), validation: false, ..device::options() });
    (copy, gpu)
}

/// Water at rest on a floor along which, in its plane, another slides: neither its pressure nor its rest knows of it. The bound
/// is that of the tank without (`tank.rs`).
#[test]
fn surfaces_that_coincide_are_one() {
    let end = |gpu: &Gpu, pressure| {
        let fluid = Fluid { pressure, ..Default::default() };
        let r = tank(gpu, &Tank { fluid, slides: 0.3, ..Default::default() }).unwrap();
        (r.base, r.frames.iter().map(|f| f.gained + f.rejected + f.sunk).sum::<u32>())
    };
    let (_folder, doubled) = without("lib/wall", "1.0 / crowd", "1.0");
    for pressure in BOTH {
        let (base, faults) = end(&gpu(), pressure);
        assert!(base < 0.01 && faults == 0, "{pressure:?}: base off by {base:.1e}, {faults} faults");
        // Control: each of them counts.
        let (base, faults) = end(&doubled, pressure);
        assert!(base > 0.05 || faults > 0, "{pressure:?}: base off by {base:.1e}, {faults} faults");
    }
}

/// What became of a run.
#[derive(Debug, Default)]
struct Run {
    fastest: f64,
    sunk: u32,
    faults: u32,
    stalled: bool,
    last: FrameStats,
}

fn run(gpu: &Gpu, w: &World, frames: u32, length: f32) -> Run {
    let mut sph = Sph::new(gpu, w).unwrap();
    let mut out = Run::default();
    for _ in 0..frames {
        let s = sph.frame(length).unwrap();
        out.fastest = out.fastest.max(sph.measure(0).unwrap().speed);
        out.sunk = out.sunk.max(s.sunk);
        out.faults += s.gained + s.rejected + s.quarantined + u32::from(s.unmended);
        out.stalled |= s.stalled.is_some();
        out.last = s;
        if s.stalled.is_some() || s.pressed.is_some() {
            break;
        }
    }
    out
}

/// A plunger of 6 h comes down into water 6 h deep until it stands on the floor; there is room at two of its sides.
fn plunged(pressure: Pressure) -> World {
    let (wide, deep) = (24.0 * H, 4.0 * H);
    let body = liquid(1000.0, 1e-3, H, lattice(H, [0.0; 3], [wide, deep, 6.0 * H]));
    let mut w = world(pressure, H, vec![body], [-0.1; 3], [wide + 0.1, deep + 0.1, 1.0]);
    w.gravity = [0.0, 0.0, -9.81];
    let (from, speed) = (7.0 * H, 0.5);
    let plunger = Collider {
        shape: BOX,
        velocity: [0.0, 0.0, -speed, 0.0],
        end: from as f32 / speed,
        ..room([9.0 * H, -1.0, from], [15.0 * H, 1.0, from + 1.0])
    };
    w.colliders = vec![room([0.0; 3], [wide, deep, 0.9]), plunger];
    w
}

/// What is below goes out at the sides. Control: where images fill a gap that has no room for them, solves for pressure end
/// the run (WCSPH gets through with them too).
#[test]
fn a_plunger_reaches_the_floor() {
    let (_folder, crowded) = without("lib/wall", "smoothstep(0.0, 1.0, -c)", "0.0");
    for pressure in BOTH {
        let r = run(&gpu(), &plunged(pressure), 20, 0.02);
        // Bernoulli's speed for what is pushed out at its rim from a gap of h: 0.5 m/s · 3 h/h, and some splash.
        assert!(!r.stalled && r.faults == 0 && r.sunk == 0 && r.fastest < 8.0, "{pressure:?}: {r:?}");
    }
    let r = run(&crowded, &plunged(Pressure::Dfsph), 20, 0.02);
    assert!(r.stalled || r.faults > 0, "{r:?}");
}

/// A lid that fits comes down by `share` of the depth of water that fills its room.
fn lidded(pressure: Pressure, share: f64) -> World {
    let (side, depth) = (6.0 * H, 8.0 * H);
    let body = liquid(1000.0, 1e-3, H, lattice(H, [0.0; 3], [side, side, depth]));
    let mut w = world(pressure, H, vec![body], [-0.1; 3], [side + 0.1, side + 0.1, 0.5]);
    w.gravity = [0.0, 0.0, -9.81];
    let lid = Collider {
        shape: BOX,
        velocity: [0.0, 0.0, -0.5, 0.0],
        end: (share * depth / 0.5) as f32,
        ..room([-1.0, -1.0, depth], [2.0, 2.0, depth + 1.0])
    };
    w.colliders = vec![room([0.0; 3], [side, side, 0.4]), lid];
    w
}

/// Half of the volume does not hold what filled all of it, and both solvers say so. A hundredth less is held by the
/// compressible one.
#[test]
fn what_is_pressed_in_on_all_sides_is_named() {
    for pressure in BOTH {
        let r = run(&gpu(), &lidded(pressure, 0.5), 20, 0.02);
        let pressed = r.last.pressed.unwrap_or_else(|| panic!("{pressure:?}: {r:?}"));
        let whole = 36.0 * 8.0 * H.powi(3);
        assert!((pressed.needed / whole - 1.0).abs() < 1e-3, "{pressed:?}");
        assert!((0.5..0.99).contains(&(pressed.left / whole)) && pressed.body == 0, "{pressed:?}");
    }
    let r = run(&gpu(), &lidded(Pressure::Wcsph, 0.01), 8, 0.02);
    assert!(r.last.pressed.is_none() && r.faults + r.sunk == 0 && r.fastest < 2.0, "{r:?}");
}

/// A jet well above the speed of sound goes through the wall that it meets, and one below it does not.
#[test]
fn what_goes_through_walls_is_counted() {
    let jet = |speed: f32| {
        let mut body = liquid(1000.0, 1e-3, H, lattice(H, [2.0 * H, 2.0 * H, 0.0], [6.0 * H, 6.0 * H, 12.0 * H]));
        body.velocities.fill([0.0, 0.0, -speed]);
        let mut w = world(Pressure::Wcsph, H, vec![body], [-0.3; 3], [0.5; 3]);
        w.colliders = vec![room([0.0; 3], [8.0 * H, 8.0 * H, 0.45])];
        run(&gpu(), &w, 6, 0.002)
    };
    let (slow, fast) = (jet(8.0), jet(60.0));
    assert_eq!(slow.sunk, 0, "{slow:?}");
    assert!(fast.sunk > 10, "{fast:?}");
}
