//! A driving video chunk by chunk through Algorithm 1. Knows models and latents, neither files nor scenes.

use std::time::Instant;

use physvideo::flow::SdeRule;
use physvideo::scene::{Act, Continuation, Noise, Pool, Solver, Start};
use physvideo::stages::latent::LatentStats;
use physvideo::stages::latent_mask::{Pooling, pool};
use physvideo_gpu::Gpu;
use physvideo_net::{
    Conditioning, Direction, Embeddings, FirstLatent, Grid, Model, Schedule, StepIndex, Tensor, VelocitySpec,
};
use serde::Serialize;

use super::algorithm::{Guide, Outcome, State, Task, Watch, phi_cf};
use super::network::Network;
use super::pixels::{Driving, from_tensor, to_tensor};
use super::velocity::FlowError;
use crate::interrupt::Interrupt;

/// How a clip is made, with everything decided.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Which of the paper's stages.
    pub act: Act,
    /// Steps of the schedule; absent: the model's own.
    pub steps: Option<usize>,
    /// Step at which the SDE runs.
    pub tau: StepIndex,
    /// Iterations N.
    pub iterations: u32,
    /// Step size γ.
    pub gamma: f64,
    /// β; absent: the paper's.
    pub beta: Option<f64>,
    /// The SDE's integrator.
    pub sde: physvideo::scene::Sde,
    /// F and F⁻¹.
    pub solver: Solver,
    /// Inversion or noise.
    pub start: Start,
    /// How masks become cells.
    pub pool: Pool,
    /// Cells by which they grow or shrink.
    pub reach: u32,
    /// Guidance; absent: the model's own.
    pub guidance: Option<f64>,
    /// Guidance of the inversion.
    pub inversion_guidance: f64,
    /// Arrays of the prompt, and of what guidance leads away from.
    pub embeddings: [Option<Embeddings>; 2],
    /// What conditions later chunks.
    pub continuation: Continuation,
    /// Noise of the chunks.
    pub noise: Noise,
    /// Seed of the scene.
    pub seed: u64,
}

/// What was done to a chunk.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ChunkReport {
    /// First and last frame.
    pub frames: [usize; 2],
    /// Evaluations of v_θ: inversion, SDE, generation.
    pub nfe: [u32; 3],
    /// Wall time of the chunk, encoding and decoding included [s].
    pub wall_s: f64,
    /// Wall time inside the velocity network [s].
    pub network_s: f64,
    /// Wall time of the latent's arithmetic on the device [s].
    pub arithmetic_s: f64,
    /// Root mean square of the latent before the SDE and after each of its iterations (the paper's norm / √elements).
    pub rms: Vec<f64>,
    /// Share of cells that the SDE updated.
    pub updated: f64,
}

/// What was done to a clip.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ClipReport {
    /// Noise level σ of the SDE.
    pub sigma: f64,
    /// β used.
    pub beta: f64,
    /// The chunks, in order of running.
    pub chunks: Vec<ChunkReport>,
}

/// Told of what a clip does.
pub trait ClipWatch: Watch {
    /// Chunk `index` of `count` begins.
    fn chunk(&mut self, index: usize, count: usize);
    /// Its latent is finished.
    fn latent(&mut self, latent: &Tensor);
}

/// A clip in the making.
pub struct Clip<'a> {
    gpu: &'a Gpu,
    model: &'a mut Model,
    driving: &'a Driving,
    settings: &'a Settings,
    interrupt: &'a Interrupt,
    report: ClipReport,
    still: Option<(usize, Tensor)>,
}

/// A stretch of frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stretch {
    first: usize,
    /// Frames of the clip in it.
    frames: usize,
    /// Frames given to the network: the last one is repeated.
    padded: usize,
}

impl<'a> Clip<'a> {
    /// A clip of a driving video at the model's size.
    pub fn new(
        gpu: &'a Gpu,
        model: &'a mut Model,
        driving: &'a Driving,
        settings: &'a Settings,
        interrupt: &'a Interrupt,
    ) -> Self {
        Self { gpu, model, driving, settings, interrupt, report: ClipReport::default(), still: None }
    }

