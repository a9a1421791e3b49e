//! Rules that join several keys of a scene: names, labels, boxes, times, what needs a photograph. Sees typed data only.

use std::collections::{BTreeMap, BTreeSet};

use super::errors::{Kind, Problem};
use super::structure::{nearest, suggest};
use super::{
    Domain, Emitter, Field, FieldRegion, Force, Material, Object, Pool, Pressure, Recycle, Region, Scene, Shape,
    Source, Thickness,
};
use crate::flow::SdeRule;

/// Every broken rule, at its key path.
pub(super) fn check(scene: &Scene) -> Vec<Problem> {
    let mut rules = Rules { scene, found: Vec::new() };
    rules.views();
    rules.names();
    rules.solvers();
    rules.flow();
    for (index, object) in scene.objects.iter().enumerate() {
        rules.object(&format!("object[{index}]"), object);
    }
    for (index, collider) in scene.colliders.iter().enumerate() {
        let key = format!("collider[{index}]");
        rules.shape(&format!("{key}.shape"), &collider.shape);
        rules.times(&key, collider.start, collider.end);
    }
    for (index, field) in scene.fields.iter().enumerate() {
        rules.field(&format!("field[{index}]"), field);
    }
    rules.found
}

struct Rules<'a> {
    scene: &'a Scene,
    found: Vec<Problem>,
}

