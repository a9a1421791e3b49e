//! A small problem with a known velocity: Gaussian data whose mean depends on the element, coupled to a neighbour so that
//! a wrong order of elements shows.

use physvideo::flow::SdeRule;
use physvideo::scene::{Act, Sde, Solver, Start};
use physvideo_app::flow::{FlowError, Guide, Outcome, Phase, State, Task, Velocity, Watch, phi_cf};
use physvideo_gpu::Gpu;
use physvideo_net::{
    Branch, Coefficients, Grid, NetError, Prediction, Schedule, ScheduleKind, ScheduleSpec, Sigma, StepIndex,
};
use physvideo_tests::random::Random;

/// A run of Algorithm 1.
#[derive(Clone, Debug)]
pub struct Case {
    pub act: Act,
    pub solver: Solver,
    pub start: Start,
    pub sde: Sde,
    pub beta: Option<f64>,
    pub gamma: f64,
    pub iterations: u32,
    pub tau: usize,
    pub seed: u64,
    pub guidance: Option<f64>,
    pub inversion_guidance: Option<f64>,
    pub prediction: Prediction,
    pub held: bool,
    /// Weights between 0 and 1.
    pub soft: bool,
    pub channels: usize,
    pub frames: usize,
    pub height: usize,
    pub width: usize,
}

impl Default for Case {
    fn default() -> Self {
        Self {
            act: Act::Animate,
            solver: Solver::Euler,
            start: Start::Inversion,
            sde: Sde::EulerMaruyama,
            beta: None,
            gamma: 0.2,
            iterations: 10,
            tau: 20,
            seed: 7,
            guidance: None,
            inversion_guidance: None,
            prediction: Prediction::EpsMinusX0,
            held: false,
            soft: false,
            channels: 4,
            frames: 3,
            // Cells are no multiple of 4: lanes of four elements straddle channels.
            height: 3,
            width: 5,
        }
    }
}

pub const STEPS: usize = 25;
const SHIFT: f64 = 7.0;
/// Variance of the data.
const S2: f64 = 0.6;

impl Case {
    pub fn cells(&self) -> usize {
        self.frames * self.height * self.width
    }

    pub fn elements(&self) -> usize {
        self.channels * self.cells()
    }

    /// Written from the formula, not from the crate.
    pub fn sigma(&self, i: usize) -> f64 {
        let t = i as f64 / STEPS as f64;
        SHIFT * t / (1.0 + (SHIFT - 1.0) * t)
    }

    pub fn guide(&self) -> Guide {
        let mut random = Random::new(99);
        let mut numbers = |n: usize| -> Vec<f32> { (0..n).map(|_| random.range(-1.5, 1.5)).collect() };
        let (encoded, background) = (numbers(self.elements()), numbers(self.elements()));
        let weight = |x: &f32| {
            if self.soft { (2.0 * x).floor().clamp(-2.0, 2.0) / 4.0 + 0.5 } else { f32::from(u8::from(*x > 0.0)) }
        };
        let mask = numbers(self.cells()).iter().map(weight).collect();
        let first = self.height * self.width;
        let held = self.held.then(|| (0..self.cells()).map(|i| f32::from(u8::from(i < first))).collect());
        Guide { encoded, background, mask, held }
    }

    /// The velocity towards the data at element `i`: exact for a Gaussian of mean `mean(i)`, with a share of the
    /// neighbour's.
    pub fn velocity(&self, z: &dyn Fn(usize) -> f64, i: usize, sigma: f64, branch: Branch) -> f64 {
        let n = self.elements();
        let one = |i: usize| {
            let shift = if branch == Branch::Conditional { 0.5 } else { -0.2 };
            let mean = shift * ((i % 7) as f64 - 3.0) / 3.0;
            let s = (1.0 - sigma).powi(2) * S2 + sigma * sigma;
            mean + ((1.0 - sigma) * S2 - sigma) * (z(i) - (1.0 - sigma) * mean) / s
        };
        0.9 * one(i) + 0.1 * one((i + 1) % n)
    }
}

