//! Latents [C, T, h, w] cut and joined along time. Knows nothing of what they mean.

use physvideo_net::Tensor;

/// Latents `range` along time of [C, T, h, w].
pub(super) fn slice(tensor: &Tensor, range: std::ops::Range<usize>) -> Tensor {
    let (frames, cells) = (tensor.shape[1], tensor.shape[2] * tensor.shape[3]);
    let data = tensor.data.chunks_exact(frames * cells);
    let data = data.flat_map(|c| c[range.start * cells..range.end * cells].iter().copied()).collect();
    Tensor { shape: vec![tensor.shape[0], range.len(), tensor.shape[2], tensor.shape[3]], data }
}

/// Two stretches of latents one after the other in time.
pub(super) fn join(a: &Tensor, b: &Tensor) -> Tensor {
    let size = |t: &Tensor| t.shape[1..].iter().product::<usize>();
    let pairs = a.data.chunks_exact(size(a)).zip(b.data.chunks_exact(size(b)));
    let data = pairs.flat_map(|(a, b)| a.iter().chain(b).copied()).collect();
    Tensor { shape: vec![a.shape[0], a.shape[1] + b.shape[1], a.shape[2], a.shape[3]], data }
}

/// Latent 0 becomes the clean image's.
pub(super) fn replace_first(latent: &mut Tensor, clean: &Tensor) {
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
