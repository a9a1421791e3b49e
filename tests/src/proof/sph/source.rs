//! Proof of `sph/source`: s − 1 + dt ds/dt, or max(dt ds/dt, 0) where there is fluid, with ds/dt = Σ V ∇W·(v_i − v_j) + v·∇wall −
//! drift (Bender & Koschier 2015, eq. 8–9 over number densities).

use physvideo_gpu::kernels::{Clock, Counts, Local};

use super::{Liquid, Vectors, gradient, h, vec3};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "sph/source",
    inputs,
    compare,
    tolerance: 2e-6,
    reason: "as the search: distances to 1e-6 h; relative to the sum of the sizes of the terms",
    unordered: &[],
    bytes: 33.0 * 36.0 + 64.0 + 64.0,
    flops: 33.0 * 30.0,
};

/// Odd seeds are of the divergence solve.
fn inputs(ask: Ask) -> Call {
    let mut liquid = Liquid::new(ask);
    let flows = liquid.vectors(|r| {
        let v = r.vector(2.0);
        [v[0], v[1], v[2], 1.0]
    });
    let warm = liquid.vectors(|r| [1.0, 2.0, r.range(0.0, 9.0), r.range(0.0, 9.0)]);
    let points = liquid.vectors(|r| [0.0, 0.0, 0.0, r.range(0.0, 9.0)]);
    let locals = liquid.locals();
    liquid
        .call()
        .constant("DIVERGENCE", (ask.seed % 2) as f64)
        .with("flows", &flows)
        .with("warm", &warm)
        .with("locals", &locals)
        .with("points", &points)
        .with("wants", &vec![0u32; ask.items])
        .with("stirs", &vec![7u32; ask.items])
}

/// Rate of s when the vectors are velocities, and the size of its terms.
pub(super) fn rate(call: &Call, i: usize, of: &[[f32; 4]]) -> (f64, f64) {
    let (places, locals): (Vec<[f32; 4]>, Vec<Local>) = (call.buffers.get("places"), call.buffers.get("locals"));
    let (v, wall) = (vec3(&of[i]), vec3(&locals[i].wall));
    let (mut sum, mut size) = (v.dot(&wall), v.norm() * wall.norm());
    for j in Liquid::near(call, i) {
        let g = gradient(vec3(&places[i]) - vec3(&places[j]));
        let apart = v - vec3(&of[j]);
        sum += apart.dot(&g);
        size += apart.norm() * (g.norm() + 0.02 / h());
    }
    (sum, size)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let b = &call.buffers;
    let placed = b.one::<Counts>("live").cursor as usize;
    let dt = f64::from(b.one::<Clock>("clock").dt);
    let divergence = call.constants == physvideo_gpu::Constants::none().with("DIVERGENCE", 1.0);
    let (flows, warm, places): (Vectors, Vectors, Vectors) = (b.get("flows"), b.get("warm"), b.get("places"));
    let locals: Vec<Local> = b.get("locals");
    let before: Vec<[f32; 4]> = b.get("points");
    let (wants, points): (Vec<f32>, Vec<[f32; 4]>) = (out.get("wants"), out.get("points"));
    let (mut want, mut scale, mut start) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..placed {
        let (sum, size) = rate(call, i, &flows);
        let (drift, fill) = (f64::from(locals[i].drift), f64::from(locals[i].fill));
        let excess = dt * (sum - drift);
        want.push(match divergence {
            true if fill < 0.75 => 0.0,
            true => excess.max(0.0),
            false => (fill - 1.0).min(0.05) + excess,
        });
        scale.push(fill * 0.1 + dt * (size + drift.abs()));
        let w = 0.7 * if divergence { warm[i][3] } else { warm[i][2] };
        start.push([places[i][0], places[i][1], places[i][2], w]);
    }
    let kept: Vec<u32> = out.get("stirs");
    let stirs: Vec<u32> = (0..placed).map(|i| if divergence { 7 } else { before[i][3].to_bits() }).collect();
    vec![
        Compared::close("excess", wants[..placed].iter().map(|w| f64::from(*w)).collect(), want, scale),
        Compared::fact("it starts from the last step's pressure", points[..placed] == start[..]),
        Compared::equal("what the divergence solve found", &kept[..placed], &stirs),
    ]
}