/// The case's velocity as predictions of a network.
pub struct Field<'a> {
    pub case: &'a Case,
    /// Noise levels it was asked for, in order.
    pub asked: Vec<f64>,
    /// What happens at an evaluation, by its number.
    pub at: Option<(usize, Trouble)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trouble {
    Nan,
    Interrupted,
}

impl<'a> Field<'a> {
    pub fn new(case: &'a Case) -> Self {
        Self { case, asked: Vec::new(), at: None }
    }
}

impl Velocity for Field<'_> {
    fn tail(&self) -> &[f32] {
        &[0.25, -0.5, 0.75]
    }
    fn plain(&self) -> bool {
        self.case.prediction.is_plain()
    }
    fn coefficients(&self, sigma: Sigma) -> Coefficients {
        self.case.prediction.coefficients(sigma)
    }
    fn evaluate(&mut self, tensor: &[f32], sigma: Sigma, branch: Branch, out: &mut Vec<f32>) -> Result<(), NetError> {
        let n = self.case.elements();
        assert_eq!(tensor[n..n + 3], [0.25, -0.5, 0.75], "what follows the latent was touched");
        if branch == Branch::Conditional {
            self.asked.push(sigma.value());
        }
        let c = self.coefficients(sigma);
        let z = |i: usize| f64::from(tensor[i]);
        let v = |i| self.case.velocity(&z, i, sigma.value(), branch);
        *out = (0..n).map(|i| ((v(i) - c.latent * z(i)) / c.prediction) as f32).collect();
        match self.at {
            Some((number, Trouble::Nan)) if number == self.asked.len() => out[n / 2] = f32::NAN,
            Some((number, Trouble::Interrupted)) if number == self.asked.len() => return Err(NetError::Interrupted),
            _ => {}
        }
        Ok(())
    }
}

/// Keeps what a watcher is given.
#[derive(Default)]
pub struct Kept {
    pub stopped: Option<State>,
    /// Steps after which the run is ended.
    pub until: Option<usize>,
    pub steps: Vec<(Phase, u32)>,
}

impl Watch for Kept {
    fn finished(&mut self, phase: Phase, done: u32, _: &dyn Fn() -> Result<State, FlowError>) -> Result<(), FlowError> {
        self.steps.push((phase, done));
        match self.until {
            Some(until) if until == self.steps.len() => Err(FlowError::Interrupted { at: "a test".into(), kept: true }),
            _ => Ok(()),
        }
    }
    fn stopped(&mut self, state: State) {
        self.stopped = Some(state);
    }
}

pub fn schedule() -> Schedule {
    let spec = ScheduleSpec { kind: ScheduleKind::Shift { shift: SHIFT }, steps: STEPS, terminal: None };
    Schedule::new(&spec, Grid { frames: 3, height: 3, width: 5 }).unwrap()
}

pub fn run_from(
    gpu: &Gpu,
    case: &Case,
    field: &mut Field,
    from: Option<&State>,
    kept: &mut Kept,
) -> Result<Outcome, FlowError> {
    let schedule = schedule();
    let tau = StepIndex(case.tau);
    let task = Task {
        act: case.act,
        schedule: &schedule,
        tau,
        rule: SdeRule::new(case.sde, case.gamma, schedule.sigma(tau).value(), case.beta, case.soft)?,
        iterations: case.iterations,
        solver: case.solver,
        start: case.start,
        guidance: case.guidance,
        inversion_guidance: case.inversion_guidance,
        seed: case.seed,
        stream: 3,
    };
    phi_cf(gpu, field, &task, &case.guide(), from, kept)
}

pub fn run(gpu: &Gpu, case: &Case, field: &mut Field) -> Result<Outcome, FlowError> {
    run_from(gpu, case, field, None, &mut Kept::default())
}
