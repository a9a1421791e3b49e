//! Proof of `sph/adopt`: new places by the particles' numbers, walls' part of the debt w·Δx, motion beyond the common one
//! |v − drift| + |Δx|/dt.

use physvideo_gpu::kernels::{Clock, Counts, Debt, Keep, Local};

use super::{Liquid, h, vec3};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "sph/adopt",
    inputs,
    compare,
    tolerance: 3e-6,
    reason: "a few products in f32, of differences of places of 0.5 m that are known to 3e-8 m",
    unordered: &[],
    bytes: 16.0 + 16.0 + 16.0 + 4.0 + 32.0 + 16.0,
    flops: 30.0,
};

const DEBT: Debt = Debt { owed: 0.25, noted: 0.5, head: 0.5, spare: 0.0 };

fn inputs(ask: Ask) -> Call {
    let mut liquid = Liquid::new(ask);
    let n = ask.items;
    let mut spread = liquid.places.clone();
    for x in &mut spread {
        let way = liquid.random.vector(0.1 * h() as f32);
        (0..3).for_each(|a| x[a] += way[a]);
    }
    // One has lost its way where the inputs are poisoned.
    if ask.poison {
        spread[0][1] = f32::NAN;
    }
    let moves = liquid.vectors(|r| {
        let v = r.vector(3.0);
        [v[0], v[1], v[2], f32::from_bits(r.below(3) as u32)]
    });
    let mut numbers: Vec<u32> = (0..n as u32).collect();
    liquid.random.shuffle(&mut numbers);
    let locals = liquid.locals();
    let mut call = liquid
        .call()
        .with("spread", &spread)
        .with("locals", &locals)
        .with("moves", &moves)
        .with("numbers", &numbers)
        .with("particles", &vec![[5.0f32; 4]; 6 * n])
        .with("debts", &vec![DEBT; n])
        .with("keep", &[Keep { drift: [0.4, -0.3, 0.2], apart: 0.1f32.to_bits(), ..Default::default() }]);
    call.immediates.clear();
    call
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let b = &call.buffers;
    let placed = b.one::<Counts>("live").cursor as usize;
    let dt = f64::from(b.one::<Clock>("clock").dt);
    let (spread, before): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (b.get("spread"), b.get("places"));
    let (moves, locals): (Vec<[f32; 4]>, Vec<Local>) = (b.get("moves"), b.get("locals"));
    let (numbers, kept): (Vec<u32>, Keep) = (b.get("numbers"), b.one("keep"));
    let (places, particles): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (out.get("places"), out.get("particles"));
    let (debts, keep): (Vec<Debt>, Keep) = (out.get("debts"), out.one("keep"));
    let (mut there, mut got, mut want, mut apart) = (true, Vec::new(), Vec::new(), 0.1);
    for i in 0..placed {
        let at = numbers[i] as usize;
        if !spread[i][..3].iter().all(|c| c.is_finite()) {
            there &= places[i] == before[i] && particles[6 * at] == [5.0; 4] && debts[at] == DEBT;
            continue;
        }
        let way = vec3(&spread[i]) - vec3(&before[i]);
        let head = particles[6 * at];
        there &= places[i] == spread[i] && head[..3] == spread[i][..3] && head[3].to_bits() == moves[i][3].to_bits();
        there &= Debt { owed: 0.25, ..debts[at] } == DEBT && (1..6).all(|k| particles[6 * at + k] == [5.0; 4]);
        got.push(f64::from(debts[at].owed));
        want.push(0.25 + vec3(&locals[i].wall).dot(&way));
        apart = f64::max(apart, (vec3(&moves[i]) - vec3(&kept.drift)).norm() + way.norm() / dt);
    }
    vec![
        Compared::fact("places and tags, and what is not its own", there),
        Compared::near("debts", got, want, 1.0),
        Compared::near("beyond the common velocity", vec![f32::from_bits(keep.apart).into()], vec![apart], apart),
    ]
}
