//! Proof of `lagrangian/force`: f_i = −Σ V0 P(F) ∇N_i over the points of a cell, and Σ N_i f of what pushes points and
//! faces, N taken where the push is.

use physvideo_gpu::kernels::{Clock, ElasticCell, Reference, Solid};

use super::{
    Bodies, DX, WAVE, around, at_point, cofactor, damped, gradient, piola, quarter, shock, solids, squash, viscous,
    weight,
};
use crate::proof::mpm::{Mat3, Vec3, vec3};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "lagrangian/force",
    inputs,
    compare,
    tolerance: 3e-6,
    reason: "polar decomposition (2e-6) and sums of some hundred products in f32, relative to the size of the terms",
    unordered: &[],
    bytes: 450.0 + 432.0,
    flops: 4800.0,
};

/// Some cells are squeezed flat or turned inside out.
fn inputs(ask: Ask) -> Call {
    let mut b = Bodies::new(ask);
    let mut random = Random::new(ask.seed ^ 0xf0);
    if ask.seed % 4 == 2 {
        b.u.iter_mut().for_each(|u| u[..3].iter_mut().for_each(|c| *c *= 5.0));
    }
    if ask.poison {
        for (i, u) in b.u.iter_mut().enumerate().skip(3).step_by(37) {
            u[i % 3] = [f32::NAN, f32::INFINITY, 1e30, -3e38][i % 4];
        }
    }
    let push = |random: &mut Random, w: f32| {
        let [x, y, z] = random.vector(0.4);
        [x, y, z, w]
    };
    let pushes: Vec<[f32; 4]> = (0..4 * b.skins.len())
        .map(|i| {
            let above = if i % 4 == 0 { 7.0 } else { [-0.25, 0.25][random.below(2)] };
            push(&mut random, above)
        })
        .collect();
    // Of three seeds, one calls for the cells that may be pushed, one for the others, and one for all, of which none is.
    let pushed = ask.seed % 3 == 1;
    if ask.seed % 3 == 2 {
        b.sizes.touched = 0;
    }
    let clock = Clock { wave_speed: WAVE as f32, speed_bits: 0.5f32.to_bits(), ..Default::default() };
    Call::new(b.cells.len().div_ceil(64) + 1)
        .constant("PUSHED", f64::from(u8::from(pushed)))
        .immediates(&b.sizes)
        .with("sizes", &[b.sizes, Reference { touched: u32::from(pushed), ..b.sizes }])
        .with("cells", &b.cells)
        .with("solids", &solids())
        .with("u", &b.u)
        .with("v", &b.v)
        .constant("DAMPED", f64::from(u8::from(ask.seed % 2 == 1)))
        .constant("SHOCKED", f64::from(u8::from(ask.seed % 4 < 2)))
        .with("pushes", &pushes)
        .with("clock", &[clock])
        .with("shares", &vec![[f32::NAN; 4]; 27 * b.cells.len()])
}

