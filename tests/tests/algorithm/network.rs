//! A clip through the shipped network: what the program makes of frames, masks, image and background against Algorithm 1
//! written out over the network's own calls. Holds pixels to latents, mask pooling, conditioning and chunks together.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use physvideo::scene::{Act, Continuation, Noise, Pool, Sde, Solver, Start};
use physvideo_app::flow::{ChunkReport, Clip, ClipWatch, Driving, FlowError, Phase, Settings, State, Watch};
use physvideo_app::interrupt::Interrupt;
use physvideo_net::{
    Branch, Conditioning, Grid, LibraryChoice, Manifest, Model, OpenOptions, Runtime, Sigma, StepIndex, Tensor,
};
use physvideo_tests::device;
use physvideo_tests::proof::latent::normals;

const SIZE: usize = 16;
const FRAMES: usize = 9;
const SEED: u64 = 0x1_0000_0005;
static NEVER: AtomicBool = AtomicBool::new(false);

struct Silent;
impl Watch for Silent {
    fn finished(&mut self, _: Phase, _: u32, _: &dyn Fn() -> Result<State, FlowError>) -> Result<(), FlowError> {
        Ok(())
    }
    fn stopped(&mut self, _: State) {}
}
impl ClipWatch for Silent {
    fn chunk(&mut self, _: usize, _: usize) {}
    fn latent(&mut self, _: &Tensor, _: &ChunkReport) {}
}

fn model() -> Model {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../assets/models/small");
    let manifest = Manifest::read(&folder).unwrap();
    let program = std::env::current_exe().unwrap();
    let library = program.ancestors().map(|f| f.join("onnxruntime/libonnxruntime.so")).find(|p| p.is_file());
    let choice = LibraryChoice { path: library, threads: Some(1), ..LibraryChoice::default() };
    let runtime = Runtime::load(&choice).unwrap_or_else(|e| panic!("run tools/setup: {e}"));
    let roles = manifest.for_clips();
    Model::open(&runtime, manifest, &OpenOptions { roles: &roles, ..OpenOptions::default() }).unwrap()
}

/// A square that moves to the right over a gradient; the mask is the square.
fn driving() -> Driving {
    let (mut frames, mut masks) = (Vec::new(), Vec::new());
    let back = |x: usize, y: usize| [(40 + 9 * x) as u8, (60 + 5 * y) as u8, 110];
    let picture = |inside: &dyn Fn(usize, usize) -> bool| -> Vec<u8> {
        let pixel = |i: usize| if inside(i % SIZE, i / SIZE) { [220, 70, 60] } else { back(i % SIZE, i / SIZE) };
        (0..SIZE * SIZE).flat_map(pixel).collect()
    };
    for frame in 0..FRAMES {
        let inside = move |x: usize, y: usize| (frame..frame + 4).contains(&x) && (8..12).contains(&y);
        frames.push(picture(&inside));
        masks.push((0..SIZE * SIZE).map(|i| u8::from(inside(i % SIZE, i / SIZE))).collect());
    }
    let (image, background) = (frames[0].clone(), picture(&|_, _| false));
    Driving { size: (SIZE as u32, SIZE as u32), frames, masks, image, background }
}

fn settings(act: Act) -> Settings {
    Settings {
        act,
        steps: Some(5),
        tau: StepIndex(3),
        iterations: 2,
        gamma: 0.2,
        beta: None,
        sde: Sde::EulerMaruyama,
        solver: Solver::Euler,
        start: Start::Inversion,
        pool: if act == Act::Animate { Pool::Any } else { Pool::All },
        reach: 0,
        guidance: None,
        inversion_guidance: 1.0,
        embeddings: [None, None],
        continuation: Continuation::LastFrame,
        noise: Noise::Chunk,
        seed: SEED,
    }
}

fn tensor(frames: &[&Vec<u8>]) -> Tensor {
    let n = frames.len();
    let at = |i: usize| {
        let (pixel, frame, channel) = (i % (SIZE * SIZE), i / (SIZE * SIZE) % n, i / (SIZE * SIZE) / n);
        f32::from(frames[frame][3 * pixel + channel]) / 255.0
    };
    Tensor { shape: vec![3, n, SIZE, SIZE], data: (0..3 * n * SIZE * SIZE).map(at).collect() }
}

