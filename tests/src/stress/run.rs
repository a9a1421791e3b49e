//! Plays a case twice and judges what comes of it.

use physvideo::fluid::Fluid;
use physvideo::scene::{Material, Pressure};
use physvideo::stages::lagrangian::{Lagrangian, LagrangianError};
use physvideo::stages::mpm::QUARANTINED;
use physvideo::stages::solver::{Fastest, FrameStats, Solver};
use physvideo::world::World;
use physvideo_gpu::Gpu;
use physvideo_gpu::kernels::{Deformation, Particle};

use super::{Bound, Case, Nodes, Row, Setup, Verdict, material_of};
use crate::problems::setup::{say, solver};

/// The world as a method takes it: SPH has particles where the lattice has them, half a cell apart.
fn world_of(setup: &Setup, method: &str) -> World {
    let mut world = setup.world.clone();
    if world.bodies.iter().any(|b| matches!(b.material, Material::Sph { .. })) {
        let pressure = if method == "wcsph" { Pressure::Wcsph } else { Pressure::Dfsph };
        world.fluid = Fluid { particle_size: 0.5 * world.dx, pressure, ..Default::default() };
    }
    if let Some(times) = setup.forced {
        world.force_dt = Some((times * f64::from(world.step())) as f32);
    }
    world
}

/// Its solver, or why it takes no such body.
fn begin<'g>(
    gpu: &'g Gpu,
    world: &World,
    nodes: Option<Nodes>,
    method: &str,
) -> Result<Result<Box<dyn Solver + 'g>, String>, String> {
    if method != "total_lagrangian" {
        return solver(gpu, world, method).map(Ok);
    }
    let mut own = match Lagrangian::new(gpu, world) {
        Ok(own) => own,
        Err(LagrangianError::Gpu(e)) => return Err(say(e)),
        Err(unfit) => return Ok(Err(unfit.to_string())),
    };
    if let Some(nodes) = nodes {
        own.set(nodes).map_err(say)?;
    }
    Ok(Ok(Box::new(own)))
}

fn refused(case: &Case, material: &'static str, method: &'static str, why: String) -> Row {
    Row {
        case: case.name,
        material,
        method,
        verdict: Verdict::Refused,
        substeps: 0,
        counts: [0; 6],
        drift: 0.0,
        of_bound: 0.0,
        sunk: 0,
        error: Some(why),
    }
}

/// What all of a case's runs must agree in.
#[derive(Default)]
struct End {
    particles: Vec<u8>,
    deformations: Vec<u8>,
    stats: Vec<FrameStats>,
}

impl End {
    /// Where two differ, in words.
    fn differs(&self, other: &Self) -> String {
        let at = |a: &[u8], b: &[u8]| a.iter().zip(b).position(|(a, b)| a != b);
        let frame = self.stats.iter().zip(&other.stats).position(|(a, b)| a != b);
        let (particle, deformation) =
            (at(&self.particles, &other.particles), at(&self.deformations, &other.deformations));
        format!(
            "frame {frame:?}, byte {particle:?} of the particles ({} a particle), {deformation:?} of the deformations ({})",
            size_of::<Particle>(),
            size_of::<Deformation>()
        )
    }
}

/// Runs a case twice.
///
/// # Errors
/// What is wrong with what came of it, or the device's refusal.
pub fn run(gpu: &Gpu, case: &Case, material: &'static str, method: &'static str) -> Result<Row, String> {
    let wrong = |what: String| Err(format!("{}, {material}, {method}: {what}", case.name));
    let (row, first) = match once(gpu, case, material, method) {
        Ok(done) => done,
        Err(e) => return wrong(e),
    };
    if case.repeats {
        let (again, second) = once(gpu, case, material, method)?;
        // What went wrong may have a NaN in it, which is not equal to itself.
        let words = |e: &End| format!("{:?}", e.stats);
        if (&second.particles, &second.deformations) != (&first.particles, &first.deformations)
            || words(&second) != words(&first)
        {
            return wrong(format!("two runs differ: {}; {row:?} and {again:?}", first.differs(&second)));
        }
    }
    let expected = case.expected(method);
    if !expected.contains(&row.verdict) {
        return wrong(format!("{:?} is none of {expected:?}: {row:?}", row.verdict));
    }
    // A NaN is not within anything.
    if row.of_bound <= 1.0 {
        Ok(row)
    } else {
        wrong(format!("{} of the largest energy it may have: {row:?}", row.of_bound))
    }
}

