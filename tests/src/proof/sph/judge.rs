//! Proof of `sph/judge`: a solve opens with the particles' workgroups and ends when the mean error is small enough.

use physvideo_gpu::kernels::{Clock, Counts, Rule, Solve};

use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "sph/judge",
    inputs,
    compare,
    tolerance: 0.0,
    reason: "integers; the mean is kept clear of the tolerance",
    unordered: &[],
    bytes: 0.5,
    flops: 0.05,
};

/// Seeds run through opening, going on, ending, ending without success, and being over already.
fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed ^ (ask.items as u64) << 8);
    let n = ask.items as u32;
    let mean = [2e-3, 2e-5][random.below(2)];
    let rule = Rule {
        opens: u32::from(ask.seed.is_multiple_of(4)),
        least: random.below(5) as u32 + 1,
        last: u32::from(ask.seed % 3 == 1),
        tolerance: 2e-4,
    };
    let solve = Solve {
        groups: [if ask.seed % 5 == 2 { 0 } else { 8 }, 1, 1],
        iterations: random.below(4) as u32,
        residual: (mean * 65536.0 * n.max(1) as f32) as u32,
        all: 40,
        worst: 2,
        unsolved: 1,
    };
    Call::new(1)
        .immediates(&rule)
        .with("rule", &[rule])
        .with("solve", &[solve])
        .with("live", &[Counts { cursor: n, ..Default::default() }])
        .with("clock", &[Clock { particle_groups: [5, 1, 1], ..Default::default() }])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let (rule, mut want): (Rule, Solve) = (call.buffers.one("rule"), call.buffers.one("solve"));
    let n = f64::from(call.buffers.one::<Counts>("live").cursor.max(1));
    if rule.opens == 1 {
        (want.groups, want.iterations, want.residual) = ([5, 1, 1], 0, 0);
    } else if want.groups[0] > 0 {
        let mean = f64::from(want.residual) / 65536.0 / n;
        (want.residual, want.iterations, want.all) = (0, want.iterations + 1, want.all + 1);
        want.worst = want.worst.max(want.iterations);
        if want.iterations >= rule.least && mean <= f64::from(rule.tolerance) {
            want.groups[0] = 0;
        } else {
            want.unsolved += rule.last;
        }
    }
    let words =
        |s: &Solve| [s.groups[0], s.groups[1], s.groups[2], s.iterations, s.residual, s.all, s.worst, s.unsolved];
    vec![Compared::equal("solve", &words(&out.one("solve")), &words(&want))]
}
