//! What a quadrature point gives to the nodes of its cell, and what the clock is told of it: shared by the proofs of
//! `lagrangian/force` and `lagrangian/thin`.

use physvideo_gpu::kernels::{Clock, ElasticCell, Solid};

use super::{DX, around, at_point, cofactor, damped, gradient, piola, shock, squash, viscous};
use crate::proof::mpm::{Mat3, Vec3};
use crate::proof::{Call, Compared};

/// What is added to the elastic stress.
#[derive(Clone, Copy)]
pub struct Flags {
    kelvin: bool,
    shocked: bool,
}

impl Flags {
    /// Those of a call.
    pub fn of(call: &Call) -> Self {
        let [kelvin, shocked] =
            ["DAMPED", "SHOCKED"].map(|flag| call.constants.clone().with(flag, 1.0) == call.constants);
        Self { kelvin, shocked }
    }
}

/// What the clock is told.
#[derive(Default)]
pub struct Told {
    torn: u32,
    flat: u32,
    /// A volume is so near to the limit that rounding decides.
    close: bool,
    fastest: f64,
    /// There is a cell of which nothing is known.
    unsound: bool,
}

/// What a cell gives to its nodes.
pub struct Share {
    /// [N]
    pub sum: [Vec3; 27],
    /// Size of the terms [N].
    pub size: f64,
    stiffest: f64,
    thickest: f64,
    /// Nothing is known of it.
    pub tainted: bool,
}

impl Share {
    /// Nothing yet; terms smaller than `size` [N] are not told from it.
    pub fn new(size: f64) -> Self {
        Self { sum: [Vec3::zeros(); 27], size, stiffest: 0.0, thickest: 0.0, tainted: false }
    }

    /// Adds −V P(F) ∇N of a point at `place` cells from the middle, which stands for `part` of a particle.
    pub fn add(
        &mut self,
        told: &mut Told,
        (solid, cell): (&Solid, &ElasticCell),
        (u, v): (&[[f32; 4]], &[[f32; 4]]),
        (place, part): ([f64; 3], f64),
        flags: Flags,
    ) {
        let f = Mat3::identity() + at_point(cell, u, place).1;
        let stretched = f.norm_squared();
        if stretched.is_nan() || stretched > 300.0 {
            told.torn += 1;
            self.tainted = true;
            return;
        }
        let j = f.determinant();
        told.flat += u32::from(j < 0.05);
        told.close |= (j - 0.05).abs() < 1e-4;
        let steep = stiff(solid, &f);
        self.stiffest = self.stiffest.max(steep);
        // The rotation has no derivative where two singular values cancel.
        let mut order: Vec<f64> = f.svd(false, false).singular_values.iter().copied().collect();
        order.sort_by(f64::total_cmp);
        self.tainted |= solid.material == 1 && j < 0.0 && order[1] - order[0] < 0.05 * order[2];
        let volume = f64::from(solid.volume) * part;
        self.size += volume * f64::from(solid.mu + solid.lambda) * (1.0 + f.norm().powi(3)) / DX;
        // J is rounded by some 2e-7 of ‖F‖ |cof F|, which the slope of the pressure passes on.
        self.size += 0.1 * volume * steep * f.norm() / DX;
        let rate = at_point(cell, v, place).1;
        let mut p = piola(solid, &f);
        if flags.kelvin {
            p += viscous(solid, &f, &rate);
        }
        if flags.shocked {
            let (more, thick) = shock(solid, &f, &rate);
            p += more;
            self.thickest = self.thickest.max(thick);
            self.size += volume * more.norm() / DX;
        }
        for (sum, s) in self.sum.iter_mut().zip(around()) {
            *sum -= volume * p * gradient(s, place);
        }
    }

    /// Tells the waves of what it is made of.
    pub fn tell(&self, told: &mut Told, solid: &Solid) {
        let waves = f64::from(solid.wave) * (self.stiffest / f64::from(solid.lambda + 2.0 * solid.mu)).sqrt();
        told.fastest = told.fastest.max(damped(solid, waves, self.thickest));
        told.unsound |= self.tainted;
    }
}

impl Told {
    /// Against what the clock was and is.
    pub fn compared(&self, before: &Clock, after: &Clock) -> Vec<Compared> {
        let mut all = vec![Compared::equal("torn", &[after.clamped_velocity], &[self.torn])];
        if self.torn == 0 && !self.close {
            all.push(Compared::equal("squeezed", &[after.clamped_volume], &[self.flat]));
        }
        // Waves a tenth faster than at rest shorten the next step.
        let limit = 1.1 * f64::from(before.wave_speed);
        if !self.unsound && (self.fastest / limit - 1.0).abs() > 1e-4 {
            let speed = f64::from(f32::from_bits(before.speed_bits));
            let speed = if self.fastest > limit { speed.max(self.fastest) } else { speed };
            let told = f64::from(f32::from_bits(after.speed_bits));
            // A difference of waves of all sizes.
            all.push(Compared::near("speed", vec![told], vec![speed], 6.0 + self.fastest * 10.0));
        }
        all
    }
}

/// Largest derivative of P along a direction as the step counts on it: the volume part grows with the cofactor.
fn stiff(solid: &Solid, f: &Mat3) -> f64 {
    let (mu, lambda) = (f64::from(solid.mu), f64::from(solid.lambda));
    let (wide, j) = ((cofactor(f).norm_squared() - 2.0).max(1.0), f.determinant().max(0.05));
    match solid.material {
        1 => 2.0 * mu + lambda * (1.0 + squash(f.determinant()).1) * wide,
        2 => mu + (lambda * (1.0 - j.ln()).max(0.0) + mu) * wide / (j * j),
        _ => 0.0,
    }
}
