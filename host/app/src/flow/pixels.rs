//! Frames and masks of a driving video at the network's size. Knows no files and no latents.

use image::imageops::{FilterType, resize};
use image::{ImageBuffer, Rgb};
use physvideo::scene::Pool;
use physvideo_net::Tensor;

/// A picture, sRGB, 3 bytes a pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pixels {
    /// Width and height [px].
    pub size: (u32, u32),
    /// Rows from the top.
    pub rgb: Vec<u8>,
}

impl Pixels {
    /// Scaled to another size; the same size is the same picture.
    pub fn scaled(&self, size: (u32, u32)) -> Self {
        if size == self.size {
            return self.clone();
        }
        let picture: Option<ImageBuffer<Rgb<u8>, Vec<u8>>> =
            ImageBuffer::from_raw(self.size.0, self.size.1, self.rgb.clone());
        // A filter as wide as the step: what shrinks is averaged.
        let rgb = picture.map_or_else(Vec::new, |p| resize(&p, size.0, size.1, FilterType::Triangle).into_raw());
        Self { size, rgb }
    }
}

/// A mask (0 outside) scaled by a rule: a pixel belongs to it when `pool` says so of the pixels it covers.
pub fn scale_mask(mask: &[u8], from: (u32, u32), to: (u32, u32), pool: Pool) -> Vec<u8> {
    if from == to {
        return mask.iter().map(|m| u8::from(*m != 0)).collect();
    }
    let span = |i: u32, from: u32, to: u32| {
        let (from, to, i) = (u64::from(from), u64::from(to), u64::from(i));
        let begin = i * from / to;
        (begin, ((i + 1) * from).div_ceil(to).max(begin + 1).min(from))
    };
    let mut out = Vec::with_capacity(to.0 as usize * to.1 as usize);
    for y in 0..to.1 {
        let (top, bottom) = span(y, from.1, to.1);
        for x in 0..to.0 {
            let (left, right) = span(x, from.0, to.0);
            let rows = (top..bottom).map(|v| &mask[(v * u64::from(from.0)) as usize..]);
            let inside: u64 =
                rows.map(|row| row[left as usize..right as usize].iter().filter(|m| **m != 0).count() as u64).sum();
            let all = (bottom - top) * (right - left);
            out.push(u8::from(match pool {
                Pool::Any => inside > 0,
                Pool::All => inside == all,
                Pool::Share => 2 * inside > all,
            }));
        }
    }
    out
}

/// A driving video at the network's size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Driving {
    /// Width and height [px].
    pub size: (u32, u32),
    /// Frames, sRGB, 3 bytes a pixel.
    pub frames: Vec<Vec<u8>>,
    /// 1 where a frame guides, a byte a pixel.
    pub masks: Vec<Vec<u8>>,
    /// The image to be consistent with.
    pub image: Vec<u8>,
    /// What is behind the moving things.
    pub background: Vec<u8>,
}

/// Pictures as the tensor [3, F, H, W] of colours from 0 to 1.
pub fn to_tensor(size: (u32, u32), frames: &[&[u8]]) -> Tensor {
    let pixels = size.0 as usize * size.1 as usize;
    let mut data = vec![0.0; 3 * frames.len() * pixels];
    for (f, frame) in frames.iter().enumerate() {
        for channel in 0..3 {
            let plane = &mut data[(channel * frames.len() + f) * pixels..][..pixels];
            for (value, byte) in plane.iter_mut().zip(frame.iter().skip(channel).step_by(3)) {
                *value = f32::from(*byte) / 255.0;
            }
        }
    }
    Tensor { shape: vec![3, frames.len(), size.1 as usize, size.0 as usize], data }
}

/// The pictures of a tensor [3, F, H, W].
pub fn from_tensor(tensor: &Tensor) -> Vec<Vec<u8>> {
    let [_, frames, height, width] = tensor.shape[..] else { return Vec::new() };
    let pixels = width * height;
    (0..frames)
        .map(|f| {
            let channel = |c: usize| &tensor.data[(c * frames + f) * pixels..][..pixels];
            let (r, g, b) = (channel(0), channel(1), channel(2));
            (0..pixels).flat_map(|i| [r[i], g[i], b[i]].map(|v| (v.clamp(0.0, 1.0) * 255.0).round() as u8)).collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_go_to_tensors_and_back() {
        let frames: Vec<Vec<u8>> = (0..3u8).map(|f| (0..24).map(|i| 10 * f + 7 * i).collect()).collect();
        let views: Vec<&[u8]> = frames.iter().map(Vec::as_slice).collect();
        let tensor = to_tensor((4, 2), &views);
        assert_eq!(tensor.shape, [3, 3, 2, 4]);
        // Channel 1 of frame 2 at pixel 0.
        assert_eq!(tensor.data[(3 + 2) * 8], f32::from(frames[2][1]) / 255.0);
        assert_eq!(from_tensor(&tensor), frames);
    }

    #[test]
    fn masks_shrink_by_their_rule() {
        let mask = [1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 1];
        let scaled = |pool| scale_mask(&mask, (4, 3), (2, 1), pool);
        assert_eq!(scaled(Pool::Any), [1, 1]);
        assert_eq!(scaled(Pool::All), [0, 0]);
        assert_eq!(scaled(Pool::Share), [1, 0]);
        assert_eq!(scale_mask(&mask, (4, 3), (8, 6), Pool::All)[..3], [1, 1, 0]);
    }

    #[test]
    fn a_picture_of_one_colour_keeps_it_at_any_size() {
        let p = Pixels { size: (7, 5), rgb: [40, 90, 200].repeat(35) };
        for size in [(3, 2), (7, 5), (16, 8)] {
            let scaled = p.scaled(size);
            assert!(scaled.size == size && scaled.rgb == [40, 90, 200].repeat((size.0 * size.1) as usize));
        }
    }
}
