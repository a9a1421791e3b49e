//! Proof of `sph/force`: a = drive − 1/ρ (Σ (P_i + P_j) V∇W / steep + P_i ∇wall) − 1/(ρ h²) Σ 2 m_i m_j/(m_i + m_j) w e·(v_i − v_j) e
//! with m the viscosities (Solenthaler & Pajarola 2008; Monaghan 2005; Cleary 1998), then the implicit drag of walls that stick and, along their normals, of those that let slip; all
//! are left out where they are solved for. What is held stands still. Walls give what their drag changes of momentum times their velocity.

use physvideo_gpu::kernels::{Clock, Counts, Local};

use super::{Liquid, Vec3, gradient, h, rub, steep, vec3};
use crate::proof::cloud::PINNED;
use crate::proof::work::{Work, begun};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "sph/force",
    inputs,
    compare,
    tolerance: 2e-6,
    reason: "as the search: distances to 1e-6 h; relative to the sum of the sizes of the terms",
    unordered: &[],
    bytes: 33.0 * 36.0 + 64.0 + 48.0,
    flops: 33.0 * 40.0,
};

/// Odd seeds leave pressure to the solves, the third and fourth of four viscosity.
fn inputs(ask: Ask) -> Call {
    let mut liquid = Liquid::new(ask);
    let pressures = liquid.vectors(|r| [0.0, 0.0, 0.0, if r.chance(0.3) { 0.0 } else { r.range(0.0, 5e3) }]);
    let points: Vec<[f32; 4]> = liquid.places.iter().zip(&pressures).map(|(x, p)| [x[0], x[1], x[2], p[3]]).collect();
    let flows = liquid.vectors(|r| {
        let v = r.vector(2.0);
        [v[0], v[1], v[2], r.range(0.0, 2.0)]
    });
    let locals = liquid.locals();
    let call = liquid.call();
    let clock = begun(call.buffers.one("clock"));
    call.with("clock", &[clock])
        .constant("INCOMPRESSIBLE", (ask.seed % 2) as f64)
        .constant("IMPLICIT", (ask.seed % 4 / 2) as f64)
        .constant("COUNTS_WORK", 1.0)
        .with("points", &points)
        .with("flows", &flows)
        .with("locals", &locals)
        .with("flown", &vec![[0.0f32; 4]; ask.items])
}

/// Acceleration by pressures, and the size of its terms.
pub(super) fn pressure(call: &Call, i: usize) -> (Vec3, f64) {
    let (points, locals): (Vec<[f32; 4]>, Vec<Local>) = (call.buffers.get("points"), call.buffers.get("locals"));
    let of = |j: usize| f64::from(points[j][3]);
    let (mut sum, mut size) = (vec3(&locals[i].wall) * of(i), 0.0);
    size += sum.norm();
    for j in Liquid::near(call, i) {
        let g = gradient(vec3(&points[i]) - vec3(&points[j])) * ((of(i) + of(j)) / steep());
        sum += g;
        size += g.norm() + (of(i) + of(j)) * 0.02 / h();
    }
    let density = f64::from(locals[i].density);
    (-sum / density, size / density)
}

/// Rate of change of velocity by viscosity that two particles at a distance d have on each other, times the density, and
/// the size of its terms: near ones know the line that joins them to 1e-7 m. Of each v and the viscosity.
pub(super) fn viscous(d: Vec3, a: &[f32; 4], b: &[f32; 4]) -> (Vec3, f64) {
    let (m, n) = (f64::from(a[3]), f64::from(b[3]));
    let (r, e, over) = (d.norm(), d.normalize(), vec3(a) - vec3(b));
    let shared = if m + n > 0.0 { 2.0 * m * n / (m + n) } else { 0.0 };
    let k = rub(r / h()) * shared / (h() * h());
    (-e * (k * over.dot(&e)), k * over.norm() * (1.0 + 0.1 * h() / r))
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let placed = call.buffers.one::<Counts>("live").cursor as usize;
    let dt = f64::from(call.buffers.one::<Clock>("clock").dt);
    let (flows, locals): (Vec<[f32; 4]>, Vec<Local>) = (call.buffers.get("flows"), call.buffers.get("locals"));
    let points: Vec<[f32; 4]> = call.buffers.get("points");
    let method = |pressed: f64, implicit: f64| {
        let constants = physvideo_gpu::Constants::none().with("COUNTS_WORK", 1.0);
        constants.with("INCOMPRESSIBLE", 1.0 - pressed).with("IMPLICIT", implicit)
    };
    let pressed = [0.0, 1.0].iter().any(|i| call.constants == method(1.0, *i));
    let implicit = [0.0, 1.0].iter().any(|p| call.constants == method(*p, 1.0));
    let flown: Vec<[f32; 4]> = out.get("flown");
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    let mut done = Work::default();
    for i in 0..placed {
        let (own, v) = (&locals[i], vec3(&flows[i]));
        let (mut a, mut size) = (vec3(&own.drive), vec3(&own.drive).norm());
        if pressed {
            let (p, s) = pressure(call, i);
            a += p;
            size += s;
        }
        for j in Liquid::near(call, i).into_iter().filter(|_| !implicit) {
            let (term, most) = viscous(vec3(&points[i]) - vec3(&points[j]), &flows[i], &flows[j]);
            a += term / f64::from(own.density);
            size += most / f64::from(own.density);
        }
        let held = if implicit { 0.0 } else { dt * f64::from(own.drag) };
        let before = v + a * dt;
        let slid = (before + vec3(&own.slide) * held) / (1.0 + held);
        let squeeze = vec3(&own.squeeze) * if implicit { 0.0 } else { dt };
        let (rate, n) = (squeeze.norm(), squeeze.try_normalize(0.0).unwrap_or_default());
        let free = slid - n * ((slid - vec3(&own.slide)).dot(&n) * rate / (1.0 + rate));
        let next = if own.tag & PINNED != 0 { Vec3::zeros() } else { free };
        if !implicit && own.tag & PINNED == 0 {
            let mass = f64::from(own.density) * h().powi(3);
            let most = mass * (v.norm() + dt * size + vec3(&own.slide).norm()) * vec3(&own.slide).norm();
            done.add(mass * (free - before).dot(&vec3(&own.slide)), most, true);
        }
        got.extend(flown[i][..3].iter().map(|c| f64::from(*c)));
        want.extend(next.iter());
        scale.extend([v.norm() + dt * size; 3]);
    }
    let kept = (0..placed).all(|i| flown[i][3] == flows[i][3]);
    let (begun, clock): (Clock, Clock) = (call.buffers.one("clock"), out.one("clock"));
    vec![
        Compared::close("velocities", got, want, scale),
        Compared::fact("the fourth goes on", kept),
        done.compare(&begun, &clock, true, CASE.tolerance),
    ]
}
