//! Proof of `sph/descend`: p ← z + β p, Ap ← Az + β Ap, v ← v + α p, z ← z − α Ap (Chronopoulos & Gear 1989).

use physvideo_gpu::kernels::{Counts, Descent};

use super::{Liquid, Vec3, vec3};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "sph/descend",
    inputs,
    compare,
    tolerance: 4e-7,
    reason: "two products and two sums in f32, relative to the sum of the sizes",
    unordered: &[],
    bytes: 9.0 * 16.0,
    flops: 24.0,
};

/// Odd seeds begin: there is no direction yet, and nobody may look at it.
fn inputs(ask: Ask) -> Call {
    let mut liquid = Liquid::new(ask);
    let begins = ask.seed % 2 == 1;
    let mut vectors = |of: f32| {
        liquid.vectors(|r| {
            let v = r.vector(2.0);
            [v[0], v[1], v[2], of]
        })
    };
    let (pulls, lefts, flown) = (vectors(1.0), vectors(2.0), vectors(3.0));
    let (mut aims, mut draws) = (vectors(0.0), vectors(0.0));
    if begins {
        aims.fill([f32::NAN; 4]);
        draws.fill([f32::NAN; 4]);
    }
    let descent = Descent { along: 0.7, turn: if begins { 0.0 } else { 0.3 }, ..Default::default() };
    Call { immediates: Vec::new(), ..liquid.call() }
        .with("descent", &[descent])
        .with("pulls", &pulls)
        .with("lefts", &lefts)
        .with("aims", &aims)
        .with("draws", &draws)
        .with("flown", &flown)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let placed = call.buffers.one::<Counts>("live").cursor as usize;
    let d: Descent = call.buffers.one("descent");
    let (along, turn) = (f64::from(d.along), f64::from(d.turn));
    let names = ["aims", "draws", "flown", "lefts"];
    let after = names.map(|n| out.get::<[f32; 4]>(n));
    let was = ["pulls", "lefts", "aims", "draws", "flown"].map(|n| call.buffers.get::<[f32; 4]>(n));
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..placed {
        let [pull, left, aim, draw, v] = [0, 1, 2, 3, 4].map(|k: usize| vec3(&was[k][i]));
        let begun = |v: Vec3| if turn == 0.0 { Vec3::zeros() } else { v * turn };
        let (p, ap) = (left + begun(aim), pull + begun(draw));
        for (k, vector) in [p, ap, v + p * along, left - ap * along].into_iter().enumerate() {
            got.extend(after[k][i][..3].iter().map(|c| f64::from(*c)));
            want.extend(vector.iter());
            scale.extend([8.0; 3]);
        }
    }
    let kept = (0..placed).all(|i| after[2][i][3] == was[4][i][3] && after[3][i][3] == was[1][i][3]);
    vec![Compared::close("vectors", got, want, scale), Compared::fact("the fourth stays", kept)]
}
