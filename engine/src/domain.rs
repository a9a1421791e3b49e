//! The space that the grid covers, and what of a scene must lie in it. Knows no solver.

use glam::Vec3;
use physvideo_gpu::kernels;

use crate::scene::{Kind, Problem, Scene};
use crate::world::Body;

/// Lowest and highest corner [m].
pub(crate) type Space = ([f32; 3], [f32; 3]);

/// The grid's space: the scene's, else the bodies' box doubled.
pub(crate) fn of(scene: &Scene, bodies: &[Body], dx: f32) -> Space {
    if let Some(d) = scene.simulation.domain {
        return (d.min, d.max);
    }
    let (mut low, mut high) = (Vec3::splat(f32::MAX), Vec3::splat(f32::MIN));
    for x in bodies.iter().flat_map(|b| &b.positions) {
        low = low.min(Vec3::from(*x));
        high = high.max(Vec3::from(*x));
    }
    if low.x > high.x {
        return ([0.0; 3], [dx; 3]);
    }
    let margin = 0.5 * (high - low).max(Vec3::splat(0.25));
    ((low - margin).to_array(), (high + margin).to_array())
}

fn problem(key: String, message: impl ToString) -> Problem {
    Problem::new(Kind::Conflict, key, message.to_string())
}

/// Refuses what would be lost in the first frame, or could never happen.
pub(crate) fn check(scene: &Scene, bodies: &[Body], object_of: &[usize], domain: Space) -> Result<(), Problem> {
    for (body, index) in bodies.iter().zip(object_of) {
        let inside = |x: &&[f32; 3]| (0..3).all(|a| x[a] >= domain.0[a] && x[a] <= domain.1[a]);
        let outside = body.positions.iter().filter(|x| !inside(x)).count();
        // What an emitter keeps in its pool is looked at below.
        if scene.simulation.domain.is_some() && body.emission.is_none() && outside > 0 {
            let message = format!(
                "{outside} of the {} particles of object[{index}] '{}' start outside of it",
                body.positions.len(),
                body.name
            );
            return Err(problem("simulation.domain".into(), message).help("enlarge it, or move the object into it"));
        }
        if let (Some(_), Some(behind)) = (&body.emission, behind(body, domain, 1.0 / scene.output.fps)) {
            let message = format!(
                "particles wait {behind:.3} m behind the nozzle for their turn, which is outside the grid's domain"
            );
            return Err(problem(format!("object[{index}].emitter"), message).help("enlarge simulation.domain"));
        }
        if let Some(r) = &body.recycle
            && !reaches(domain, r)
        {
            let message = "the region lies outside the grid's domain, so nothing reaches it";
            return Err(problem(format!("object[{index}].recycle.region"), message).help("enlarge simulation.domain"));
        }
        if let Some(r) = &body.recycle
            && r.drains == 0
            && (0..3).any(|a| r.source_min[a] < domain.0[a] || r.source_max[a] > domain.1[a])
        {
            let message = "particles would start anew outside the grid's domain";
            return Err(problem(format!("object[{index}].recycle.to"), message).help("enlarge simulation.domain"));
        }
    }
    Ok(())
}

/// How far what leaves within a frame of `length` [s] stands behind the nozzle [m], where that is outside the domain.
fn behind(body: &Body, (low, high): Space, length: f32) -> Option<f32> {
    let back = |(x, v): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|a| x[a] - v[a] * length);
    let outside = |x: [f32; 3]| (0..3).any(|a| x[a] < low[a] || x[a] > high[a]);
    let speed = body.velocities.first().map_or(0.0, |v| Vec3::from(*v).length());
    body.positions.iter().zip(&body.velocities).map(back).any(outside).then_some(speed * length)
}

/// Whether a region that particles return from lies in the grid's space at all.
fn reaches((low, high): Space, r: &kernels::Return) -> bool {
    let reach = if r.region == 2 { r.region_max[0] } else { 0.0 };
    let end = |a: usize| if r.region == 2 { r.region_min[a] } else { r.region_max[a] };
    (0..3).all(|a| r.region_min[a] - reach < high[a] && end(a) + reach > low[a])
}
