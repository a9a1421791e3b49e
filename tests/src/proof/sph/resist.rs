//! Proof of `sph/resist`: v + dt D v + dt/(ρ h²) Σ 2 m_i m_j/(m_i + m_j) w e·(v_i − v_j) e, or what v* leaves of it,
//! dt D (wall − v*) − dt/(ρ h²) Σ …; sums Σ ρ z·z and Σ ρ z·Az of each workgroup.

use physvideo_gpu::kernels::{Clock, Counts, Local};

use super::{Liquid, Vec3, force, vec3};
use crate::proof::cloud::PINNED;
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "sph/resist",
    inputs,
    compare,
    tolerance: 2e-6,
    reason: "as the search: distances to 1e-6 h; relative to the sum of the sizes of the terms",
    unordered: &[],
    bytes: 33.0 * 36.0 + 64.0 + 32.0,
    flops: 33.0 * 30.0,
};

/// Odd seeds open a solve.
fn inputs(ask: Ask) -> Call {
    let mut liquid = Liquid::new(ask);
    let motions = liquid.vectors(|r| {
        let v = r.vector(2.0);
        [v[0], v[1], v[2], if r.chance(0.2) { 0.0 } else { r.range(0.0, 200.0) }]
    });
    let locals = liquid.locals();
    let groups = ask.items.div_ceil(64) + 1;
    liquid
        .call()
        .constant("OPENS", (ask.seed % 2) as f64)
        .with("motions", &motions)
        .with("locals", &locals)
        .with("answers", &vec![[0.0f32; 4]; ask.items])
        .with("partials", &vec![[f32::NAN; 2]; groups])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let b = &call.buffers;
    let placed = b.one::<Counts>("live").cursor as usize;
    let dt = f64::from(b.one::<Clock>("clock").dt);
    let (places, motions): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (b.get("places"), b.get("motions"));
    let locals: Vec<Local> = b.get("locals");
    let opens = call.constants == physvideo_gpu::Constants::none().with("OPENS", 1.0);
    let (answers, partials): (Vec<[f32; 4]>, Vec<[f32; 2]>) = (out.get("answers"), out.get("partials"));
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    let (mut sums, mut sizes) = (vec![[0.0; 2]; partials.len()], vec![[0.0; 2]; partials.len()]);
    for i in 0..placed {
        let (own, v) = (&locals[i], vec3(&motions[i]));
        let held = dt * f64::from(own.drag);
        let (mut slowed, mut size) = (Vec3::zeros(), v.norm() + held * (v.norm() + vec3(&own.slide).norm()));
        for j in Liquid::near(call, i) {
            let d = vec3(&places[i]) - vec3(&places[j]);
            let (term, most) = force::viscous(d, &motions[i], &motions[j]);
            slowed -= term * (dt / f64::from(own.density));
            size += most * dt / f64::from(own.density);
        }
        let mut answer = if opens { (vec3(&own.slide) - v) * held - slowed } else { v + v * held + slowed };
        if own.tag & PINNED != 0 {
            answer = Vec3::zeros();
        }
        got.extend(answers[i][..3].iter().map(|c| f64::from(*c)));
        want.extend(answer.iter());
        scale.extend([size; 3]);
        let density = f64::from(own.density);
        for (k, (sum, most)) in [(v.dot(&v), v.dot(&v)), (v.dot(&answer), v.norm() * size)].into_iter().enumerate() {
            sums[i / 64][k] += density * sum;
            sizes[i / 64][k] += density * most;
        }
    }
    let kept = (0..placed).all(|i| answers[i][3] == motions[i][3]);
    let mut all = vec![Compared::close("answers", got, want, scale), Compared::fact("the fourth goes on", kept)];
    if opens {
        all.push(Compared::fact("no sums yet", partials.iter().all(|p| p[0].is_nan())));
    } else {
        let flat = |sums: &[[f64; 2]]| sums.iter().flatten().copied().collect::<Vec<_>>();
        let got = partials.iter().flatten().map(|c| f64::from(*c)).collect();
        all.push(Compared::close("sums", got, flat(&sums), flat(&sizes)));
    }
    all
}
