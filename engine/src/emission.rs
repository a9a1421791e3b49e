//! The pool of an emitter: as many copies of an object's particles as can be out at once, in the order in which they
//! leave. Runs once per scene on the CPU; knows no device.

use glam::Vec3;

use crate::geometry::Particles;
use crate::limits::Crowd;
use crate::scene::{Kind, Object, Problem, Scene};
use crate::world::Emission;

/// Makes the pool of object `index` of `filled`, its particles; absent where it has no emitter.
///
/// # Errors
/// A rate that does not fit through the nozzle, or more particles than can be held.
pub(crate) fn pool(
    scene: &Scene,
    index: usize,
    object: &Object,
    filled: &mut Particles,
    crowd: &mut Crowd,
) -> Result<Option<Emission>, Problem> {
    let Some(emitter) = &object.emitter else { return Ok(None) };
    let velocity = Vec3::from(object.velocity);
    let (speed, forward) = (f64::from(velocity.length()), velocity.normalize_or_zero());
    // How far behind the front each particle is, front first.
    let ahead = |x: &[f32; 3]| Vec3::from(*x).dot(forward);
    let front = filled.positions.iter().map(ahead).fold(f32::MIN, f32::max);
    let mut order: Vec<(f32, usize)> = filled.positions.iter().map(|x| front - ahead(x)).zip(0..).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let each = order.len();
    let depth = f64::from(order.last().map_or(0.0, |last| last.0)) + f64::from(filled.volume.cbrt());
    let mass = f64::from(object.density) * f64::from(filled.volume) * each as f64;
    let fastest = depth / speed;
    let period = emitter.rate.map_or(fastest, |rate| mass / f64::from(rate));
    if period < fastest * (1.0 - 1e-4) {
        let message = format!("at most {:.4} kg/s fit through at this speed", mass / fastest);
        let help = "lower the rate, raise the object's velocity, or make its source wider";
        return Err(Problem::new(Kind::OutOfRange, format!("object[{index}].emitter.rate"), message).help(help));
    }
    let frame = 1.0 / f64::from(scene.output.fps);
    let clip = f64::from(scene.output.frames) * frame;
    let (start, end) = (f64::from(emitter.start), f64::from(emitter.end).min(clip));
    let mut out = (end - start).max(0.0);
    if let Some(lifetime) = emitter.lifetime {
        // A frame more: what is due is let out before what is over is seen to be.
        out = out.min(f64::from(lifetime) + 2.0 * frame);
    }
    let copies = (out / period).ceil().max(1.0) as usize;
    crowd.add(&format!("object[{index}].emitter"), object, (each as u64).saturating_mul(copies as u64 - 1))?;
    let at = |(behind, i): &(f32, usize)| (Vec3::from(filled.positions[*i]) + forward * *behind).to_array();
    let positions: Vec<_> = order.iter().map(at).collect();
    let colors: Vec<_> = order.iter().map(|(_, i)| filled.colors[*i]).collect();
    filled.positions = positions.repeat(copies);
    filled.colors = colors.repeat(copies);
    Ok(Some(Emission {
        start,
        end: f64::from(emitter.end),
        period,
        delays: order.iter().map(|(behind, _)| f64::from(*behind) / speed).collect(),
        lifetime: emitter.lifetime.map(f64::from),
    }))
}
