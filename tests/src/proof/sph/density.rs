//! Proof of `sph/density`: s = V Σ W with the particle's own share, Σ V ∇W and Σ |V ∇W|²/ρ over the listed.

use physvideo_gpu::kernels::{Counts, Crowd};

use super::{Liquid, Vec3, gradient, h, vec3, weight};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "sph/density",
    inputs,
    compare,
    tolerance: 4e-6,
    reason: "distances are known to 1e-6 h in f32 and |slope| ≤ 1/h, its derivative ≤ 3/h²; relative to the sum of the \
             sizes of the terms",
    unordered: &[],
    bytes: 20.0 + 33.0 * 20.0 + 32.0,
    flops: 33.0 * 40.0,
};

/// The sums are what the other proofs of SPH are given.
fn inputs(ask: Ask) -> Call {
    let liquid = Liquid::new(ask);
    let found: Vec<u32> = liquid.crowds.iter().map(|c| c.count).collect();
    liquid.call().with("found", &found).with("crowds", &vec![Crowd::default(); ask.items])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let placed = call.buffers.one::<Counts>("live").cursor as usize;
    let places: Vec<[f32; 4]> = call.buffers.get("places");
    let (found, lists): (Vec<u32>, Vec<u32>) = (call.buffers.get("found"), call.buffers.get("lists"));
    let crowds: Vec<Crowd> = out.get("crowds");
    let n = places.len();
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    for (i, crowd) in crowds.iter().enumerate().take(placed) {
        let (mut fill, mut slope, mut coupling, mut size) = (weight(0.0), Vec3::zeros(), 0.0, 0.0);
        for k in 0..found[i] as usize {
            let j = lists[(k / 4 * n + i) * 4 + k % 4] as usize;
            let d = vec3(&places[i]) - vec3(&places[j]);
            let g = gradient(d);
            fill += weight(d.norm() / h());
            slope += g;
            coupling += g.norm_squared() / f64::from(places[j][3]);
            size += g.norm();
        }
        got.extend([f64::from(crowd.fill), f64::from(crowd.coupling)]);
        got.extend(crowd.slope.map(f64::from));
        want.extend([fill, coupling, slope[0], slope[1], slope[2]]);
        let least = size + 0.01 / h();
        scale.extend([fill, coupling + 1.0 / 400.0 / h() / h() * 1e-2, least, least, least]);
    }
    let counts = |c: &[u32]| c[..placed].to_vec();
    let kept: Vec<u32> = crowds.iter().map(|c| c.count).collect();
    vec![Compared::close("sums", got, want, scale), Compared::equal("counts", &counts(&kept), &counts(&found))]
}
