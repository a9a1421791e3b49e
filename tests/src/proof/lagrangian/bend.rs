//! Proof of `lagrangian/bend`: of each thin cell Σ V ψ(F) over its listed places, less that over the points they stand for.

use physvideo_gpu::kernels::family::material::NEO_HOOKEAN;
use physvideo_gpu::kernels::{Body, ElasticCell, Place, Solid, ThinCell};

use super::thin::parts;
use super::{Bodies, at_point, elastic, quarter, solids};
use crate::proof::mpm::{Mat3, law};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "lagrangian/bend",
    inputs,
    compare,
    tolerance: 1e-6,
    reason: "F is a sum of 27 products in f32, which the energy's slope passes on; relative to the size of the stress",
    unordered: &[],
    bytes: 450.0 + 400.0,
    flops: 25000.0,
};

fn inputs(ask: Ask) -> Call {
    let mut b = Bodies::new(ask);
    let mut random = Random::new(ask.seed ^ 0xbe);
    if ask.poison {
        for (i, u) in b.u.iter_mut().enumerate().skip(3).step_by(37) {
            u[i % 3] = [f32::NAN, f32::INFINITY, 1e30, -3e38][i % 4];
        }
    }
    let (thins, places) = parts(&mut b, &mut random);
    Call::new(b.cells.len().div_ceil(64) + 1)
        .immediates(&b.sizes)
        .with("cells", &b.cells)
        .with("solids", &solids())
        .with("thins", &thins)
        .with("places", &places)
        .with("u", &b.u)
        .with("bodies", &elastic())
        .with("energies", &vec![f32::NAN; thins.len()])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let (cells, solids): (Vec<ElasticCell>, Vec<Solid>) = (input.get("cells"), input.get("solids"));
    let (thins, places): (Vec<ThinCell>, Vec<Place>) = (input.get("thins"), input.get("places"));
    let (u, bodies): (Vec<[f32; 4]>, Vec<Body>) = (input.get("u"), input.get("bodies"));
    let energies: Vec<f32> = out.get("energies");
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    for (thin, energy) in thins.iter().zip(&energies) {
        let cell = &cells[thin.cell as usize];
        let (body, volume) =
            (&bodies[(cell.mask >> 16) as usize], f64::from(solids[(cell.mask >> 16) as usize].volume));
        let boxes = &places[thin.first as usize..(thin.first + thin.count) as usize];
        let boxes = boxes.iter().map(|p| (p.x.map(f64::from), f64::from(p.share)));
        let own = (0..8).filter(|corner| thin.points >> corner & 1 == 1).map(|corner| (quarter(corner), -1.0));
        let (mut sum, mut size, mut tainted) = (0.0, 1e-9, false);
        for (place, share) in boxes.filter(|b| b.1 > 0.0).chain(own) {
            let f = Mat3::identity() + at_point(cell, &u, place).1;
            tainted |= !f.iter().all(|c| c.is_finite() && c.abs() < 1e3);
            // The logarithm ends there.
            tainted |= body.material == NEO_HOOKEAN && f.determinant() < 0.05;
            if tainted {
                break;
            }
            let answer = law::respond(body, &f, 0.0, &Mat3::zeros());
            sum += share * volume * answer.energy;
            size += share.abs() * volume * law::stiffness(body, &f, &answer);
        }
        if !tainted {
            got.push(f64::from(*energy));
            want.push(sum);
            scale.push(size);
        }
    }
    vec![Compared::close("energy of each cell", got, want, scale)]
}
