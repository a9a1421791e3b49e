//! Act *animate* up to the drawn frames: the world is simulated, its points are drawn over the background. Knows no
//! files; whoever drives it decides what to keep of each frame.

use std::time::Instant;

use physvideo_gpu::kernels::{Carrier, DepthMap, points};
use physvideo_gpu::{Buf, Constants, Gpu, GpuError, Recording};

use crate::assemble::{Assembled, View};
use crate::backdrop::FillError;
use crate::geometry::{self, GeometryError, PhotoData, SurfaceMap, WorldFromCamera};
use crate::holes::{Holes, edge};
use crate::plan::Plan;
use crate::scene::{Scene, Source};
use crate::stages::display::{Carry, DisplayArrays, nothing, rgba};
use crate::stages::lagrangian::{Lagrangian, LagrangianError};
use crate::stages::mpm::{DORMANT, Method, Mpm};
use crate::stages::render::{Background, Image, PointRenderer, RenderError, RenderSettings};
use crate::stages::solver::{FrameStats, Solver};
use crate::stages::sph::Sph;
use crate::stages::view;

/// Why a clip cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum AnimateError {
    /// The device refused.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The bodies cannot be on grids of their own, or the device refused.
    #[error(transparent)]
    Lagrangian(#[from] LagrangianError),
    /// Points cannot be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The background cannot be filled.
    #[error("the background behind the objects: {0}")]
    Fill(#[from] FillError),
    /// Geometry that cannot be used.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
}

/// Particles at a moment, as parallel arrays.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Snapshot {
    /// Positions [m].
    pub positions: Vec<[f32; 3]>,
    /// Velocities [m/s].
    pub velocities: Vec<[f32; 3]>,
    /// Bodies.
    pub bodies: Vec<u32>,
    /// Numbers among all particles, ascending.
    pub numbers: Vec<u32>,
}

/// A clip in the making.
pub struct Animation<'gpu> {
    gpu: &'gpu Gpu,
    /// The solver, when anything is simulated.
    pub solver: Option<Box<dyn Solver + 'gpu>>,
    drawing: Option<Drawing>,
    fps: f32,
    frame: u32,
    /// Stages that ran before the first frame and the wall time of each [ms].
    pub wall_ms: Vec<(&'static str, f64)>,
    /// The picture without what moves, for the network.
    pub empty: Option<Image>,
}

struct Drawing {
    carry: Carry,
    renderer: PointRenderer,
    background: Option<Buf<u32>>,
    /// The background at the start, and with everything filled that objects in motion touch.
    pictures: Option<(Vec<u32>, Vec<u32>)>,
    /// Points of objects in motion; they come first.
    moving: u64,
}

impl Drawing {
    /// Draws what stands still over the filled background.
    fn without_moving(&mut self, gpu: &Gpu) -> Result<Image, AnimateError> {
        let points = self.carry.display.points;
        let all = gpu.read_range(points, 0, self.moving)?;
        // Nothing is drawn of a point without a radius.
        gpu.write(points, 0, &all.iter().map(|p| [p[0], p[1], p[2], 0.0]).collect::<Vec<_>>())?;
        let pictures = self.background.zip(self.pictures.take());
        if let Some((background, (_, filled))) = &pictures {
            gpu.write(*background, 0, filled)?;
        }
        let image = self.renderer.draw(gpu)?;
        gpu.write(points, 0, &all)?;
        if let Some((background, (start, _))) = &pictures {
            gpu.write(*background, 0, start)?;
        }
        Ok(image)
    }
}

