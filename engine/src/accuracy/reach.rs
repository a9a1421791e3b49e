//! What the tables speak of: bodies like those that were measured. Whatever is faster for its waves, thinner than its own
//! particles tell, or more slender, is refused.

use physvideo_gpu::kernels::family::shape;

use super::{Kind, Unfit, size};
use crate::world::{Body, World};

/// Largest speed over that of waves of what was measured: blocks of 18 kPa that have fallen for 0.4 m; of sand and liquids.
const MACH: f32 = 0.57;
const MACH_FLOWS: f32 = 0.21;
/// Longest extent over thickness: twice that of the beams.
const SLENDER: f32 = 20.0;
/// Largest damping over the time a wave takes across a body: that of the damped blocks, whose errors were 0.5 to 1.6 times what
/// the table promises (4 to 12 cells against 24, at 1 ms).
const DAMPED: f32 = 0.07;

/// Size of a body of `world` [m], if it is like those that were measured.
///
/// # Errors
/// What it is beyond.
pub fn reach(body: &Body, world: &World, kind: Kind) -> Result<f32, Unfit> {
    let beyond = |what: String| Err(Unfit::Beyond { body: body.name.clone(), what });
    if body.emission.is_some() || body.recycle.is_some() {
        return beyond("is emitted or starts anew".into());
    }
    if body.damping > 0.0 && kind != Kind::FreeOwn {
        return beyond("is damped, and only what is not was measured".into());
    }
    if world.bodies.iter().any(|b| b.material.elastic() != body.material.elastic()) {
        return beyond("meets bodies of another kind, and each kind was measured by itself".into());
    }
    let moved = world.colliders.iter().any(|c| c.velocity != [0.0; 4] || c.spin != [0.0; 4]);
    let fields = body.fields & ((1u64 << world.fields.len().min(32)) - 1) as u32 != 0;
    if kind != Kind::Held && (fields || moved || body.surface_tension() > 0.0) {
        return beyond("is moved by more than its weight, and only what falls was measured".into());
    }
    let spacing = if world.is_fluid() { world.fluid.particle_size } else { body.particle_volume.cbrt() };
    let size = size(&body.positions, spacing);
    if size < 1.5 * spacing {
        return beyond(
            "is one particle thick here, which says nothing of its thickness: raise the density of the grid".into(),
        );
    }
    let damped = body.damping * body.wave_speed() / size;
    if damped > DAMPED {
        return beyond(format!(
            "is damped for {damped:.2} of the time that a wave takes across it, and at most {DAMPED} was measured"
        ));
    }
    let extent = (0..3).map(|a| {
        let (low, high) = body.positions.iter().fold((f32::MAX, f32::MIN), |(l, h), x| (l.min(x[a]), h.max(x[a])));
        high - low + spacing
    });
    let slender = extent.fold(0.0, f32::max) / size;
    if kind == Kind::Held && slender > SLENDER {
        return beyond(format!("is {slender:.0} times as long as thick, and beams of up to {SLENDER} were measured"));
    }
    let most = match kind {
        // Incompressible: there are no waves.
        Kind::Dfsph => return Ok(size),
        Kind::Sand | Kind::Liquid => MACH_FLOWS,
        _ => MACH,
    };
    let mach = fastest(body, world, kind) / body.wave_speed();
    if mach > most {
        return beyond(format!(
            "moves at {mach:.2} of the speed of its waves, and at most {most} was measured: it is too soft, or too fast"
        ));
    }
    Ok(size)
}

