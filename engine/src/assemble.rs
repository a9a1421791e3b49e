//! From a scene and its decoded files to what is simulated and drawn. Runs on the CPU once per scene; knows neither
//! files nor devices.

use std::collections::BTreeMap;
use std::time::Instant;

use glam::Vec3;
use physvideo_gpu::kernels::Camera;

use crate::cap::{self, Capped};
use crate::crossing;
use crate::domain;
use crate::elastic::{self, Choice};
use crate::emission;
use crate::filling::{colored, shortfall};
use crate::fluid::Fluid;
use crate::geometry::{self, GeometryError, Lattice, Particles, PhotoData, Smoothing, SurfaceMap, WorldFromCamera};
use crate::idle;
use crate::limits::{Crowd, MOST_BODIES, refuse_short, refuse_wide};
use crate::pins;
use crate::plan::Plan;
use crate::scene::{Depth, Ground, Kind, Material, Object, Problem, Scene, Source};
use crate::stages::view;
use crate::world::{self, Body, World};

/// Vertices, in the file's own units, and triangles over them.
pub type Mesh = (Vec<[f32; 3]>, Vec<[u32; 3]>);
/// Positions, in the file's own units, and sRGB colours 0–1, where there are any.
pub type Points = (Vec<[f32; 3]>, Option<Vec<[f32; 3]>>);

/// Decoded files of a scene.
#[derive(Clone, Debug, Default)]
pub struct Inputs {
    /// The photograph at its full size.
    pub photo: Option<PhotoData>,
    /// Meshes, by index of the object.
    pub meshes: BTreeMap<usize, Mesh>,
    /// Points, by index of the object.
    pub points: BTreeMap<usize, Points>,
    /// Memory the run may take [bytes]; bodies that need more are refused before they are made. Absent: not known.
    pub memory: Option<u64>,
}

/// The photograph at the working size, and what was found in it.
#[derive(Clone, Debug)]
pub struct View {
    /// The photograph.
    pub photo: PhotoData,
    /// Depth of the objects.
    pub surfaces: Option<SurfaceMap>,
    /// The world.
    pub world: WorldFromCamera,
    /// Height of the ground plane [m], when there is one.
    pub ground: Option<f32>,
}

