//! The latent of one chunk on the device and the steps of Algorithm 1 on it. Knows coefficients and predictions, not
//! where either comes from.

use std::cell::Cell;

use physvideo_gpu::kernels::{self, latent};
use physvideo_gpu::{Buf, Constants, Gpu, GpuError, Kernel, Recording};

use super::{LatentSetup, LatentStats, NoiseKey, Reading};
use crate::flow::{FlowStep, SdeStep};

/// A latent of `elements` = channels × cells numbers in the order [C, T, h, w]; `cells` = T h w.
pub struct LatentSpace<'gpu> {
    gpu: &'gpu Gpu,
    elements: u64,
    cells: u64,
    /// The latent, then what a network's input tensor holds after it.
    tensor: Buf<[f32; 4]>,
    length: u64,
    predicted: Buf<[f32; 4]>,
    unguided: Option<Buf<[f32; 4]>>,
    velocity: Option<Buf<[f32; 4]>>,
    before: Option<Buf<[f32; 4]>>,
    base: Buf<[f32; 4]>,
    anchor: Option<Buf<[f32; 4]>>,
    mask: Buf<f32>,
    update: Buf<f32>,
    free: Option<Buf<f32>>,
    partials: Buf<kernels::Partial>,
    /// Device time of everything recorded so far [ms].
    device_ms: Cell<f64>,
}

const ARENA: &str = "latent";

impl<'gpu> LatentSpace<'gpu> {
    /// Allocates what the setup needs, and nothing else.
    ///
    /// # Errors
    /// Lengths that do not fit, or the device's refusal.
    pub fn new(gpu: &'gpu Gpu, setup: &LatentSetup) -> Result<Self, GpuError> {
        let LatentSetup { elements, cells, .. } = *setup;
        let refuse = |message: String| Err(GpuError::Call { kernel: ARENA.into(), message });
        if elements == 0 || cells == 0 || elements % 4 != 0 || elements % cells != 0 || u32::try_from(elements).is_err()
        {
            return refuse(format!(
                "a latent of {elements} numbers in channels of {cells}: it must be a multiple of 4"
            ));
        }
        let wrong = |found: Option<usize>, want: u64| found.is_some_and(|n| n as u64 != want);
        if wrong(setup.anchor.map(<[f32]>::len), elements) || wrong(setup.free.map(<[f32]>::len), cells) {
            return refuse("the anchor or the mask of held cells does not fit the latent".into());
        }
        let quads = elements / 4;
        let length = elements + setup.tail.len() as u64;
        let one = |name| gpu.alloc(ARENA, name, quads);
        let when = |wanted: bool, name| if wanted { one(name).map(Some) } else { Ok(None) };
        let space = Self {
            gpu,
            elements,
            cells,
            tensor: gpu.alloc(ARENA, "latent/tensor", length.div_ceil(4))?,
            length,
            predicted: one("latent/prediction")?,
            unguided: when(setup.guided, "latent/unguided")?,
            velocity: when(setup.guided || setup.apart, "latent/velocity")?,
            before: when(setup.history, "latent/velocity before")?,
            base: one("latent/base")?,
            anchor: when(setup.anchor.is_some(), "latent/anchor")?,
            mask: gpu.alloc(ARENA, "latent/mask", cells)?,
            update: gpu.alloc(ARENA, "latent/update", cells)?,
            free: if setup.free.is_some() { Some(gpu.alloc(ARENA, "latent/free", cells)?) } else { None },
            partials: gpu.alloc(ARENA, "latent/partials", partials(elements))?,
            device_ms: Cell::new(0.0),
        };
        gpu.write(space.tensor.cast::<f32>(), elements, setup.tail)?;
        if let (Some(buf), Some(anchor)) = (space.anchor, setup.anchor) {
            gpu.write(buf.cast::<f32>(), 0, anchor)?;
        }
        if let (Some(buf), Some(free)) = (space.free, setup.free) {
            gpu.write(buf, 0, free)?;
        }
        Ok(space)
    }

    /// Device memory a setup takes [bytes].
    pub fn bytes(setup: &LatentSetup) -> u64 {
        let buffers = 3 + [setup.guided, setup.guided || setup.apart, setup.history, setup.anchor.is_some()]
            .into_iter()
            .map(u64::from)
            .sum::<u64>();
        4 * (buffers * setup.elements + setup.tail.len() as u64 + 3 * setup.cells)
            + partials(setup.elements) * size_of::<kernels::Partial>() as u64
    }

    /// Numbers of the latent.
    pub fn elements(&self) -> u64 {
        self.elements
    }

    /// Sets the latent.
    ///
    /// # Errors
    /// A length that does not fit.
    pub fn set(&self, z: &[f32]) -> Result<(), GpuError> {
        self.fits(z)?;
        self.gpu.write(self.tensor.cast::<f32>(), 0, z)
    }

