//! What `report.json` says, as data. Does not know how a run finds it out.

use std::time::Instant;

use physvideo::cap::Capped;
use physvideo::plan::Plan;
use physvideo::stages::solver::{FrameStats, Measure, Nap};
use serde::Serialize;

use crate::device::DeviceEntry;
use crate::io::write::OutputFile;

/// Version of the layout; a change that breaks readers raises it.
pub const SCHEMA_VERSION: u32 = 1;

/// How a run ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Still running: a report is never left like this.
    #[default]
    Running,
    /// Everything was made.
    Ok,
    /// The user stopped it; finished files are whole.
    Interrupted,
    /// An error ended it; finished files are whole.
    Failed,
}

/// One run.
#[derive(Debug, Default, Serialize)]
pub struct Report {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Name and version of the program.
    pub program: String,
    /// How it ended.
    pub status: Status,
    /// Why, when it did not end well.
    pub message: Option<String>,
    /// What was noticed: clamps, lost particles.
    pub warnings: Vec<String>,
    /// Scene file as named on the command line.
    pub scene: String,
    /// SHA-256 of the scene file.
    pub scene_sha256: String,
    /// Seed of every random stream.
    pub seed: u64,
    /// Whether the same run gives the same bits on this device.
    pub deterministic: bool,
    /// Absent when nothing in the plan needs a device.
    pub device: Option<DeviceEntry>,
    /// Stages and why some are skipped.
    pub plan: Vec<PlanEntry>,
    /// Which solver moved the bodies, and why; absent when nothing is simulated.
    pub solver: Option<String>,
    /// Time each took.
    pub stages: Vec<StageTime>,
    /// Particles of each simulated object.
    pub particles: Vec<ObjectCount>,
    /// Frames finished.
    pub frames: u32,
    /// Frames asked for.
    pub frames_asked: u32,
    /// Frames per second.
    pub fps: f32,
    /// Size of the frames [px].
    pub size: Option<[u32; 2]>,
    /// Substeps taken, those of rejected attempts included.
    pub substeps: u64,
    /// Steps of SPH that searched for neighbours; in the others the lists of the last search held.
    pub searches: u64,
    /// Substeps' sizes [s].
    pub dt: Option<Range>,
    /// Objects that the stiffness cap has made softer, and how much.
    pub softened: Vec<Softened>,
    /// Objects that were left out for some of the time, because they were at rest.
    pub skipped: Vec<Skipped>,
    /// Limits that were hit.
    pub clamps: Clamps,
    /// Numbers of frames that were kept with a fault which shorter steps did not mend.
    pub unmended: Vec<u32>,
    /// Particles that left an emitter.
    pub emitted: u64,
    /// Times that a particle started anew at its source.
    pub recycled: u64,
    /// Sums over each simulated object at the start and the end.
    pub conservation: Vec<Conservation>,
    /// The network's part.
    pub flow: Option<crate::flow::FlowReport>,
    /// Device memory.
    pub memory: Memory,
    /// Kernels compiled, once per variant.
    pub pipelines: Vec<String>,
    /// Files written, in order, by their path in the output folder.
    pub outputs: Vec<OutputFile>,
    /// Simulated time [s].
    pub simulated_s: f64,
    /// Wall time of the whole run [s].
    pub wall_s: f64,
    /// Wall time of the stage `simulate` for each simulated second.
    pub simulate_wall_s_per_simulated_s: Option<f64>,
}

/// A stage of the plan.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PlanEntry {
    /// Its name.
    pub stage: String,
    /// Whether it was left out.
    pub skipped: bool,
    /// Why it was left out.
    pub reason: Option<String>,
}

/// Time of a stage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StageTime {
    /// Its name.
    pub name: String,
    /// Wall time [ms].
    pub wall_ms: f64,
}

/// A number of things of an object.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ObjectCount {
    /// Its name.
    pub object: String,
    /// How many.
    pub count: u64,
}

