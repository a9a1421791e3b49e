//! A driving video chunk by chunk through Algorithm 1. Knows models and latents, neither files nor scenes.

use std::time::Instant;

use physvideo::flow::SdeRule;
use physvideo::scene::{Continuation, Noise, Pool};
use physvideo::stages::latent::mask::{Pooling, pool};
use physvideo_gpu::Gpu;
use physvideo_net::{
    Conditioning, Direction, FirstLatent, Grid, Guidance, Kind, Model, NetError, Schedule, Tensor, VelocitySpec,
};

use super::algorithm::{Guide, State, Task, Watch, phi_cf};
use super::chunk_report::{ChunkReport, ClipReport, Finished};
use super::chunks::{Stretch, padding, stretches};
use super::network::Network;
use super::pixels::{Driving, from_tensor, to_tensor};
use super::settings::Settings;
use super::time::{join, replace_first, slice};
use super::velocity::FlowError;
use crate::interrupt::Interrupt;

/// Told of what a clip does.
pub trait ClipWatch: Watch {
    /// Chunk `index` of `count` begins.
    fn chunk(&mut self, index: usize, count: usize);
    /// Its latent is finished.
    fn latent(&mut self, latent: &Tensor, report: &ChunkReport);
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
        finished: &[Finished],
        state: Option<State>,
        watch: &mut dyn ClipWatch,
    ) -> Result<(Vec<Vec<u8>>, ClipReport), FlowError> {
        let chunks = self.stretches();
        let frames = if self.model.manifest().chunk.history > 0 {
            self.linked(&chunks, finished, state, watch)?
        } else {
            self.continued(&chunks, finished, state, watch)?
        };
        if let Some(first) = self.report.chunks.first() {
            (self.report.sigma, self.report.beta) = (first.sigma, first.beta);
        }
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
        finished: &[Finished],
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
                Some(finished) => self.again(finished),
                None => {
                    let encoded = self.encode(&self.frames(*at))?;
                    let still = self.background(at.padded)?;
                    let mask = self.mask(*at)?;
                    let link = Link { history: None, padding: 0, stream: k, image: &image };
                    self.run(*at, encoded, still, mask, &clean, link, state.take(), watch)?
                }
            };
            let whole = if self.separate() { join(&clean, &latent) } else { latent };
            let mut frames = self.decode(&whole)?;
            frames.truncate(at.frames);
            // The first frame of a later chunk is the last of the chunk before.
            out.extend(frames.into_iter().skip(usize::from(k > 0)));
            if let Some(report) = self.report.chunks.last_mut().filter(|_| k >= finished.len()) {
                report.wall_s = since.elapsed().as_secs_f64();
            }
        }
        Ok(out)
    }

    /// Each chunk sees latents of its neighbours (FramePack); the clip is decoded as one.
    fn linked(
        &mut self,
        chunks: &[Stretch],
        finished: &[Finished],
        mut state: Option<State>,
        watch: &mut dyn ClipWatch,
    ) -> Result<Vec<Vec<u8>>, FlowError> {
        let chunk = self.model.manifest().chunk.clone();
        let temporal = self.model.manifest().latent.temporal;
        let per = (chunk.frames - 1) / temporal;
        let backward = chunk.direction == Direction::Backward;
        let image = self.driving.image.clone();
        let clean = self.encode(&[&image])?;
        let whole =
            Stretch { first: 0, frames: self.driving.frames.len(), padded: 1 + chunks.len() * (chunk.frames - 1) };
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
                Some(finished) => self.again(finished),
                None => {
                    let padding = if backward { per * padding(k, chunks.len()) } else { 0 };
                    let link = Link { history: made.as_ref(), padding, stream: k, image: &image };
                    let cells = encoded.shape[2] * encoded.shape[3];
                    let mask = mask[part.start * cells..part.end * cells].to_vec();
                    let [encoded, still] = [&encoded, &still].map(|t| slice(t, part.clone()));
                    self.run(chunks[k], encoded, still, mask, &clean, link, state.take(), watch)?
                }
            };
            made = Some(match (&made, backward) {
                (None, _) => latent,
                (Some(made), true) => join(&latent, made),
                (Some(made), false) => join(made, &latent),
            });
            if let Some(report) = self.report.chunks.last_mut().filter(|_| done >= finished.len()) {
                report.wall_s = since.elapsed().as_secs_f64();
            }
        }
        let made = made.ok_or_else(|| FlowError::Input("the driving video has no frames".into()))?;
        let mut frames = self.decode(&join(&clean, &made))?;
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
        let sigma = schedule.sigma(tau).value();
        let rule = SdeRule::new(sde, gamma, sigma, beta, soft)?;
        let beta = rule.beta.unwrap_or(physvideo::flow::paper_beta(sigma));
        let two = match velocity.guidance {
            Guidance::Cfg { scale, .. } => {
                Some((self.settings.guidance.unwrap_or(scale), self.settings.inversion_guidance))
            }
            _ => None,
        };
        // A scale of 1 is the conditional prediction itself; both branches are made ready when either needs them.
        let asked = match two {
            Some((1.0, inversion)) => Some(inversion),
            Some((guidance, _)) => Some(guidance),
            None => self.settings.guidance,
        };
        let inputs = self.model.condition(
            Conditioning {
                grid,
                image: clean.clone(),
                image_frame: Some(to_tensor(self.driving.size, &[link.image])),
                history: link.history.cloned(),
                padding: link.padding,
                guidance: asked,
                embeddings: self.settings.embeddings[0].clone(),
                negative: self.settings.embeddings[1].clone(),
            },
            &self.interrupt.flag(),
        )?;
        let (guidance, inversion_guidance) =
            (two.map(|t| t.0).filter(|s| *s != 1.0), two.map(|t| t.1).filter(|s| *s != 1.0));
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
        let report = ChunkReport::new(at, &outcome, act, &guide, (sigma, beta));
        let latent = Tensor { shape: encoded.shape, data: outcome.latent };
        watch.latent(&latent, &report);
        self.report.chunks.push(report);
        Ok(latent)
    }

    fn again(&mut self, finished: &Finished) -> Tensor {
        self.report.chunks.push(finished.report.clone());
        finished.latent.clone()
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
        let what = || format!("{} frames", frames.len());
        let latent = self.model.encode(&to_tensor(self.driving.size, frames), &self.interrupt.flag());
        finite("encode", latent, what)
    }

    fn decode(&mut self, latent: &Tensor) -> Result<Vec<Vec<u8>>, FlowError> {
        let what = || format!("{} latents", latent.shape[1]);
        let frames = self.model.decode(latent, &self.interrupt.flag());
        Ok(from_tensor(&finite("decode", frames, what)?))
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

/// What a codec gave, when all of it are numbers.
fn finite(
    network: &'static str,
    given: Result<Tensor, NetError>,
    what: impl Fn() -> String,
) -> Result<Tensor, FlowError> {
    let tensor = match given {
        Err(e) if e.kind() == Kind::Interrupted => {
            return Err(FlowError::Interrupted { at: format!("the network `{network}`"), kept: true });
        }
        given => given?,
    };
    match tensor.data.iter().filter(|x| !x.is_finite()).count() {
        0 => Ok(tensor),
        count => Err(FlowError::CodecNotFinite { network, count, what: what() }),
    }
}
