//! The source of an object as particles, with its colours.

use glam::Vec3;

use crate::assemble::{Inputs, View, at};
use crate::geometry::{self, GeometryError, Lattice, MaskBody, Particles, TriangleMesh};
use crate::limits::Crowd;
use crate::scene::{Material, Object, Problem, Scene, Source};

/// The particles of an object, with pattern and light where it has no colours of its own.
pub(crate) fn colored(
    scene: &Scene,
    index: usize,
    inputs: &Inputs,
    view: Option<&View>,
    lattice: &Lattice,
    crowd: &mut Crowd,
) -> Result<Particles, Problem> {
    let object = &scene.objects[index];
    let mut filled = fill(index, object, inputs, view, lattice, crowd)?;
    let (origin, yaw) = match &object.source {
        Source::Box { min, .. } => (*min, 0.0),
        Source::Ball { center, .. } => (*center, 0.0),
        Source::Mesh { yaw, position, .. } => (*position, *yaw),
        Source::Mask { .. } | Source::Points { .. } => return Ok(filled),
    };
    if let Some(side) = object.checks {
        let back = glam::Quat::from_rotation_z(-yaw.to_radians());
        geometry::checks(&mut filled, side, |x| back * (x - Vec3::from(origin)));
    }
    if let Some(light) = scene.render.light {
        geometry::shade(&mut filled, lattice.spacing, Vec3::from(light));
    }
    Ok(filled)
}

/// Says how much of a box of liquid its whole layers leave free, where it is more than a twentieth.
pub(crate) fn shortfall(object: &Object, filled: &Particles) -> Option<String> {
    let (Source::Box { min, max }, Some(Material::Sph { .. })) = (&object.source, object.material) else { return None };
    let whole: f64 = (0..3).map(|a| f64::from(max[a]) - f64::from(min[a])).product();
    let free = 1.0 - filled.positions.len() as f64 * f64::from(filled.volume) / whole;
    (free > 0.05).then(|| {
        format!(
            "whole layers of particles leave {:.0} % of the box of '{}' free: a smaller `simulation.particle_size` fills more",
            100.0 * free,
            object.name
        )
    })
}

fn fill(
    index: usize,
    object: &Object,
    inputs: &Inputs,
    view: Option<&View>,
    lattice: &Lattice,
    crowd: &mut Crowd,
) -> Result<Particles, Problem> {
    let key = format!("object[{index}].source");
    let fail = |e: GeometryError| at(key.clone(), e);
    let mut room = |count: u64| crowd.add(&key, object, count);
    let predicted = |volume: f64| lattice.predict_count(volume);
    let liquid = matches!(object.material, Some(Material::Sph { .. }));
    // Liquids of SPH stand in whole layers, so that none is nearer to a wall at their faces than half a particle. What a
    // nozzle lets out follows the lattice of all.
    let seats = liquid && object.emitter.is_none();
    match &object.source {
        Source::Box { min, max } => {
            room(predicted((0..3).map(|a| f64::from(max[a]) - f64::from(min[a])).product()))?;
            let fits = if liquid { Lattice::fill_vessel } else { Lattice::fill_box };
            fits(lattice, &object.name, *min, *max, object.color).map_err(fail)
        }
        Source::Ball { center, radius } => {
            room(predicted(4.19 * f64::from(*radius).powi(3)))?;
            let center = Vec3::from(*center);
            let ball = |back: Vec3| lattice.fill_ball(&object.name, (center - back).into(), *radius, object.color);
            // Off the middle of a lattice it can have a single particle at a pole, on which it bounces sideways.
            let round = object.material.is_some() && object.emitter.is_none() && *radius > lattice.spacing;
            if !seats && !round {
                return ball(Vec3::ZERO).map_err(fail);
            }
            lattice.seated((center - *radius).into(), (center + *radius).into(), ball).map_err(fail)
        }
        Source::Mesh { scale, yaw, position, .. } => {
            let Some((vertices, triangles)) = inputs.meshes.get(&index) else {
                return Err(at(key.clone(), "its mesh was not read"));
            };
            let turn = glam::Quat::from_rotation_z(yaw.to_radians());
            let placed: Vec<Vec3> =
                vertices.iter().map(|v| turn * (Vec3::from(*v) * *scale) + Vec3::from(*position)).collect();
            let moved = |back: Vec3| {
                let placed: Vec<[f32; 3]> = placed.iter().map(|x| (*x - back).to_array()).collect();
                TriangleMesh::new(&placed, triangles)
            };
            let mesh = moved(Vec3::ZERO).map_err(fail)?;
            room(predicted(mesh.volume()))?;
            if !seats {
                return lattice.fill_mesh(&object.name, &mesh, object.color).map_err(fail);
            }
            let low = placed.iter().copied().fold(Vec3::MAX, Vec3::min);
            let high = placed.iter().copied().fold(Vec3::MIN, Vec3::max);
            let fill = |back: Vec3| lattice.fill_mesh(&object.name, &moved(back)?, object.color);
            lattice.seated(low.into(), high.into(), fill).map_err(fail)
        }
        Source::Points { scale, position, .. } => {
            let Some((points, colors)) = inputs.points.get(&index) else {
                return Err(at(key.clone(), "its points were not read"));
            };
            room(points.len() as u64)?;
            let positions: Vec<_> =
                points.iter().map(|p| std::array::from_fn(|a| p[a] * scale + position[a])).collect();
            let colors = colors.clone().unwrap_or_else(|| vec![object.color; positions.len()]);
            Ok(Particles { positions, volume: lattice.spacing.powi(3), colors })
        }
        Source::Mask { label, thickness } => {
            let Some(View { photo, surfaces: Some(map), world, .. }) = view else {
                return Err(at(key.clone(), "a mask needs [photo]"));
            };
            let thick = geometry::thickness(map, *label, *thickness);
            let body = MaskBody::new(map, *label, &thick, &photo.rgb, world).map_err(fail)?;
            room(predicted(body.volume()))?;
            lattice.fill_mask(&object.name, &body).map_err(fail)
        }
    }
}