/// What the stiffness cap has done to an object.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Softened {
    /// Its name.
    pub object: String,
    /// Young's modulus of the scene [Pa].
    pub young: f32,
    /// Young's modulus it was simulated with [Pa].
    pub effective_young: f32,
    /// How many times as soft that is.
    pub factor: f32,
    /// How many times as long its vibration and contact last as they should.
    pub lasts: f32,
}

impl From<&Capped> for Softened {
    fn from(c: &Capped) -> Self {
        let factor = c.factor();
        Self { object: c.body.clone(), young: c.young, effective_young: c.effective, factor, lasts: factor.sqrt() }
    }
}

/// When an object was left out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Skipped {
    /// Its name.
    pub object: String,
    /// When some of its particles were asleep.
    pub asleep: Vec<Asleep>,
}

/// A time in which some particles of an object were asleep without a break.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Asleep {
    /// When it began [s].
    pub from_s: f64,
    /// When it ended [s].
    pub to_s: f64,
    /// How many slept at the most.
    pub particles: u32,
}

impl From<&Nap> for Asleep {
    fn from(nap: &Nap) -> Self {
        Self { from_s: nap.from, to_s: nap.to, particles: nap.particles }
    }
}

/// Least and greatest of a number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Range {
    /// Least.
    pub min: f32,
    /// Greatest.
    pub max: f32,
}

/// Limits that were hit, summed over the run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Clamps {
    /// Grid nodes slowed down to the speed limit.
    pub velocity: u64,
    /// Particle updates whose stretch was limited.
    pub strain: u64,
    /// Particle updates whose compression was refused.
    pub volume: u64,
    /// Pressure solves of liquids that ended with more error than they may have.
    pub unsolved: u64,
    /// Attempts at a frame that were taken back and repeated with smaller steps.
    pub rejected: u64,
    /// Attempts at a frame that ended with more energy than can have come in.
    pub gained: u64,
    /// Particles taken out: not finite, or outside the grid.
    pub quarantined: u64,
    /// Those of them that left the grid's domain.
    pub left: u64,
    /// Particles of liquids found deeper in an obstacle than half of their size at the end of a frame, at the most.
    pub sunk: u64,
}

/// What should change only as physics says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Conservation {
    /// Name of the object.
    pub object: String,
    /// At the start.
    pub start: Sums,
    /// After the last frame.
    pub end: Sums,
}

/// Sums over one object.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Sums {
    /// [kg].
    pub mass: f64,
    /// [kg m/s].
    pub momentum: [f64; 3],
    /// Kinetic energy [J].
    pub kinetic: f64,
    /// Elastic energy [J].
    pub elastic: f64,
    /// Energy in the vertical part of gravity, 0 at z = 0 [J].
    pub potential: f64,
}

impl Sums {
    /// From what the solver measured, under `gravity` [m/s²].
    pub fn new(m: &Measure, gravity: [f32; 3]) -> Self {
        let potential = -f64::from(gravity[2]) * m.height;
        Self { mass: m.mass, momentum: m.momentum, kinetic: m.kinetic, elastic: m.elastic, potential }
    }

    /// False when a sum is NaN or infinite.
    pub fn finite(&self) -> bool {
        let [x, y, z] = self.momentum;
        [self.mass, x, y, z, self.kinetic, self.elastic, self.potential].iter().all(|v| v.is_finite())
    }
}

/// Device memory [bytes].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Memory {
    /// Said before anything was allocated.
    pub predicted: u64,
    /// Most in use at once.
    pub peak: u64,
    /// What the device had.
    pub available: u64,
    /// Buffers in use at the end.
    pub buffers: usize,
}

impl Report {
    /// The stages of a plan.
    pub fn plan_of(plan: &Plan) -> Vec<PlanEntry> {
        let entry = |s: &physvideo::plan::Planned| PlanEntry {
            stage: s.name.into(),
            skipped: s.skipped.is_some(),
            reason: s.skipped.clone(),
        };
        plan.stages.iter().map(entry).collect()
    }

