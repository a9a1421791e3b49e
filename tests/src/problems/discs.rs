//! M6: two elastic discs in plane strain meet and part (Sulsky 1994): radius 0.2, speed 0.1·√2 each, E 1000, ν 0.3,
//! ρ 1000 in the unit square.

use physvideo::scene::Material;
use physvideo_gpu::Gpu;

use super::setup::{Lattice, Play, between, whole_steps, world};
use super::{Outcome, Problem, Setting, elastic};

const SPEED: f64 = 0.1;
const RADIUS: f64 = 0.2;
/// Distance of 0.6 √2 less two radii, at a speed of 0.2 √2 [s].
pub const CONTACT: f64 = 1.585_79;
/// ½ ρ π r² · 2 · (0.1² + 0.1²) [J/m].
pub const ENERGY: f64 = 2.513_27;

/// The discs.
pub const DISCS: Problem = Problem {
    id: "M6",
    title: "colliding discs, cells along 1 m: share of the energy that is lost by 3 s",
    goal: 0.04,
    methods: &elastic::WITH_OWN_GRID,
    resolutions: &[16, 32, 64, 128],
    courants: &elastic::COURANTS,
    run: |gpu, setting| collide(gpu, setting, 1.0).map(|c| c.outcome),
};

/// What the discs did.
#[derive(Clone, Copy, Debug)]
pub struct Collision {
    /// Share of the energy lost.
    pub outcome: Outcome,
    /// Energy at the start over that of the circles.
    pub start: f64,
    /// When 3 % of the kinetic energy was gone [s].
    pub contact: Option<f64>,
    /// Largest rise of the total energy from frame to frame, relative.
    pub rise: f64,
    /// Largest total momentum, over that of one disc.
    pub momentum: f64,
    /// Least kinetic energy over that at the start.
    pub slowest: f64,
    /// Speed of the first disc along an axis at the end, over that at the start.
    pub away: f64,
}

/// Two discs for 3 s; the second is `heavier` times as dense.
///
/// # Errors
/// The device's refusal.
pub fn collide(gpu: &Gpu, setting: Setting, heavier: f64) -> Result<Collision, String> {
    let lattice = Lattice::of(setting.method, 1.0 / f64::from(setting.resolution));
    let dx = lattice.dx;
    let material = Material::Elastic { young: 1000.0, poisson: 0.3 };
    let disc = |c: f64, density: f64, speed: f64| {
        let inside = |x: [f64; 3]| (x[0] - c).hypot(x[1] - c) < RADIUS;
        let places = lattice.fill([0.0; 3], [1.0, 1.0, 2.0 * dx], inside);
        lattice.body(material, density, &places, |_| [speed, speed, 0.0])
    };
    let bodies = vec![disc(0.2, 1000.0, SPEED), disc(0.8, 1000.0 * heavier, -SPEED)];
    let mut w = world(bodies, dx, [-0.2, -0.2, 0.0], [1.2, 1.2, 2.0 * dx]);
    w.courant = setting.courant;
    w.colliders = between(dx, 2.0).to_vec();
    let mut play = Play::new(gpu, &w, setting.method)?;
    let (first, second) = (play.measure(0)?, play.measure(1)?);
    let begun = first.kinetic + second.kinetic;
    let unit = first.mass * SPEED;
    let step = whole_steps(&w, SPEED * 2f64.sqrt(), 0.02);
    let (mut last, mut contact, mut slowest) = (begun, None, f64::MAX);
    let (mut rise, mut momentum, mut away) = (f64::MIN, 0.0, 1.0);
    for i in 1..=(3.0 / step).ceil() as u32 {
        play.frame(step)?;
        let (a, b) = (play.measure(0)?, play.measure(1)?);
        let kinetic = a.kinetic + b.kinetic;
        let total = kinetic + a.elastic + b.elastic;
        momentum = (0..2).map(|i| (a.momentum[i] + b.momentum[i]).abs() / unit).fold(momentum, f64::max);
        rise = rise.max(total / last - 1.0);
        slowest = slowest.min(kinetic / begun);
        away = a.momentum[0] / unit;
        last = total;
        if contact.is_none() && kinetic < 0.97 * begun {
            contact = Some(f64::from(i) * step);
        }
    }
    let start = begun / (2.0 * dx) / (ENERGY * (1.0 + heavier) / 2.0);
    Ok(Collision { outcome: play.finish(1.0 - last / begun), start, contact, rise, momentum, slowest, away })
}