impl<'gpu> Animation<'gpu> {
    /// Uploads what the plan runs, finds the rest state, fills the background.
    ///
    /// # Errors
    /// The device's refusal, or geometry that cannot be used.
    pub fn new(
        gpu: &'gpu Gpu,
        scene: &Scene,
        assembled: &Assembled,
        plan: &Plan,
        method: Method,
    ) -> Result<Self, AnimateError> {
        let mut wall_ms = Vec::new();
        let mut took = |stage, since: Instant| wall_ms.push((stage, since.elapsed().as_secs_f64() * 1e3));
        let since = Instant::now();
        let world = &assembled.world;
        let solver: Option<Box<dyn Solver + 'gpu>> = match plan.runs("simulate") {
            true if assembled.elastic.total_lagrangian => Some(Box::new(Lagrangian::new(gpu, world)?)),
            true if !assembled.elastic.beside.is_empty() => {
                Some(Box::new(Mpm::beside(gpu, world, method, &assembled.elastic.beside)?))
            }
            true if world.is_fluid() => Some(Box::new(Sph::new(gpu, world)?)),
            true => Some(Box::new(Mpm::new(gpu, world, method)?)),
            false => None,
        };
        took("simulate", since);
        let since = Instant::now();
        let mut drawing =
            if plan.runs("render") { Some(draw(gpu, scene, assembled, plan, solver.as_deref())?) } else { None };
        took("display", since);
        let empty = match &mut drawing {
            Some(drawing) if plan.runs("flow") => Some(drawing.without_moving(gpu)?),
            _ => None,
        };
        wall_ms.retain(|(stage, _)| plan.runs(stage));
        Ok(Self { gpu, solver, drawing, fps: scene.output.fps, frame: 0, wall_ms, empty })
    }

    /// Whether the same run gives the same bits on this device.
    pub fn deterministic(&self) -> bool {
        self.solver.as_ref().is_none_or(|s| s.deterministic())
    }

    /// Advances to the next frame; the first is the start itself.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn advance(&mut self) -> Result<FrameStats, AnimateError> {
        let stats = match &mut self.solver {
            Some(solver) if self.frame > 0 => solver.frame(1.0 / self.fps)?,
            _ => FrameStats::default(),
        };
        self.frame += u32::from(!stats.stopped);
        Ok(stats)
    }

    /// Draws the frame as it is now; absent when the plan draws nothing.
    ///
    /// # Errors
    /// The device's refusal, or more points than can be drawn.
    pub fn draw(&mut self) -> Result<Option<Image>, AnimateError> {
        let Some(d) = &mut self.drawing else { return Ok(None) };
        if let Some(solver) = &self.solver {
            let mut rec = Recording::new("carry");
            d.carry.record(&mut rec, solver.particles(), solver.deformations(), d.background);
            self.gpu.run(&rec)?;
        }
        Ok(Some(d.renderer.draw(self.gpu)?))
    }

    /// The particles now, without those that are not emitted.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn particles(&self) -> Result<Snapshot, AnimateError> {
        let Some(solver) = &self.solver else { return Ok(Snapshot::default()) };
        let all = self.gpu.read(solver.particles())?;
        let mut out = Snapshot::default();
        for (p, number) in all.iter().zip(0..).filter(|(p, _)| p.tag & DORMANT == 0) {
            out.positions.push(p.x);
            out.velocities.push(p.v);
            out.bodies.push(p.tag & 0xff);
            out.numbers.push(number);
        }
        Ok(out)
    }
}

fn draw(
    gpu: &Gpu,
    scene: &Scene,
    a: &Assembled,
    plan: &Plan,
    solver: Option<&dyn Solver>,
) -> Result<Drawing, AnimateError> {
    let mut arrays = display(gpu, scene, a)?;
    let moving = arrays.objects.iter().filter(|o| scene.objects[**o as usize - 1].material.is_some()).count() as u64;
    let mut pictures = None;
    let (background, behind) = match &a.view {
        Some(view) if scene.camera.is_none() => {
            let photo: Vec<u32> = view.photo.rgb.iter().map(|c| rgba(*c)).collect();
            let mut picture = photo.clone();
            if plan.runs("backdrop") {
                let holes = Holes::new(scene, view)?;
                let filled = holes.fill(view, scene.seed)?;
                for (pixel, (moving, color)) in picture.iter_mut().zip(holes.moving.iter().zip(&filled)) {
                    if *moving {
                        *pixel = rgba(*color);
                    }
                }
                arrays.edge = edge(view, &holes, &filled, &arrays);
                if plan.runs("flow") {
                    let of = |(i, color)| if holes.hole[i] || holes.moving[i] { rgba(filled[i]) } else { color };
                    pictures = Some((picture.clone(), picture.iter().copied().enumerate().map(of).collect()));
                }
            }
            let buf = gpu.upload("run", "background", &picture)?;
            (Some(buf), Background::Picture(buf))
        }
        _ => (None, Background::Color(scene.render.background.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8))),
    };
    let carry = Carry::new(gpu, &arrays, a.camera, solver.map(|s| (s.particles(), s.deformations())))?;
    let settings = RenderSettings {
        width: a.size.0,
        height: a.size.1,
        per_pixel: scene.render.points_per_pixel,
        compositing: scene.render.compositing,
        blend_depth: scene.render.blend_depth,
        radius_in_pixels: false,
        depth: scene.output.exr,
        // The network refines what moves, and ids say where that is.
        ids: scene.output.exr || plan.runs("flow"),
        background: Some(behind),
    };
    let renderer = PointRenderer::new(gpu, settings, carry.display)?;
    Ok(Drawing { carry, renderer, background, pictures, moving })
}