    /// Makes the frames; `finished` latents and `state` are those of a checkpoint.
    ///
    /// # Errors
    /// [`FlowError`]; `watch` was given what is needed to go on.
    pub fn make(
        mut self,
        finished: &[Tensor],
        state: Option<State>,
        watch: &mut dyn ClipWatch,
    ) -> Result<(Vec<Vec<u8>>, ClipReport), FlowError> {
        let chunks = self.stretches();
        let frames = if self.model.manifest().chunk.history > 0 {
            self.linked(&chunks, finished, state, watch)?
        } else {
            self.continued(&chunks, finished, state, watch)?
        };
        Ok((frames, self.report))
    }

    /// Chunks share one frame with the next.
    fn stretches(&self) -> Vec<Stretch> {
        let chunk = &self.model.manifest().chunk;
        let temporal = self.model.manifest().latent.temporal;
        stretches(self.driving.frames.len(), chunk.frames, temporal, chunk.fixed || chunk.history > 0)
    }

    /// Each chunk is conditioned on an image alone.
    fn continued(
        &mut self,
        chunks: &[Stretch],
        finished: &[Tensor],
        mut state: Option<State>,
        watch: &mut dyn ClipWatch,
    ) -> Result<Vec<Vec<u8>>, FlowError> {
        let mut out: Vec<Vec<u8>> = Vec::new();
        for (k, at) in chunks.iter().enumerate() {
            let since = Instant::now();
            watch.chunk(k, chunks.len());
            let image = match (self.settings.continuation, out.last()) {
                (Continuation::LastFrame, Some(last)) => last.clone(),
                _ => self.driving.image.clone(),
            };
            let clean = self.encode(&[&image])?;
            let latent = match finished.get(k) {
                Some(latent) => latent.clone(),
                None => {
                    let encoded = self.encode(&self.frames(*at))?;
                    let still = self.background(at.padded)?;
                    let mask = self.mask(*at)?;
                    let link = Link { history: None, padding: 0, stream: k, image: &image };
                    let latent = self.run(*at, encoded, still, mask, &clean, link, state.take(), watch)?;
                    watch.latent(&latent);
                    latent
                }
            };
            let whole = if self.separate() { join(&clean, &latent) } else { latent };
            let mut frames = from_tensor(&self.model.decode(&whole, &self.interrupt.flag())?);
            frames.truncate(at.frames);
            // The first frame of a later chunk is the last of the chunk before.
            out.extend(frames.into_iter().skip(usize::from(k > 0)));
            if let Some(report) = self.report.chunks.last_mut().filter(|r| r.frames[0] == at.first) {
                report.wall_s = since.elapsed().as_secs_f64();
            }
        }
        Ok(out)
    }

