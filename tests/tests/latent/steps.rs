//! Steps on the device against closed forms, and what they must leave alone.

use physvideo_gpu::kernels::{Adapt, Buf, FlowStep, MaskPool, SdeStep, latent};
use physvideo_gpu::{Constants, Gpu, Recording};
use physvideo_tests::device;
use physvideo_tests::random::Random;

use super::{COUNT, Noise, SEED, silent};

/// A latent with a network that knows the law of its data: all v are c z + k, made by `adapt`.
struct Chain<'a> {
    gpu: &'a Gpu,
    z: Buf<f32>,
    v: Buf<f32>,
    ones: Buf<f32>,
    recording: Recording,
}

/// τ of the paper, and the variance of z_τ for data of variance 1.
const TAU: f64 = 28.0 / 29.0;
const S: f64 = (1.0 - TAU) * (1.0 - TAU) + TAU * TAU;

impl<'a> Chain<'a> {
    /// From N(0, variance).
    fn new(gpu: &'a Gpu, variance: f64) -> Self {
        let [z, v] = ["z", "v"].map(|name| gpu.alloc::<f32>("chain", name, COUNT as u64).unwrap());
        let ones = gpu.upload("chain", "ones", &vec![1.0f32; COUNT]).unwrap();
        let mut recording = Recording::new("chain");
        recording.fill(v, 0);
        let start = Noise { seed: SEED, stream: 0, iteration: 0 };
        recording.each(&start.mix(z, v, z, variance.sqrt() as f32), &Constants::none(), COUNT as u64 / 4);
        Self { gpu, z, v, ones, recording }
    }

    /// A step with data N(μ, 1): z + γ (−z/τ + (1 − τ)/τ v) + s0 ε_n + s1 ε_{n+1}, v by its sign and its closed form
    /// v = μ + ((1 − τ) − τ)(z − (1 − τ) μ)/S.
    fn step(&mut self, n: u32, mu: f64, sign: f64, gamma: f64, [s0, s1]: [f64; 2]) {
        let c = ((1.0 - TAU) - TAU) / S;
        let count = COUNT as u32;
        let (z, ones) = (self.z.cast(), self.ones.cast());
        let adapt = latent::Adapt {
            z,
            conditional: z,
            unconditional: z,
            velocity: self.v.cast(),
            immediates: Adapt { count, kp: (sign * c) as f32, kz: 0.0, guidance: 0.0 },
        };
        self.recording.each(&adapt, &Constants::none(), u64::from(count) / 4);
        let b = gamma * (1.0 - TAU) / TAU;
        let rest = mu - c * (1.0 - TAU) * mu;
        let step = latent::SdeStep {
            z,
            v: self.v.cast(),
            mu: ones,
            update: self.ones,
            immediates: SdeStep {
                seed: SEED,
                count,
                cells: count,
                iteration: n,
                stream: 1,
                a: (-gamma / TAU) as f32,
                b: b as f32,
                m: (sign * b * rest) as f32,
                s0: s0 as f32,
                s1: s1 as f32,
                ..Default::default()
            },
        };
        let two = f64::from(u8::from(s1 != 0.0));
        let constants = Constants::none().with("ANCHORED", 1.0).with("TWO", two).with("MASKED", f64::from(n % 2));
        self.recording.each(&step, &constants, u64::from(count) / 4);
    }

    /// Mean and variance at the end.
    fn law(self) -> [f64; 2] {
        self.gpu.run(&self.recording).unwrap();
        let z = self.gpu.read(self.z).unwrap();
        let mean = z.iter().map(|z| f64::from(*z)).sum::<f64>() / COUNT as f64;
        let variance = z.iter().map(|z| (f64::from(*z) - mean).powi(2)).sum::<f64>() / COUNT as f64;
        self.gpu.free_arena("chain");
        [mean, variance]
    }
}

/// Ten steps are an AR(1) with A = 1 − γ/S. Bounds are five standard errors of a sample of 2²⁰: the mean's is
/// sqrt(S/n), the variance's S sqrt(2/n).
#[test]
fn ten_steps_have_the_law_of_their_closed_form() {
    let gpu = device::gpu();
    let near = |got: f64, want: f64, one: f64| (got - want).abs() < 5.0 * one / (COUNT as f64).sqrt();
    let gamma = 0.2;
    // Euler-Maruyama with data N(1, 1) from mean 0: 0.03139, and with the sign of v turned −0.03297.
    for (sign, mean) in [(1.0, 0.03139), (-1.0, -0.03297)] {
        let mut chain = Chain::new(&gpu, S);
        (0..10).for_each(|n| chain.step(n, 1.0, sign, gamma, [(2.0 * gamma).sqrt(), 0.0]));
        let [got, variance] = chain.law();
        println!("sign {sign}: mean {got:.5}, variance {variance:.5}");
        assert!(near(got, mean, variance.sqrt()), "mean {got}, not {mean}");
        assert!(!near(got, -mean, variance.sqrt()));
        if sign > 0.0 {
            let a: f64 = 1.0 - gamma / S;
            let want = a.powi(20) * S + 2.0 * gamma * (1.0 - a.powi(20)) / (1.0 - a * a);
            assert!(near(variance, want, want * 2f64.sqrt()), "variance {variance}, not {want}");
            assert!(!near(variance, S, S * 2f64.sqrt()), "a sample of this size tells it from S");
        }
    }
    // Leimkuhler-Matthews, whose first step has the noise of Euler's in all: S in the end, where Euler's is 12 % wide.
    let half = (gamma / 2.0).sqrt();
    for steps in [1, 10] {
        let mut chain = Chain::new(&gpu, S);
        for n in 0..steps {
            let first = if n == 0 { (1.5 * gamma).sqrt() } else { half };
            chain.step(n, 0.0, 1.0, gamma, [first, half]);
        }
        let [mean, variance] = chain.law();
        println!("Leimkuhler-Matthews after {steps}: mean {mean:.5}, variance {variance:.5} of {S:.5}");
        assert!(near(mean, 0.0, S.sqrt()));
        let want = leimkuhler_matthews(gamma, steps);
        assert!(near(variance, want, S * 2f64.sqrt()), "{variance}, not {want}");
    }
    silent(&gpu);
}

