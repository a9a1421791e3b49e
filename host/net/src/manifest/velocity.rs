//! The velocity network in a manifest: prediction, guidance, schedule. Reads no input by itself and runs nothing.

use super::inputs::{InputSpec, Part, Source, inputs};
use super::keys::{Item, Keys};
use super::parse::{float_tensor, path, role};
use super::{ChunkSpec, LatentSpec, RoleSpec, TensorSpec};
use crate::prediction::{Coefficients, Prediction};
use crate::schedule::{ScheduleKind, ScheduleSpec, Sigma};

/// Least noise of networks that predict the clean latent, unless the manifest says otherwise.
const LEAST_SIGMA_OF_X0: f64 = 1e-3;

/// A network that predicts from noisy latents.
#[derive(Debug, Clone, PartialEq)]
pub struct VelocitySpec {
    /// Its files.
    pub role: RoleSpec,
    /// What it predicts.
    pub prediction: Prediction,
    /// The network is given at least this noise level, and its answer is read as of that level.
    pub least_sigma: f64,
    /// How it follows its condition more than it was trained to.
    pub guidance: Guidance,
    /// File of default arrays for inputs with source `embedding`.
    pub embeddings: Option<String>,
    /// The same for the unconditional branch.
    pub negative: Option<String>,
    /// What it writes.
    pub output: TensorSpec,
    /// Its noise levels.
    pub schedule: ScheduleSpec,
    /// What it reads.
    pub inputs: Vec<InputSpec>,
}

/// How a network follows its condition more than it was trained to.
#[derive(Debug, Clone, PartialEq)]
pub enum Guidance {
    /// Not at all.
    None,
    /// By an input.
    Embedded {
        /// Its usual value.
        scale: f64,
    },
    /// By two evaluations: u + scale (c - u).
    Cfg {
        /// Its usual value.
        scale: f64,
        /// Parts that are zero in the unconditional branch: image, mask, first.
        drops: Vec<Part>,
    },
}

impl VelocitySpec {
    /// The noise level the network is given.
    pub fn effective(&self, sigma: Sigma) -> Sigma {
        sigma.at_least(self.least_sigma)
    }

    /// The coefficients of its prediction at one noise level, held at `least_sigma`.
    pub fn coefficients(&self, sigma: Sigma) -> Coefficients {
        self.prediction.coefficients(self.effective(sigma))
    }
}

pub(super) fn velocity(
    mut keys: Keys<'_>,
    latent: Option<&LatentSpec>,
    chunk: Option<&ChunkSpec>,
) -> Option<VelocitySpec> {
    let role = role(&mut keys);
    let choices = [
        ("eps_minus_x0", Prediction::EpsMinusX0),
        ("x0_minus_eps", Prediction::X0MinusEps),
        ("x0", Prediction::X0),
        ("vp_v", Prediction::VpV),
    ];
    let prediction = keys.need("prediction").and_then(|i| i.choice(&choices));
    let usual = if prediction == Some(Prediction::X0) { LEAST_SIGMA_OF_X0 } else { 0.0 };
    let least_sigma = keys.get("least_sigma").map_or(Some(usual), |i| {
        if prediction == Some(Prediction::X0) {
            i.number_that("greater than 0 and below 1, since x0 has no velocity at 0", |v| v > 0.0 && v < 1.0)
        } else {
            i.number_that("at least 0 and below 1", |v| (0.0..1.0).contains(&v))
        }
    });
    let guidance = keys.get("guidance").map_or(Some(Guidance::None), |i| i.table().and_then(guidance));
    let embeddings = keys.get("embeddings").map(|i| path(&i));
    let negative_item = keys.get("negative");
    let negative = negative_item.as_ref().map(path);
    if let (Some(item), Some(Guidance::None | Guidance::Embedded { .. })) = (&negative_item, &guidance) {
        item.problem("only guidance of kind \"cfg\" has a negative");
    }
    let output = keys.need("output").and_then(float_tensor);
    let schedule = keys.need("schedule").and_then(|i| i.table()).and_then(schedule);
    let item = keys.need("inputs");
    let inputs = item.as_ref().and_then(|i| inputs(i, latent, chunk));
    if let (Some(item), Some(inputs), Some(guidance), Some(schedule)) = (&item, &inputs, &guidance, &schedule) {
        agree(item, inputs, guidance, schedule);
    }
    Some(VelocitySpec {
        role: role?,
        prediction: prediction?,
        least_sigma: least_sigma?,
        guidance: guidance?,
        embeddings: embeddings.map_or(Some(None), |p| p.map(Some))?,
        negative: negative.map_or(Some(None), |p| p.map(Some))?,
        output: output?,
        schedule: schedule?,
        inputs: inputs?,
    })
}