/// What a scene becomes.
#[derive(Clone, Debug)]
pub struct Assembled {
    /// What is simulated.
    pub world: World,
    /// sRGB colours 0–1 of the particles, body after body.
    pub colors: Vec<[f32; 3]>,
    /// The solver of that, and why.
    pub elastic: Choice,
    /// Bodies that the stiffness cap has made softer.
    pub capped: Vec<Capped>,
    /// Index of each body's object in the scene.
    pub object_of: Vec<usize>,
    /// Objects that only occlude, by index: their points, drawn and not simulated.
    pub statics: Vec<(usize, Particles)>,
    /// The photograph, when there is one.
    pub view: Option<View>,
    /// The camera at the frames' size.
    pub camera: Camera,
    /// Size of the frames [px].
    pub size: (u32, u32),
    /// What the user should know of how it was built.
    pub notes: Vec<String>,
    /// Stages that ran here and the wall time of each [ms].
    pub wall_ms: Vec<(&'static str, f64)>,
}

/// Something in the scene that cannot be built, at a key.
pub(crate) fn at(key: String, message: impl ToString) -> Problem {
    Problem::new(Kind::Conflict, key, message.to_string())
}

/// Builds what the plan needs.
///
/// # Errors
/// A problem located at a key of the scene.
pub fn assemble(scene: &Scene, inputs: &Inputs, plan: &Plan) -> Result<Assembled, Problem> {
    let mut wall_ms = Vec::new();
    let view = inputs.photo.as_ref().map(|photo| see(scene, photo, plan, &mut wall_ms)).transpose()?;
    let dx = 1.0 / scene.simulation.grid_density;
    let lattice = Lattice::new(dx, scene.simulation.particles_per_cell)
        .map_err(|e| at("simulation.particles_per_cell".into(), e))?;
    let liquid =
        Lattice::new(scene.simulation.particle_size, 1).map_err(|e| at("simulation.particle_size".into(), e))?;
    let height = |g: &Ground| g.height.or(view.as_ref().and_then(|v| v.ground)).unwrap_or(0.0);
    let ground = scene.ground.as_ref().map(height);
    let since = Instant::now();
    let mut crowd = Crowd::new(inputs.memory);
    let (mut bodies, mut notes) = (Vec::new(), Vec::new());
    let mut colors = Vec::new();
    let mut object_of = Vec::new();
    if plan.runs("bodies") {
        // Bodies of one material follow each other: the solver calls each material's kernels once.
        let mut simulated: Vec<_> = scene.objects.iter().enumerate().filter(|(_, o)| o.material.is_some()).collect();
        simulated.sort_by_key(|(_, o)| o.material.map(|m| m.law().material));
        for (index, object) in simulated {
            let lattice = if matches!(object.material, Some(Material::Sph { .. })) { &liquid } else { &lattice };
            let mut filled = colored(scene, index, inputs, view.as_ref(), lattice, &mut crowd)?;
            notes.extend(shortfall(object, &filled));
            notes.extend(crossing::clear(scene, object, ground, lattice.spacing, &mut filled));
            let emission = emission::pool(scene, index, object, &mut filled, &mut crowd)?;
            colors.extend_from_slice(&filled.colors);
            let body = body(scene, index, object, filled, view.as_ref(), &mut notes)?;
            bodies.push(Body { emission, ..body });
            object_of.push(index);
        }
    }
    let mut statics = Vec::new();
    for (index, object) in scene.objects.iter().enumerate() {
        if object.material.is_none() && !matches!(object.source, Source::Mask { .. }) && plan.runs("display") {
            statics.push((index, colored(scene, index, inputs, view.as_ref(), &lattice, &mut crowd)?));
        }
    }
    if plan.runs("bodies") {
        wall_ms.push(("bodies", ms(since)));
    }
    let size = frame_size(scene, view.as_ref());
    let camera = match (&scene.camera, &view) {
        (Some(camera), _) => view::look_at(camera, size.0, size.1),
        (None, Some(v)) => view::of_photo(&v.photo, &v.world),
        (None, None) if plan.runs("render") => {
            return Err(at("camera".into(), "frames need a view: add [camera] with `eye` and `target`, or a [photo]"));
        }
        (None, None) => view::look_at(
            &crate::scene::Camera { eye: [0.0, -1.0, 0.5], target: [0.0; 3], fov_y: 40.0 },
            size.0,
            size.1,
        ),
    };
    let mut colliders: Vec<_> = scene.colliders.iter().map(world::collider).collect();
    if let (Some(height), Some(g)) = (ground, &scene.ground) {
        colliders.insert(0, world::ground(height, g.friction));
    }
    if colliders.len() > 16 || scene.fields.len() > 16 {
        return Err(at("collider".into(), "at most 16 colliders (the ground counts) and 16 fields fit in a scene"));
    }
    if bodies.len() > MOST_BODIES {
        return Err(at("object".into(), format!("at most {MOST_BODIES} objects with a material fit in a scene")));
    }
    let domain = domain::of(scene, &bodies, dx);
    domain::check(scene, &bodies, &object_of, domain)?;
    let mut world = World {
        bodies,
        gravity: scene.gravity,
        fields: scene.fields.iter().zip(0..).map(|(f, i)| world::field(f, scene.seed, i)).collect(),
        colliders,
        domain,
        dx,
        courant: scene.simulation.courant,
        force_dt: scene.simulation.force_dt,
        fluid: Fluid {
            particle_size: scene.simulation.particle_size,
            pressure: scene.simulation.pressure,
            viscosity: scene.simulation.viscosity,
            shifting: scene.simulation.shifting,
            ..Fluid::default()
        },
    };
    idle::silence(scene, &mut world, ground.is_some());
    refuse_wide(domain, world.cell())?;
    crossing::refuse(scene, &world, &object_of, ground)?;
    let capped = scene.simulation.stiffness_cap.map_or_else(Vec::new, |share| cap::apply(share, &mut world));
    notes.extend(capped.iter().map(Capped::line));
    let elastic = elastic::choose(scene.simulation.elastic, &world)?;
    notes.extend(elastic::undamped(&elastic, &mut world));
    notes.extend(idle::notes(scene, &world, &elastic));
    refuse_short(&world, &object_of, 1.0 / scene.output.fps)?;
    Ok(Assembled { world, elastic, capped, colors, object_of, statics, view, camera, size, notes, wall_ms })
}

/// Milliseconds since.
fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

fn see(scene: &Scene, photo: &PhotoData, plan: &Plan, wall_ms: &mut Vec<(&'static str, f64)>) -> Result<View, Problem> {
    let since = Instant::now();
    let labels: Vec<u8> = scene
        .objects
        .iter()
        .filter_map(|o| if let Source::Mask { label, .. } = o.source { Some(label) } else { None })
        .collect();
    let up = scene.photo.as_ref().and_then(|p| p.up).map(Vec3::from);
    let geometric = |e: GeometryError| at("photo".into(), e);
    // The ground is sought at full size: it costs little and has more points there.
    let (world, ground) = match &scene.ground {
        Some(g) if g.height.is_none() && plan.runs("world") => {
            let plane = geometry::find_ground(photo, &labels, up, scene.seed).map_err(|e| at("ground".into(), e))?;
            (WorldFromCamera::new(plane.normal, plane.height).map_err(geometric)?, Some(0.0))
        }
        other => {
            let image_up = Vec3::new(0.0, -1.0, 0.0);
            let world = WorldFromCamera::new(up.unwrap_or(image_up), 0.0).map_err(|e| at("photo.up".into(), e))?;
            (world, other.as_ref().and_then(|g| g.height))
        }
    };
    if plan.runs("world") {
        wall_ms.push(("world", ms(since)));
    }
    let since = Instant::now();
    let width = if plan.runs("render") || plan.runs("surfaces") { scene.output.width } else { photo.width };
    let small = photo.resample(width).map_err(geometric)?;
    let surfaces = if plan.runs("surfaces") {
        let smoothing = match scene.photo.as_ref().map(|p| &p.depth) {
            Some(Depth::Disparity { baseline, scale, .. }) => {
                Smoothing::integer_disparity(photo.focal_px, *baseline, *scale)
            }
            _ => Smoothing::continuous(),
        };
        Some(geometry::smooth(&small, &labels, &smoothing).map_err(geometric)?)
    } else {
        None
    };
    if plan.runs("surfaces") {
        wall_ms.push(("surfaces", ms(since)));
    }
    Ok(View { photo: small, surfaces, world, ground })
}

fn frame_size(scene: &Scene, view: Option<&View>) -> (u32, u32) {
    match view {
        Some(v) if scene.camera.is_none() => (v.photo.width, v.photo.height),
        _ => {
            let height = scene.output.height.unwrap_or((scene.output.width * 9 / 16).max(2));
            (scene.output.width, height.next_multiple_of(2))
        }
    }
}

fn body(
    scene: &Scene,
    index: usize,
    object: &Object,
    filled: Particles,
    view: Option<&View>,
    notes: &mut Vec<String>,
) -> Result<Body, Problem> {
    let n = filled.positions.len().max(1) as f32;
    let center = filled.positions.iter().fold(Vec3::ZERO, |s, p| s + Vec3::from(*p)) / n;
    let spin = Vec3::from(object.angular_velocity);
    let velocities = filled
        .positions
        .iter()
        .map(|p| (Vec3::from(object.velocity) + spin.cross(Vec3::from(*p) - center)).to_array())
        .collect();
    let mut pinned = vec![false; filled.positions.len()];
    for region in &object.pins {
        pins::pin(scene, region, view, &filled.positions, &mut pinned)?;
    }
    if object.prestress == Some(true) && object.pins.is_empty() {
        return Err(at(
            format!("object[{index}].prestress"),
            format!(
                "nothing holds '{}': only a body with `pins` can start at rest under gravity; one without settles by itself",
                object.name
            ),
        ));
    }
    let prestress = object.prestressed() && !object.pins.is_empty();
    if prestress {
        // Twice the spacing of the particles.
        let loose = pins::hold_loose(&filled.positions, 2.0 * filled.volume.cbrt(), &mut pinned);
        if loose.pieces > 0 {
            notes.push(format!(
                "{}: {} of its pieces ({} particles) that no pin reaches are held where they are",
                object.name, loose.pieces, loose.particles
            ));
        }
    }
    let material = object.material.ok_or_else(|| at("object".into(), "an object without material is not simulated"))?;
    let mut fields = 0;
    for (i, field) in scene.fields.iter().enumerate() {
        if field.objects.as_ref().is_none_or(|names| names.contains(&object.name)) {
            fields |= 1 << i;
        }
    }
    Ok(Body {
        name: object.name.clone(),
        material,
        density: object.density,
        particle_volume: filled.volume,
        positions: filled.positions,
        velocities,
        pinned,
        gravity: object.gravity,
        // A photograph shows a held body sagged. One that nothing holds stands on something, and may fall from it.
        prestress,
        friction: object.friction,
        damping: object.damping,
        fields,
        recycle: world::recycle(object, scene.seed, index as u32),
        emission: None,
    })
}
