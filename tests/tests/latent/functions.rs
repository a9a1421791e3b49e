//! Philox, Box-Muller and remainders by themselves: known answers, and inputs where something changes.

use physvideo_gpu::{Command, Constants, Gpu, Groups, KernelInfo, Recording};
use physvideo_tests::proof::latent::{box_muller, philox};
use physvideo_tests::random::Random;
use physvideo_tests::{device, probe};

use super::{Noise, silent};

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
const PHILOX: &str = include_str!("../../../kernels/wgsl/lib/philox.wgsl");
const GAUSSIAN: &str = include_str!("../../../kernels/wgsl/lib/gaussian.wgsl");

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

/// Words where something changes: ends, the switch to 1 − u at a half, powers of two, quarters of a turn; and random ones of
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
    let latent = include_str!("../../../kernels/wgsl/lib/latent.wgsl");
    let texel = include_str!("../../../kernels/wgsl/lib/texel.wgsl");
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