fn once(gpu: &Gpu, case: &Case, material: &'static str, method: &'static str) -> Result<(Row, End), String> {
    let setup = (case.setup)(material_of(material));
    let world = &world_of(&setup, method);
    let Setup { spoil, frames, length, bound, .. } = setup;
    let mut solver = match begin(gpu, world, None, method)? {
        Ok(solver) => solver,
        Err(why) => return Ok((refused(case, material, method, why), End::default())),
    };
    let bodies = world.bodies.len();
    let sums = |solver: &dyn Solver| -> Result<[f64; 4], String> {
        let mut out = [0.0; 4];
        for body in 0..bodies {
            let m = solver.measure(body).map_err(say)?;
            out = std::array::from_fn(|i| out[i] + [m.kinetic, m.energy(), m.potential, m.mass][i]);
        }
        Ok(out)
    };
    let begun = sums(&*solver)?;
    if setup.nodes.is_some() {
        drop(solver);
        gpu.free_arena("run");
        solver = begin(gpu, world, setup.nodes, method)??;
    }
    // What it could turn into motion: all there is above the lowest place it may fall to.
    let at_hand = begun[1] + begun[2] + f64::from(world.gravity[2] * world.domain.0[2]) * begun[3];
    let mut particles = gpu.read(solver.particles()).map_err(say)?;
    let mut deformations = gpu.read(solver.deformations()).map_err(say)?;
    if method != "total_lagrangian" {
        spoil(&mut particles, &mut deformations);
        gpu.write(solver.particles(), 0, &particles).map_err(say)?;
        gpu.write(solver.deformations(), 0, &deformations).map_err(say)?;
    }
    let (mut most, mut stats, mut dt) = (begun, Vec::new(), f32::MAX);
    let mut end = begun;
    for _ in 0..frames {
        let s = solver.frame(length as f32).map_err(say)?;
        end = sums(&*solver)?;
        most = std::array::from_fn(|i| if end[i] <= most[i] { most[i] } else { end[i] });
        dt = if s.dt.0 > 0.0 { dt.min(s.dt.0) } else { dt };
        stats.push(s);
        if s.stalled.is_some() || s.pressed.is_some() {
            break;
        }
    }
    let (particles, deformations) =
        (gpu.read(solver.particles()).map_err(say)?, gpu.read(solver.deformations()).map_err(say)?);
    drop(solver);
    gpu.free_arena("run");
    gpu.free_arena("grid");
    let pressed = stats.iter().find_map(|s| s.pressed);
    let pressed =
        pressed.map(|p| format!("pressed together: {:.3e} m³ are left of the {:.3e} m³ it needs", p.left, p.needed));
    let stalled = stats.iter().find_map(|s| s.stalled).map(|f| {
        let Fastest { particle, speed, stretch, volume, .. } = f;
        let of = if method == "updated_lagrangian" { "mpm" } else { method };
        format!(
            "{of}/clock, {of}/particles, particle {particle}: {speed:e} m/s, stretched to {stretch:e}, volume {volume:e}"
        )
    });
    let error = pressed.or(stalled);
    let sunk = stats.iter().map(|s| s.sunk).max().unwrap_or(0);
    let sph = world.is_fluid();
    if error.is_none() {
        for (i, (p, d)) in particles.iter().zip(&deformations).enumerate() {
            let numbers = [p.x, p.v].concat();
            // SPH has no use for C and F, and leaves there what was written.
            let rows: &[&[f32]] = if sph { &[&p.s] } else { &[&p.c0, &p.c1, &p.c2, &p.s, &d.f0, &d.f1, &d.f2] };
            let state = rows.concat();
            if p.tag & QUARANTINED == 0 && !numbers.iter().chain(&state).all(|c| c.is_finite()) {
                return Err(format!("particle {i} is not finite and was not taken out: {p:?} {d:?}"));
            }
        }
    }
    let counts = stats.iter().fold([0; 6], |sum, s| {
        let more = [s.clamped_velocity, s.clamped_strain, s.clamped_volume, s.quarantined, s.rejected, s.gained]
            .map(u64::from);
        std::array::from_fn(|i| sum[i] + more[i])
    });
    let verdict = match counts {
        _ if error.is_some() => Verdict::Refused,
        [0, 0, 0, 0, 0, 0] if sunk == 0 => Verdict::Clean,
        [.., 0, _] => Verdict::Counted,
        // The last attempt gained too, and was kept.
        [.., rejected, gained] if gained > rejected => Verdict::Counted,
        _ => Verdict::TakenBack,
    };
    let empty = begun[3] == 0.0 && world.bodies.iter().all(|b| b.emission.is_none());
    let of_bound = match bound {
        _ if error.is_some() || empty => 0.0,
        Bound::Energy(times, besides) => most[1] / (times * at_hand + besides),
        // Single precision's rounding besides.
        Bound::SpeedLimit => most[0] / (0.5 * begun[3] * f64::from(0.9 * world.dx / dt).powi(2) * (1.0 + 1e-6)),
    };
    let scale = match bound {
        Bound::Energy(_, besides) => at_hand.max(besides),
        Bound::SpeedLimit => at_hand,
    };
    let drift = (end[1] + end[2] - begun[1] - begun[2]) / scale;
    let row = Row {
        case: case.name,
        material,
        method,
        verdict,
        substeps: stats.iter().map(|s| u64::from(s.substeps)).sum(),
        counts,
        drift: if empty || error.is_some() { 0.0 } else { drift },
        of_bound,
        sunk,
        error,
    };
    let end = End {
        particles: bytemuck::cast_slice(&particles).to_vec(),
        deformations: bytemuck::cast_slice(&deformations).to_vec(),
        stats,
    };
    Ok((row, end))
}