/// The points that are drawn: the pixels of objects seen in the photograph, the particles of all others.
fn display(gpu: &Gpu, scene: &Scene, a: &Assembled) -> Result<DisplayArrays, AnimateError> {
    let seen = match &a.view {
        Some(View { photo, surfaces: Some(map), world, .. }) => unprojected(gpu, photo, map, world)?,
        _ => Vec::new(),
    };
    let surface = |k: usize| ([seen[k][0], seen[k][1], seen[k][2]], seen[k][3]);
    let mut out = DisplayArrays::default();
    let mut push = |x: [f32; 3], radius: f32, color: [f32; 3], object: usize, carrier: Carrier| {
        out.points.push([x[0], x[1], x[2], radius]);
        out.colors.push(rgba(color.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)));
        out.objects.push(object as u32 + 1);
        out.carriers.push(carrier);
    };
    let size = scene.render.radius;
    let mut first = 0_u32;
    for (body, object) in a.world.bodies.iter().zip(&a.object_of) {
        let spacing = body.particle_volume.cbrt();
        match (&scene.objects[*object].source, &a.view) {
            (Source::Mask { label, .. }, Some(View { photo, surfaces: Some(map), .. })) => {
                let points = geometry::display_points(map, *label, &photo.rgb, surface)?;
                let carriers = geometry::attach(&points.positions, &body.positions, spacing)?;
                for (i, c) in carriers.iter().enumerate() {
                    let carrier = Carrier { particle: c.particle.map(|p| p + first), weight: c.weight };
                    push(points.positions[i], size * points.spacing[i], points.colors[i], *object, carrier);
                }
            }
            _ => {
                for (i, x) in body.positions.iter().enumerate() {
                    let own = Carrier { particle: [first + i as u32; 4], weight: [1.0, 0.0, 0.0, 0.0] };
                    push(*x, size * spacing, a.colors[first as usize + i], *object, own);
                }
            }
        }
        first += body.positions.len() as u32;
    }
    for (object, still) in &a.statics {
        for (x, color) in still.positions.iter().zip(&still.colors) {
            push(*x, size * still.volume.cbrt(), *color, *object, nothing());
        }
    }
    if let Some(View { photo, surfaces: Some(map), .. }) = &a.view {
        for (index, object) in scene.objects.iter().enumerate() {
            if let (Source::Mask { label, .. }, None) = (&object.source, object.material) {
                let points = geometry::display_points(map, *label, &photo.rgb, surface)?;
                for (i, x) in points.positions.iter().enumerate() {
                    push(*x, size * points.spacing[i], points.colors[i], index, nothing());
                }
            }
        }
    }
    Ok(out)
}

/// World point and spacing of every pixel of the photograph, from the depth of its objects; zero where there is none.
fn unprojected(
    gpu: &Gpu,
    photo: &PhotoData,
    map: &SurfaceMap,
    world: &WorldFromCamera,
) -> Result<Vec<[f32; 4]>, AnimateError> {
    let camera = view::of_photo(photo, world);
    let call = points::Unproject {
        depths: gpu.upload("unproject", "depths", &map.depth)?,
        camera: gpu.upload("unproject", "camera", &[camera])?,
        points: gpu.alloc("unproject", "points", map.depth.len() as u64)?,
        immediates: DepthMap { width: map.width, height: map.height, spacing: 1.0 },
    };
    let mut rec = Recording::new("unproject");
    rec.each(&call, &Constants::none(), map.depth.len() as u64);
    gpu.run(&rec)?;
    let points = gpu.read(call.points)?;
    gpu.free_arena("unproject");
    Ok(points)
}
