//! Algorithm 1 of the paper for one chunk, in its order and with its line numbers. Knows neither files nor frames.

use std::fmt;
use std::time::Instant;

use physvideo::flow::{FlowStep, SdeRule, ab2, euler, heun_corrector, stable_gamma};
use physvideo::scene::{Act, Solver, Start};
use physvideo::stages::latent::{LatentSetup, LatentSpace, LatentStats, NoiseKey, Reading};
use physvideo_gpu::Gpu;
use physvideo_net::{Branch, Kind, Schedule, Sigma, StepIndex};

use super::velocity::{FlowError, Velocity};

/// What is done to a chunk.
#[derive(Clone, Debug)]
pub struct Task<'a> {
    /// Which of the paper's stages.
    pub act: Act,
    /// Noise levels by step.
    pub schedule: &'a Schedule,
    /// Step at which the SDE runs.
    pub tau: StepIndex,
    /// The SDE's integrator.
    pub rule: SdeRule,
    /// Iterations N.
    pub iterations: u32,
    /// F and F⁻¹.
    pub solver: Solver,
    /// Inversion, or noise on the encoded latent.
    pub start: Start,
    /// Guidance scale of SDE and generation with two predictions; absent: one prediction.
    pub guidance: Option<f64>,
    /// The same for the inversion.
    pub inversion_guidance: Option<f64>,
    /// Seed of the scene.
    pub seed: u64,
    /// Number of the chunk's noise streams.
    pub stream: u32,
}

/// Latents that guide a chunk, each [C, T, h, w]; masks [T, h, w].
#[derive(Clone, Debug)]
pub struct Guide {
    /// The encoded driving video, z.
    pub encoded: Vec<f32>,
    /// The encoded background, z^bg; used by the act animate.
    pub background: Vec<f32>,
    /// M: 1 where the driving video is known (reconstruct) or moves (animate).
    pub mask: Vec<f32>,
    /// Cells that nothing changes (a clean first latent that the model is given): 1 there.
    pub held: Option<Vec<f32>>,
}

/// A phase of the algorithm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Lines 3–5.
    Inversion,
    /// Lines 9–13.
    Sde,
    /// Lines 14–16.
    Generation,
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Phase::Inversion => "the inversion",
            Phase::Sde => "the SDE",
            Phase::Generation => "the generation",
        })
    }
}

/// Where a chunk stands after a finished step.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// The phase.
    pub phase: Phase,
    /// Finished steps of it.
    pub done: u32,
    /// The latent.
    pub latent: Vec<f32>,
    /// Velocities of the step before (AB2).
    pub history: Option<Vec<f32>>,
    /// What was counted and measured until then; its latent is empty.
    pub so_far: Outcome,
}

/// Called after every finished step; an error ends the chunk.
pub trait Watch {
    /// A step was finished. `state` reads the latent from the device.
    ///
    /// # Errors
    /// Whatever should end the run.
    fn finished(
        &mut self,
        phase: Phase,
        done: u32,
        state: &dyn Fn() -> Result<State, FlowError>,
    ) -> Result<(), FlowError>;
    /// The chunk ends early; `state` is that of the last finished step.
    fn stopped(&mut self, state: State);
}

/// What came of a chunk.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// z*, [C, T, h, w].
    pub latent: Vec<f32>,
    /// Evaluations of v_θ in inversion, SDE and generation.
    pub nfe: [u32; 3],
    /// Calls of the network: two for an evaluation with guidance by two predictions.
    pub calls: u32,
    /// The latent after each iteration of the SDE (the paper's norm curve), that before the first in front.
    pub stats: Vec<LatentStats>,
    /// Wall time inside the network [s].
    pub network_s: f64,
    /// Time of the latent's arithmetic by the device's own clock [s].
    pub arithmetic_s: f64,
    /// Wall time of that arithmetic with handing it over and waiting for it [s].
    pub latent_s: f64,
}

/// Runs Algorithm 1 (lines 2–17) on a chunk, from `from` on when given.
///
/// # Errors
/// [`FlowError`]; the state of the last finished step was given to `watch` then.
pub fn phi_cf(
    gpu: &Gpu,
    velocity: &mut dyn Velocity,
    task: &Task,
    guide: &Guide,
    from: Option<&State>,
    watch: &mut dyn Watch,
) -> Result<Outcome, FlowError> {
    let mut run = Run::new(gpu, velocity, task, guide)?;
    let mut at = (Phase::Inversion, 0);
    if let Some(state) = from {
        run.space.set(&state.latent)?;
        if let Some(history) = &state.history {
            run.space.set_history(history)?;
        }
        (at, run.moved) = ((state.phase, state.done), state.history.is_some());
        run.outcome = state.so_far.clone();
    } else {
        // Line 2.
        run.space.set(&guide.encoded)?;
    }
    run.at = at;
    let ended = run.play(guide, watch);
    // A latent that is no longer finite is nothing to go on from.
    let lost = matches!(ended, Err(FlowError::Diverged { .. }));
    if ended.is_err()
        && !lost
        && let Ok(state) = run.state()
    {
        watch.stopped(state);
    }
    ended
}

