//! Proof of `sph/spread`: x − min(6 h V dt, 0.06 h²) (w + Σ V ∇W (1 + (W/W(h))²)) at most 0.05 h far, times min(V² ρ/p, 1),
//! without its part along S = w + Σ V ∇W where h |S| tells of a free surface; s before it, and
//! what is left of the debt, of which 4e-4 c dt/h is forgiven.

use physvideo_gpu::kernels::{Clock, Counts, Debt, Keep, Local};

use super::{Liquid, Vec3, gradient, h, vec3, weight};
use crate::proof::cloud::{LED, PINNED};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "sph/spread",
    inputs,
    compare,
    tolerance: 5e-5,
    reason: "distances are known to 1e-6 h in f32, and what pushes has derivatives of up to 60/h² where two are near; \
             relative to h",
    unordered: &[],
    bytes: 20.0 + 33.0 * 20.0 + 80.0 + 32.0,
    flops: 33.0 * 50.0,
};

/// Of four seeds two are of slow flows.
fn inputs(ask: Ask) -> Call {
    let mut liquid = Liquid::new(ask);
    let n = ask.items;
    let mut locals = liquid.locals();
    for own in &mut locals {
        own.tag |= if liquid.random.chance(0.1) { LED } else { 0 };
        own.wall = own.wall.map(|c| 0.3 * c);
    }
    let mut numbers: Vec<u32> = (0..n as u32).collect();
    liquid.random.shuffle(&mut numbers);
    let debt = |owed| Debt { owed, noted: 7.0, head: 4.0, spare: 0.0 };
    let debts: Vec<Debt> = (0..n).map(|_| debt(liquid.random.range(-0.1, 0.1))).collect();
    liquid
        .call()
        .with("locals", &locals)
        .with("numbers", &numbers)
        .with("spread", &vec![[5.0f32; 4]; n])
        .with("debts", &debts)
        .with("keep", &[Keep { apart: [0.03f32, 3.0][(ask.seed / 2 % 2) as usize].to_bits(), ..Default::default() }])
}

/// Near a free surface or not, by the slope of s times h: a cubic from 1 at 0.25 to 0 at 0.45.
pub(super) fn inside(slope: f64) -> f64 {
    let t = ((slope - 0.25) / 0.2).clamp(0.0, 1.0);
    1.0 - t * t * (3.0 - 2.0 * t)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let b = &call.buffers;
    let placed = b.one::<Counts>("live").cursor as usize;
    let (before, after): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (b.get("places"), out.get("spread"));
    let (locals, numbers): (Vec<Local>, Vec<u32>) = (b.get("locals"), b.get("numbers"));
    let (were, debts): (Vec<Debt>, Vec<Debt>) = (b.get("debts"), out.get("debts"));
    let speed = f64::from(f32::from_bits(b.one::<Keep>("keep").apart));
    let pace = (6.0 * h() * speed * f64::from(b.one::<Clock>("clock").dt)).min(0.06 * h() * h());
    let (mut got, mut want) = (Vec::new(), Vec::new());
    let (mut owed, mut owes, mut sizes, mut densities) = (Vec::new(), Vec::new(), Vec::new(), true);
    let clock: Clock = b.one("clock");
    let left = 1.0 - 4e-4 * f64::from(clock.wave_speed) * f64::from(clock.dt) / h();
    for i in 0..placed {
        let (x, own) = (vec3(&before[i]), &locals[i]);
        let (mut slope, mut push, mut fill) = (vec3(&own.wall), vec3(&own.wall), weight(0.0));
        for j in Liquid::near(call, i) {
            let d = x - vec3(&before[j]);
            let w = weight(d.norm() / h());
            slope += gradient(d);
            push += gradient(d) * (1.0 + (w / weight(1.0)).powi(2));
            fill += w;
        }
        let mut way = push * -pace;
        // A particle alone, without a wall, has none.
        let normal = slope.try_normalize(1e-20).unwrap_or_default();
        way -= normal * (normal.dot(&way) * (1.0 - inside(h() * slope.norm())));
        way *= (speed * speed / 4.0).min(1.0);
        if way.norm() > 0.05 * h() {
            way = way.normalize() * (0.05 * h());
        }
        let led = own.tag & (LED | PINNED) != 0;
        if led || own.fill < 0.75 {
            way = Vec3::zeros();
        }
        got.extend(after[i][..3].iter().map(|c| f64::from(*c)));
        want.extend((x + way).iter());
        densities &= after[i][3] == before[i][3];
        let row = |d: &Debt| [d.owed, d.noted, d.head].map(f64::from);
        let (was, now) = (row(&were[numbers[i] as usize]), row(&debts[numbers[i] as usize]));
        owed.extend(now);
        owes.extend(if led { [0.0, 0.0, 4.0] } else { [was[0] * left, fill, 4.0] });
        sizes.extend([0.1, 1.0, 4.0]);
    }
    vec![
        Compared::near("places", got, want, h()),
        Compared::close("debts", owed, owes, sizes),
        Compared::fact("densities are kept", densities),
    ]
}