    /// Each chunk sees latents of its neighbours (FramePack); the clip is decoded as one.
    fn linked(
        &mut self,
        chunks: &[Stretch],
        finished: &[Tensor],
        mut state: Option<State>,
        watch: &mut dyn ClipWatch,
    ) -> Result<Vec<Vec<u8>>, FlowError> {
        let chunk = self.model.manifest().chunk.clone();
        let temporal = self.model.manifest().latent.temporal;
        let per = (chunk.frames - 1) / temporal;
        let backward = chunk.direction == Direction::Backward;
        let image = self.driving.image.clone();
        let clean = self.encode(&[&image])?;
        let whole = Stretch { first: 0, frames: self.driving.frames.len(), padded: 1 + chunks.len() * (chunk.frames - 1) };
        let encoded = self.encode(&self.frames(whole))?;
        let still = self.background(whole.padded)?;
        let mask = self.mask(whole)?;
        let order: Vec<usize> = if backward { (0..chunks.len()).rev().collect() } else { (0..chunks.len()).collect() };
        // Made so far, in order of time.
        let mut made: Option<Tensor> = None;
        for (done, k) in order.into_iter().enumerate() {
            let since = Instant::now();
            watch.chunk(done, chunks.len());
            let part = 1 + k * per..1 + (k + 1) * per;
            let latent = match finished.get(done) {
                Some(latent) => latent.clone(),
                None => {
                    let padding = if backward { per * padding(k, chunks.len()) } else { 0 };
                    let link = Link { history: made.as_ref(), padding, stream: k, image: &image };
                    let cells = encoded.shape[2] * encoded.shape[3];
                    let mask = mask[part.start * cells..part.end * cells].to_vec();
                    let [encoded, still] = [&encoded, &still].map(|t| slice(t, part.clone()));
                    let latent = self.run(chunks[k], encoded, still, mask, &clean, link, state.take(), watch)?;
                    watch.latent(&latent);
                    latent
                }
            };
            made = Some(match (&made, backward) {
                (None, _) => latent,
                (Some(made), true) => join(&latent, made),
                (Some(made), false) => join(made, &latent),
            });
            if let Some(report) = self.report.chunks.last_mut() {
                report.wall_s = since.elapsed().as_secs_f64();
            }
        }
        let made = made.ok_or_else(|| FlowError::Input("the driving video has no frames".into()))?;
        let mut frames = from_tensor(&self.model.decode(&join(&clean, &made), &self.interrupt.flag())?);
        frames.truncate(self.driving.frames.len());
        Ok(frames)
    }

    /// Algorithm 1 on one chunk; latents hold latent 0 unless they are parts of a linked clip.
    #[expect(clippy::too_many_arguments, reason = "what Algorithm 1 requires, one argument each")]
    fn run(
        &mut self,
        at: Stretch,
        mut encoded: Tensor,
        mut still: Tensor,
        mut mask: Vec<f32>,
        clean: &Tensor,
        link: Link,
        state: Option<State>,
        watch: &mut dyn ClipWatch,
    ) -> Result<Tensor, FlowError> {
        let policy = self.model.manifest().latent.first;
        let cells = encoded.shape[2] * encoded.shape[3];
        let mut held = None;
        match policy {
            FirstLatent::Generated => {}
            FirstLatent::Clamped => {
                replace_first(&mut encoded, clean);
                replace_first(&mut still, clean);
                held = Some((0..mask.len()).map(|i| f32::from(u8::from(i < cells))).collect());
            }
            FirstLatent::Separate if self.model.manifest().chunk.history == 0 => {
                encoded = slice(&encoded, 1..encoded.shape[1]);
                still = slice(&still, 1..still.shape[1]);
                mask.drain(..cells);
            }
            FirstLatent::Separate => {}
        }
        let grid = Grid { frames: encoded.shape[1], height: encoded.shape[2], width: encoded.shape[3] };
        let velocity = self.velocity()?;
        let mut spec = velocity.schedule.clone();
        spec.steps = self.settings.steps.unwrap_or(spec.steps);
        let schedule = Schedule::new(&spec, grid)?;
        let soft = self.settings.pool == Pool::Share;
        let Settings { act, tau, iterations, gamma, beta, sde, solver, start, seed, noise, .. } = *self.settings;
        if tau.0 > schedule.steps() {
            let message = format!("flow.tau_step {} is beyond the schedule's {} steps", tau.0, schedule.steps());
            return Err(FlowError::Input(message));
        }
        let sigma = schedule.sigma(tau).value();
        let rule = SdeRule::new(sde, gamma, sigma, beta, soft)?;
        (self.report.sigma, self.report.beta) = (sigma, rule.beta.unwrap_or(physvideo::flow::paper_beta(sigma)));
        let inputs = self.model.condition(
            Conditioning {
                grid,
                image: clean.clone(),
                image_frame: Some(to_tensor(self.driving.size, &[link.image])),
                history: link.history.cloned(),
                padding: link.padding,
                guidance: self.settings.guidance,
                embeddings: self.settings.embeddings[0].clone(),
                negative: self.settings.embeddings[1].clone(),
            },
            &self.interrupt.flag(),
        )?;
        // A scale of 1 is the conditional prediction itself.
        let two = |scale: f64| inputs.cfg().map(|_| scale).filter(|s| *s != 1.0);
        let (guidance, inversion_guidance) =
            (inputs.cfg().and_then(two), two(self.settings.inversion_guidance));
        let stream = if noise == Noise::Shared { 0 } else { link.stream as u32 };
        let task = Task {
            act,
            schedule: &schedule,
            tau,
            rule,
            iterations,
            solver,
            start,
            guidance,
            inversion_guidance,
            seed,
            stream,
        };
        let guide = Guide { encoded: encoded.data, background: still.data, mask, held };
        let flag = self.interrupt.flag();
        let mut network = Network::new(self.model, velocity, inputs, &flag);
        let outcome = phi_cf(self.gpu, &mut network, &task, &guide, state.as_ref(), watch)?;
        self.report.chunks.push(report(at, &outcome, act, &guide));
        Ok(Tensor { shape: encoded.shape, data: outcome.latent })
    }