struct Run<'a, 'gpu> {
    velocity: &'a mut dyn Velocity,
    task: &'a Task<'a>,
    space: LatentSpace<'gpu>,
    /// Phase and finished steps of it.
    at: (Phase, u32),
    /// Whether the step before left its velocities.
    moved: bool,
    outcome: Outcome,
    predictions: [Vec<f32>; 2],
}

impl<'a, 'gpu> Run<'a, 'gpu> {
    fn new(gpu: &'gpu Gpu, velocity: &'a mut dyn Velocity, task: &'a Task, guide: &Guide) -> Result<Self, FlowError> {
        let guided = task.guidance.is_some() || task.inversion_guidance.is_some();
        let free: Option<Vec<f32>> = guide.held.as_ref().map(|held| held.iter().map(|h| 1.0 - h).collect());
        let setup = LatentSetup {
            elements: guide.encoded.len() as u64,
            cells: guide.mask.len() as u64,
            tail: velocity.tail(),
            guided,
            apart: !velocity.plain(),
            history: task.solver != Solver::Euler,
            anchor: task.rule.anchored().then_some(&guide.encoded),
            free: free.as_deref(),
        };
        let space = LatentSpace::new(gpu, &setup)?;
        Ok(Self {
            velocity,
            task,
            space,
            at: (Phase::Inversion, 0),
            moved: false,
            outcome: Outcome::default(),
            predictions: Default::default(),
        })
    }

    fn state(&self) -> Result<State, FlowError> {
        let history = if self.moved { self.space.history()? } else { None };
        let mut so_far = self.outcome.clone();
        so_far.arithmetic_s += self.space.device_ms() * 1e-3;
        Ok(State { phase: self.at.0, done: self.at.1, latent: self.space.get()?, history, so_far })
    }

    fn play(&mut self, guide: &Guide, watch: &mut dyn Watch) -> Result<Outcome, FlowError> {
        let Task { act, schedule, tau, iterations, start, rule, .. } = *self.task;
        let sigma = |i: u32| schedule.sigma(StepIndex(i as usize));
        let top = tau.0 as u32;
        let inverts = start == Start::Inversion;
        if self.at.0 == Phase::Inversion {
            // Lines 3–5; without inversion there is nothing to go through.
            for t in self.at.1..if inverts { top } else { 0 } {
                self.flow(sigma(t), sigma(t + 1), t.checked_sub(1).map(sigma), self.task.inversion_guidance)?;
                self.finished(Phase::Inversion, t + 1, watch)?;
            }
            // Lines 6–8.
            self.begin_at_tau(guide, sigma(top), inverts)?;
            self.enter(Phase::Sde);
        }
        if self.at.0 == Phase::Sde {
            self.space.update_where(&updated(act, guide))?;
            let noise = self.noise(1);
            if self.outcome.stats.is_empty() {
                self.outcome.stats.push(self.space.stats()?);
            }
            for n in self.at.1..iterations {
                // Lines 10–12.
                let reading = self.predict(sigma(top), self.task.guidance)?;
                let since = Instant::now();
                let stats = self.space.sde_step(rule.step(n), n, reading, noise)?;
                self.outcome.latent_s += since.elapsed().as_secs_f64();
                if stats.faults > 0 || !stats.rms.is_finite() {
                    let limit = stable_gamma(rule.tau);
                    let (sigma, gamma) = (rule.tau, rule.gamma);
                    return Err(FlowError::Diverged { iteration: n + 1, sigma, gamma, limit });
                }
                self.outcome.stats.push(stats);
                self.finished(Phase::Sde, n + 1, watch)?;
            }
            self.enter(Phase::Generation);
        }
        // Lines 14–16, from τ down to the clean end.
        for done in self.at.1..top {
            let t = top - done;
            let before = (done > 0).then(|| sigma(t + 1));
            self.flow(sigma(t), sigma(t - 1), before, self.task.guidance)?;
            self.finished(Phase::Generation, done + 1, watch)?;
        }
        self.outcome.latent = self.space.get()?;
        self.outcome.arithmetic_s += self.space.device_ms() * 1e-3;
        Ok(std::mem::take(&mut self.outcome))
    }

    /// Lines 6–8. Inside the mask the inverted latent, elsewhere noise over line 7's base; without inversion noise over
    /// the encoded video everywhere (supplement B).
    fn begin_at_tau(&mut self, guide: &Guide, sigma: Sigma, inverts: bool) -> Result<(), FlowError> {
        let since = Instant::now();
        let held = |i: usize| guide.held.as_ref().map_or(0.0, |h| h[i]);
        let (base, mask) = match (inverts, self.task.act) {
            (false, _) => (&guide.encoded, guide.held.clone()),
            (true, act) => {
                // A mixture of two independent noises would be too narrow: a cell takes one side, the larger.
                let kept = guide.mask.iter().enumerate().map(|(i, m)| m.round().max(held(i))).collect();
                // Line 7: the act animate starts from the background, so that motion does not spread.
                (if act == Act::Animate { &guide.background } else { &guide.encoded }, Some(kept))
            }
        };
        self.space.mix(base, mask.as_deref(), sigma.value(), self.noise(0))?;
        self.outcome.latent_s += since.elapsed().as_secs_f64();
        Ok(())
    }

