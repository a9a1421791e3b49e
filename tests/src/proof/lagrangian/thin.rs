//! Proof of `lagrangian/thin`: to the shares of a cell, −Σ V P(F) ∇N over its listed places.

use physvideo_gpu::kernels::{Clock, ElasticCell, Place, Solid, ThinCell};

use super::point::{Flags, Share, Told};
use super::{Bodies, WAVE, at_point, solids};
use crate::proof::mpm::{Mat3, vec3};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "lagrangian/thin",
    inputs,
    compare,
    tolerance: 3e-6,
    reason: "polar decomposition (2e-6) and sums of some hundred products in f32, relative to the size of the terms",
    unordered: &[],
    bytes: 450.0 + 864.0 + 200.0,
    flops: 12000.0,
};

/// One to three fours of places in each of two thirds of the cells, some of which are none.
pub fn parts(b: &mut Bodies, random: &mut Random) -> (Vec<ThinCell>, Vec<Place>) {
    let (mut thins, mut places) = (Vec::new(), Vec::new());
    for cell in 0..b.cells.len() as u32 {
        if random.chance(0.33) {
            continue;
        }
        let count = 4 * (1 + random.below(3) as u32);
        thins.push(ThinCell { cell, first: places.len() as u32, count, points: random.below(256) as u32 });
        for _ in 0..count {
            let share = if random.chance(0.2) { 0.0 } else { random.range(0.1, 0.6) };
            places.push(Place { x: random.vector(0.5), share });
        }
    }
    b.sizes.thin = thins.len() as u32;
    (thins, places)
}

fn inputs(ask: Ask) -> Call {
    let mut b = Bodies::new(ask);
    let mut random = Random::new(ask.seed ^ 0x41);
    if ask.poison {
        for (i, u) in b.u.iter_mut().enumerate().skip(3).step_by(37) {
            u[i % 3] = [f32::NAN, f32::INFINITY, 1e30, -3e38][i % 4];
        }
    }
    let (thins, places) = parts(&mut b, &mut random);
    let shares: Vec<[f32; 4]> = (0..27 * b.cells.len())
        .map(|_| {
            let [x, y, z] = random.vector(0.5);
            [x, y, z, f32::NAN]
        })
        .collect();
    let clock = Clock { wave_speed: WAVE as f32, speed_bits: 0.5f32.to_bits(), ..Default::default() };
    Call::new(b.cells.len().div_ceil(64) + 1)
        .immediates(&b.sizes)
        .with("cells", &b.cells)
        .with("solids", &solids())
        .with("thins", &thins)
        .with("places", &places)
        .with("u", &b.u)
        .with("v", &b.v)
        .constant("DAMPED", f64::from(u8::from(ask.seed % 2 == 1)))
        .constant("SHOCKED", f64::from(u8::from(ask.seed % 4 < 2)))
        .with("shares", &shares)
        .same("shares_was", "shares")
        .with("clock", &[clock])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let (cells, solids): (Vec<ElasticCell>, Vec<Solid>) = (input.get("cells"), input.get("solids"));
    let (thins, places): (Vec<ThinCell>, Vec<Place>) = (input.get("thins"), input.get("places"));
    let (u, v): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (input.get("u"), input.get("v"));
    let (was, now): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (input.get("shares"), out.get("shares"));
    let (before, clock): (Clock, Clock) = (input.one("clock"), out.one("clock"));
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    let mut told = Told::default();
    let mut kept = vec![true; cells.len()];
    for thin in &thins {
        let cell = &cells[thin.cell as usize];
        kept[cell.slot as usize] = false;
        let solid = &solids[(cell.mask >> 16) as usize];
        let mut given = Share::new(1.0);
        for p in &places[thin.first as usize..(thin.first + thin.count) as usize] {
            let place = p.x.map(f64::from);
            let f = Mat3::identity() + at_point(cell, &u, place).1;
            // What is not there may still be NaN times nothing.
            given.tainted |= !f.iter().all(|c| c.is_finite() && c.abs() < 1e9);
            if p.share > 0.0 {
                given.add(&mut told, (solid, cell), (&u, &v), (place, p.share.into()), Flags::of(call));
            }
        }
        given.tell(&mut told, solid);
        if given.tainted {
            continue;
        }
        for (slot, sum) in given.sum.iter().enumerate() {
            let at = slot * cells.len() + cell.slot as usize;
            got.extend(now[at][..3].iter().map(|c| f64::from(*c)));
            want.extend((vec3(&was[at]) + sum).iter());
            scale.extend([given.size; 3]);
        }
    }
    let left = (0..27 * cells.len()).filter(|at| kept[at % cells.len()]).all(|at| now[at][..3] == was[at][..3]);
    let mut all = vec![
        Compared::close("forces on the nodes", got, want, scale),
        Compared::fact("other cells are left alone", left),
    ];
    all.extend(told.compared(&before, &clock));
    all
}
