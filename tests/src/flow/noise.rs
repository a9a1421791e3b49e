//! The noise of `lib/gaussian` in f64, from the generator's paper (Salmon et al. 2011, Philox4x32-10) with 64-bit
//! products and the library's logarithm and cosine.

use physvideo::stages::latent::NoiseKey;

fn philox(counter: [u32; 4], key: [u32; 2]) -> [u32; 4] {
    let halves = |a: u32, b: u32| {
        let p = u64::from(a) * u64::from(b);
        ((p >> 32) as u32, p as u32)
    };
    let (mut c, mut k) = (counter, key);
    for _ in 0..10 {
        let (high0, low0) = halves(0xd251_1f53, c[0]);
        let (high1, low1) = halves(0xcd9e_8d57, c[2]);
        c = [high1 ^ c[1] ^ k[0], low1, high0 ^ c[3] ^ k[1], low0];
        k = [k[0].wrapping_add(0x9e37_79b9), k[1].wrapping_add(0xbb67_ae85)];
    }
    c
}

/// The noise of an iteration, element by element.
pub fn normals(key: NoiseKey, iteration: u32, elements: usize) -> Vec<f64> {
    let unit = |x: u32| (f64::from(x) + 0.5) / 2f64.powi(32);
    let seed = [key.seed as u32, (key.seed >> 32) as u32];
    let mut all = Vec::with_capacity(elements + 3);
    for block in 0..elements.div_ceil(4) {
        let x = philox([block as u32, iteration, key.stream, 0], seed);
        for [a, b] in [[x[0], x[1]], [x[2], x[3]]] {
            let (sine, cosine) = (std::f64::consts::TAU * unit(b)).sin_cos();
            let length = (-2.0 * unit(a).ln()).sqrt();
            all.extend([length * cosine, length * sine]);
        }
    }
    all.truncate(elements);
    all
}

#[cfg(test)]
mod tests {
    /// Known answers of the authors' Random123 (kat_vectors, philox4x32 with 10 rounds).
    #[test]
    fn philox_gives_the_published_words() {
        assert_eq!(super::philox([0; 4], [0; 2]), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
        assert_eq!(super::philox([u32::MAX; 4], [u32::MAX; 2]), [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]);
    }
}