    fn noise(&self, which: u32) -> NoiseKey {
        NoiseKey { seed: self.task.seed, stream: 2 * self.task.stream + which }
    }

    fn enter(&mut self, phase: Phase) {
        (self.at, self.moved) = ((phase, 0), false);
    }

    fn finished(&mut self, phase: Phase, done: u32, watch: &mut dyn Watch) -> Result<(), FlowError> {
        self.at = (phase, done);
        watch.finished(phase, done, &|| self.state())
    }

    /// One step of F or F⁻¹; `before` is the noise level of the step before, when this phase has one.
    fn flow(&mut self, from: Sigma, to: Sigma, before: Option<Sigma>, guidance: Option<f64>) -> Result<(), FlowError> {
        let (start, end) = (from.value(), to.value());
        let reading = self.predict(from, guidance)?;
        match self.task.solver {
            Solver::Euler => self.apply(euler(start, end), reading, false),
            Solver::Ab2 => {
                let with = before.filter(|_| self.moved).map_or(euler(start, end), |b| ab2(b.value(), start, end));
                self.apply(with, reading, true)?;
                self.moved = true;
                Ok(())
            }
            Solver::Heun => {
                // Should the second evaluation fail, the step was not finished.
                let untouched = self.space.get()?;
                self.apply(euler(start, end), reading, true)?;
                match self.predict(to, guidance) {
                    Ok(reading) => self.apply(heun_corrector(start, end), reading, false),
                    Err(e) => {
                        self.space.set(&untouched)?;
                        Err(e)
                    }
                }
            }
        }
    }

    fn apply(&mut self, step: FlowStep, reading: Reading, remember: bool) -> Result<(), FlowError> {
        let since = Instant::now();
        self.space.flow_step(step, reading, remember)?;
        self.outcome.latent_s += since.elapsed().as_secs_f64();
        Ok(())
    }

    /// Evaluates v_θ where the latent is now and hands the predictions to the device.
    fn predict(&mut self, sigma: Sigma, guidance: Option<f64>) -> Result<Reading, FlowError> {
        let since = Instant::now();
        let Self { velocity, predictions, space, .. } = self;
        let evaluated = space.view(|tensor| {
            velocity.evaluate(tensor, sigma, Branch::Conditional, &mut predictions[0])?;
            if guidance.is_some() {
                velocity.evaluate(tensor, sigma, Branch::Unconditional, &mut predictions[1])?;
            }
            Ok(())
        })?;
        self.outcome.network_s += since.elapsed().as_secs_f64();
        match evaluated {
            Some(Err(e)) if physvideo_net::NetError::kind(&e) == Kind::Interrupted => {
                return Err(FlowError::Interrupted { at: self.place(), kept: true });
            }
            Some(result) => result.map_err(FlowError::Net)?,
            None => return Err(FlowError::Input("the latent is empty".into())),
        }
        let since = Instant::now();
        let branches = 1 + usize::from(guidance.is_some());
        for prediction in &self.predictions[..branches] {
            // A sum is finite unless a term is not, or the terms are beyond any prediction.
            let bad = |x: &f32| !x.is_finite();
            if let Some(first) = prediction.iter().position(bad) {
                let count = prediction.iter().filter(|x| bad(x)).count();
                let at = self.place();
                return Err(FlowError::NotFinite { count, first, at, sigma: sigma.value() });
            }
        }
        self.space.predict(&self.predictions[0], guidance.map(|_| &self.predictions[1][..]))?;
        self.outcome.latent_s += since.elapsed().as_secs_f64();
        self.outcome.calls += branches as u32;
        self.outcome.nfe[match self.at.0 {
            Phase::Inversion => 0,
            Phase::Sde => 1,
            Phase::Generation => 2,
        }] += 1;
        let c = self.velocity.coefficients(sigma);
        Ok(Reading { scale: c.prediction, latent: c.latent, guidance })
    }

    fn place(&self) -> String {
        format!("step {} of {}", self.at.1 + 1, self.at.0)
    }
}

/// Line 12: where, and how much, the SDE updates.
pub(super) fn updated(act: Act, guide: &Guide) -> Vec<f32> {
    let held = |i: usize| guide.held.as_ref().is_some_and(|h| h[i] != 0.0);
    let weight = |(i, m): (usize, &f32)| match act {
        _ if held(i) => 0.0,
        Act::Reconstruct => 1.0 - m,
        Act::Animate => *m,
    };
    guide.mask.iter().enumerate().map(weight).collect()
}
