//! M2 and M4: a neo-Hookean body that a body force moves along a chosen motion (Wallstedt & Guilkey 2008; Steffen 2008),
//! u_i = A_i sin(k X_i) sin(ω t + ψ_i).
//!
//! The force belongs to places in the reference, so it is a force field of its own, added to a copy of the kernels. The
//! faces of the cube slip, which a plane on the grid does to first order only: here the cube goes on for three cells
//! beyond each face, and what is there is the mirror image of what is inside, renewed every step. The bar goes on so far
//! that no wave from its free ends arrives.

use std::f64::consts::PI;

use physvideo::scene::Material;
use physvideo::world::World;
use physvideo_gpu::kernels::{Deformation, Field, Particle};
use physvideo_gpu::{Gpu, Options};

use super::setup::{Lattice, Play, say, world};
use super::{Outcome, Problem, Setting, elastic};
use crate::folder;

/// M2.
pub const CUBE: Problem = Problem {
    id: "M2",
    title: "manufactured motion of a cube, cells along 1 m: rms distance over 0.05 m, largest of 4 instants to 0.02 s",
    goal: 1e-2,
    methods: &elastic::METHODS,
    resolutions: &[8, 12, 16, 24, 32],
    courants: &elastic::COURANTS,
    run: |gpu, setting| Motion::cube().follow(gpu, setting, 1.0),
};

/// M4.
pub const BAR: Problem = Problem {
    id: "M4",
    title: "manufactured motion of a bar, cells along 1 m: rms distance over 0.05 m, largest of 4 instants of a period",
    goal: 1e-2,
    methods: &elastic::METHODS,
    resolutions: &[8, 16, 32, 64],
    courants: &elastic::COURANTS,
    run: |gpu, setting| Motion::bar().follow(gpu, setting, 1.0),
};

/// Number of the force among the fields of the copy.
const FORCE: u32 = 100;
const AMPLITUDE: f64 = 0.05;
const INSTANTS: u32 = 4;

/// A chosen motion of a block of density 1.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    amplitude: [f64; 3],
    phase: [f64; 3],
    wavenumber: f64,
    rate: f64,
    young: f64,
    poisson: f64,
    end: f64,
    /// Fastest wave and fastest particle together [m/s].
    fastest: f64,
    faces: Faces,
}

/// What is beyond X = 0 and X = 1.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Faces {
    /// Along all axes, three cells of mirror images: a particle's stencil reaches 1.5.
    Mirrors,
    /// Along x, so many metres more of the same; along the others the body is two cells wide.
    Far(f64),
}

impl Motion {
    /// M2: E 1e4, ν 0.3, c = sqrt(E/ρ) = 100, three phases; it begins stretched.
    pub fn cube() -> Self {
        Self {
            amplitude: [AMPLITUDE; 3],
            phase: [0.0, 2.0 * PI / 3.0, 4.0 * PI / 3.0],
            wavenumber: PI,
            rate: 100.0 * PI,
            young: 1e4,
            poisson: 0.3,
            end: 0.02,
            fastest: 123.0 + 15.7,
            faces: Faces::Mirrors,
        }
    }

    /// M4: E 1, ν 0, uniaxial. A quarter of its period later than in the literature, so that it begins unstretched.
    pub fn bar() -> Self {
        Self {
            amplitude: [AMPLITUDE, 0.0, 0.0],
            phase: [0.0; 3],
            wavenumber: 2.0 * PI,
            rate: PI,
            young: 1.0,
            poisson: 0.0,
            end: 2.0,
            // Stretch down to 0.686: c sqrt((1 + 1/F²)/2) = 1.25.
            fastest: 1.25 + 0.157,
            // More than a period of waves, 2 · 1.25.
            faces: Faces::Far(2.75),
        }
    }

