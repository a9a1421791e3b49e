//! Proof of `lagrangian/force`: f_i = −Σ V0 P(F) ∇N_i over the points of a cell, and Σ N_i f of what pushes points and
//! faces, N taken where the push is.

use physvideo_gpu::kernels::{Clock, ElasticCell, Reference, Solid};

use super::point::{Flags, Share, Told};
use super::{Bodies, WAVE, around, quarter, solids, weight};
use crate::proof::mpm::vec3;
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "lagrangian/force",
    inputs,
    compare,
    tolerance: 3e-6,
    reason: "polar decomposition (2e-6) and sums of some hundred products in f32, relative to the size of the terms",
    unordered: &[],
    bytes: 450.0 + 432.0,
    flops: 4800.0,
};

/// Some cells are squeezed flat or turned inside out.
fn inputs(ask: Ask) -> Call {
    let mut b = Bodies::new(ask);
    let mut random = Random::new(ask.seed ^ 0xf0);
    if ask.seed % 4 == 2 {
        b.u.iter_mut().for_each(|u| u[..3].iter_mut().for_each(|c| *c *= 5.0));
    }
    if ask.poison {
        for (i, u) in b.u.iter_mut().enumerate().skip(3).step_by(37) {
            u[i % 3] = [f32::NAN, f32::INFINITY, 1e30, -3e38][i % 4];
        }
    }
    let push = |random: &mut Random, w: f32| {
        let [x, y, z] = random.vector(0.4);
        [x, y, z, w]
    };
    let pushes: Vec<[f32; 4]> = (0..4 * b.skins.len())
        .map(|i| {
            let above = if i % 4 == 0 { 7.0 } else { [-0.25, 0.25][random.below(2)] };
            push(&mut random, above)
        })
        .collect();
    // Of three seeds, one calls for the cells that may be pushed, one for the others, and one for all, of which none is.
    let pushed = ask.seed % 3 == 1;
    if ask.seed % 3 == 2 {
        b.sizes.touched = 0;
    }
    let clock = Clock { wave_speed: WAVE as f32, speed_bits: 0.5f32.to_bits(), ..Default::default() };
    Call::new(b.cells.len().div_ceil(64) + 1)
        .constant("PUSHED", f64::from(u8::from(pushed)))
        .immediates(&b.sizes)
        .with("sizes", &[b.sizes, Reference { touched: u32::from(pushed), ..b.sizes }])
        .with("cells", &b.cells)
        .with("solids", &solids())
        .with("u", &b.u)
        .with("v", &b.v)
        .constant("DAMPED", f64::from(u8::from(ask.seed % 2 == 1)))
        .constant("SHOCKED", f64::from(u8::from(ask.seed % 4 < 2)))
        .with("pushes", &pushes)
        .with("clock", &[clock])
        .with("shares", &vec![[f32::NAN; 4]; 27 * b.cells.len()])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let (cells, solids): (Vec<ElasticCell>, Vec<Solid>) = (input.get("cells"), input.get("solids"));
    let (u, pushes): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (input.get("u"), input.get("pushes"));
    let v: Vec<[f32; 4]> = input.get("v");
    let shares: Vec<[f32; 4]> = out.get("shares");
    let (was, clock): (Clock, Clock) = (input.one("clock"), out.one("clock"));
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    let (mut told, mut kept) = (Told::default(), true);
    let sizes: Vec<Reference> = input.get("sizes");
    let pushed = sizes[1].touched == 1;
    for (i, cell) in cells.iter().enumerate() {
        if (i < sizes[0].touched as usize) != pushed {
            kept &= (0..27).all(|slot| shares[slot * cells.len() + cell.slot as usize][0].is_nan());
            continue;
        }
        let solid = &solids[(cell.mask >> 16) as usize];
        let mut given = Share::new(1e-6);
        for corner in (0..8).filter(|k| cell.mask >> k & 1 == 1) {
            given.add(&mut told, (solid, cell), (&u, &v), (quarter(corner), 1.0), Flags::of(call));
        }
        let surface = (0..8).filter(|k| pushed && cell.mask >> (8 + k) & 1 == 1);
        for (skin, corner) in (cell.skin as usize..).zip(surface) {
            for which in 0..4 {
                let push = &pushes[4 * skin + which];
                let mut place = quarter(corner);
                if which > 0 {
                    place[which - 1] += f64::from(push[3]);
                }
                for (sum, s) in given.sum.iter_mut().zip(around()) {
                    *sum += weight(s, place) * vec3(push);
                }
                given.size += vec3(push).norm();
            }
        }
        given.tell(&mut told, solid);
        if given.tainted {
            continue;
        }
        for (slot, sum) in given.sum.iter().enumerate() {
            let share = &shares[slot * cells.len() + cell.slot as usize];
            got.extend(share[..3].iter().map(|c| f64::from(*c)));
            want.extend(sum.iter());
            scale.extend([given.size; 3]);
        }
    }
    let mut all = vec![
        Compared::close("forces on the nodes", got, want, scale),
        Compared::fact("the cells of the other call are left alone", kept),
    ];
    all.extend(told.compared(&was, &clock));
    all
}
