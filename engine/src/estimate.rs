//! What a run will take, said before anything is allocated: memory, points, substeps. Opens no device.

use physvideo_gpu::kernels::{Bound, Carrier, EdgePixel};

use crate::assemble::Assembled;
use crate::plan::Plan;
use crate::scene::{Scene, Source};
use crate::stages::cells;
use crate::stages::lagrangian::Lagrangian;
use crate::stages::mpm::Mpm;
use crate::stages::render::RenderSettings;

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
    /// Substeps of a frame by the elastic limit, while nothing moves faster than the waves.
    pub substeps: f64,
}

/// Small buffers: clock, forces, colliders, counters.
const SMALL: u64 = 64 << 10;

/// Estimates what `plan` takes; `two_pass` when the device has no 64-bit atomics.
pub fn estimate(scene: &Scene, assembled: &Assembled, plan: &Plan, two_pass: bool) -> Estimate {
    let world = &assembled.world;
    let particles: u64 = world.bodies.iter().map(|b| b.positions.len() as u64).sum();
    let grid = cells::grid(world.domain, world.dx);
    let (blocks, _) = cells::touched(&grid, world.bodies.iter().flat_map(|b| b.positions.iter().copied()));
    let solver = if assembled.elastic.total_lagrangian { Lagrangian::bytes(world) } else { Mpm::bytes(world) };
    let simulation_bytes = if plan.runs("simulate") { solver + SMALL } else { 0 };
    let points = points(scene, assembled);
    let drawing_bytes =
        if plan.runs("render") { drawing(scene, assembled, plan, points, particles, two_pass) } else { 0 };
    let dt = world.step();
    let substeps = if particles > 0 { (1.0 / f64::from(scene.output.fps) / f64::from(dt)).ceil() } else { 0.0 };
    Estimate {
        particles,
        points,
        cells: 64 * blocks,
        simulation_bytes,
        drawing_bytes,
        bytes: simulation_bytes + drawing_bytes,
        substeps,
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
