//! M8: an elastic column on rollers under its own weight, at rest. With ν = 0 the stress of any law is
//! σ(Y) = −ρ₀ g (H − Y) at a particle's height Y in the reference, and the width does not matter: it is two cells. The
//! roller is a mirror: the column hangs together with its reflection, which weighs upwards.

use physvideo::scene::Material;
use physvideo_gpu::Gpu;
use physvideo_gpu::kernels::Field;
use physvideo_gpu::kernels::family::field::{UNIFORM, WIND};

use super::setup::{Lattice, Play, world};
use super::{Outcome, Problem, Setting, elastic};

const HEIGHT: f64 = 0.1;
const DENSITY: f64 = 1800.0;
const YOUNG: f64 = 1e6;
const GRAVITY: f64 = 9.81;

/// The column.
pub const COLUMN: Problem = Problem {
    id: "M8",
    title: "column at rest on rollers, cells along its height: largest error of any particle's stress, over that of the base",
    goal: 5e-3,
    methods: &elastic::METHODS,
    resolutions: &[5, 10, 20, 40],
    courants: &elastic::COURANTS,
    run: |gpu, setting| rest(gpu, setting, DENSITY),
};

/// A column of some density against the stress of ρ = 1800.
///
/// # Errors
/// The device's refusal.
pub fn rest(gpu: &Gpu, setting: Setting, density: f64) -> Result<Outcome, String> {
    let lattice = Lattice::of(setting.method, HEIGHT / f64::from(setting.resolution));
    let dx = lattice.dx;
    let places = lattice.fill([0.0, 0.0, -HEIGHT], [2.0 * dx, 2.0 * dx, HEIGHT], |_| true);
    let material = Material::Elastic { young: YOUNG as f32, poisson: 0.0 };
    let body = lattice.body(material, density, &places, |_| [0.0; 3]);
    let margin = HEIGHT + 4.0 * dx;
    let mut w = world(vec![body], dx, [-margin; 3], [margin; 3]);
    w.courant = setting.courant;
    let half = |sign: f64| {
        let (low, high) = if sign > 0.0 { (0.0, 1.0) } else { (-1.0, 0.0) };
        Field {
            kind: UNIFORM,
            region: 1,
            end: 1e9,
            a: [0.0, 0.0, (-sign * GRAVITY) as f32, 0.0],
            region_min: [-1.0, -1.0, low, 0.0],
            region_max: [1.0, 1.0, high, 0.0],
            ..Default::default()
        }
    };
    // The slowest mode swings at π/(2H) sqrt(E/ρ); with its critical drag, 2.5 periods leave exp(−5π) (1 + 5π) = 3e-6.
    let rate = std::f64::consts::FRAC_PI_2 / HEIGHT * (YOUNG / density).sqrt();
    let air = Field { kind: WIND, end: 1e9, p0: (2.0 * rate) as f32, ..Default::default() };
    w.fields = vec![half(1.0), half(-1.0), air];
    let mut play = Play::new(gpu, &w, setting.method)?;
    play.frame(2.5 * std::f64::consts::TAU / rate)?;
    // First Piola is Cauchy where nothing changes sideways: P = E (F − 1).
    let base = DENSITY * GRAVITY * HEIGHT;
    let error = play.deformations()?.into_iter().zip(&places).map(|(d, x)| {
        let stress = YOUNG * (f64::from(d.f2[2]) - 1.0);
        (stress + DENSITY * GRAVITY * (HEIGHT - x[2].abs())).abs() / base
    });
    let error = error.fold(0.0, f64::max);
    Ok(play.finish(error))
}
