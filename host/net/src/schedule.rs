//! Noise levels of the steps of a model. Knows nothing of networks.

use crate::error::NetError;
use crate::manifest::Grid;

/// A step, counted from the clean end: 0 is clean, `Schedule::steps` is noise. Not a noise level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StepIndex(pub usize);

/// A noise level in z = (1 - sigma) x0 + sigma eps, from 0 to 1. Not a step.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Sigma(f64);

impl Sigma {
    /// A noise level.
    ///
    /// # Errors
    /// Outside 0 to 1, and NaN.
    pub fn new(value: f64) -> Result<Self, NetError> {
        if (0.0..=1.0).contains(&value) {
            Ok(Self(value))
        } else {
            Err(NetError::usage(format!("a noise level lies between 0 and 1; {value} does not")))
        }
    }

    /// The number.
    pub fn value(self) -> f64 {
        self.0
    }

    /// This or the least allowed, whichever is noisier.
    pub(crate) fn at_least(self, least: f64) -> Self {
        Self(self.0.max(least.clamp(0.0, 1.0)))
    }
}

/// How noise levels follow from steps.
#[derive(Debug, Clone, PartialEq)]
pub enum ScheduleKind {
    /// sigma = s t / (1 + (s - 1) t), t = step / steps.
    Shift {
        /// s.
        shift: f64,
    },
    /// The same with ln s = min(ln most, base + slope (tokens - from) / span).
    ByTokens {
        /// ln s at `from` tokens.
        base: f64,
        /// Growth of ln s over `span` tokens.
        slope: f64,
        /// Tokens at which ln s is `base`.
        from: f64,
        /// Tokens over which ln s grows by `slope`.
        span: f64,
        /// Largest s.
        most: Option<f64>,
        /// Latents of a token in time, rows, columns.
        patch: [usize; 3],
    },
    /// Table of a variance-preserving model: scaled-linear betas, trailing spacing; sigma = b / (a + b).
    Vp {
        /// Entries of the table.
        train_steps: usize,
        /// First beta.
        beta_start: f64,
        /// Last beta.
        beta_end: f64,
        /// Divides the signal-to-noise ratio.
        snr_shift: f64,
        /// The last entry is pure noise.
        zero_terminal_snr: bool,
    },
}

/// Noise levels as a manifest gives them.
#[derive(Debug, Clone, PartialEq)]
pub struct ScheduleSpec {
    /// How they follow from steps.
    pub kind: ScheduleKind,
    /// Steps from noise to clean.
    pub steps: usize,
    /// The noise level of step 1, as LTX wants it (`stretch_shift_to_terminal` of diffusers): 1 - sigma is scaled
    /// for all steps but 0.
    pub terminal: Option<f64>,
}

/// The noise level of every step for one size of latents.
#[derive(Debug, Clone, PartialEq)]
pub struct Schedule {
    sigmas: Vec<f64>,
    table: Vec<f64>,
}

