//! Masks of a clip that does not fit the device at once are pooled stretch by stretch, with the same weights.

use physvideo::scene::Pool;
use physvideo::stages::latent::mask::{Pooling, pool, pooling_bytes};
use physvideo_tests::device;

/// 45 frames of 512 × 512 are 45 MiB as words, and at most 32 go to the device: two stretches, the second cut short.
#[test]
fn long_clips_are_pooled_in_stretches() {
    let gpu = device::gpu();
    let (size, frames) = (512usize, 45usize);
    // A square of one cell that moves down by a cell a frame.
    let covered = |f: usize, x: usize, y: usize| x / 8 == 5 && y / 8 == f;
    let masks: Vec<u8> =
        (0..frames).flat_map(|f| (0..size * size).map(move |i| u8::from(covered(f, i % size, i / size)))).collect();
    for (first, kind) in [(true, Pool::Any), (false, Pool::Any), (true, Pool::Share)] {
        let pooling = Pooling {
            size: (size as u32, size as u32),
            frames: frames as u32,
            spatial: 8,
            temporal: 4,
            pool: kind,
            reach: 0,
            first,
        };
        assert!(pooling_bytes(&pooling) < 40 << 20);
        let weights = pool(&gpu, &masks, pooling).unwrap();
        let latents = 11 + usize::from(first);
        assert_eq!(weights.len(), latents * 64 * 64);
        for (i, weight) in weights.iter().enumerate() {
            let (latent, y, x) = (i / 4096 + usize::from(!first), i / 64 % 64, i % 64);
            let span = if latent == 0 { 0..1 } else { 4 * latent - 3..4 * latent + 1 };
            let share = if kind == Pool::Share && latent > 0 { 0.25 } else { 1.0 };
            let want = if x == 5 && span.contains(&y) { share } else { 0.0 };
            assert_eq!(*weight, want, "latent {latent}, cell {x}, {y}");
        }
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}
