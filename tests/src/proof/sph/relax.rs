//! Proof of `sph/relax`: Q = max(P + ω e/(dt² A), 0), ω ½ or 0.4, with e the excess and what the accelerations do about it, then Nesterov's
//! P ← max(Q + k/(k+3) (Q − Q of the pass before), 0); Σ of what is left.

use physvideo_gpu::kernels::{Clock, Counts, Local, Solve};

use super::{Liquid, source};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "sph/relax",
    inputs,
    compare,
    tolerance: 1e-5,
    reason: "as the search: distances to 1e-6 h; relative to the sum of the sizes of the terms. The sum of what is left \
             is kept in steps of 2⁻¹⁶ a workgroup and 2⁻²² a particle",
    unordered: &[],
    bytes: 33.0 * 36.0 + 64.0 + 40.0,
    flops: 33.0 * 30.0,
};

fn inputs(ask: Ask) -> Call {
    let mut liquid = Liquid::new(ask);
    let points = liquid.vectors(|r| [0.0, 0.0, 0.0, if r.chance(0.5) { 0.0 } else { r.range(0.0, 2e3) }]);
    let pushes = liquid.vectors(|r| {
        let a = r.vector(40.0);
        [a[0], a[1], a[2], 0.0]
    });
    let wants: Vec<f32> = (0..ask.items).map(|_| liquid.random.range(-0.02, 0.02)).collect();
    let lasts: Vec<f32> = (0..ask.items).map(|_| liquid.random.range(0.0, 2e3)).collect();
    let locals = liquid.locals();
    liquid
        .call()
        .constant("IMPLICIT", (ask.seed % 2) as f64)
        .with("pushes", &pushes)
        .with("locals", &locals)
        .with("points", &points)
        .with("wants", &wants)
        .with("lasts", &lasts)
        .with(
            "solve",
            &[Solve { residual: 11, iterations: ask.seed as u32 % 4, groups: [9, 1, 1], ..Default::default() }],
        )
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let b = &call.buffers;
    let placed = b.one::<Counts>("live").cursor as usize;
    let dt = f64::from(b.one::<Clock>("clock").dt);
    let (pushes, before): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (b.get("pushes"), b.get("points"));
    let (wants, locals): (Vec<f32>, Vec<Local>) = (b.get("wants"), b.get("locals"));
    let after: Vec<[f32; 4]> = out.get("points");
    let lasts: Vec<f32> = b.get("lasts");
    let found: Vec<f32> = out.get("lasts");
    let implicit = call.constants == physvideo_gpu::Constants::none().with("IMPLICIT", 1.0);
    let relaxed = if implicit { 0.4 } else { 0.5 };
    let turn = f64::from(b.one::<Solve>("solve").iterations);
    let (mut got, mut want, mut scale, mut left, mut doubt) = (Vec::new(), Vec::new(), Vec::new(), 0.0, 0.0);
    for i in 0..placed {
        let (sum, size) = source::rate(call, i, &pushes);
        let excess = f64::from(wants[i]) + dt * dt * sum;
        let each = relaxed / (dt * dt * f64::from(locals[i].response));
        let pressure = (f64::from(before[i][3]) + each * excess).max(0.0);
        let last = if turn == 0.0 { f64::from(before[i][3]) } else { f64::from(lasts[i]) };
        got.extend([f64::from(found[i]), f64::from(after[i][3])]);
        want.extend([pressure, (pressure + turn / (turn + 3.0) * (pressure - last)).max(0.0)]);
        let terms = f64::from(before[i][3]) + each * (f64::from(wants[i]).abs() + dt * dt * size);
        scale.extend([terms, terms + last]);
        left += excess.clamp(0.0, 0.05);
        doubt += 1e-5 * (dt * dt * size + excess.abs());
    }
    let solve: Solve = out.one("solve");
    let groups = placed.div_ceil(64) as f64;
    let sum = (f64::from(solve.residual) - 11.0) / 65536.0;
    let room = doubt + groups / 65536.0 + placed as f64 / 65536.0 / 64.0;
    vec![
        Compared::close("pressures", got, want, scale),
        // Within the room it has: relative to it, times the tolerance.
        Compared::near("what is left", vec![sum], vec![left], room / CASE.tolerance + 1e-12),
        Compared::fact("nothing else of the solve", f64::from(solve.iterations) == turn && solve.groups == [9, 1, 1]),
    ]
}