/// The fastest that a body gets by gravity [m/s]: its highest particle falls to the highest plane below it, or out of the
/// domain. What is held does not fall.
fn fastest(body: &Body, world: &World, kind: Kind) -> f32 {
    let square = |v: &[f32; 3]| v.iter().map(|c| c * c).sum::<f32>();
    let start = body.velocities.iter().map(square).fold(0.0, f32::max);
    let gravity = body.gravity.unwrap_or(world.gravity);
    let g = square(&gravity).sqrt();
    if kind == Kind::Held || g == 0.0 {
        return start.sqrt();
    }
    let up = gravity.map(|c| -c / g);
    let along = |x: &[f32]| x.iter().zip(up).map(|(a, b)| a * b).sum::<f32>();
    let highest = body.positions.iter().map(|x| along(x)).fold(f32::MIN, f32::max);
    let lowest = body.positions.iter().map(|x| along(x)).fold(f32::MAX, f32::min);
    let corners =
        (0..8).map(|c| [0, 1, 2].map(|a| if c >> a & 1 == 0 { world.domain.0[a] } else { world.domain.1[a] }));
    let bottom = corners.map(|x| along(&x)).fold(f32::MAX, f32::min);
    let planes = world.colliders.iter().filter(|c| c.shape == shape::PLANE && along(&c.size[..3]) > 0.5);
    // Half a particle may lie in what it rests on.
    let below = planes.map(|c| along(&c.center[..3])).filter(|level| *level <= lowest + world.dx);
    let floor = below.fold(bottom, f32::max);
    (start + 2.0 * g * (highest - floor).max(0.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::tests::bar;
    use super::*;
    use crate::scene::Material;
    use crate::world::ground;

    const JELLY: Material = Material::Elastic { young: 1e3, poisson: 0.0 };

    #[test]
    fn what_is_too_fast_for_its_waves_is_refused() {
        // Waves of 31.6 m/s in a bar two metres high.
        let mut world = bar(JELLY);
        world.colliders = vec![ground(0.0, 0.5)];
        world.gravity = [0.0, 0.0, -9.81];
        let speed = fastest(&world.bodies[0], &world, Kind::Free);
        assert!((speed - (2.0f32 * 9.81 * 1.75).sqrt()).abs() < 1e-3, "{speed}");
        assert!(reach(&world.bodies[0], &world, Kind::Free).is_ok());
        // Neither damping was measured, nor what meets another kind.
        let mut damped = world.clone();
        damped.bodies[0].damping = 1e-3;
        assert!(reach(&damped.bodies[0], &damped, Kind::Free).is_err());
        // But on grids of their own, some: a wave takes 63 ms across two metres.
        assert!(reach(&damped.bodies[0], &damped, Kind::FreeOwn).is_ok());
        damped.bodies[0].damping = 5e-3;
        assert!(reach(&damped.bodies[0], &damped, Kind::FreeOwn).is_err());
        let mut beside = world.clone();
        beside.bodies.push(Body {
            material: Material::Sand { young: 1e6, poisson: 0.3, friction: 0.7 },
            ..world.bodies[0].clone()
        });
        assert!(reach(&beside.bodies[0], &beside, Kind::Free).is_err());
        let high = |world: &mut World, z: f32| world.bodies[0].positions.iter_mut().for_each(|x| x[2] += z);
        high(&mut world, 30.0);
        let refused = reach(&world.bodies[0], &world, Kind::Free);
        assert!(matches!(&refused, Err(Unfit::Beyond { what, .. }) if what.contains("waves")), "{refused:?}");
        // What is held does not fall.
        assert!(reach(&world.bodies[0], &world, Kind::Held).is_ok());
        // By a field, which says nothing of a body that it does not act on.
        world.fields = vec![Default::default()];
        world.bodies[0].fields = 1;
        let refused = reach(&world.bodies[0], &world, Kind::Free);
        assert!(matches!(&refused, Err(Unfit::Beyond { what, .. }) if what.contains("weight")), "{refused:?}");
        world.fields.clear();
        // By its own speed.
        high(&mut world, -30.0);
        world.bodies[0].velocities = vec![[20.0, 0.0, 0.0]; 320];
        assert!(reach(&world.bodies[0], &world, Kind::Free).is_err());
    }

    #[test]
    fn what_is_too_thin_or_too_slender_is_refused() {
        let mut world = bar(JELLY);
        for (i, x) in world.bodies[0].positions.iter_mut().enumerate() {
            *x = [i as f32 * 0.5, 0.0, 0.0];
        }
        let thin = reach(&world.bodies[0], &world, Kind::Held);
        assert!(matches!(&thin, Err(Unfit::Beyond { what, .. }) if what.contains("one particle")), "{thin:?}");
        for (i, x) in world.bodies[0].positions.iter_mut().enumerate() {
            *x = [(i / 4) as f32 * 0.5, (i % 2) as f32 * 0.5, (i / 2 % 2) as f32 * 0.5];
        }
        let slender = reach(&world.bodies[0], &world, Kind::Held);
        assert!(matches!(&slender, Err(Unfit::Beyond { what, .. }) if what.contains("40 times")), "{slender:?}");
    }
}
