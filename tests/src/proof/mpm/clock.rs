//! Proof of `mpm/clock`: the step is the elastic wave limit, evened out over what is left of the frame.

use physvideo_gpu::kernels::{Clock, Live};

use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

/// The shortest step as a share of the frame.
const LEAST_STEP: f64 = 2.5e-7;

pub static CASE: Case = Case {
    kernel: "mpm/clock",
    inputs,
    compare,
    tolerance: 4e-7,
    reason: "a sum, a difference and two divisions in f32 (6e-8 each), relative to the frame for t and to the step for dt",
    unordered: &[],
    bytes: 0.2,
    flops: 0.02,
};

/// A clock within a frame.
pub(crate) fn sample(ask: Ask) -> Clock {
    let mut random = Random::new(ask.seed);
    let length = random.range(0.01, 0.1);
    Clock {
        frame_start: random.range(0.0, 5.0),
        frame_length: length,
        t: length * random.range(0.0, 0.9),
        dt: length * random.range(0.0, 0.05),
        dx: random.range(0.005, 0.05),
        courant: 0.75,
        wave_speed: random.range(10.0, 60.0),
        speed_bits: random.range(0.0, 80.0).to_bits(),
        substeps: random.below(100) as u32,
        dt_min: if random.chance(0.3) { 0.0 } else { random.range(1e-5, 1e-2) },
        dt_max: random.range(1e-5, 1e-2),
        clamped_velocity: 3,
        quarantined: 4,
        left: 1,
        particles: ask.items as u32,
        idle: ask.items as u32 / 3,
        runs: std::array::from_fn(|i| match i {
            0 => [7, 1, 1, 65],
            1 => [0, 1, 1, ask.items as u32],
            7 | 13 => [1, 1, 1, i as u32],
            _ => [0; 4],
        }),
        ..Default::default()
    }
}

/// Seeds run through a plain step, the end of a frame, overflow, a forced step, one too long, one too short.
fn inputs(ask: Ask) -> Call {
    let mut clock = sample(ask);
    let length = clock.frame_length;
    let mut live = Live { blocks: 3, nodes: 9, cursor: 100, rows: 70, row_groups: 2, upper: 6, ..Default::default() };
    match ask.seed % 10 {
        1 => clock.t = length - clock.dt,
        2 => live.overflow = 2,
        5 => live.crowded = 1,
        8 => (clock.wave_speed, clock.speed_bits) = (1e-4, 0), // one step is more than the frame
        9 => clock.longest = length * 0.003,
        6 => clock.watch = 1,
        // Those that only left the domain are no fault.
        7 => (clock.watch, clock.clamped_velocity, clock.quarantined, clock.left) = (1, 0, 2, 2),
        3 if ask.items == 65 => (clock.watch, clock.clamped_velocity, clock.quarantined, clock.left) = (1, 0, 2, 2),
        3 => clock.force_dt = length * 0.01,
        0 if ask.items == 1000 => clock.stirred = 1,
        0 if ask.items == 65 => clock.force_dt = length * 1e-7,
        4 => clock.force_dt = length * 2.0,
        _ => {}
    }
    if ask.poison {
        clock.speed_bits = [f32::NAN, -f32::NAN, f32::INFINITY, f32::MAX][ask.items % 4].to_bits();
    }
    Call::new(1).with("clock", &[clock]).with("live", &[live])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let (was, live_was): (Clock, Live) = (call.buffers.one("clock"), call.buffers.one("live"));
    let (now, live): (Clock, Live) = (out.one("clock"), out.one("live"));
    let live_want = Live {
        blocks_y: 1,
        blocks_z: 1,
        nodes_y: 1,
        nodes_z: 1,
        row_groups_y: 1,
        row_groups_z: 1,
        overflow: live_was.overflow,
        crowded: live_was.crowded,
        ..Default::default()
    };
    let mut compared = compare_clock(&was, &live_was, &now);
    compared.push(Compared::fact("the list of blocks is empty", live == live_want));
    compared
}

/// A clock after its tick, given what it was and what the sort had no room for.
pub(crate) fn compare_clock(was: &Clock, live_was: &Live, now: &Clock) -> Vec<Compared> {
    let of = |x: f32| f64::from(x);
    let t = of(was.t) + of(was.dt);
    let done = of(was.frame_length) - t <= 1e-6 * of(was.frame_length);
    let full = live_was.overflow + live_was.crowded > 0;
    let fault = was.watch != 0 && was.clamped_velocity + was.quarantined - was.left > 0;
    // A speed that is not finite counts as the largest there is: the step is then as good as nothing.
    let speed = f32::from_bits(was.speed_bits);
    let speed = if speed.is_finite() { of(speed) } else { of(f32::MAX) };
    let mut limit = of(was.courant) * of(was.dx) / of(was.wave_speed).max(speed);
    if was.longest > 0.0 {
        limit = limit.min(of(was.longest));
    }
    let left = of(was.frame_length) - t;
    let forced = of(was.force_dt) > 0.0;
    // As few equal steps as the limit allows; a thousandth of a step over it is let pass.
    let dt = if forced { left.min(of(was.force_dt)) } else { left / (left / limit - 1e-3).ceil().max(1.0) };
    let early = full || fault || was.stirred > 0;
    // Time in f32 would not pass.
    let stalled = !done && !early && dt < LEAST_STEP * of(was.frame_length);
    let stop = done || early || stalled;
    let groups = if stop { 0 } else { (was.particles - was.idle).div_ceil(64) };
    let mut facts = vec![
        Compared::equal("groups", &now.particle_groups, &[groups, 1, 1]),
        Compared::equal(
            "groups of the runs",
            &now.runs.map(|r| r[0]),
            &was.runs.map(|r| if stop { 0 } else { r[3].div_ceil(64) }),
        ),
        Compared::equal("particles of the runs", &now.runs.map(|r| r[3]), &was.runs.map(|r| r[3])),
        Compared::equal("substeps", &[now.substeps], &[was.substeps + u32::from(!stop)]),
        Compared::near(
            "t",
            vec![of(now.t)],
            vec![if done && !early { of(was.frame_length) } else { t }],
            of(was.frame_length),
        ),
        Compared::equal("stalled", &[now.stalled], &[u32::from(stalled)]),
        Compared::fact("a step is never negative, infinite or NaN", now.dt.is_finite() && now.dt >= 0.0),
    ];
    if stop {
        facts.push(Compared::fact("no step", now.dt == 0.0));
        if stalled {
            facts.push(Compared::near(
                "the speed that stalls it",
                vec![of(f32::from_bits(now.speed_bits))],
                vec![speed],
                speed,
            ));
        }
        return facts;
    }
    // Below the smallest normal f32 a device may flush to zero.
    let scale = dt.max(1e-30);
    let min = if was.dt_min == 0.0 { dt } else { dt.min(of(was.dt_min)) };
    // A difference of nearly equal times: what t lost to rounding shows in what is left.
    let lost = 1.0 + of(was.frame_length) / left;
    facts.extend([
        Compared::near("dt", vec![of(now.dt)], vec![dt], scale * lost),
        Compared::near("dt_min", vec![of(now.dt_min)], vec![min], scale * lost),
        Compared::near("dt_max", vec![of(now.dt_max)], vec![dt.max(of(was.dt_max))], of(was.dt_max).max(dt) * lost),
        Compared::equal("the largest speed starts anew", &[now.speed_bits], &[0]),
    ]);
    facts
}