/// Algorithm 1 over the network, in f64 between its calls. 9 frames are 3 latents of 2 × 2 cells.
fn by_hand(model: &mut Model, d: &Driving, act: Act) -> Tensor {
    let all: Vec<&Vec<u8>> = d.frames.iter().collect();
    let z = model.encode(&tensor(&all), &NEVER).unwrap();
    let clean = model.encode(&tensor(&[&d.image]), &NEVER).unwrap();
    let still = model.encode(&tensor(&[&d.background; FRAMES]), &NEVER).unwrap();
    let grid = Grid { frames: 3, height: 2, width: 2 };
    let inputs = model.condition(Conditioning::on_image(grid, clean), &NEVER).unwrap();
    // Latent 0 is frame 0, 1 is frames 1–4, 2 is frames 5–8; a cell is 8 × 8 pixels.
    let mask: Vec<f64> = (0..12)
        .map(|cell| {
            let (k, row, column) = (cell / 4, cell / 2 % 2, cell % 2);
            let frames = if k == 0 { 0..1 } else { 4 * k - 3..4 * k + 1 };
            let mut pixels = frames
                .flat_map(|f| (0..64).map(move |p| (f, p)))
                .map(|(f, p)| d.masks[f][(8 * row + p / 8) * SIZE + 8 * column + p % 8] == 1);
            f64::from(u8::from(if act == Act::Animate { pixels.any(|m| m) } else { pixels.all(|m| m) }))
        })
        .collect();
    let sigma = |i: usize| 2.3 * (i as f64 / 5.0) / (1.0 + 1.3 * (i as f64 / 5.0));
    let mut v = |x: &[f64], s: f64| -> Vec<f64> {
        let x: Vec<f32> = x.iter().map(|x| *x as f32).collect();
        let mut p = Vec::new();
        model.evaluate(&inputs, &x, Sigma::new(s).unwrap(), Branch::Conditional, &mut p, &NEVER).unwrap();
        p.iter().map(|p| -f64::from(*p)).collect()
    };
    let noise = |which: u32, n: u32, i: usize| normals([5, 1], which, n, (i / 4) as u32)[i % 4];
    let mut x: Vec<f64> = z.data.iter().map(|x| f64::from(*x)).collect();
    for t in 0..3 {
        let step = v(&x, sigma(t));
        x.iter_mut().zip(step).for_each(|(x, v)| *x -= (sigma(t + 1) - sigma(t)) * v);
    }
    let tau = sigma(3);
    let base = if act == Act::Animate { &still } else { &z };
    for (i, x) in x.iter_mut().enumerate() {
        let noisy = (1.0 - tau) * f64::from(base.data[i]) + tau * noise(0, 0, i);
        *x = mask[i % 12] * *x + (1.0 - mask[i % 12]) * noisy;
    }
    for n in 0..2 {
        let w = v(&x, tau);
        for (i, x) in x.iter_mut().enumerate() {
            let hat = (1.0 - 0.2 / tau) * *x + (1.0 - tau) / tau * 0.2 * w[i] + 0.4f64.sqrt() * noise(1, n, i);
            let moves = if act == Act::Animate { mask[i % 12] } else { 1.0 - mask[i % 12] };
            *x = moves * hat + (1.0 - moves) * *x;
        }
    }
    for t in (1..=3).rev() {
        let step = v(&x, sigma(t));
        x.iter_mut().zip(step).for_each(|(x, v)| *x += (sigma(t) - sigma(t - 1)) * v);
    }
    let latent = Tensor { shape: z.shape, data: x.iter().map(|x| *x as f32).collect() };
    model.decode(&latent, &NEVER).unwrap()
}

fn difference(frames: &[Vec<u8>], decoded: &Tensor) -> f64 {
    let pixels = SIZE * SIZE;
    let mut worst = 0.0f64;
    for (f, frame) in frames.iter().enumerate() {
        for (i, byte) in frame.iter().enumerate() {
            let value = decoded.data[(i % 3 * FRAMES + f) * pixels + i / 3];
            worst = worst.max((f64::from(*byte) - 255.0 * f64::from(value)).abs());
        }
    }
    worst
}

#[test]
fn a_clip_through_the_network_is_the_papers_algorithm() {
    let gpu = device::gpu();
    let (mut model, driving, interrupt) = (model(), driving(), Interrupt::default());
    for act in [Act::Animate, Act::Reconstruct] {
        let settings = settings(act);
        let clip = Clip::new(&gpu, &mut model, &driving, &settings, &interrupt);
        let (frames, report) = clip.make(&[], None, &mut Silent).unwrap();
        assert_eq!((frames.len(), report.chunks.len()), (FRAMES, 1));
        let want = by_hand(&mut model, &driving, act);
        // Half a byte of rounding, and f32 latents through the decoder.
        let apart = difference(&frames, &want);
        assert!(apart < 0.6, "{act:?}: {apart} of 255");
        // The other act is another picture.
        let other = if act == Act::Animate { Act::Reconstruct } else { Act::Animate };
        assert!(difference(&frames, &by_hand(&mut model, &driving, other)) > 5.0);
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}
