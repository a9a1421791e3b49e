//! Proofs of `wgsl/latent`, the inputs they share, and the twin of the noise. An item is the four elements of a lane,
//! so that sizes around those of workgroups are sizes around those of workgroups.

pub mod adapt;
pub mod flow_step;
pub mod mask_pool;
pub mod mix;
pub mod sde_step;
pub mod stats;

use std::f64::consts::TAU;

use super::{Ask, Call, Compared};
use crate::random::Random;

/// Philox4x32-10 (Salmon et al. 2011, equation of the S-box in section 3.3) with 64-bit products.
pub fn philox(counter: [u32; 4], key: [u32; 2]) -> [u32; 4] {
    let ([mut a, mut b, mut c, mut d], [mut k, mut l]) = (counter, key);
    for _ in 0..10 {
        let (p, q) = (u64::from(a) * 0xd251_1f53, u64::from(c) * 0xcd9e_8d57);
        (a, b, c, d) = ((q >> 32) as u32 ^ b ^ k, q as u32, (p >> 32) as u32 ^ d ^ l, p as u32);
        (k, l) = (k.wrapping_add(0x9e37_79b9), l.wrapping_add(0xbb67_ae85));
    }
    [a, b, c, d]
}

/// Two pairs of normals from four words: sqrt(−2 ln u) (cos 2πw, sin 2πw), u and w in the middle of 2³² steps.
pub fn box_muller(words: [u32; 4]) -> [f64; 4] {
    let [u, v, w, x] = words.map(|x| (f64::from(x) + 0.5) / 2f64.powi(32));
    let pair = |u: f64, turn: f64| [(TAU * turn).cos(), (TAU * turn).sin()].map(|c| (-2.0 * u.ln()).sqrt() * c);
    let ([a, b], [c, d]) = (pair(u, v), pair(w, x));
    [a, b, c, d]
}

/// The noise of elements `4 block .. 4 block + 4`.
pub fn normals(seed: [u32; 2], stream: u32, iteration: u32, block: u32) -> [f64; 4] {
    box_muller(philox([block, iteration, stream, 0], seed))
}

/// A call with a lane per item; odd seeds fold the workgroups into two rows.
fn each(items: usize, ask: Ask) -> Call {
    Call::new(items.div_ceil(64)).rows(1 + (ask.seed % 2) as u32)
}

/// Cells of a latent of so many items: a whole number of fours as mostly, odd, fewer than four, or more than elements.
fn cells(ask: Ask) -> usize {
    match ask.seed % 5 {
        0 => ask.items * 4 / 3,
        1 => ask.items.next_multiple_of(4),
        2 => 3,
        3 => ask.items | 1,
        _ => ask.items * 4 + 2,
    }
    .max(1)
}

/// Elements of a latent, and some more behind them, which no kernel may touch. Poison is what no arithmetic mends.
fn values(random: &mut Random, ask: Ask, more: usize) -> Vec<f32> {
    let mut values: Vec<f32> = (0..ask.items * 4 + more).map(|_| random.range(-3.0, 3.0)).collect();
    if ask.poison {
        let poison = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -f32::NAN, 1e30, f32::from_bits(0x7f80_0001), 1e-42];
        let start = random.below(13);
        for (turn, v) in values.iter_mut().skip(start).step_by(13).enumerate() {
            *v = poison[turn % poison.len()];
        }
    }
    values
}

/// A mask of so many cells: nothing, everything, and what is between.
fn mask(random: &mut Random, cells: usize) -> Vec<f32> {
    let mut weight = || [0.0, 1.0, 0.0, 1.0, random.range(0.05, 0.95)][random.below(5)];
    (0..cells).map(|_| weight()).collect()
}

/// What the twin says of an element.
#[derive(Clone, Copy)]
enum Want {
    /// It stays, bit for bit.
    Kept,
    /// A value, and the size of the numbers it is made of.
    Value(f64, f64),
}

/// The sum of some terms.
fn sum(terms: &[f64]) -> Want {
    Want::Value(terms.iter().sum(), terms.iter().map(|t| t.abs()).sum())
}

/// True when f32 has a finite number for it.
fn fits(x: f64) -> bool {
    x.abs() <= f64::from(f32::MAX)
}

/// Elements against the twin's; those behind the twin's last one are to stay.
fn compared(before: &[f32], got: &[f32], want: &[Want]) -> Vec<Compared> {
    let (mut kept, mut was, mut broken, mut breaks) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let (mut values, mut wants, mut scales) = (Vec::new(), Vec::new(), Vec::new());
    for (i, (b, g)) in before.iter().zip(got).enumerate() {
        match want.get(i).copied().unwrap_or(Want::Kept) {
            Want::Kept => {
                kept.push(g.to_bits());
                was.push(b.to_bits());
            }
            Want::Value(w, scale) => {
                broken.push(u32::from(!g.is_finite()));
                breaks.push(u32::from(!fits(w)));
                if fits(w) {
                    values.push(f64::from(*g));
                    wants.push(w);
                    scales.push(scale);
                }
            }
        }
    }
    vec![
        Compared::equal("elements that stay", &kept, &was),
        Compared::equal("elements that are not finite", &broken, &breaks),
        Compared::close("elements", values, wants, scales),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `kat_vectors` of Random123.
    #[test]
    fn philox_gives_the_known_answers() {
        assert_eq!(philox([0; 4], [0; 2]), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
        assert_eq!(philox([!0; 4], [!0; 2]), [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]);
        assert_eq!(
            philox([0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344], [0xa409_3822, 0x299f_31d0]),
            [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1]
        );
    }
}
