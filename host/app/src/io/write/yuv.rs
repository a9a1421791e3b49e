//! RGB to the planes a video encoder takes. Does not know which encoder.

use openh264::formats::YUVSource;

/// An image as 8-bit YUV 4:2:0, BT.709, limited range. Odd sizes grow by one row or column, a copy of the last.
pub(super) struct Yuv420 {
    /// Even, as are the rows.
    width: usize,
    height: usize,
    y: Vec<u8>,
    u: Vec<u8>,
    v: Vec<u8>,
}

/// Fixed point, 16 fractional bits: exact to well under half a step and the same on every machine.
const fn fixed(value: f64) -> i32 {
    (value * 65536.0 + if value < 0.0 { -0.5 } else { 0.5 }) as i32
}
const KR: f64 = 0.2126;
const KB: f64 = 0.0722;
const KG: f64 = 1.0 - KR - KB;
/// Luma takes 16–235, chroma 16–240.
const LUMA: f64 = 219.0 / 255.0;
const CHROMA: f64 = 224.0 / 255.0;
const Y: [i32; 3] = [fixed(KR * LUMA), fixed(KG * LUMA), fixed(KB * LUMA)];
const U: [i32; 3] =
    [fixed(-KR / (2.0 * (1.0 - KB)) * CHROMA), fixed(-KG / (2.0 * (1.0 - KB)) * CHROMA), fixed(0.5 * CHROMA)];
const V: [i32; 3] =
    [fixed(0.5 * CHROMA), fixed(-KG / (2.0 * (1.0 - KR)) * CHROMA), fixed(-KB / (2.0 * (1.0 - KR)) * CHROMA)];

fn dot(c: [i32; 3], rgb: [i32; 3]) -> i32 {
    c[0] * rgb[0] + c[1] * rgb[1] + c[2] * rgb[2]
}

impl Yuv420 {
    /// Black planes for images of `width × height`.
    pub fn new(width: u32, height: u32) -> Self {
        let (width, height) = (width.next_multiple_of(2) as usize, height.next_multiple_of(2) as usize);
        let chroma = vec![128; width * height / 4];
        Self { width, height, y: vec![16; width * height], u: chroma.clone(), v: chroma }
    }

    /// Even width and height.
    pub fn size(&self) -> (u32, u32) {
        (self.width as u32, self.height as u32)
    }

    /// Converts an image of the size given to `new`. Chroma is the mean of 2 × 2 pixels.
    pub fn fill(&mut self, rgb: &[u8], width: u32, height: u32) {
        let (width, height) = (width as usize, height as usize);
        let at = |x: usize, y: usize| {
            let i = 3 * (y.min(height - 1) * width + x.min(width - 1));
            [i32::from(rgb[i]), i32::from(rgb[i + 1]), i32::from(rgb[i + 2])]
        };
        for row in (0..self.height).step_by(2) {
            for col in (0..self.width).step_by(2) {
                let mut sum = [0; 3];
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let pixel = at(col + dx, row + dy);
                    self.y[(row + dy) * self.width + col + dx] = (16 + ((dot(Y, pixel) + (1 << 15)) >> 16)) as u8;
                    for c in 0..3 {
                        sum[c] += pixel[c];
                    }
                }
                // Four pixels: two more fractional bits.
                let chroma = |c| (128 + ((dot(c, sum) + (1 << 17)) >> 18)) as u8;
                let i = row / 2 * (self.width / 2) + col / 2;
                self.u[i] = chroma(U);
                self.v[i] = chroma(V);
            }
        }
    }
}

impl YUVSource for Yuv420 {
    fn dimensions(&self) -> (usize, usize) {
        (self.width, self.height)
    }
    fn strides(&self) -> (usize, usize, usize) {
        (self.width, self.width / 2, self.width / 2)
    }
    fn y(&self) -> &[u8] {
        &self.y
    }
    fn u(&self) -> &[u8] {
        &self.u
    }
    fn v(&self) -> &[u8] {
        &self.v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn yuv(rgb: [u8; 3]) -> [u8; 3] {
        let mut planes = Yuv420::new(2, 2);
        planes.fill(&rgb.repeat(4), 2, 2);
        [planes.y[3], planes.u[0], planes.v[0]]
    }

    #[test]
    fn colours_are_those_of_bt709_limited_range() {
        // ITU-R BT.709-6 table 4, 8 bits: full-scale primaries.
        assert_eq!(yuv([0, 0, 0]), [16, 128, 128]);
        assert_eq!(yuv([255, 255, 255]), [235, 128, 128]);
        assert_eq!(yuv([255, 0, 0]), [63, 102, 240]);
        assert_eq!(yuv([0, 255, 0]), [173, 42, 26]);
        assert_eq!(yuv([0, 0, 255]), [32, 240, 118]);
    }

    #[test]
    fn odd_sizes_repeat_the_edge() {
        let mut planes = Yuv420::new(3, 1);
        planes.fill(&[0, 0, 0, 0, 0, 0, 255, 255, 255], 3, 1);
        assert_eq!(planes.size(), (4, 2));
        assert_eq!(planes.y, [16, 16, 235, 235, 16, 16, 235, 235]);
    }
}