/// What inputs, guidance and schedule must agree on.
fn agree(item: &Item<'_>, inputs: &[InputSpec], guidance: &Guidance, schedule: &ScheduleSpec) {
    let takes_guidance = inputs.iter().any(|i| matches!(i.source, Source::Guidance { .. }));
    match (matches!(guidance, Guidance::Embedded { .. }), takes_guidance) {
        (true, false) => item.problem("guidance of kind \"embedded\" needs an input with source \"guidance\""),
        (false, true) => item.problem("an input with source \"guidance\" needs guidance of kind \"embedded\""),
        _ => {}
    }
    let takes_timestep = inputs.iter().any(|i| matches!(i.source, Source::Timestep { .. }));
    if takes_timestep && !matches!(schedule.kind, ScheduleKind::Vp { .. }) {
        item.problem("an input with source \"timestep\" needs a `vp` schedule, whose table it counts in");
    }
}

fn guidance(mut keys: Keys<'_>) -> Option<Guidance> {
    let kind = keys.need("kind").and_then(|i| i.choice(&[("none", 0), ("embedded", 1), ("cfg", 2)]));
    if kind == Some(0) {
        return Some(Guidance::None);
    }
    let scale = keys.need("scale").and_then(|i| i.number_that("at least 0", |v| v >= 0.0));
    let drops = match kind {
        Some(2) => keys.get("drops").map_or(Some(Vec::new()), |i| {
            let choices = [("image", Part::Image), ("mask", Part::Mask), ("first", Part::First)];
            i.list()?.iter().map(|i| i.choice(&choices)).collect()
        }),
        _ => Some(Vec::new()),
    };
    match kind? {
        1 => Some(Guidance::Embedded { scale: scale? }),
        _ => Some(Guidance::Cfg { scale: scale?, drops: drops? }),
    }
}

fn schedule(mut keys: Keys<'_>) -> Option<ScheduleSpec> {
    let kinds = [keys.get("shift"), keys.get("by_tokens"), keys.get("vp")];
    let steps = keys.need("steps").and_then(|i| i.size(1..=100_000));
    let terminal = keys.get("terminal").map(|i| i.number_that("between 0 and 1", |v| v > 0.0 && v < 1.0));
    if kinds.iter().flatten().count() != 1 {
        keys.problem("a schedule is exactly one of `shift`, `by_tokens` and `vp`");
    }
    let [shift, by_tokens, vp] = kinds;
    let kind = match (shift, by_tokens, vp) {
        (Some(item), None, None) => item.table().and_then(|mut keys| {
            let shift = keys.need("shift").and_then(|i| i.number_that("greater than 0", |v| v > 0.0));
            Some(ScheduleKind::Shift { shift: shift? })
        }),
        (None, Some(item), None) => item.table().and_then(by_token_count),
        (None, None, Some(item)) => item.table().and_then(vp_schedule),
        _ => None,
    };
    Some(ScheduleSpec { kind: kind?, steps: steps?, terminal: terminal.map_or(Some(None), |t| t.map(Some))? })
}

fn by_token_count(mut keys: Keys<'_>) -> Option<ScheduleKind> {
    let base = keys.need("base").and_then(|i| i.number());
    let slope = keys.need("slope").and_then(|i| i.number());
    let from = keys.need("from").and_then(|i| i.number());
    let span = keys.need("span").and_then(|i| i.number_that("greater than 0", |v| v > 0.0));
    let most = keys.get("most").map(|i| i.number_that("greater than 0", |v| v > 0.0));
    let patch = patch(&mut keys);
    Some(ScheduleKind::ByTokens {
        base: base?,
        slope: slope?,
        from: from?,
        span: span?,
        most: most.map_or(Some(None), |m| m.map(Some))?,
        patch: patch?,
    })
}

/// Latents of a token in time, rows, columns.
pub(super) fn patch(keys: &mut Keys<'_>) -> Option<[usize; 3]> {
    keys.get("patch").map_or(Some([1; 3]), |i| i.exactly(i.sizes(1..=64)))
}

fn vp_schedule(mut keys: Keys<'_>) -> Option<ScheduleKind> {
    let open = |v: f64| v > 0.0 && v < 1.0;
    let train_steps = keys.need("train_steps").and_then(|i| i.size(2..=100_000));
    let beta_start = keys.need("beta_start").and_then(|i| i.number_that("between 0 and 1", open));
    let beta_end = keys.need("beta_end").and_then(|i| i.number_that("between 0 and 1", open));
    let snr_shift = keys.get("snr_shift").map_or(Some(1.0), |i| i.number_that("greater than 0", |v| v > 0.0));
    let zero_terminal_snr = keys.get("zero_terminal_snr").map_or(Some(false), |i| i.flag());
    Some(ScheduleKind::Vp {
        train_steps: train_steps?,
        beta_start: beta_start?,
        beta_end: beta_end?,
        snr_shift: snr_shift?,
        zero_terminal_snr: zero_terminal_snr?,
    })
}
