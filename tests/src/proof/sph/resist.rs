//! Proof of `sph/resist`: v + dt D v + dt/(ρ h²) Σ 2 m_i m_j/(m_i + m_j) w e·(v_i − v_j) e, or what v* leaves of it,
//! dt D (wall − v*) − dt/(ρ h²) Σ …; ρ z·z and ρ z·Az of each particle, by its number.

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
    let mut numbers: Vec<u32> = (0..ask.items as u32).collect();
    liquid.random.shuffle(&mut numbers);
    liquid
        .call()
        .constant("OPENS", (ask.seed % 2) as f64)
        .with("motions", &motions)
        .with("locals", &locals)
        .with("answers", &vec![[0.0f32; 4]; ask.items])
        .with("numbers", &numbers)
        .with("shares", &vec![[f32::NAN; 2]; ask.items])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let b = &call.buffers;
    let placed = b.one::<Counts>("live").cursor as usize;
    let dt = f64::from(b.one::<Clock>("clock").dt);
    let (places, motions): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (b.get("places"), b.get("motions"));
    let locals: Vec<Local> = b.get("locals");
    let opens = call.constants == physvideo_gpu::Constants::none().with("OPENS", 1.0);
    let (answers, shares): (Vec<[f32; 4]>, Vec<[f32; 2]>) = (out.get("answers"), out.get("shares"));
    let numbers: Vec<u32> = b.get("numbers");
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    let (mut products, mut wants, mut sizes) = (Vec::new(), Vec::new(), Vec::new());
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
        let squeeze = vec3(&own.squeeze) * dt;
        let n = squeeze.try_normalize(0.0).unwrap_or_default();
        size += squeeze.norm() * (v.norm() + vec3(&own.slide).norm());
        let mut answer = if opens { (vec3(&own.slide) - v) * held - slowed } else { v + v * held + slowed };
        answer += squeeze * n.dot(&if opens { vec3(&own.slide) - v } else { v });
        if own.tag & PINNED != 0 {
            answer = Vec3::zeros();
        }
        got.extend(answers[i][..3].iter().map(|c| f64::from(*c)));
        want.extend(answer.iter());
        scale.extend([size; 3]);
        let density = f64::from(own.density);
        products.extend(shares[numbers[i] as usize].map(f64::from));
        wants.extend([density * v.dot(&v), density * v.dot(&answer)]);
        sizes.extend([density * v.dot(&v), density * v.norm() * size]);
    }
    let kept = (0..placed).all(|i| answers[i][3] == motions[i][3]);
    let mut all = vec![Compared::close("answers", got, want, scale), Compared::fact("the fourth goes on", kept)];
    if opens {
        all.push(Compared::fact("no products yet", shares.iter().all(|p| p[0].is_nan())));
    } else {
        all.push(Compared::close("products", products, wants, sizes));
    }
    all
}
