//! A model of `physvideo-net` as the velocity of Algorithm 1. Knows neither chunks nor files.

use std::sync::atomic::AtomicBool;

use physvideo_net::{Branch, Coefficients, Model, NetError, Sigma, VelocityInputs, VelocitySpec};

use super::velocity::Velocity;

/// A model with the conditions of one chunk.
pub struct Network<'a> {
    model: &'a mut Model,
    inputs: VelocityInputs,
    spec: VelocitySpec,
    cancel: &'a AtomicBool,
    tail: Vec<f32>,
}

impl<'a> Network<'a> {
    /// Takes a model and the inputs it was conditioned with.
    pub fn new(model: &'a mut Model, spec: VelocitySpec, inputs: VelocityInputs, cancel: &'a AtomicBool) -> Self {
        // In place where the network reads its tensor as the device holds it; else the inputs are packed at each call.
        let tail = inputs.direct().map(|direct| direct.tail.to_vec()).unwrap_or_default();
        Self { model, inputs, spec, cancel, tail }
    }
}

impl Velocity for Network<'_> {
    fn tail(&self) -> &[f32] {
        &self.tail
    }

    fn plain(&self) -> bool {
        self.spec.prediction.is_plain()
    }

    fn coefficients(&self, sigma: Sigma) -> Coefficients {
        self.spec.coefficients(sigma)
    }

    fn evaluate(&mut self, tensor: &[f32], sigma: Sigma, branch: Branch, out: &mut Vec<f32>) -> Result<(), NetError> {
        self.model.evaluate(&self.inputs, tensor, sigma, branch, out, self.cancel)
    }
}
