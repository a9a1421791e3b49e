//! The noise and the steps of the flow SDE on the device: known answers, the laws they are to have, what must not
//! depend on anything, what must stay.

use physvideo_gpu::kernels::{Adapt, Buf, Faults, FlowStep, MaskPool, Mix, SdeStep, latent};
use physvideo_gpu::{Command, Constants, Gpu, Groups, KernelInfo, Recording};
use physvideo_tests::proof::latent::{box_muller, philox};
use physvideo_tests::random::Random;
use physvideo_tests::{device, probe};

/// Elements of a sample; every bound below follows from it.
const COUNT: usize = 1 << 20;
const SEED: [u32; 2] = [0x1234_5678, 9];

fn silent(gpu: &Gpu) {
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Library functions with a kernel around them: words in, words out, four a lane.
fn words(gpu: &Gpu, source: &str, input: &[u32], len: usize) -> Vec<u32> {
    let kernel: &KernelInfo = probe::kernel("probe/latent", 64, source, &[("x", true, false), ("y", false, true)], &[]);
    let x = gpu.upload("probe", "x", input).unwrap();
    let y = gpu.alloc::<u32>("probe", "y", len as u64).unwrap();
    let mut recording = Recording::new("words");
    recording.commands.push(Command::Call {
        kernel,
        constants: Constants::none(),
        bufs: vec![x.erase(), y.erase()],
        immediates: vec![],
        groups: Groups::Direct([len.div_ceil(256) as u32, 1, 1]),
    });
    gpu.run(&recording).unwrap();
    let out = gpu.read(y).unwrap();
    gpu.free_arena("probe");
    out
}

const ENTRY: &str = "
    struct Words { d: array<u32> }
    struct Fours { d: array<vec4u> }
    @group(0) @binding(1) var<storage, read_write> y: Fours;
    @compute @workgroup_size(64)
    fn main(@builtin(global_invocation_id) id: vec3u) {
        let i = id.x;
        if (i >= arrayLength(&y.d)) { return; }
        y.d[i] = work(i);
    }";
const PHILOX: &str = include_str!("../../kernels/wgsl/lib/philox.wgsl");
const GAUSSIAN: &str = include_str!("../../kernels/wgsl/lib/gaussian.wgsl");

/// Vectors of Random123's `kat_vectors`, philox4x32 of 10 rounds: counter, key, answer.
#[test]
fn philox_gives_the_known_answers_on_the_device() {
    let known = [
        ([0; 4], [0; 2], [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]),
        ([!0; 4], [!0; 2], [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]),
        (
            [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344],
            [0xa409_3822, 0x299f_31d0],
            [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1],
        ),
    ];
    let gpu = device::gpu();
    let source = format!(
        "{PHILOX}{ENTRY}
        @group(0) @binding(0) var<storage, read> x: Words;
        fn work(i: u32) -> vec4u {{
            let at = i * 6u;
            return philox(vec4u(x.d[at], x.d[at + 1u], x.d[at + 2u], x.d[at + 3u]), vec2u(x.d[at + 4u], x.d[at + 5u]));
        }}"
    );
    let input: Vec<u32> = known.iter().flat_map(|(counter, key, _)| counter.iter().chain(key).copied()).collect();
    let want: Vec<u32> = known.iter().flat_map(|k| k.2).collect();
    assert_eq!(words(&gpu, &source, &input, 12), want);
    // And far more of them against the twin.
    let mut random = Random::new(3);
    let input: Vec<u32> = (0..6 * 10_000).map(|_| random.bits() as u32).collect();
    let want: Vec<u32> = input.chunks(6).flat_map(|c| philox([c[0], c[1], c[2], c[3]], [c[4], c[5]])).collect();
    assert_eq!(words(&gpu, &source, &input, 4 * 10_000), want);
    // The whole way: latents that are nothing but noise, of counter 0 and key 0.
    let noise = Noise { seed: [0; 2], stream: 0, iteration: 0 }.sample(&gpu, 4);
    for (got, want) in noise.iter().zip(box_muller(known[0].2)) {
        assert!((f64::from(*got) - want).abs() < 1e-6, "{got} where the known words give {want}");
    }
    silent(&gpu);
}

/// Words where something changes: ends, the switch to 1 − u, powers of two, quarters of a turn; and random ones of
/// every length.
fn edges() -> Vec<u32> {
    let mut random = Random::new(5);
    let turns = [0u32, 0x2000_0000, 0x4000_0000, 0x6000_0000, 0x8000_0000, 0xa000_0000, 0xc000_0000, 0xe000_0000];
    let powers = (0..32).map(|k| 1u32 << k);
    let mut words: Vec<u32> =
        turns.into_iter().chain(powers).flat_map(|w| (0..7).map(move |k| w.wrapping_add(k).wrapping_sub(3))).collect();
    words.extend((0..200_000).map(|_| random.bits() as u32));
    words.extend((0..100_000).map(|_| (random.bits() as u32) >> random.below(32)));
    words.extend((0..100_000).map(|_| !((random.bits() as u32) >> random.below(32))));
    words.resize(words.len().next_multiple_of(4), 7);
    words
}

#[test]
fn normals_are_those_of_their_words() {
    let gpu = device::gpu();
    let source = format!(
        "{PHILOX}{GAUSSIAN}{ENTRY}
        @group(0) @binding(0) var<storage, read> x: Words;
        fn work(i: u32) -> vec4u {{
            let at = i * 4u;
            return bitcast<vec4u>(box_muller(vec4u(x.d[at], x.d[at + 1u], x.d[at + 2u], x.d[at + 3u])));
        }}"
    );
    let mut random = Random::new(6);
    let (mut worst, mut largest) = (0.0f64, 0.0f64);
    for turn in 0..4 {
        let mut input = edges();
        if turn > 0 {
            random.shuffle(&mut input);
        }
        let out = words(&gpu, &source, &input, input.len());
        for (x, got) in input.chunks(4).zip(out.chunks(4)) {
            for (got, want) in
                got.iter().map(|b| f64::from(f32::from_bits(*b))).zip(box_muller([x[0], x[1], x[2], x[3]]))
            {
                let error = (got - want).abs() / want.abs().max(1.0);
                assert!(error < 1e-6, "{got} where {x:x?} gives {want}");
                worst = worst.max(error);
                largest = largest.max(got.abs());
            }
        }
    }
    println!("worst error of a normal {worst:.1e}, largest {largest}");
    // Words of 0 are among those of odd and of even places: u = 2⁻³³.
    assert!(largest <= 6.7638 && largest > 4.7, "{largest}");
    silent(&gpu);
}

/// Remainders at every size of elements and cells, those included where f32 rounds the quotient over a whole number.
#[test]
fn cells_are_remainders() {
    let gpu = device::gpu();
    let latent = include_str!("../../kernels/wgsl/lib/latent.wgsl");
    let texel = include_str!("../../kernels/wgsl/lib/texel.wgsl");
    let source = format!(
        "{latent}{texel}{ENTRY}
        @group(0) @binding(0) var<storage, read> x: Words;
        fn work(i: u32) -> vec4u {{
            let at = i * 4u;
            return vec4u(cell_of(x.d[at], x.d[at + 1u]), 0u, cell_of(x.d[at + 2u], x.d[at + 3u]), 0u);
        }}"
    );
    let mut random = Random::new(8);
    let mut input = Vec::new();
    while input.len() < 400_000 {
        let cells = ((random.bits() as u32) >> (1 + random.below(31))).max(1);
        let channels = ((random.bits() as u32) >> (12 + random.below(20))).min(u32::MAX / cells);
        let element = (cells * channels).wrapping_add(random.below(5) as u32).wrapping_sub(2);
        if element / cells < 1 << 20 {
            input.extend([element, cells]);
        }
    }
    let out = words(&gpu, &source, &input, input.len());
    for (x, got) in input.chunks(2).zip(out.chunks(2)) {
        assert_eq!(got[0], x[0] % x[1], "{} modulo {}", x[0], x[1]);
    }
    silent(&gpu);
}

/// What noise depends on.
#[derive(Clone, Copy)]
struct Noise {
    seed: [u32; 2],
    stream: u32,
    iteration: u32,
}

impl Noise {
    /// So many normals.
    fn sample(self, gpu: &Gpu, count: usize) -> Vec<f32> {
        let z = gpu.alloc::<f32>("noise", "z", count as u64).unwrap();
        let base = gpu.alloc::<f32>("noise", "base", count as u64).unwrap();
        let mut recording = Recording::new("noise");
        recording.each(&self.mix(z, base, z, 1.0), &Constants::none(), count as u64 / 4);
        gpu.run(&recording).unwrap();
        let out = gpu.read(z).unwrap();
        gpu.free_arena("noise");
        out
    }

    fn mix(self, z: Buf<f32>, base: Buf<f32>, mask: Buf<f32>, sigma: f32) -> latent::Mix {
        let Self { seed, stream, iteration } = self;
        let count = z.len() as u32;
        let immediates = Mix { seed, count, cells: mask.len() as u32, iteration, stream, sigma, ..Default::default() };
        latent::Mix { z: z.cast(), base: base.cast(), mask, immediates }
    }
}

/// Φ by the series and the asymptotic fraction of erfc, to 1e-12.
fn normal_below(x: f64) -> f64 {
    let t = x.abs();
    let density = (-0.5 * t * t).exp() / (2.0 * std::f64::consts::PI).sqrt();
    let upper = if t < 3.0 {
        let (mut term, mut sum) = (t, t);
        for k in 1..60 {
            term *= t * t / f64::from(2 * k + 1);
            sum += term;
        }
        0.5 - density * sum
    } else {
        density / (1..60).rev().fold(t, |below, k| t + f64::from(k) / below)
    };
    if x < 0.0 { upper } else { 1.0 - upper }
}

/// Sentences on how a sample is not N(0, 1); each bound is five standard errors of its estimate, which a right sample
/// fails once in two million times, and the Kolmogorov-Smirnov distance is that of one in two million.
fn objections(sample: &[f32]) -> Vec<String> {
    let n = sample.len() as f64;
    let x: Vec<f64> = sample.iter().map(|x| f64::from(*x)).collect();
    let moment = |k: i32| x.iter().map(|x| x.powi(k)).sum::<f64>() / n;
    // Standard errors of the raw moments of a normal: (E x^2k - (E x^k)^2) / n.
    let mut found = Vec::new();
    for (k, want, variance) in [(1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0), (6, 15.0, 10170.0)] {
        let (got, bound) = (moment(k), 5.0 * f64::sqrt(variance / n));
        if (got - want).abs() > bound {
            found.push(format!("moment {k} is {got}, not {want} within {bound:.1e}"));
        }
    }
    let mut sorted = x.clone();
    sorted.sort_by(f64::total_cmp);
    let distance = sorted.iter().enumerate().fold(0.0f64, |d, (i, x)| {
        let p = normal_below(*x);
        d.max((p - i as f64 / n).abs()).max((p - (i + 1) as f64 / n).abs())
    });
    let bound = ((4e6f64).ln() / 2.0 / n).sqrt();
    if distance > bound {
        found.push(format!("Kolmogorov-Smirnov distance {distance:.1e}, over {bound:.1e}"));
    }
    // Beyond 4 there are 6.3e-5 of them.
    let (many, want) = (x.iter().filter(|x| x.abs() > 4.0).count() as f64, 2.0 * normal_below(-4.0) * n);
    if (many - want).abs() > 5.0 * want.sqrt() {
        found.push(format!("{many} beyond 4, not {want}"));
    }
    // Neighbours, also of the other lanes and of the pair; squares see what signs hide.
    for apart in [1, 2, 3, 4, 5, 8, 16, 64, 256, 1024, 65_536] {
        found.extend(alike(&format!("{apart} apart"), &x[apart..], &x[..x.len() - apart]));
    }
    found
}

/// Correlation of values and of squares, where both are over five standard errors of independent ones.
fn alike(what: &str, a: &[f64], b: &[f64]) -> Vec<String> {
    let n = a.len().min(b.len()) as f64;
    let values = a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / n;
    let squares = a.iter().zip(b).map(|(a, b)| (a * a - 1.0) * (b * b - 1.0)).sum::<f64>() / n / 2.0;
    let bound = 5.0 / n.sqrt();
    let mut found = Vec::new();
    for (of, r) in [("values", values), ("squares", squares)] {
        if r.abs() > bound {
            found.push(format!("{what}: {of} correlate by {r:.1e}, over {bound:.1e}"));
        }
    }
    found
}

#[test]
fn noise_is_normal_and_independent() {
    let gpu = device::gpu();
    let first = Noise { seed: SEED, stream: 3, iteration: 7 };
    let others = [
        Noise { iteration: 8, ..first },
        Noise { iteration: 0x8000_0007, ..first },
        Noise { stream: 4, ..first },
        Noise { seed: [SEED[0] + 1, SEED[1]], ..first },
        Noise { seed: [SEED[0], SEED[1] + 1], ..first },
        // Iteration and stream changed over.
        Noise { iteration: 3, stream: 7, ..first },
    ];
    let sample = first.sample(&gpu, COUNT);
    assert_eq!(objections(&sample), Vec::<String>::new());
    let wide = |sample: &[f32]| sample.iter().map(|x| f64::from(*x)).collect::<Vec<_>>();
    let a = wide(&sample);
    for (turn, other) in others.into_iter().enumerate() {
        let sample = other.sample(&gpu, COUNT);
        assert_eq!(objections(&sample), Vec::<String>::new());
        assert_eq!(alike(&format!("noise {turn}"), &a, &wide(&sample)), Vec::<String>::new());
    }
    // Mistakes a sample of this size tells apart.
    let wrong: [fn(usize, f32) -> f32; 5] = [
        |_, x| x + 0.01,
        |_, x| x * 1.01,
        |_, x| x.clamp(-4.0, 4.0),
        |_, x| (x * 64.0).round() / 64.0,
        |i, x| if i % 3 == 0 { x.abs() } else { x },
    ];
    for (turn, mistake) in wrong.into_iter().enumerate() {
        let spoiled: Vec<f32> = sample.iter().enumerate().map(|(i, x)| mistake(i, *x)).collect();
        assert_ne!(objections(&spoiled), Vec::<String>::new(), "mistake {turn} was not noticed");
    }
    let mut neighbours = a.clone();
    neighbours.iter_mut().zip(&a[1..]).for_each(|(x, next)| *x += 0.01 * next);
    assert_ne!(alike("neighbours", &neighbours, &a[1..]), Vec::<String>::new());
    silent(&gpu);
}

#[test]
fn noise_has_the_same_bits_whatever_the_dispatch() {
    let gpu = device::gpu();
    let noise = Noise { seed: SEED, stream: 1, iteration: 2 };
    let bits = |x: &[f32]| x.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    let long = bits(&noise.sample(&gpu, COUNT));
    for count in [4, 252, 256, 260, 4096, 30_000] {
        assert_eq!(bits(&noise.sample(&gpu, count)), long[..count], "{count} elements");
    }
    // Folded into rows, and with far more workgroups than needed.
    let count = 30_000;
    for groups in [[118, 1, 1], [1, 118, 1], [7, 17, 1], [300, 3, 1]] {
        let z = gpu.alloc::<f32>("noise", "z", count as u64).unwrap();
        let base = gpu.alloc::<f32>("noise", "base", count as u64).unwrap();
        let mut recording = Recording::new("noise");
        recording.call(&noise.mix(z, base, z, 1.0), &Constants::none(), Groups::Direct(groups));
        gpu.run(&recording).unwrap();
        assert_eq!(bits(&gpu.read(z).unwrap()), long[..count], "{groups:?}");
    }
    // The noise of a step is that of the next iteration made one early, and that of `mix`.
    let step = |iteration, s0, s1| {
        let z = gpu.alloc::<f32>("noise", "z", count as u64).unwrap();
        let immediates =
            SdeStep { seed: SEED, count: count as u32, cells: 4, iteration, stream: 1, s0, s1, ..Default::default() };
        let call = latent::SdeStep { z: z.cast(), v: z.cast(), mu: z.cast(), update: z, immediates };
        let mut recording = Recording::new("step");
        let constants = Constants::none().with("TWO", 1.0);
        recording.each(&call, &constants, count as u64 / 4);
        gpu.run(&recording).unwrap();
        bits(&gpu.read(z).unwrap())
    };
    assert_eq!(step(2, 1.0, 0.0), long[..count]);
    assert_eq!(step(1, 0.0, 1.0), long[..count]);
    silent(&gpu);
}

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
        let faults = self.gpu.alloc::<Faults>("chain", "faults", 1).unwrap();
        let count = COUNT as u32;
        let (z, ones) = (self.z.cast(), self.ones.cast());
        let adapt = latent::Adapt {
            z,
            conditional: z,
            unconditional: z,
            velocity: self.v.cast(),
            faults,
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
