//! Proof of `sph/weigh`: β = γ/γ₋, α = γ/(δ − β γ/α₋) of conjugate gradients (Chronopoulos & Gear 1989), and the end of a
//! solve.

use physvideo_gpu::kernels::{Clock, Descent, Scale};

use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "sph/weigh",
    inputs,
    compare,
    tolerance: 2e-6,
    reason: "sums of positive numbers, some ten in a row, and a difference of two of them",
    unordered: &[],
    bytes: 8.0,
    flops: 2.0,
};

fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed ^ (ask.items as u64) << 8);
    let partials: Vec<[f32; 2]> = (0..ask.items).map(|_| [random.range(0.5, 1.5), random.range(2.0, 8.0)]).collect();
    let n = ask.items as f32;
    // Of four seeds one opens, one begins, one goes on and one has little left; now and then it is over already.
    let kind = random.below(4);
    let scale = Scale { opens: u32::from(kind == 0), last: u32::from(random.chance(0.2)), tolerance: 1e-2 };
    let descent = Descent {
        groups: [if random.chance(0.2) { 0 } else { 8 }, 1, 1],
        iterations: if kind == 1 { 0 } else { 3 },
        size: n * random.range(1.0, 3.0),
        along: random.range(0.4, 0.8),
        turn: 0.5,
        first: n * if kind == 3 { 1e5 } else { 5.0 },
        all: 40,
        worst: 2,
        unsolved: 1,
        spare: 7,
    };
    Call::new(1)
        .immediates(&scale)
        .with("scale", &[scale])
        .with("descent", &[descent])
        .with("clock", &[Clock { particle_groups: [ask.items as u32, 1, 1], ..Default::default() }])
        .with("partials", &partials)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let b = &call.buffers;
    let (scale, before): (Scale, Descent) = (b.one("scale"), b.one("descent"));
    let partials: Vec<[f32; 2]> = b.get("partials");
    let sum = |k: usize| partials.iter().map(|p| f64::from(p[k])).sum::<f64>();
    let mut want = before;
    let (mut turn, mut along, mut first) = (f64::from(before.turn), f64::from(before.along), f64::from(before.first));
    let mut size = f64::from(before.size);
    if scale.opens == 1 {
        (want.groups, want.iterations) = ([partials.len() as u32, 1, 1], 0);
    } else if before.groups[0] > 0 {
        let (left, over) = (sum(0), sum(1));
        let begins = before.iterations == 0;
        first = if begins { left } else { first };
        let beta = if begins { 0.0 } else { left / size };
        let under = if begins { over } else { over - beta * left / along };
        let ends = left <= f64::from(scale.tolerance).powi(2) * first;
        if ends || under <= 0.0 || scale.last == 1 {
            want.groups[0] = 0;
            want.unsolved += u32::from(!ends);
        } else {
            (size, turn, along) = (left, beta, left / under);
            want.iterations += 1;
            want.all += 1;
            want.worst = want.worst.max(want.iterations);
        }
    }
    let after: Descent = out.one("descent");
    let words =
        |d: &Descent| [d.groups[0], d.groups[1], d.groups[2], d.iterations, d.all, d.worst, d.unsolved, d.spare];
    let got = [after.size, after.turn, after.along, after.first].map(f64::from).to_vec();
    let scales = vec![size, turn, 8.0 * along, first].into_iter().map(|s| s.abs() + 1e-12).collect();
    vec![
        Compared::equal("counts", &words(&after), &words(&want)),
        Compared::close("sizes", got, vec![size, turn, along, first], scales),
    ]
}
