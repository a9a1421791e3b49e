//! What a run will take, said before anything is allocated: memory, points, substeps. Opens no device.

use physvideo_gpu::kernels::{Bound, Carrier, EdgePixel};

use crate::assemble::Assembled;
use crate::cap::{self, Expected};
use crate::fluid;
use crate::plan::Plan;
use crate::scene::{Scene, Source};
use crate::stages::cells;
use crate::stages::lagrangian::Lagrangian;
use crate::stages::mpm::Mpm;
use crate::stages::render::RenderSettings;
use crate::stages::sph::Sph;
use crate::world::World;

/// What a run will take.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Simulated particles.
    pub particles: u64,
    /// Points that are drawn.
    pub points: u64,
    /// Cells of the grid that particles touch at the start.
    pub cells: u64,
    /// Device memory of the simulation [bytes].
    pub simulation_bytes: u64,
    /// Device memory of drawing [bytes].
    pub drawing_bytes: u64,
    /// Both [bytes].
    pub bytes: u64,
    /// Substeps of a frame by the limits of its materials, while nothing moves faster than at the start.
    pub substeps: f64,
    /// The largest speed to be expected of anything [m/s], from falls, fields and obstacles.
    pub fastest: f64,
    /// Substeps of a frame while something moves so fast.
    pub most_substeps: f64,
}

/// Small buffers: clock, forces, colliders, counters.
const SMALL: u64 = 64 << 10;

/// Estimates what `plan` takes; `two_pass` when the device has no 64-bit atomics.
pub fn estimate(scene: &Scene, assembled: &Assembled, plan: &Plan, two_pass: bool) -> Estimate {
    let world = &assembled.world;
    let particles: u64 = world.bodies.iter().map(|b| b.positions.len() as u64).sum();
    let grid = cells::grid(world.domain, world.cell());
    let (blocks, _) = cells::touched(&grid, world.bodies.iter().flat_map(|b| b.positions.iter().copied()));
    let simulation_bytes = match plan.runs("simulate") {
        true if world.is_fluid() => Sph::bytes(world) + SMALL,
        true if assembled.elastic.total_lagrangian => Lagrangian::bytes(world) + SMALL,
        true => Mpm::bytes_beside(world, &assembled.elastic.beside) + SMALL,
        false => 0,
    };
    let points = points(scene, assembled);
    let drawing_bytes =
        if plan.runs("render") { drawing(scene, assembled, plan, points, particles, two_pass) } else { 0 };
    let frame = 1.0 / f64::from(scene.output.fps);
    let in_frame = |dt: f32| if particles > 0 { (frame / f64::from(dt)).ceil() } else { 0.0 };
    let fastest = Expected::of(world).speed().max(cap::front(world));
    let most = world.force_dt.unwrap_or_else(|| world.step_at(fastest as f32));
    Estimate {
        particles,
        points,
        cells: 64 * blocks,
        simulation_bytes,
        drawing_bytes,
        bytes: simulation_bytes + drawing_bytes,
        substeps: in_frame(world.step()),
        fastest,
        most_substeps: in_frame(most),
    }
}

/// Points that are drawn, or a few more: every pixel of an object of the photograph, every particle of the others.
fn points(scene: &Scene, assembled: &Assembled) -> u64 {
    let mut sum: u64 = assembled.statics.iter().map(|(_, still)| still.positions.len() as u64).sum();
    for (body, object) in assembled.world.bodies.iter().zip(&assembled.object_of) {
        if !matches!(scene.objects[*object].source, Source::Mask { .. }) {
            sum += body.positions.len() as u64;
        }
    }
    if let Some(view) = &assembled.view {
        let seen =
            |label: &u8| scene.objects.iter().any(|o| matches!(o.source, Source::Mask { label: l, .. } if l == *label));
        sum += view.photo.labels.iter().filter(|l| seen(l)).count() as u64;
    }
    sum
}

fn drawing(scene: &Scene, assembled: &Assembled, plan: &Plan, points: u64, particles: u64, two_pass: bool) -> u64 {
    let (width, height) = assembled.size;
    let settings = RenderSettings {
        width,
        height,
        per_pixel: scene.render.points_per_pixel,
        depth: scene.output.exr,
        ids: scene.output.exr || plan.runs("flow"),
        // Which one does not matter to the size of the picture it is drawn over.
        background: Some(crate::stages::render::Background::Color([0; 3])),
        ..RenderSettings::default()
    };
    let pixels = u64::from(width) * u64::from(height);
    // Position at rest and now, colour, object.
    let each = 16 + 16 + 4 + 4 + size_of::<Carrier>() as u64;
    let picture = if assembled.view.is_some() && scene.camera.is_none() { 4 * pixels } else { 0 };
    let edge = if plan.runs("backdrop") { size_of::<EdgePixel>() as u64 * pixels } else { 0 };
    settings.bytes(points, two_pass) + each * points + size_of::<Bound>() as u64 * particles + picture + edge + SMALL
}

/// Step of the paper: 4e-3 s in ten substeps.
const PAPER_STEP: f32 = 4e-4;
/// Deformation by its own fall and weight that a solid may show before it counts as softer than it should look.
const SOFT: f32 = 0.05;

/// Share of its stiffness below which nothing to speak of loads a body.
const LIGHT: f32 = 1e-6;

