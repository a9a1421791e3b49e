//! The plan: which stages a scene needs for the output asked for, compiled backwards from it. Plain data; what
//! nothing needs is skipped, with the reason.

use crate::scene::{Material, Pressure, Scene, Source, Until};

/// What a stage makes and others need.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Artifact {
    /// The decoded photograph, labels and depth at the working size.
    Photo,
    /// Smooth surfaces of the objects.
    Surfaces,
    /// Where the world is, seen from the camera.
    World,
    /// Particles of the bodies.
    Bodies,
    /// The simulated particles.
    State,
    /// Files of particles.
    Points,
    /// The photograph without the objects that move.
    Backdrop,
    /// Points that are drawn.
    Display,
    /// Drawn frames.
    Frames,
    /// Frames after the network.
    Flow,
    /// The encoded videos.
    Video,
}

/// A stage of the registry: what it makes, what it needs, and why a scene may do without it.
struct Stage {
    name: &'static str,
    makes: Artifact,
    needs: &'static [Artifact],
    what: fn(&Scene) -> &'static str,
    /// The reason to skip it in this scene, if there is one.
    idle: fn(&Scene) -> Option<&'static str>,
}

fn no_photo(scene: &Scene) -> Option<&'static str> {
    scene.photo.is_none().then_some("the scene has no photograph")
}
fn nothing_moves(scene: &Scene) -> Option<&'static str> {
    (!scene.objects.iter().any(|o| o.material.is_some())).then_some("no object has a material")
}
fn frames_given(scene: &Scene) -> Option<&'static str> {
    scene.flow.as_ref().and_then(|f| f.input.as_ref()).map(|_| "`flow.input` gives the frames")
}
/// The solver of a scene's bodies.
fn solver(scene: &Scene) -> &'static str {
    let fluid = scene.objects.iter().any(|o| matches!(o.material, Some(Material::Sph { .. })));
    match scene.simulation.pressure {
        Pressure::Wcsph if fluid => "SPH (WCSPH)",
        Pressure::Dfsph if fluid => "SPH (DFSPH)",
        _ => "MLS-MPM",
    }
}
fn always(_: &Scene) -> Option<&'static str> {
    None
}

/// Every stage, in the order of running.
const STAGES: &[Stage] = &[
    Stage {
        name: "photo",
        makes: Artifact::Photo,
        needs: &[],
        what: |_| "read the photograph, its labels and depth",
        idle: no_photo,
    },
    Stage {
        name: "surfaces",
        makes: Artifact::Surfaces,
        needs: &[Artifact::Photo],
        what: |_| "complete and smooth the depth inside each mask",
        idle: no_photo,
    },
    Stage {
        name: "world",
        makes: Artifact::World,
        needs: &[Artifact::Photo],
        what: |_| "find up and the ground",
        idle: no_photo,
    },
    Stage {
        name: "bodies",
        makes: Artifact::Bodies,
        needs: &[Artifact::Surfaces, Artifact::World],
        what: |_| "fill the bodies with particles",
        idle: nothing_moves,
    },
    Stage { name: "simulate", makes: Artifact::State, needs: &[Artifact::Bodies], what: solver, idle: nothing_moves },
    Stage {
        name: "points",
        makes: Artifact::Points,
        needs: &[Artifact::State],
        what: |_| "write the particles of each frame",
        idle: |s| s.output.points.is_none().then_some("`output.points` is not set"),
    },
    Stage {
        name: "backdrop",
        makes: Artifact::Backdrop,
        needs: &[Artifact::Photo],
        what: |_| "fill the photograph behind what moves",
        idle: |s| {
            let moving = s.objects.iter().any(|o| o.material.is_some() && matches!(o.source, Source::Mask { .. }));
            no_photo(s).or((!moving).then_some("nothing seen in the photograph moves"))
        },
    },
    Stage {
        name: "display",
        makes: Artifact::Display,
        needs: &[Artifact::Surfaces, Artifact::World, Artifact::Bodies],
        what: |_| "tie the points that are drawn to the particles",
        idle: frames_given,
    },
    Stage {
        name: "render",
        makes: Artifact::Frames,
        needs: &[Artifact::State, Artifact::Display, Artifact::Backdrop],
        what: |_| "draw the points over the background",
        idle: frames_given,
    },
    Stage {
        name: "driving",
        makes: Artifact::Frames,
        needs: &[],
        what: |_| "read the driving frames",
        idle: |s| frames_given(s).is_none().then_some("`flow.input` is not set"),
    },
    Stage {
        name: "flow",
        makes: Artifact::Flow,
        needs: &[Artifact::Frames],
        what: |_| "make the frames consistent with the image (network)",
        idle: |s| s.flow.is_none().then_some("the scene has no [flow]"),
    },
    Stage {
        name: "encode",
        makes: Artifact::Video,
        needs: &[Artifact::Frames, Artifact::Flow],
        what: |_| "encode the video",
        idle: always,
    },
];

/// A stage of a plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Planned {
    /// Name of the stage.
    pub name: &'static str,
    /// What it does.
    pub what: &'static str,
    /// Why it is skipped; absent when it runs.
    pub skipped: Option<String>,
}

/// The stages of a run, in order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Run and skipped stages.
    pub stages: Vec<Planned>,
    /// The last thing asked for.
    pub until: Until,
}

impl Plan {
    /// Compiles a scene backwards from what is asked for.
    pub fn new(scene: &Scene, until: Until) -> Self {
        let mut wanted: Vec<Artifact> = match until {
            Until::State => vec![Artifact::State],
            Until::Points => vec![Artifact::Points],
            Until::Frames => vec![Artifact::Frames, Artifact::Points],
            Until::Video => vec![Artifact::Video, Artifact::Points],
        };
        let mut stages: Vec<Planned> = STAGES
            .iter()
            .rev()
            .map(|stage| {
                // `--output points` asks for points whether or not the scene does.
                let forced = until == Until::Points && stage.makes == Artifact::Points;
                // What the scene has no use for is said first: no other output would change it.
                let idle = (stage.idle)(scene).filter(|_| !forced).map(str::to_string);
                let unwanted = || format!("nothing asked for needs it (`--output {}`)", name_of(until));
                let skipped = idle.or_else(|| (!wanted.contains(&stage.makes)).then(unwanted));
                if skipped.is_none() {
                    wanted.extend(stage.needs);
                }
                Planned { name: stage.name, what: (stage.what)(scene), skipped }
            })
            .collect();
        stages.reverse();
        Self { stages, until }
    }

    /// Whether a stage runs.
    pub fn runs(&self, name: &str) -> bool {
        self.stages.iter().any(|s| s.name == name && s.skipped.is_none())
    }
}

/// The word a user writes for it.
pub fn name_of(until: Until) -> &'static str {
    match until {
        Until::State => "state",
        Until::Points => "points",
        Until::Frames => "frames",
        Until::Video => "video",
    }
}