impl Schedule {
    /// The schedule for latents of this size.
    ///
    /// # Errors
    /// Without a step, and numbers that give no increasing noise levels from 0 to 1.
    pub fn new(spec: &ScheduleSpec, grid: Grid) -> Result<Self, NetError> {
        if spec.steps == 0 || spec.steps > 100_000 {
            return Err(NetError::usage(format!("a schedule has 1 to 100000 steps, not {}", spec.steps)));
        }
        let (mut sigmas, table) = match &spec.kind {
            ScheduleKind::Shift { shift } => (shifted(*shift, spec.steps), Vec::new()),
            ScheduleKind::ByTokens { base, slope, from, span, most, patch } => {
                let tokens = grid.tokens(*patch)? as f64;
                let log = base + slope * (tokens - from) / span;
                let log = most.map_or(log, |most| log.min(most.ln()));
                (shifted(log.exp(), spec.steps), Vec::new())
            }
            ScheduleKind::Vp { train_steps, .. } => {
                if spec.steps > *train_steps {
                    let text = format!("the model's table has {train_steps} entries, too few for {} steps", spec.steps);
                    return Err(NetError::usage(text));
                }
                let table = vp_table(&spec.kind);
                let entry = |i: usize| {
                    let k = (i as f64 * *train_steps as f64 / spec.steps as f64).round_ties_even() as usize;
                    table.get(k.saturating_sub(1)).copied().unwrap_or(1.0)
                };
                let sigmas = std::iter::once(0.0).chain((1..=spec.steps).map(entry)).collect();
                (sigmas, table)
            }
        };
        if let (Some(terminal), Some(&first)) = (spec.terminal, sigmas.get(1)) {
            let scale = (1.0 - terminal) / (1.0 - first);
            // One step alone is noise and stays so.
            if spec.steps > 1 {
                sigmas.iter_mut().skip(1).for_each(|s| *s = 1.0 - (1.0 - *s) * scale);
            }
        }
        let increasing = sigmas.windows(2).all(|pair| pair[0] < pair[1]);
        if !increasing || sigmas.iter().any(|s| !(0.0..=1.0).contains(s)) {
            let text = "the model's schedule gives no noise levels that increase from 0 to 1 for this size and steps";
            return Err(NetError::usage(text));
        }
        Ok(Self { sigmas, table })
    }

    /// The noise level of a step; that of the noisy end for any step past it.
    pub fn sigma(&self, step: StepIndex) -> Sigma {
        Sigma(self.sigmas.get(step.0).or(self.sigmas.last()).copied().unwrap_or(1.0))
    }

    /// Steps from noise to clean.
    pub fn steps(&self) -> usize {
        self.sigmas.len().saturating_sub(1)
    }

    /// Index of the table entry nearest to a noise level, the lower of two; 0 where there is no table.
    pub fn timestep(&self, sigma: Sigma) -> usize {
        nearest(&self.table, sigma)
    }
}

fn shifted(shift: f64, steps: usize) -> Vec<f64> {
    let sigma = |i: usize| {
        let t = i as f64 / steps as f64;
        shift * t / (1.0 + (shift - 1.0) * t)
    };
    // The ends are exact whatever the rounding of the quotient.
    (0..=steps).map(|i| if i == steps { 1.0 } else { sigma(i) }).collect()
}

/// Noise level of each entry of a variance-preserving table; empty for the other kinds.
pub(crate) fn vp_table(kind: &ScheduleKind) -> Vec<f64> {
    let ScheduleKind::Vp { train_steps, beta_start, beta_end, snr_shift, zero_terminal_snr } = kind else {
        return Vec::new();
    };
    let (first, last) = (beta_start.sqrt(), beta_end.sqrt());
    let step = (last - first) / (train_steps.saturating_sub(1).max(1)) as f64;
    let mut signal = 1.0;
    let mut a: Vec<f64> = (0..*train_steps)
        .map(|k| {
            signal *= 1.0 - (first + step * k as f64).powi(2);
            let shifted = signal / (snr_shift + (1.0 - snr_shift) * signal);
            shifted.sqrt()
        })
        .collect();
    if let (true, Some(&first), Some(&last)) = (zero_terminal_snr, a.first(), a.last()) {
        a.iter_mut().for_each(|a| *a = (*a - last) * first / (first - last));
    }
    a.into_iter()
        .map(|a| {
            let b = (1.0 - a * a).max(0.0).sqrt();
            b / (a + b)
        })
        .collect()
}

/// Index of the entry nearest to a noise level, the lower of two equally near.
pub(crate) fn nearest(table: &[f64], sigma: Sigma) -> usize {
    let mut best = (0, f64::INFINITY);
    for (k, entry) in table.iter().enumerate() {
        let distance = (entry - sigma.value()).abs();
        if distance < best.1 {
            best = (k, distance);
        }
    }
    best.0
}

#[cfg(test)]
#[path = "schedule_tests.rs"]
mod tests;