/// Variance after so many steps from S, with the covariance of z and the noise it shares with the next step.
fn leimkuhler_matthews(gamma: f64, steps: u32) -> f64 {
    let a = 1.0 - gamma / S;
    let (mut variance, mut shared) = (S, 0.0);
    for n in 0..steps {
        let (first, half) = (if n == 0 { 1.5 * gamma } else { gamma / 2.0 }, gamma / 2.0);
        variance = a * a * variance + 2.0 * a * shared * first.sqrt() + first + half;
        shared = half.sqrt();
    }
    variance
}

/// What is outside the updated region has the same bits after inversion, ten steps and generation, in both acts,
/// whatever it is and whatever the network says of it.
#[test]
fn held_elements_keep_their_bits_in_both_acts() {
    let gpu = device::gpu();
    let (frames, width, height, spatial, temporal, channels) = (9u32, 60, 44, 4, 4, 5);
    let (latents, plane) = (3, 15 * 11);
    let cells = latents * plane;
    let count = (cells * channels / 4 * 4) as usize;
    // Reconstruct: known where all frames are covered, and the rest is made. Animate: what is touched is made.
    for (act, mode, reach) in [("reconstruct", 0.0, 0), ("animate", 1.0, 1)] {
        let mut random = Random::new(12);
        let words: Vec<u32> = (0..frames * width * height)
            .map(|i| if (i % width / 20 + i / width % height / 20).is_multiple_of(2) { 0xff00_0000 } else { 0 })
            .collect();
        let layers = gpu.upload("act", "layers", &words).unwrap();
        let weights = gpu.alloc::<f32>("act", "weights", u64::from(cells)).unwrap();
        let immediates = MaskPool { frames, width, height, spatial, temporal, reach, first: 1 };
        let mut recording = Recording::new("pool");
        recording.each(
            &latent::MaskPool { layers, weights, immediates },
            &Constants::none().with("MODE", mode),
            u64::from(cells),
        );
        gpu.run(&recording).unwrap();
        let pooled = gpu.read(weights).unwrap();
        // Weight 1 is to be updated.
        let made: Vec<f32> = pooled.iter().map(|m| if act == "reconstruct" { 1.0 - m } else { *m }).collect();
        let held: Vec<f32> = made.iter().map(|d| 1.0 - d).collect();
        let share = made.iter().sum::<f32>() / cells as f32;
        assert!((0.1..0.95).contains(&share), "{act}: {share} of the cells are made");

        let mut random_values = |more: usize| (0..count + more).map(|_| random.range(-3.0, 3.0)).collect::<Vec<f32>>();
        let mut start = random_values(8);
        for (i, x) in start.iter_mut().enumerate().take(count) {
            if made[i % cells as usize] == 0.0 && i % 7 == 0 {
                *x = [f32::from_bits(0x7f80_1234), f32::NEG_INFINITY, -0.0, 1e-42][i / 7 % 4];
            }
        }
        let mut predicted = random_values(0);
        predicted
            .iter_mut()
            .enumerate()
            .filter(|(i, _)| made[i % cells as usize] == 0.0)
            .for_each(|(_, v)| *v = f32::NAN);
        let upload = |name, data: &[f32]| gpu.upload("act", name, data).unwrap();
        let (z, v, base) = (upload("z", &start), upload("v", &predicted), upload("base", &random_values(0)));
        let (update, hold) = (upload("update", &made), upload("hold", &held));
        let mut recording = Recording::new("act");
        let n = count as u32;
        let flow = |recording: &mut Recording, a| {
            let immediates = FlowStep { count: n, cells, a, b: 0.01 };
            let call = latent::FlowStep { z: z.cast(), v: v.cast(), w: base.cast(), free: update, immediates };
            recording.each(&call, &Constants::none().with("HELD", 1.0).with("TWO", 1.0), u64::from(n) / 4);
        };
        flow(&mut recording, 0.04);
        let mut mix = Noise { seed: SEED, stream: 0, iteration: 0 }.mix(z, base, hold, 0.9);
        mix.immediates.count = n;
        recording.each(&mix, &Constants::none().with("MASKED", 1.0), u64::from(n) / 4);
        for iteration in 0..10 {
            let immediates = SdeStep {
                seed: SEED,
                count: n,
                cells,
                iteration,
                stream: 1,
                a: -0.2,
                b: 0.007,
                s0: 0.63,
                s1: 0.1,
                ..Default::default()
            };
            let call = latent::SdeStep { z: z.cast(), v: v.cast(), mu: v.cast(), update, immediates };
            recording.each(&call, &Constants::none().with("MASKED", 1.0).with("TWO", 1.0), u64::from(n) / 4);
        }
        flow(&mut recording, -0.04);
        gpu.run(&recording).unwrap();
        let end = gpu.read(z).unwrap();
        for (i, (before, after)) in start.iter().zip(&end).enumerate() {
            let stays = i >= count || made[i % cells as usize] == 0.0;
            assert_eq!(before.to_bits() == after.to_bits(), stays, "{act}: element {i} was {before} and is {after}");
            assert!(stays || after.is_finite(), "{act}: element {i} is {after}");
        }
        gpu.free_arena("act");
    }
    silent(&gpu);
}
