//! Proof of `sph/total`: sums over the particles of each sorted group that have a place.

use physvideo_gpu::kernels::Clock;

use crate::proof::lattice::{NOWHERE, awake};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "sph/total",
    inputs,
    compare,
    tolerance: 1e-6,
    reason: "sums of 64 positive numbers, at most fourteen in a row",
    unordered: &[],
    bytes: 12.0,
    flops: 2.0,
};

fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed ^ 0x707);
    let keys: Vec<u32> =
        (0..ask.items).map(|_| if random.chance(0.1) { NOWHERE } else { random.below(1 << 20) as u32 }).collect();
    // Those without a place hold what an earlier pass left, or no number.
    let lost = if ask.poison { f32::NAN } else { 5.0 };
    let shares: Vec<[f32; 2]> = keys
        .iter()
        .map(|k| if *k == NOWHERE { [lost; 2] } else { [random.range(0.0, 1.0), random.range(0.0, 9.0)] })
        .collect();
    let awake = awake(ask.items, ask.seed);
    Call::new(awake.len())
        .with("keys", &keys)
        .with("clock", &[Clock { particles: ask.items as u32, ..Default::default() }])
        .with("shares", &shares)
        .with("partials", &vec![[f32::NAN; 2]; awake.len()])
        .with("awake", &awake)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let b = &call.buffers;
    let (keys, awake): (Vec<u32>, Vec<u32>) = (b.get("keys"), b.get("awake"));
    let shares: Vec<[f32; 2]> = b.get("shares");
    let sum = |group: &u32, k: usize| {
        let all = (*group as usize * 64..keys.len().min(*group as usize * 64 + 64)).filter(|p| keys[*p] != NOWHERE);
        all.map(|p| f64::from(shares[p][k])).sum::<f64>()
    };
    let want: Vec<f64> = awake.iter().flat_map(|g| [sum(g, 0), sum(g, 1)]).collect();
    let got = out.get::<[f32; 2]>("partials").iter().flatten().map(|c| f64::from(*c)).collect();
    let scale = want.iter().map(|w| w + 1e-3).collect();
    vec![Compared::close("sums", got, want, scale)]
}