    fn lame(&self) -> (f64, f64) {
        let (e, nu) = (self.young, self.poisson);
        (e / (2.0 * (1.0 + nu)), e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)))
    }

    /// Position, velocity, and the diagonals of F and of the velocity's gradient, of what rests at `x`.
    fn at(&self, x: [f64; 3], t: f64) -> [[f64; 3]; 4] {
        let mut out = [[0.0; 3]; 4];
        for a in 0..3 {
            let (k, w) = (self.wavenumber, self.rate);
            let ((s, c), (now, turn)) = ((k * x[a]).sin_cos(), (w * t + self.phase[a]).sin_cos());
            let stretch = 1.0 + self.amplitude[a] * k * c * now;
            out[0][a] = x[a] + self.amplitude[a] * s * now;
            out[1][a] = self.amplitude[a] * w * s * turn;
            out[2][a] = stretch;
            out[3][a] = self.amplitude[a] * w * k * c * turn / stretch;
        }
        out
    }

    /// The force for a material `wrong` times as stiff.
    fn force(&self, wrong: f64) -> Field {
        let (mu, lambda) = self.lame();
        let [a, b, c] = self.amplitude.map(|c| c as f32);
        let [d, e, f] = self.phase.map(|c| c as f32);
        Field {
            kind: FORCE,
            end: 1e9,
            p0: self.wavenumber as f32,
            p1: self.rate as f32,
            a: [a, b, c, (wrong * lambda) as f32],
            b: [d, e, f, (wrong * mu) as f32],
            ..Default::default()
        }
    }

    /// Moves the block, and measures how far its particles get from the motion; `wrong` times the stiffness in the force
    /// is a control.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn follow(&self, gpu: &Gpu, setting: Setting, wrong: f64) -> Result<Outcome, String> {
        if !cfg!(debug_assertions) {
            return Err("its force is read from a folder, which release builds do not".into());
        }
        let copy = tempfile::tempdir().map_err(|e| e.to_string())?;
        folder::copy_kernels(copy.path());
        std::fs::write(copy.path().join("field/manufactured.wgsl"), include_str!("manufactured.wgsl"))
            .map_err(|e| e.to_string())?;
        let device = Some(gpu.info.index.to_string());
        let gpu = Gpu::new(Options { device, wgsl: Some(copy.path().into()), ..Default::default() }).map_err(say)?;
        let dx = 1.0 / f64::from(setting.resolution);
        let lattice = Lattice::of(setting.method, dx);
        let beyond = self.beyond(dx);
        let low = beyond.map(|b| -b);
        let high: [f64; 3] = std::array::from_fn(|a| if beyond[a] > 0.0 { 1.0 + beyond[a] } else { 2.0 * dx });
        let rest = lattice.fill(low, high, |_| true);
        // Equal steps that fill every instant's frame.
        let frame = self.end / f64::from(INSTANTS);
        let steps = (frame * self.fastest / (f64::from(setting.courant) * dx)).ceil();
        let step = frame / steps;
        let mut play = Play::new(&gpu, &self.world(lattice, &rest, step, wrong), setting.method)?;
        if self.phase != [0.0; 3] {
            let (particles, deformations) = self.start(&play, &rest, step)?;
            play.put(&particles, &deformations)?;
        }
        let images = if self.faces == Faces::Mirrors { images(lattice, &rest, low, high) } else { vec![] };
        let inside = |x: &[f64; 3]| (0..3).all(|a| beyond[a] == 0.0 || (0.0..=1.0).contains(&x[a]));
        let mut error: f64 = 0.0;
        for i in 1..=INSTANTS {
            if images.is_empty() {
                play.frame(frame)?;
            }
            for _ in 0..if images.is_empty() { 0 } else { steps as u32 } {
                play.frame(step)?;
                let (mut particles, mut deformations) = (play.particles()?, play.deformations()?);
                for image in &images {
                    particles[image.at] = image.particle(particles[image.of]);
                    deformations[image.at] = image.deformation(deformations[image.of]);
                }
                play.put(&particles, &deformations)?;
            }
            let particles = play.particles()?;
            let (mut sum, mut count) = (0.0, 0.0);
            for (x, p) in rest.iter().zip(&particles).filter(|(x, _)| inside(x)) {
                let exact = self.at(*x, frame * f64::from(i))[0];
                sum += (0..3).map(|a| (f64::from(p.x[a]) - exact[a]).powi(2)).sum::<f64>();
                count += 1.0;
            }
            error = error.max((sum / count).sqrt() / AMPLITUDE);
        }
        Ok(play.finish(error))
    }

    /// How far the body goes on beyond its faces [m], in whole cells; 0 along an axis where nothing moves.
    fn beyond(&self, dx: f64) -> [f64; 3] {
        match self.faces {
            Faces::Mirrors => [3.0 * dx; 3],
            Faces::Far(far) => [(far / dx).ceil() * dx, 0.0, 0.0],
        }
    }

    fn world(&self, lattice: Lattice, rest: &[[f64; 3]], step: f64, wrong: f64) -> World {
        let places: Vec<[f64; 3]> = rest.iter().map(|x| self.at(*x, 0.0)[0]).collect();
        let material = Material::NeoHookean { young: self.young as f32, poisson: self.poisson as f32 };
        let mut body = lattice.body(material, 1.0, &places, |_| [0.0; 3]);
        // Velocities live half a step before positions: with those of t = 0 the motion would be half a step late.
        body.velocities = rest.iter().map(|x| self.at(*x, -0.5 * step)[1].map(|c| c as f32)).collect();
        let margin = self.beyond(lattice.dx)[0] + 4.0 * lattice.dx + 0.5;
        let mut w = world(vec![body], lattice.dx, [-margin; 3], [1.0 + margin; 3]);
        w.fields = vec![self.force(wrong)];
        w.force_dt = Some(step as f32);
        w
    }

    /// The state at t = 0 of a body that does not begin at rest in its reference: F, the stress of it, and C.
    fn start(&self, play: &Play, rest: &[[f64; 3]], step: f64) -> Result<(Vec<Particle>, Vec<Deformation>), String> {
        let (mut particles, mut deformations) = (play.particles()?, play.deformations()?);
        let (mu, lambda) = self.lame();
        for ((x, p), d) in rest.iter().zip(&mut particles).zip(&mut deformations) {
            let (stretch, slope) = (self.at(*x, 0.0)[2], self.at(*x, -0.5 * step)[3]);
            let log_j = stretch.iter().product::<f64>().ln();
            let volume = f64::from(d.f0[3]);
            let tau = stretch.map(|s| volume * (mu * (s * s - 1.0) + lambda * log_j));
            (d.f0[0], d.f1[1], d.f2[2]) = (stretch[0] as f32, stretch[1] as f32, stretch[2] as f32);
            (p.c0[0], p.c1[1], p.c2[2]) = (slope[0] as f32, slope[1] as f32, slope[2] as f32);
            (p.c0[3], p.c1[3], p.c2[3]) = (tau[0] as f32, tau[1] as f32, tau[2] as f32);
        }
        Ok((particles, deformations))
    }
}