    /// Adds what happened in frame `frame`.
    pub fn count(&mut self, frame: u32, stats: &FrameStats) {
        self.substeps += u64::from(stats.substeps);
        self.searches += u64::from(stats.searches);
        self.clamps.velocity += u64::from(stats.clamped_velocity);
        self.clamps.strain += u64::from(stats.clamped_strain);
        self.clamps.volume += u64::from(stats.clamped_volume);
        self.clamps.unsolved += u64::from(stats.unsolved);
        self.clamps.rejected += u64::from(stats.rejected);
        self.clamps.gained += u64::from(stats.gained);
        self.clamps.quarantined += u64::from(stats.quarantined);
        self.clamps.left += u64::from(stats.left);
        self.clamps.sunk = self.clamps.sunk.max(u64::from(stats.sunk));
        self.unmended.extend(stats.unmended.then_some(frame));
        self.recycled += u64::from(stats.recycled);
        self.emitted += u64::from(stats.emitted);
        let (min, max) = stats.dt;
        if max > 0.0 {
            let so_far = self.dt.unwrap_or(Range { min, max });
            self.dt = Some(Range { min: so_far.min.min(min), max: so_far.max.max(max) });
        }
    }

    /// Adds the time since `begun` to a stage.
    pub fn took(&mut self, stage: &str, begun: Instant) {
        self.add_ms(stage, begun.elapsed().as_secs_f64() * 1e3);
    }

    /// Adds time to a stage [ms].
    pub fn add_ms(&mut self, stage: &str, ms: f64) {
        match self.stages.iter_mut().find(|s| s.name == stage) {
            Some(s) => s.wall_ms += ms,
            None => self.stages.push(StageTime { name: stage.into(), wall_ms: ms }),
        }
    }

    /// What a user should know of the clamps, in plain words.
    pub fn warn_of_clamps(&mut self) {
        let c = self.clamps;
        if !self.unmended.is_empty() {
            let frames = self.unmended.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
            self.warnings.push(format!(
                "frame {frames}: shorter steps did not mend what is counted below, and from there on energy, or what runs \
                 away, is no longer judged: look at it, or lower `simulation.courant`"
            ));
        }
        for (count, what) in [
            (
                c.left,
                "particles left the grid's domain and were taken out: `simulation.domain` says how far it reaches",
            ),
            (c.quarantined.saturating_sub(c.left), "particles were no longer finite and were taken out"),
            (
                c.sunk,
                "particles of liquids went through a surface: they were in an obstacle, deeper than half of their size, at the \
                 end of a frame",
            ),
            (c.velocity, "grid nodes or particles were slowed down to one cell or spacing a substep"),
            (c.strain, "particle updates were limited to a stretch of one half in a substep"),
            (c.volume, "particle updates were kept from compressing further, or left out neighbours beyond 64"),
            (c.unsolved, "solves of pressure or viscosity ended with more than the error they may have"),
            (c.gained, "attempts at a frame ended with more energy than can have come in"),
            (c.rejected, "attempts at a frame were taken back and repeated with shorter steps"),
        ] {
            if count > 0 {
                self.warnings.push(format!("{count} {what}"));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_that_were_not_mended_are_named_first() {
        let mut report = Report::default();
        let bad = FrameStats { substeps: 9, gained: 4, rejected: 3, unmended: true, ..Default::default() };
        report.count(6, &FrameStats::default());
        report.count(7, &bad);
        report.count(8, &FrameStats { quarantined: 5, left: 3, ..Default::default() });
        report.warn_of_clamps();
        assert_eq!(report.unmended, [7]);
        let starts = ["frame 7: shorter steps did not", "3 particles left", "2 particles were no longer finite"];
        assert!(report.warnings.iter().zip(starts).all(|(w, s)| w.starts_with(s)), "{:?}", report.warnings);
        assert_eq!(report.dt, None, "no step was kept");
    }
}
