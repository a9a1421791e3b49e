//! Display points carried by particles, and the edge of the background that they uncover. Knows nothing of solvers
//! beyond the particles' layout, and nothing of how points become pixels.

use bytemuck::Zeroable;
use physvideo_gpu::kernels::{Bound, Camera, Carried, Carrier, Deformation, EdgePixel, Particle, Uncovered, points};
use physvideo_gpu::{Buf, Constants, Gpu, GpuError, Recording};

use super::render::Display;

/// A displacement of this many pixels shows the filled background instead of the photograph's edge pixels.
const UNCOVERED_AT: f32 = 1.5;

/// What is drawn, as arrays.
#[derive(Clone, Debug, Default)]
pub struct DisplayArrays {
    /// Position [m] and radius [px] of each point.
    pub points: Vec<[f32; 4]>,
    /// RGBA8, red lowest.
    pub colors: Vec<u32>,
    /// Object, from 1 on.
    pub objects: Vec<u32>,
    /// What carries each point; weights of 0 where nothing does.
    pub carriers: Vec<Carrier>,
    /// Pixels of the background at the edge of what moves.
    pub edge: Vec<EdgePixel>,
}

/// Display points on the device.
#[derive(Debug)]
pub struct Carry {
    rest: Buf<[f32; 4]>,
    carriers: Buf<Carrier>,
    bound: Buf<Bound>,
    edge: Option<(Buf<EdgePixel>, u32)>,
    /// What the renderer draws.
    pub display: Display,
}

impl Carry {
    /// Uploads the points and remembers the particles they are bound to.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn new(
        gpu: &Gpu,
        arrays: &DisplayArrays,
        camera: Camera,
        particles: Option<(Buf<Particle>, Buf<Deformation>)>,
    ) -> Result<Self, GpuError> {
        let count = arrays.points.len() as u64;
        let bound = gpu.alloc("run", "display/bound", particles.map_or(1, |p| p.0.len()))?;
        if let Some((particles, deformations)) = particles {
            let mut rec = Recording::new("bind");
            let immediates = Carried { count: particles.len() as u32 };
            rec.each(&points::Bind { particles, deformations, bound, immediates }, &Constants::none(), particles.len());
            gpu.run(&rec)?;
        }
        let edge = match arrays.edge.len() as u32 {
            0 => None,
            n => Some((gpu.upload("run", "display/edge", &arrays.edge)?, n)),
        };
        Ok(Self {
            rest: gpu.upload("run", "display/rest", &arrays.points)?,
            carriers: gpu.upload("run", "display/carriers", &arrays.carriers)?,
            bound,
            edge,
            display: Display {
                points: gpu.upload("run", "display/points", &arrays.points)?,
                colors: gpu.upload("run", "display/colors", &arrays.colors)?,
                objects: gpu.upload("run", "display/objects", &arrays.objects)?,
                count,
                camera: gpu.upload("run", "display/camera", &[camera])?,
            },
        })
    }

    /// Moves the points with the particles; `background` is the picture whose edge they uncover.
    pub fn record(
        &self,
        rec: &mut Recording,
        particles: Buf<Particle>,
        deformations: Buf<Deformation>,
        background: Option<Buf<u32>>,
    ) {
        let Self { rest, carriers, bound, .. } = *self;
        let Display { points, camera, count, .. } = self.display;
        let immediates = Carried { count: count as u32 };
        rec.section("carry");
        rec.each(
            &points::Carry { rest, carriers, particles, deformations, bound, points, immediates },
            &Constants::none(),
            count,
        );
        if let (Some((edge, n)), Some(background)) = (self.edge, background) {
            let immediates = Uncovered { count: n, full: UNCOVERED_AT };
            rec.each(
                &points::Uncover { edge, rest, points, camera, background, immediates },
                &Constants::none(),
                u64::from(n),
            );
        }
    }
}

/// A carrier that carries nothing: its point stays where it is.
pub fn nothing() -> Carrier {
    Carrier::zeroed()
}

/// RGBA8 with red in the lowest byte.
pub fn rgba(rgb: [u8; 3]) -> u32 {
    u32::from_le_bytes([rgb[0], rgb[1], rgb[2], 255])
}