/// What a user should know of the steps: that the paper's are not stable here, and what makes a stiff solid cheaper.
pub fn step_notes(world: &World, fps: f32) -> Vec<String> {
    if let Some(forced) = world.force_dt {
        return vec![forced_note(forced, world.chosen_step(), 1.0 / fps)];
    }
    if world.is_fluid() {
        return fluid::step_notes(world);
    }
    let mut notes = Vec::new();
    let Some(fastest) = world.bodies.iter().max_by(|a, b| a.step_speed(world.dx).total_cmp(&b.step_speed(world.dx)))
    else {
        return notes;
    };
    let (speed, step) = (fastest.step_speed(world.dx), world.step());
    let limit = world.dx / speed;
    if limit < PAPER_STEP {
        notes.push(format!(
            "steps of {PAPER_STEP:e} s as in the paper would be {:.1} times the limit of '{}'; {step:.1e} s are taken",
            PAPER_STEP / limit,
            fastest.name
        ));
    }
    for body in &world.bodies {
        let damped = body.damping_cost(world.dx);
        if damped > 1.2 {
            notes.push(format!("`damping` of '{}' makes its steps {damped:.1} times as short", body.name));
        }
        let hardest = body.material.hardest();
        if hardest > 1.0 {
            let times = hardest.sqrt();
            notes.push(format!("'{}' hardens as it packs: up to {times:.1} times as many substeps", body.name));
        }
    }
    if let (Some(needed), Some(young)) = (Expected::of(world).modulus(fastest, SOFT), fastest.material.young()) {
        let share = needed / young;
        // Steps go with the root of the modulus.
        if (LIGHT..0.25).contains(&share) {
            notes.push(format!(
                "'{}' costs {:.0} substeps a frame; {:.1e} of its `young` would do with {:.0}, and its fall and weight \
                 deform it by about {:.0} %: `simulation.stiffness_cap = {SOFT}` takes that",
                fastest.name,
                (1.0 / (fps * step)).ceil(),
                share,
                (share.sqrt() / (fps * step)).ceil(),
                100.0 * SOFT
            ));
        }
    }
    notes
}

/// What a forced step is beside the one that would be chosen, in frames of `frame` [s].
fn forced_note(forced: f32, chosen: f32, frame: f32) -> String {
    let whole =
        if forced > frame { format!("a step is no longer than a frame, {frame:.1e} s: ") } else { String::new() };
    let forced = forced.min(frame);
    let times = forced / chosen;
    let outlook = if times > 1.0 { "it may blow up, and is not taken back" } else { "it only takes longer" };
    format!("{whole}steps of {forced:.1e} s are forced, {times:.1} times those chosen at the start: {outlook}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Material;
    use crate::world::Body;

    fn cube(young: f32) -> World {
        let body = Body {
            name: "apple".into(),
            material: Material::Elastic { young, poisson: 0.32 },
            density: 40.0,
            positions: vec![[0.0; 3], [0.0, 0.0, 0.1]],
            particle_volume: 1e-6,
            velocities: vec![[0.0; 3]; 2],
            pinned: vec![],
            gravity: None,
            prestress: false,
            friction: 0.2,
            fields: 0,
            recycle: None,
            emission: None,
            damping: 0.0,
        };
        World {
            bodies: vec![body],
            gravity: [0.0, 0.0, -9.81],
            fields: vec![],
            colliders: vec![],
            domain: ([-1.0, -1.0, -0.1], [1.0; 3]),
            dx: 1.0 / 128.0,
            courant: 0.75,
            force_dt: None,
            fluid: Default::default(),
        }
    }

    /// c = 53.5 m/s: a Courant number of 2.74 by the paper's step.
    #[test]
    fn the_papers_step_is_told_to_be_too_long() {
        let notes = step_notes(&cube(8e4), 24.0);
        assert!(notes.len() == 1 && notes[0].contains("2.7 times the limit of 'apple'; 1.1e-4 s"), "{notes:?}");
        assert!(step_notes(&cube(8e3), 24.0).is_empty(), "c = 16.9 m/s is slow enough");
    }

    /// 1e-3 s for 1.1e-4.
    #[test]
    fn a_forced_step_is_told() {
        let told = |dt| step_notes(&World { force_dt: Some(dt), ..cube(8e4) }, 24.0);
        let [long] = &told(1e-3)[..] else { panic!("{:?}", told(1e-3)) };
        assert_eq!(
            long,
            "steps of 1.0e-3 s are forced, 9.1 times those chosen at the start: it may blow up, and is not taken back"
        );
        assert!(
            told(1e-5)[0].ends_with("0.1 times those chosen at the start: it only takes longer"),
            "{:?}",
            told(1e-5)
        );
        let whole = told(1.0);
        assert!(whole[0].starts_with("a step is no longer than a frame, 4.2e-2 s: steps of 4.2e-2 s"), "{whole:?}");
    }

    /// ζ = 1.1 β c/dx = 7.5 of the fastest vibration: 1/(ζ + sqrt(1 + ζ²)) of the step.
    #[test]
    fn what_damping_costs_is_told() {
        let mut damped = cube(8e4);
        damped.bodies[0].damping = 1e-3;
        let notes = step_notes(&damped, 24.0);
        assert!(notes.iter().any(|n| n == "`damping` of 'apple' makes its steps 15.1 times as short"), "{notes:?}");
    }

    /// A fall of 0.1 m: ρ v²/ε² = 31 kPa.
    #[test]
    fn stiffness_that_nobody_sees_is_told() {
        let notes = step_notes(&cube(8e7), 24.0);
        assert!(notes.len() == 2 && notes[1].contains("'apple' costs"), "{notes:?}");
        assert!(notes[1].contains("`simulation.stiffness_cap = 0.05`"), "{notes:?}");
    }
}