    fn separate(&self) -> bool {
        self.model.manifest().latent.first == FirstLatent::Separate
    }

    fn velocity(&self) -> Result<VelocitySpec, FlowError> {
        let manifest = self.model.manifest();
        let missing = || FlowError::Input(format!("model {} has no velocity network", manifest.name));
        manifest.velocity.clone().ok_or_else(missing)
    }

    fn frames(&self, at: Stretch) -> Vec<&'a [u8]> {
        let last = self.driving.frames.len() - 1;
        (0..at.padded).map(|i| self.driving.frames[(at.first + i).min(last)].as_slice()).collect()
    }

    fn encode(&mut self, frames: &[&[u8]]) -> Result<Tensor, FlowError> {
        Ok(self.model.encode(&to_tensor(self.driving.size, frames), &self.interrupt.flag())?)
    }

    /// The background standing still for as long as a chunk: z^bg.
    fn background(&mut self, frames: usize) -> Result<Tensor, FlowError> {
        if let Some((_, still)) = self.still.as_ref().filter(|(n, _)| *n == frames) {
            return Ok(still.clone());
        }
        let still = self.encode(&vec![self.driving.background.as_slice(); frames])?;
        self.still = Some((frames, still.clone()));
        Ok(still)
    }

    fn mask(&self, at: Stretch) -> Result<Vec<f32>, FlowError> {
        let last = self.driving.masks.len() - 1;
        let masks: Vec<u8> =
            (0..at.padded).flat_map(|i| self.driving.masks[(at.first + i).min(last)].iter().copied()).collect();
        let latent = &self.model.manifest().latent;
        let pooling = Pooling {
            size: self.driving.size,
            frames: at.padded as u32,
            spatial: latent.spatial as u32,
            temporal: latent.temporal as u32,
            pool: self.settings.pool,
            reach: self.settings.reach,
            first: true,
        };
        Ok(pool(self.gpu, &masks, pooling)?)
    }
}

/// What ties a chunk to its neighbours.
struct Link<'a> {
    history: Option<&'a Tensor>,
    padding: usize,
    stream: usize,
    image: &'a [u8],
}

fn stretches(frames: usize, chunk: usize, temporal: usize, fixed: bool) -> Vec<Stretch> {
    let step = (chunk - 1).max(1);
    let count = frames.saturating_sub(1).div_ceil(step).max(1);
    let one = |k: usize| {
        let first = k * step;
        let frames = chunk.min(frames - first);
        let padded = if fixed { chunk } else { 1 + (frames - 1).div_ceil(temporal) * temporal };
        Stretch { first, frames, padded }
    };
    (0..count).map(one).collect()
}

/// Chunks that FramePack leaves room for between the image and chunk `k` of `count`; long clips squeeze the middle.
fn padding(k: usize, count: usize) -> usize {
    if count <= 4 || k <= 1 {
        k
    } else if k == count - 1 {
        3
    } else {
        2
    }
}