/// A particle beyond a face, and the one inside whose mirror image it is.
struct Image {
    at: usize,
    of: usize,
    /// −1 along the axes it is mirrored along.
    sign: [f32; 3],
    /// Twice the place of the mirror [m].
    twice: [f32; 3],
}

/// Every particle of a lattice over [low, high] that is outside of the unit cube, with its image.
fn images(lattice: Lattice, rest: &[[f64; 3]], low: [f64; 3], high: [f64; 3]) -> Vec<Image> {
    let s = lattice.spacing();
    let n: [usize; 3] = std::array::from_fn(|a| ((high[a] - low[a]) / s).round() as usize);
    let place = |x: [f64; 3]| {
        let i: [usize; 3] = std::array::from_fn(|a| ((x[a] - low[a]) / s) as usize);
        (i[2] * n[1] + i[1]) * n[0] + i[0]
    };
    let mut out = Vec::new();
    for (at, x) in rest.iter().enumerate() {
        let (mut sign, mut twice, mut inner) = ([1.0; 3], [0.0; 3], *x);
        for a in 0..3 {
            if !(0.0..=1.0).contains(&x[a]) {
                (sign[a], twice[a]) = (-1.0, if x[a] < 0.0 { 0.0 } else { 2.0 });
                inner[a] = f64::from(twice[a]) - x[a];
            }
        }
        if inner != *x {
            out.push(Image { at, of: place(inner), sign, twice });
        }
    }
    out
}

impl Image {
    fn vector(&self, v: [f32; 3]) -> [f32; 3] {
        std::array::from_fn(|a| self.sign[a] * v[a])
    }

    /// Row or column `i` of a matrix; what is in its fourth number stays.
    fn line(&self, i: usize, v: [f32; 4]) -> [f32; 4] {
        let s = self.sign;
        [s[i] * s[0] * v[0], s[i] * s[1] * v[1], s[i] * s[2] * v[2], v[3]]
    }

    fn particle(&self, p: Particle) -> Particle {
        let (x, s) = (self.vector(p.x), self.sign);
        Particle {
            x: std::array::from_fn(|a| self.twice[a] + x[a]),
            v: self.vector(p.v),
            c0: self.line(0, p.c0),
            c1: self.line(1, p.c1),
            c2: self.line(2, p.c2),
            s: [s[0] * s[1] * p.s[0], s[0] * s[2] * p.s[1], s[1] * s[2] * p.s[2], p.s[3]],
            ..p
        }
    }

    fn deformation(&self, d: Deformation) -> Deformation {
        Deformation { f0: self.line(0, d.f0), f1: self.line(1, d.f1), f2: self.line(2, d.f2) }
    }
}