    /// Reads the latent.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn get(&self) -> Result<Vec<f32>, GpuError> {
        self.gpu.read_range(self.tensor.cast::<f32>(), 0, self.elements)
    }

    /// Looks at the whole tensor that the network reads, without a copy where memory is shared.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn view<R>(&self, look: impl FnOnce(&[f32]) -> R) -> Result<Option<R>, GpuError> {
        self.gpu.view(self.tensor.cast::<f32>(), 0, self.length, look)
    }

    /// Velocities of the step before.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn history(&self) -> Result<Option<Vec<f32>>, GpuError> {
        self.before.map(|b| self.gpu.read_range(b.cast::<f32>(), 0, self.elements)).transpose()
    }

    /// Sets the velocities of the step before.
    ///
    /// # Errors
    /// A length that does not fit.
    pub fn set_history(&self, before: &[f32]) -> Result<(), GpuError> {
        self.fits(before)?;
        self.before.map_or(Ok(()), |b| self.gpu.write(b.cast::<f32>(), 0, before))
    }

    /// Hands over what the network predicts, with and without its condition.
    ///
    /// # Errors
    /// A length that does not fit.
    pub fn predict(&self, conditional: &[f32], unconditional: Option<&[f32]>) -> Result<(), GpuError> {
        self.fits(conditional)?;
        self.gpu.write(self.predicted.cast::<f32>(), 0, conditional)?;
        if let (Some(buf), Some(u)) = (self.unguided, unconditional) {
            self.fits(u)?;
            self.gpu.write(buf.cast::<f32>(), 0, u)?;
        }
        Ok(())
    }

    fn fits(&self, numbers: &[f32]) -> Result<(), GpuError> {
        if numbers.len() as u64 == self.elements {
            return Ok(());
        }
        let message = format!("{} numbers for a latent of {}", numbers.len(), self.elements);
        Err(GpuError::Call { kernel: ARENA.into(), message })
    }

    /// The velocity's buffer and the factor it still needs. Where the prediction is the velocity but for a factor, it
    /// serves as it is and nothing is recorded.
    fn velocity(&self, rec: &mut Recording, reading: Reading) -> Result<(Buf<[f32; 4]>, f64), GpuError> {
        let Some(velocity) = self.velocity else {
            if reading.latent != 0.0 || reading.guidance.is_some() {
                let message = "the setup has no buffer for velocities that are not the prediction".into();
                return Err(GpuError::Call { kernel: ARENA.into(), message });
            }
            return Ok((self.predicted, reading.scale));
        };
        let guided = self.unguided.filter(|_| reading.guidance.is_some());
        let call = latent::Adapt {
            z: self.tensor,
            conditional: self.predicted,
            unconditional: guided.unwrap_or(self.predicted),
            velocity,
            immediates: kernels::Adapt {
                count: self.elements as u32,
                kp: reading.scale as f32,
                kz: reading.latent as f32,
                guidance: reading.guidance.unwrap_or(1.0) as f32,
            },
        };
        let constants = Constants::none().with("GUIDED", f64::from(u8::from(guided.is_some())));
        rec.each(&call, &constants, self.elements / 4);
        Ok((velocity, 1.0))
    }

    /// One step of F or F⁻¹ with the prediction handed over last; `remember` keeps its velocity for the next step.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn flow_step(&self, step: FlowStep, reading: Reading, remember: bool) -> Result<(), GpuError> {
        let mut rec = Recording::new("flow step");
        rec.section("flow step");
        let (v, factor) = self.velocity(&mut rec, reading)?;
        let two = self.before.filter(|_| step.b != 0.0);
        let call = latent::FlowStep {
            z: self.tensor,
            v,
            w: two.unwrap_or(v),
            free: self.free.unwrap_or(self.mask),
            immediates: kernels::FlowStep {
                count: self.elements as u32,
                cells: self.cells as u32,
                a: (factor * step.a) as f32,
                b: (factor * step.b) as f32,
            },
        };
        let constants = Constants::none()
            .with("TWO", f64::from(u8::from(two.is_some())))
            .with("HELD", f64::from(u8::from(self.free.is_some())));
        rec.each(&call, &constants, self.elements / 4);
        if let (Some(before), true) = (self.before, remember) {
            rec.copy(v, before);
        }
        self.run(&rec)
    }

    /// Lines 6–8 of Algorithm 1: z ← M z + (1 − M) ((1 − σ) base + σ ε). Without `mask`, M = 0 everywhere.
    ///
    /// # Errors
    /// Lengths that do not fit, or the device's refusal.
    pub fn mix(&self, base: &[f32], mask: Option<&[f32]>, sigma: f64, noise: NoiseKey) -> Result<(), GpuError> {
        self.fits(base)?;
        self.gpu.write(self.base.cast::<f32>(), 0, base)?;
        if let Some(mask) = mask {
            self.gpu.write(self.mask, 0, mask)?;
        }
        let call = latent::Mix {
            z: self.tensor,
            base: self.base,
            mask: self.mask,
            immediates: kernels::Mix {
                count: self.elements as u32,
                cells: self.cells as u32,
                sigma: sigma as f32,
                iteration: 0,
                seed: halves(noise.seed),
                stream: noise.stream,
                ..Default::default()
            },
        };
        let mut rec = Recording::new("mix");
        rec.section("mix");
        let constants = Constants::none().with("MASKED", f64::from(u8::from(mask.is_some())));
        rec.each(&call, &constants, self.elements / 4);
        self.run(&rec)
    }

    /// Which cells the SDE updates, and how much; 0 leaves a cell as it is.
    ///
    /// # Errors
    /// A length that does not fit.
    pub fn update_where(&self, update: &[f32]) -> Result<(), GpuError> {
        self.gpu.write(self.update, 0, update)
    }

    /// Lines 10–12 of Algorithm 1 with the prediction handed over last, and what the latent is like after it.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn sde_step(
        &self,
        step: SdeStep,
        iteration: u32,
        reading: Reading,
        noise: NoiseKey,
    ) -> Result<LatentStats, GpuError> {
        let mut rec = Recording::new("sde step");
        rec.section("sde step");
        let (v, factor) = self.velocity(&mut rec, reading)?;
        let call = latent::SdeStep {
            z: self.tensor,
            v,
            mu: self.anchor.unwrap_or(self.base),
            update: self.update,
            immediates: kernels::SdeStep {
                count: self.elements as u32,
                cells: self.cells as u32,
                a: step.a as f32,
                b: (factor * step.b) as f32,
                m: step.m as f32,
                s0: step.s0 as f32,
                s1: step.s1 as f32,
                iteration,
                seed: halves(noise.seed),
                stream: noise.stream,
                ..Default::default()
            },
        };
        let constants = Constants::none()
            .with("MASKED", 1.0)
            .with("ANCHORED", f64::from(u8::from(self.anchor.is_some())))
            .with("TWO", f64::from(u8::from(step.s1 != 0.0)));
        rec.each(&call, &constants, self.elements / 4);
        self.record_stats(&mut rec);
        self.run(&rec)?;
        self.read_stats()
    }

    /// What the latent is like now.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn stats(&self) -> Result<LatentStats, GpuError> {
        let mut rec = Recording::new("stats");
        rec.section("stats");
        self.record_stats(&mut rec);
        self.run(&rec)?;
        self.read_stats()
    }

    fn run(&self, rec: &Recording) -> Result<(), GpuError> {
        let timings = self.gpu.run(rec)?;
        self.device_ms.set(self.device_ms.get() + timings.iter().map(|t| t.ms).sum::<f64>());
        Ok(())
    }

    /// Device time of all steps so far [ms], by the device's own clock.
    pub fn device_ms(&self) -> f64 {
        self.device_ms.get()
    }

    fn record_stats(&self, rec: &mut Recording) {
        let call = latent::Stats {
            z: self.tensor,
            mask: self.mask,
            partials: self.partials,
            immediates: kernels::Stats { count: self.elements as u32, cells: self.cells as u32 },
        };
        rec.each(&call, &Constants::none(), self.elements.div_ceil(u64::from(STATS_EACH)));
    }

    fn read_stats(&self) -> Result<LatentStats, GpuError> {
        let partials = self.gpu.read(self.partials)?;
        let sum = |of: fn(&kernels::Partial) -> f32| partials.iter().map(|p| f64::from(of(p))).sum::<f64>();
        let faults = partials.iter().map(|p| u64::from(p.faults)).sum::<u64>();
        let n = (self.elements - faults).max(1) as f64;
        Ok(LatentStats { faults, mean: sum(|p| p.sum) / n, rms: (sum(|p| p.squares) / n).sqrt() })
    }
}

impl Drop for LatentSpace<'_> {
    fn drop(&mut self) {
        self.gpu.free_arena(ARENA);
    }
}

fn halves(seed: u64) -> [u32; 2] {
    [seed as u32, (seed >> 32) as u32]
}

/// Elements a lane of `latent/stats` takes.
const STATS_EACH: u32 = 32;

/// Workgroups of `latent/stats`, each of which leaves one partial sum.
fn partials(elements: u64) -> u64 {
    elements.div_ceil(u64::from(STATS_EACH * <latent::Stats as Kernel>::INFO.workgroup[0]))
}