/// Largest derivative of P along a direction as the step counts on it: the volume part grows with the cofactor.
pub fn stiff(solid: &Solid, f: &Mat3) -> f64 {
    let (mu, lambda) = (f64::from(solid.mu), f64::from(solid.lambda));
    let (wide, j) = ((cofactor(f).norm_squared() - 2.0).max(1.0), f.determinant().max(0.05));
    match solid.material {
        1 => 2.0 * mu + lambda * (1.0 + squash(f.determinant()).1) * wide,
        2 => mu + (lambda * (1.0 - j.ln()).max(0.0) + mu) * wide / (j * j),
        _ => 0.0,
    }
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let (cells, solids): (Vec<ElasticCell>, Vec<Solid>) = (input.get("cells"), input.get("solids"));
    let (u, pushes): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (input.get("u"), input.get("pushes"));
    let v: Vec<[f32; 4]> = input.get("v");
    let [kelvin, shocked] = ["DAMPED", "SHOCKED"].map(|flag| call.constants.clone().with(flag, 1.0) == call.constants);
    let shares: Vec<[f32; 4]> = out.get("shares");
    let (was, clock): (Clock, Clock) = (input.one("clock"), out.one("clock"));
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    let (mut torn, mut flat, mut close) = (0, 0, false);
    let (mut fastest, mut sound, mut kept) = (0.0f64, true, true);
    let sizes: Vec<Reference> = input.get("sizes");
    let pushed = sizes[1].touched == 1;
    for (i, cell) in cells.iter().enumerate() {
        if (i < sizes[0].touched as usize) != pushed {
            kept &= (0..27).all(|slot| shares[slot * cells.len() + cell.slot as usize][0].is_nan());
            continue;
        }
        let solid = &solids[(cell.mask >> 16) as usize];
        let (mut stiffest, mut thickest) = (0.0f64, 0.0f64);
        let (mut sum, mut size) = ([Vec3::zeros(); 27], 1e-6);
        let mut skin = cell.skin as usize;
        let mut tainted = false;
        for corner in (0..8).filter(|k| cell.mask >> k & 1 == 1) {
            let place = quarter(corner);
            let f = Mat3::identity() + at_point(cell, &u, place).1;
            let stretched = f.norm_squared();
            if stretched.is_nan() || stretched > 300.0 {
                torn += 1;
                tainted = true;
                continue;
            }
            let j = f.determinant();
            flat += u32::from(j < 0.05);
            close |= (j - 0.05).abs() < 1e-4;
            let steep = stiff(solid, &f);
            stiffest = stiffest.max(steep);
            // The rotation has no derivative where two singular values cancel.
            let values = f.svd(false, false).singular_values;
            let mut order: Vec<f64> = values.iter().copied().collect();
            order.sort_by(f64::total_cmp);
            tainted |= solid.material == 1 && j < 0.0 && order[1] - order[0] < 0.05 * order[2];
            let rate = at_point(cell, &v, place).1;
            let volume = f64::from(solid.volume);
            let mut p = piola(solid, &f);
            if kelvin {
                p += viscous(solid, &f, &rate);
            }
            if shocked {
                let (more, thick) = shock(solid, &f, &rate);
                p += more;
                thickest = thickest.max(thick);
                size += volume * more.norm() / DX;
            }
            size += volume * f64::from(solid.mu + solid.lambda) * (1.0 + f.norm().powi(3)) / DX;
            // J is rounded by some 2e-7 of ‖F‖ |cof F|, which the slope of the pressure passes on.
            size += 0.1 * volume * steep * f.norm() / DX;
            for (sum, s) in sum.iter_mut().zip(around()) {
                *sum -= volume * p * gradient(s, place);
            }
        }
        for corner in (0..8).filter(|k| pushed && cell.mask >> (8 + k) & 1 == 1) {
            for which in 0..4 {
                let push = &pushes[4 * skin + which];
                let mut place = quarter(corner);
                if which > 0 {
                    place[which - 1] += f64::from(push[3]);
                }
                for (sum, s) in sum.iter_mut().zip(around()) {
                    *sum += weight(s, place) * vec3(push);
                }
                size += vec3(push).norm();
            }
            skin += 1;
        }
        let waves = f64::from(solid.wave) * (stiffest / f64::from(solid.lambda + 2.0 * solid.mu)).sqrt();
        fastest = fastest.max(damped(solid, waves, thickest));
        if tainted {
            sound = false;
            continue;
        }
        for (slot, sum) in sum.iter().enumerate() {
            let share = &shares[slot * cells.len() + cell.slot as usize];
            got.extend(share[..3].iter().map(|c| f64::from(*c)));
            want.extend(sum.iter());
            scale.extend([size; 3]);
        }
    }
    let mut all = vec![
        Compared::close("forces on the nodes", got, want, scale),
        Compared::fact("the cells of the other call are left alone", kept),
    ];
    all.push(Compared::equal("torn", &[clock.clamped_velocity], &[torn]));
    if torn == 0 && !close {
        all.push(Compared::equal("squeezed", &[clock.clamped_volume], &[flat]));
    }
    // Waves a tenth faster than at rest shorten the next step.
    let limit = 1.1 * f64::from(was.wave_speed);
    if sound && (fastest / limit - 1.0).abs() > 1e-4 {
        let speed = f64::from(f32::from_bits(was.speed_bits));
        let speed = if fastest > limit { speed.max(fastest) } else { speed };
        // A difference of waves of all sizes.
        all.push(Compared::near(
            "speed",
            vec![f64::from(f32::from_bits(clock.speed_bits))],
            vec![speed],
            6.0 + fastest * 10.0,
        ));
    }
    all
}
