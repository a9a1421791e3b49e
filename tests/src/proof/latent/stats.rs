//! Proof of `latent/stats`: sum, sum of squares, range and count of every 2048 elements.

use physvideo_gpu::kernels::{Partial, Stats};

use super::{cells, mask, values};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "latent/stats",
    inputs,
    compare,
    tolerance: 3e-7,
    reason: "three rounds of eight numbers, one by one: at most two dozen roundings, which mostly cancel, relative to the \
             sum of the sizes",
    unordered: &[],
    bytes: 2.0 * 16.0,
    flops: 10.0 * 4.0,
};

fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed);
    let masked = ask.seed % 2 == 1;
    let cells = cells(ask);
    let z = values(&mut random, ask, 4);
    let mut mask = mask(&mut random, cells);
    if ask.seed % 4 == 3 {
        mask.fill(0.0);
    }
    let groups = ask.items.div_ceil(512);
    Call::new(groups)
        .rows(1 + (ask.seed % 2) as u32)
        .constant("MASKED", f64::from(u8::from(masked)))
        .immediates(&Stats { count: ask.items as u32 * 4, cells: cells as u32 })
        .with("z", &z)
        .with("mask", if masked { &mask[..] } else { &[] })
        .with("partials", &vec![Partial { sum: f32::NAN, count: 9, ..Default::default() }; groups])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let (z, mask): (Vec<f32>, Vec<f32>) = (call.buffers.get("z"), call.buffers.get("mask"));
    let given: Stats = bytemuck::pod_read_unaligned(&call.immediates);
    let partials: Vec<Partial> = out.get("partials");
    let (mut sums, mut want, mut scale, mut ranges, mut counts) = (vec![], vec![], vec![], vec![], vec![]);
    for (k, chunk) in z[..given.count as usize].chunks(2048).enumerate() {
        let cell = |i: usize| (k * 2048 + i) % given.cells as usize;
        let counts_in = |(i, _): &(usize, &f32)| mask.get(cell(*i)).is_none_or(|m| *m != 0.0);
        let (good, bad): (Vec<f64>, Vec<f64>) =
            chunk.iter().enumerate().filter(counts_in).map(|(_, x)| f64::from(*x)).partition(|x| x.is_finite());
        let squares: f64 = good.iter().map(|x| x * x).sum();
        let p = partials[k];
        sums.push(p.sum.into());
        want.push(good.iter().sum());
        scale.push(good.iter().map(|x| x.abs()).sum());
        // 1e30 has no square in f32.
        if squares < f64::from(f32::MAX) {
            sums.push(p.squares.into());
            want.push(squares);
            scale.push(squares);
        }
        let least = good.iter().copied().reduce(f64::min).unwrap_or(0.0);
        let most = good.iter().copied().reduce(f64::max).unwrap_or(0.0);
        ranges.push([p.smallest, p.largest].map(f64::from) == [least, most]);
        counts.push([p.count, p.faults] == [good.len() as u32, bad.len() as u32]);
    }
    vec![
        Compared::close("sums", sums, want, scale),
        Compared::fact("ranges", ranges.iter().all(|r| *r)),
        Compared::fact("counts", counts.iter().all(|c| *c)),
    ]
}
