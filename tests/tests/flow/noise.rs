//! 11: the device's noise is Gaussian, new in every iteration, and the same whatever the size of the latent.

use physvideo::stages::latent::NoiseKey;
use physvideo_gpu::Gpu;
use physvideo_tests::device;
use physvideo_tests::flow::noise::normals;
use physvideo_tests::flow::run::{Lab, PLAIN};

use super::CHAIN;

const NUMBERS: usize = 1 << 18;

fn noise(gpu: &Gpu, numbers: usize, key: NoiseKey, iteration: u32) -> Vec<f32> {
    let lab = Lab::plain(gpu, numbers).unwrap();
    lab.space.set(&vec![0.0; numbers]).unwrap();
    lab.space.predict(&vec![0.0; numbers], None).unwrap();
    let step = physvideo::flow::SdeStep { a: 0.0, b: 0.0, m: 0.0, s0: 1.0, s1: 0.0 };
    lab.space.sde_step(step, iteration, PLAIN, key).unwrap();
    lab.space.get().unwrap()
}

/// Φ, by Simpson's rule from 0.
fn normal_below(x: f64) -> f64 {
    let (n, density) = (64, |t: f64| (-0.5 * t * t).exp() / std::f64::consts::TAU.sqrt());
    let h = x / f64::from(n);
    let sum: f64 =
        (0..n).map(|i| f64::from(i) * h).map(|t| density(t) + 4.0 * density(t + 0.5 * h) + density(t + h)).sum();
    0.5 + sum * h / 6.0
}

#[test]
fn noise_is_gaussian_and_new_every_time() {
    let gpu = device::gpu();
    let n = NUMBERS as f64;
    let first = noise(&gpu, NUMBERS, CHAIN, 0);
    // Number by number that of f64: f32 of a logarithm, a root and a cosine of at most 6.8.
    for (a, b) in first.iter().zip(normals(CHAIN, 0, NUMBERS)) {
        assert!((f64::from(*a) - b).abs() < 4e-6, "{a} {b}");
    }
    // Moments of n standard Gaussians have variances 1, 2, 15, 96 (the last of x⁴) over n.
    let moment = |k: i32| first.iter().map(|x| f64::from(*x).powi(k)).sum::<f64>() / n;
    for (k, right, variance) in [(1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0f64)] {
        assert!((moment(k) - right).abs() < 4.0 * (variance / n).sqrt(), "moment {k}: {}", moment(k));
    }
    // Kolmogorov–Smirnov: √n D exceeds 2.23 once in 10,000.
    let mut sorted: Vec<f64> = first.iter().map(|x| f64::from(*x)).collect();
    sorted.sort_by(f64::total_cmp);
    let gap = sorted.iter().enumerate().fold(0.0, |d: f64, (i, x)| {
        let p = normal_below(*x);
        d.max(((i + 1) as f64 / n - p).max(p - i as f64 / n))
    });
    assert!(gap * n.sqrt() < 2.23, "Kolmogorov-Smirnov: {}", gap * n.sqrt());
    // No correlation with other iterations, streams, seeds, or neighbours.
    let product = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum::<f64>() / n;
    let others = [
        (CHAIN, 1),
        (CHAIN, 2),
        (NoiseKey { stream: CHAIN.stream + 1, ..CHAIN }, 0),
        (NoiseKey { seed: CHAIN.seed + 1, ..CHAIN }, 0),
    ];
    for (key, iteration) in others {
        let other = noise(&gpu, NUMBERS, key, iteration);
        assert!(product(&first, &other).abs() < 4.0 / n.sqrt(), "{key:?}, iteration {iteration}");
    }
    for lag in [1, 2, 3, 4, 64, 256] {
        assert!(product(&first, &first[lag..]).abs() < 4.0 / n.sqrt(), "numbers {lag} apart");
    }
    // Control: the same key gives the same bits, in a latent of another size.
    assert_eq!(noise(&gpu, 4096, CHAIN, 0), first[..4096]);
}
