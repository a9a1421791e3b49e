//! Noise is normal, independent of other noise, and depends on nothing but its numbers.

use physvideo_gpu::kernels::{SdeStep, latent};
use physvideo_gpu::{Constants, Groups, Recording};
use physvideo_tests::device;

use super::{COUNT, Noise, SEED, silent};

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
