//! Proof of `sph/press`: accelerations by pressures alone, or the velocities that took them.

use physvideo_gpu::kernels::{Clock, Counts};

use super::{Liquid, force, vec3};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "sph/press",
    inputs,
    compare,
    tolerance: 2e-6,
    reason: "as the search: distances to 1e-6 h; relative to the sum of the sizes of the terms",
    unordered: &[],
    bytes: 33.0 * 20.0 + 64.0 + 48.0,
    flops: 33.0 * 30.0,
};

/// Odd seeds end a solve.
fn inputs(ask: Ask) -> Call {
    let mut liquid = Liquid::new(ask);
    let pressures = liquid.vectors(|r| [0.0, 0.0, 0.0, if r.chance(0.3) { 0.0 } else { r.range(0.0, 5e3) }]);
    let points: Vec<[f32; 4]> = liquid.places.iter().zip(&pressures).map(|(x, p)| [x[0], x[1], x[2], p[3]]).collect();
    let flows = liquid.vectors(|r| {
        let v = r.vector(2.0);
        [v[0], v[1], v[2], 1.0]
    });
    let locals = liquid.locals();
    liquid
        .call()
        .constant("LAST", (ask.seed % 2) as f64)
        .with("points", &points)
        .with("flows", &flows)
        .with("locals", &locals)
        .with("pushes", &vec![[0.0f32; 4]; ask.items])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let placed = call.buffers.one::<Counts>("live").cursor as usize;
    let dt = f64::from(call.buffers.one::<Clock>("clock").dt);
    let last = call.constants == physvideo_gpu::Constants::none().with("LAST", 1.0);
    let before: Vec<[f32; 4]> = call.buffers.get("flows");
    let (flows, pushes): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (out.get("flows"), out.get("pushes"));
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..placed {
        let (a, size) = force::pressure(call, i);
        let v = vec3(&before[i]);
        let (result, expected, size) =
            if last { (flows[i], v + a * dt, v.norm() + dt * size) } else { (pushes[i], a, size) };
        got.extend(result[..3].iter().map(|c| f64::from(*c)));
        want.extend(expected.iter());
        scale.extend([size + 1e-9; 3]);
    }
    let untouched =
        if last { pushes.iter().all(|p| *p == [0.0; 4]) } else { out.bytes("flows") == call.buffers.bytes("flows") };
    vec![Compared::close("what is made", got, want, scale), Compared::fact("the other stays", untouched)]
}