fn report(at: Stretch, outcome: &Outcome, act: Act, guide: &Guide) -> ChunkReport {
    let inside = guide.mask.iter().map(|m| f64::from(*m)).sum::<f64>() / guide.mask.len().max(1) as f64;
    ChunkReport {
        frames: [at.first, at.first + at.frames - 1],
        nfe: outcome.nfe,
        wall_s: 0.0,
        network_s: outcome.network_s,
        arithmetic_s: outcome.arithmetic_s,
        rms: outcome.stats.iter().map(|s: &LatentStats| s.rms).collect(),
        updated: if act == Act::Animate { inside } else { 1.0 - inside },
    }
}

/// Latents `range` along time of [C, T, h, w].
fn slice(tensor: &Tensor, range: std::ops::Range<usize>) -> Tensor {
    let (frames, cells) = (tensor.shape[1], tensor.shape[2] * tensor.shape[3]);
    let data = tensor.data.chunks_exact(frames * cells);
    let data = data.flat_map(|c| c[range.start * cells..range.end * cells].iter().copied()).collect();
    Tensor { shape: vec![tensor.shape[0], range.len(), tensor.shape[2], tensor.shape[3]], data }
}

/// Two stretches of latents one after the other in time.
fn join(a: &Tensor, b: &Tensor) -> Tensor {
    let size = |t: &Tensor| t.shape[1..].iter().product::<usize>();
    let pairs = a.data.chunks_exact(size(a)).zip(b.data.chunks_exact(size(b)));
    let data = pairs.flat_map(|(a, b)| a.iter().chain(b).copied()).collect();
    Tensor { shape: vec![a.shape[0], a.shape[1] + b.shape[1], a.shape[2], a.shape[3]], data }
}

/// Latent 0 becomes the clean image's.
fn replace_first(latent: &mut Tensor, clean: &Tensor) {
    let cells = latent.shape[2] * latent.shape[3];
    let channels = latent.data.chunks_exact_mut(latent.shape[1] * cells);
    for (channel, clean) in channels.zip(clean.data.chunks_exact(cells)) {
        channel[..cells].copy_from_slice(clean);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clip_of_109_frames_is_three_chunks_that_share_frames() {
        let all = stretches(109, 37, 4, false);
        assert_eq!(all.iter().map(|s| (s.first, s.frames, s.padded)).collect::<Vec<_>>(), [
            (0, 37, 37),
            (36, 37, 37),
            (72, 37, 37)
        ]);
        let short = stretches(40, 37, 4, false);
        assert_eq!((short[1].first, short[1].frames, short[1].padded), (36, 4, 5));
        assert_eq!(stretches(40, 37, 4, true)[1].padded, 37);
        assert_eq!(stretches(1, 37, 4, false), [Stretch { first: 0, frames: 1, padded: 1 }]);
        assert_eq!(stretches(37, 37, 4, false).len(), 1);
    }

    #[test]
    fn framepack_leaves_room_as_its_authors_do() {
        assert_eq!((0..3).rev().map(|k| padding(k, 3)).collect::<Vec<_>>(), [2, 1, 0]);
        assert_eq!((0..6).rev().map(|k| padding(k, 6)).collect::<Vec<_>>(), [3, 2, 2, 2, 1, 0]);
    }

    #[test]
    fn latents_are_cut_and_joined_along_time() {
        let t = Tensor { shape: vec![2, 3, 1, 2], data: (0..12).map(|i| i as f32).collect() };
        let (a, b) = (slice(&t, 0..1), slice(&t, 1..3));
        assert_eq!(a.data, [0.0, 1.0, 6.0, 7.0]);
        assert_eq!(join(&a, &b), t);
        let mut c = t.clone();
        replace_first(&mut c, &Tensor { shape: vec![2, 1, 1, 2], data: vec![-1.0; 4] });
        assert_eq!(c.data[..3], [-1.0, -1.0, 2.0]);
        assert_eq!(c.data[6..9], [-1.0, -1.0, 8.0]);
    }
}