impl Rules<'_> {
    fn report(&mut self, kind: Kind, key: impl Into<String>, message: impl Into<String>, help: impl Into<String>) {
        self.found.push(Problem::new(kind, key, message).help(help));
    }

    fn views(&mut self) {
        if let Some(up) = self.scene.photo.as_ref().and_then(|photo| photo.up) {
            self.direction("photo.up", up);
        }
        if let Some(light) = self.scene.render.light {
            self.direction("render.light", light);
        }
        if let Some(camera) = &self.scene.camera
            && camera.eye == camera.target
        {
            self.report(
                Kind::OutOfRange,
                "camera.target",
                "the same point as `eye`: the view has no direction",
                "give a point in front of the camera",
            );
        }
        if let Some(domain) = &self.scene.simulation.domain {
            self.ordered("simulation.domain", &domain.min, &domain.max);
        }
    }

    fn flow(&mut self) {
        let Some(flow) = &self.scene.flow else { return };
        if let (Some(steps), Some(tau)) = (flow.steps, flow.tau_step)
            && tau > steps
        {
            let message = format!("step {tau} is beyond the schedule's {steps}");
            self.report(Kind::OutOfRange, "flow.tau_step", message, "give tau_step ≤ steps");
        }
        if let Some([w, h]) = flow.size
            && !([w, h].iter().all(|s| (8..=8192).contains(s)))
        {
            let message = format!("{w} × {h} is out of range, width and height must be between 8 and 8192");
            self.report(Kind::OutOfRange, "flow.size", message, "give the size in pixels");
        }
        // Which integrators go with β and with soft masks does not depend on the numbers.
        let soft = flow.mask.pool == Some(Pool::Share);
        for (key, unfit) in [("flow.beta", flow.beta.is_some()), ("flow.mask.pool", soft)] {
            let beta = flow.beta.filter(|_| key == "flow.beta").map(f64::from);
            if unfit && let Err(e) = SdeRule::new(flow.sde, 1e-3, 0.5, beta, soft && beta.is_none()) {
                self.report(Kind::Conflict, key, e.to_string(), "choose another `flow.sde`, or remove this key");
            }
        }
        if flow.negative_embeddings.is_some() && flow.guidance == Some(1.0) {
            let message = "guidance 1 leads away from nothing, so this file is not used";
            self.report(Kind::Conflict, "flow.negative_embeddings", message, "raise guidance or remove this key");
        }
        if flow.input.is_some() && (!self.scene.objects.is_empty() || self.scene.photo.is_some()) {
            let message = "frames from files take the place of a simulated scene, and this one has both";
            self.report(Kind::Conflict, "flow.input", message, "remove [photo] and the objects, or `input`");
        }
    }

    fn names(&mut self) {
        let mut names = BTreeMap::new();
        let mut labels = BTreeMap::new();
        for (index, object) in self.scene.objects.iter().enumerate() {
            if let Some(first) = names.insert(object.name.as_str(), index).filter(|_| !object.name.trim().is_empty()) {
                let message = format!("`{}` is already the name of object[{first}]", object.name);
                self.report(Kind::Duplicate, format!("object[{index}].name"), message, "give each object its own name");
            }
            if let Source::Mask { label, .. } = object.source
                && let Some(first) = labels.insert(label, index)
            {
                let message = format!("label {label} is already object[{first}]");
                let help = "each label of the label image is one object";
                self.report(Kind::Duplicate, format!("object[{index}].source.mask.label"), message, help);
            }
        }
    }

    /// Liquids of SPH and the bodies of other solvers do not feel each other yet.
    fn solvers(&mut self) {
        let fluid = |o: &&Object| matches!(o.material, Some(Material::Sph { .. }));
        let liquid = self.scene.objects.iter().any(|o| fluid(&o));
        if liquid && self.scene.simulation.shifting && self.scene.simulation.pressure == Pressure::Dfsph {
            let message = "a pressure that is solved for does not stand shifted particles yet";
            let help = "give `pressure = 'wcsph'`, or remove this key";
            self.report(Kind::Conflict, "simulation.shifting", message, help);
        }
        let simulated = || self.scene.objects.iter().filter(|o| o.material.is_some());
        let Some(first) = simulated().next() else { return };
        let other = |o: &Object| o.material.is_some() && fluid(&o) != fluid(&first);
        if let Some((index, second)) = self.scene.objects.iter().enumerate().find(|(_, o)| other(o)) {
            let message = format!(
                "`{}` and `{}`, a liquid of SPH and a body of another solver, do not feel each other yet",
                first.name, second.name
            );
            let help = "give all objects `sph`, or none, or remove the material of those that stand still";
            self.report(Kind::Conflict, format!("object[{index}].material"), message, help);
        }
    }

    fn object(&mut self, key: &str, object: &Object) {
        match &object.source {
            Source::Mask { thickness, .. } => {
                if self.scene.photo.is_none() {
                    let message = "a mask needs a photograph and the scene has none";
                    let help = "add [photo] with image, labels, depth and focal_px, or use mesh, points, box or ball";
                    self.report(Kind::Conflict, format!("{key}.source.mask"), message, help);
                }
                if let Thickness::Inflate { min, max, .. } = *thickness
                    && min > max
                {
                    let message = format!("min {min} is above max {max}");
                    let key = format!("{key}.source.mask.thickness.inflate.min");
                    self.report(Kind::OutOfRange, key, message, "give min ≤ max");
                }
            }
            Source::Box { min, max } => self.ordered(&format!("{key}.source.box"), min, max),
            Source::Mesh { .. } | Source::Points { .. } | Source::Ball { .. } => {}
        }
        if let Some(emitter) = &object.emitter {
            self.emitter(&format!("{key}.emitter"), object, emitter);
        }
        if let Some(recycle) = &object.recycle {
            self.recycle(key, object, recycle);
        }
        for (index, pin) in object.pins.iter().enumerate() {
            let key = format!("{key}.pins[{index}]");
            match pin {
                Region::Box { min, max } => self.ordered(&format!("{key}.box"), min, max),
                Region::Ball { .. } => {}
                Region::Pixels { min, max } => {
                    if self.scene.photo.is_none() {
                        let message = "a rectangle of pixels needs a photograph and the scene has none";
                        self.report(
                            Kind::Conflict,
                            format!("{key}.pixels"),
                            message,
                            "add [photo], or use box or ball",
                        );
                    }
                    self.ordered(&format!("{key}.pixels"), min, max);
                }
                Region::Near { object: other, .. } if *other == object.name => {
                    let message = format!("`{other}` is the object itself, so all of it would be held");
                    self.report(Kind::Conflict, format!("{key}.near.object"), message, "name another object");
                }
                Region::Near { object: other, .. } => self.known(&format!("{key}.near.object"), other),
            }
        }
    }

    fn emitter(&mut self, key: &str, object: &Object, emitter: &Emitter) {
        self.times(key, emitter.start, emitter.end);
        if object.material.is_none() || matches!(object.source, Source::Mask { .. }) {
            let message = "only an object with a material that is not seen in the photograph can be emitted";
            self.report(Kind::Conflict, key, message, "give it a material, or remove this key");
        }
        if object.velocity == [0.0; 3] {
            let message = "without a velocity of the object nothing leaves it";
            self.report(Kind::Conflict, key, message, "give the object a `velocity`");
        }
        if object.angular_velocity != [0.0; 3] || !object.pins.is_empty() {
            let message = "what is emitted neither spins nor is held";
            self.report(Kind::Conflict, key, message, "remove `angular_velocity` and `pins`");
        }
    }

    fn recycle(&mut self, object_key: &str, object: &Object, recycle: &Recycle) {
        let key = format!("{object_key}.recycle");
        if object.material.is_none() || matches!(object.source, Source::Mask { .. }) {
            let message = "only an object with a material that is not seen in the photograph can start anew";
            self.report(Kind::Conflict, key.clone(), message, "give it a material, or remove this key");
        }
        self.reach(&format!("{key}.region"), object, recycle.region);
        if matches!(object.material, Some(Material::Sph { .. })) {
            return self.drain(&key, object, recycle);
        }
        let Some(Domain { min, max }) = recycle.to else {
            let message = "without `to` its particles have no place to start anew at";
            return self.report(Kind::Conflict, key, message, "give the box of their source");
        };
        self.ordered(&format!("{key}.to"), &min, &max);
        let apart = match recycle.region {
            FieldRegion::Box { min: low, max: high } => {
                self.ordered(&format!("{key}.region.box"), &low, &high);
                (0..3).any(|a| max[a] < low[a] || min[a] > high[a])
            }
            FieldRegion::Ball { center, radius } => {
                let gap = |a: usize| center[a] - center[a].clamp(min[a].min(max[a]), max[a].max(min[a]));
                (0..3).map(|a| gap(a) * gap(a)).sum::<f32>() > radius * radius
            }
        };
        if !apart {
            let message = "the source reaches into the region, so particles would start anew for ever";
            self.report(Kind::Conflict, format!("{key}.to"), message, "move them apart");
        }
    }

    /// What is fast must not pass a region between two substeps, in which nothing moves by more than a cell.
    fn reach(&mut self, key: &str, object: &Object, region: FieldRegion) {
        let set = &self.scene.simulation;
        let fluid = matches!(object.material, Some(Material::Sph { .. }));
        let cell = if fluid { set.particle_size } else { 1.0 / set.grid_density };
        let thin = match region {
            FieldRegion::Box { min, max } => (0..3).map(|a| max[a] - min[a]).fold(f32::MAX, f32::min),
            FieldRegion::Ball { radius, .. } => 2.0 * radius,
        };
        if thin > 0.0 && thin < cell * (1.0 - 1e-4) {
            let message = format!("{thin} m thick: what is fast passes it between two substeps");
            self.report(Kind::OutOfRange, key, message, format!("make it {cell} m thick or more"));
        }
    }

    /// Particles of SPH would meet others at random places: they start anew out of an emitter.
    fn drain(&mut self, key: &str, object: &Object, recycle: &Recycle) {
        if let FieldRegion::Box { min, max } = recycle.region {
            self.ordered(&format!("{key}.region.box"), &min, &max);
        }
        if recycle.to.is_some() {
            let message = "a liquid of SPH starts anew out of its emitter, not at random places";
            self.report(Kind::Conflict, format!("{key}.to"), message, "remove this key");
        }
        let (message, help) = match object.emitter {
            None => ("a liquid of SPH needs an emitter to start anew", "give it an `emitter`"),
            Some(Emitter { lifetime: Some(_), .. }) => {
                ("particles that have a lifetime are not drained", "remove `emitter.lifetime`, or this key")
            }
            Some(_) => return,
        };
        self.report(Kind::Conflict, key, message, help);
    }

    fn shape(&mut self, key: &str, shape: &Shape) {
        match shape {
            Shape::Plane { normal, .. } => self.direction(&format!("{key}.plane.normal"), *normal),
            Shape::Box { half, .. } => self.sizes(&format!("{key}.box.half"), half),
            Shape::Room { half, .. } => self.sizes(&format!("{key}.room.half"), half),
            Shape::Ball { .. } => {}
        }
    }

    fn field(&mut self, key: &str, field: &Field) {
        self.times(key, field.start, field.end);
        if let Some(FieldRegion::Box { min, max }) = &field.region {
            self.ordered(&format!("{key}.region.box"), min, max);
        }
        if let Force::Vortex { axis, .. } = field.force {
            self.direction(&format!("{key}.force.vortex.axis"), axis);
        }
        for (index, name) in field.objects.iter().flatten().enumerate() {
            self.known(&format!("{key}.objects[{index}]"), name);
        }
    }

    fn known(&mut self, key: &str, name: &str) {
        let names: BTreeSet<&str> = self.scene.objects.iter().map(|object| object.name.as_str()).collect();
        let names = Vec::from_iter(names);
        if !names.contains(&name) {
            let help = suggest(nearest(name, &names), &names, "the objects");
            self.report(Kind::UnknownObject, key, format!("no object is named `{name}`"), help);
        }
    }

    fn times(&mut self, key: &str, start: f32, end: f32) {
        if start >= end {
            let message = format!("end {end} is not after start {start}");
            self.report(Kind::OutOfRange, format!("{key}.end"), message, "give end > start [s]");
        }
    }

    fn ordered(&mut self, key: &str, min: &[f32], max: &[f32]) {
        let axes = ["x", "y", "z"].into_iter().zip(min.iter().zip(max));
        if let Some((axis, (min, max))) = axes.into_iter().find(|(_, (min, max))| min >= max) {
            let message = format!("the box is empty along {axis}: min {min}, max {max}");
            self.report(Kind::OutOfRange, format!("{key}.min"), message, "give min < max along every axis");
        }
    }

    fn sizes(&mut self, key: &str, half: &[f32; 3]) {
        if let Some(size) = half.iter().find(|size| **size <= 0.0) {
            let message = format!("{size} is out of range, it must be above 0");
            self.report(Kind::OutOfRange, key, message, "half of the size along each axis [m]");
        }
    }

    fn direction(&mut self, key: &str, direction: [f32; 3]) {
        // Too short to be normalised in f32 counts as zero: its square underflows.
        if direction.iter().map(|axis| axis * axis).sum::<f32>() < f32::MIN_POSITIVE {
            self.report(Kind::OutOfRange, key, "has no length, so no direction", "give any vector but zero");
        }
    }
}
