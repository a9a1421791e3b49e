//! Enough of an MP4 player to check one: boxes, samples, decoding, colour description.

use std::fs;
use std::path::Path;

use openh264::decoder::Decoder;
use openh264::formats::YUVSource;

/// A box of an MP4: its kind and what is in it.
pub struct Box4<'a> {
    pub kind: [u8; 4],
    pub at: usize,
    pub body: &'a [u8],
}

pub fn be32(bytes: &[u8], at: usize) -> usize {
    u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()) as usize
}

pub fn boxes(bytes: &[u8]) -> Vec<Box4<'_>> {
    let (mut at, mut found) = (0, Vec::new());
    while at < bytes.len() {
        let length = be32(bytes, at);
        assert!(length >= 8 && at + length <= bytes.len(), "box of {length} bytes at {at}");
        found.push(Box4 { kind: bytes[at + 4..at + 8].try_into().unwrap(), at, body: &bytes[at + 8..at + length] });
        at += length;
    }
    found
}

pub fn inside<'a>(bytes: &'a [u8], path: &[&[u8; 4]]) -> &'a [u8] {
    path.iter().fold(bytes, |bytes, kind| {
        let found = boxes(bytes).into_iter().find(|b| &b.kind == *kind);
        found.unwrap_or_else(|| panic!("no box {}", String::from_utf8_lossy(*kind))).body
    })
}

/// A movie as a player finds its way through it.
pub struct Movie {
    pub bytes: Vec<u8>,
}

impl Movie {
    pub fn open(path: &Path) -> Self {
        Self { bytes: fs::read(path).unwrap() }
    }
    pub fn stbl(&self, kind: &[u8; 4]) -> &[u8] {
        inside(&self.bytes, &[b"moov", b"trak", b"mdia", b"minf", b"stbl", kind])
    }
    /// The entry `avc1`: width, height and what follows its fixed part.
    pub fn avc1(&self) -> (usize, usize, &[u8]) {
        let entry = &boxes(&self.stbl(b"stsd")[8..])[0];
        assert_eq!(&entry.kind, b"avc1");
        let size = be32(entry.body, 24);
        (size >> 16, size & 0xffff, inside(&entry.body[78..], &[b"avcC"]))
    }
    /// Durations of all frames, and the clock they count [1/s].
    pub fn durations(&self) -> (Vec<usize>, usize) {
        let stts = self.stbl(b"stts");
        let runs = (0..be32(stts, 4)).map(|i| (be32(stts, 8 + 8 * i), be32(stts, 12 + 8 * i)));
        let clock = be32(inside(&self.bytes, &[b"moov", b"trak", b"mdia", b"mdhd"]), 12);
        (runs.flat_map(|(n, d)| std::iter::repeat_n(d, n)).collect(), clock)
    }
    /// Frames as a player finds them: sizes from stsz, places from stco and stsc.
    pub fn samples(&self) -> Vec<&[u8]> {
        let (stsz, stco, stsc) = (self.stbl(b"stsz"), self.stbl(b"stco"), self.stbl(b"stsc"));
        let count = be32(stsz, 8);
        let mut samples = Vec::new();
        for chunk in 0..be32(stco, 4) {
            let run = (0..be32(stsc, 4)).rev().find(|&r| be32(stsc, 8 + 12 * r) <= chunk + 1).unwrap();
            let mut at = be32(stco, 8 + 4 * chunk);
            for _ in 0..be32(stsc, 12 + 12 * run) {
                let size = match be32(stsz, 4) {
                    0 => be32(stsz, 12 + 4 * samples.len()),
                    all => all,
                };
                samples.push(&self.bytes[at..at + size]);
                at += size;
            }
        }
        assert_eq!(samples.len(), count);
        samples
    }
    pub fn sps(&self) -> &[u8] {
        let avcc = self.avc1().2;
        &avcc[8..8 + usize::from(u16::from_be_bytes([avcc[6], avcc[7]]))]
    }
    pub fn pps(&self) -> &[u8] {
        let rest = &self.avc1().2[8 + self.sps().len()..];
        &rest[3..3 + usize::from(u16::from_be_bytes([rest[1], rest[2]]))]
    }
    /// All frames as RGB, by BT.709 limited range in f64.
    pub fn decode(&self) -> Vec<Vec<u8>> {
        let mut decoder = Decoder::new().unwrap();
        let start = [0, 0, 0, 1];
        let mut stream = [&start, self.sps(), &start, self.pps()].concat();
        let mut frames = Vec::new();
        for sample in self.samples() {
            let mut at = 0;
            while at < sample.len() {
                let length = be32(sample, at);
                stream.extend(start);
                stream.extend(&sample[at + 4..at + 4 + length]);
                at += 4 + length;
            }
            frames.extend(decoder.decode(&stream).unwrap().map(|yuv| rgb(&yuv)));
            stream.clear();
        }
        frames.extend(decoder.flush_remaining().unwrap().iter().map(rgb));
        frames
    }
}

fn rgb(yuv: &impl YUVSource) -> Vec<u8> {
    let ((width, height), (sy, su, sv)) = (yuv.dimensions(), yuv.strides());
    let mut out = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let l = (f64::from(yuv.y()[y * sy + x]) - 16.0) / 219.0;
            let u = (f64::from(yuv.u()[y / 2 * su + x / 2]) - 128.0) / 224.0;
            let v = (f64::from(yuv.v()[y / 2 * sv + x / 2]) - 128.0) / 224.0;
            let (r, b) = (l + 1.5748 * v, l + 1.8556 * u);
            let g = (l - 0.2126 * r - 0.0722 * b) / 0.7152;
            out.extend([r, g, b].map(|c| (c * 255.0).round().clamp(0.0, 255.0) as u8));
        }
    }
    out
}

/// Full range, and primaries, transfer and matrix, from a sequence parameter set (H.264 7.3.2.1.1 and annex E.1.1).
pub fn vui(sps: &[u8]) -> Option<(bool, [u32; 3])> {
    // Take out the bytes that keep start codes from appearing.
    let mut raw: Vec<u8> = Vec::new();
    for &b in &sps[1..] {
        if !(b == 3 && raw.ends_with(&[0, 0])) {
            raw.push(b);
        }
    }
    let mut bits = Bits { raw, at: 0 };
    let profile = bits.take(8);
    bits.take(16);
    bits.golomb();
    if [100, 110, 122, 244, 44, 83, 86, 118, 128].contains(&profile) {
        assert_eq!(bits.golomb(), 1, "4:2:0");
        bits.golomb();
        bits.golomb();
        bits.take(1);
        assert_eq!(bits.take(1), 0, "no scaling matrix");
    }
    bits.golomb();
    match bits.golomb() {
        0 => {
            bits.golomb();
        }
        kind => assert_eq!(kind, 2, "picture order"),
    }
    bits.golomb();
    bits.take(1);
    bits.golomb();
    bits.golomb();
    if bits.take(1) == 0 {
        bits.take(1);
    }
    bits.take(1);
    if bits.take(1) == 1 {
        for _ in 0..4 {
            bits.golomb();
        }
    }
    if bits.take(1) == 0 {
        return None;
    }
    if bits.take(1) == 1 && bits.take(8) == 255 {
        bits.take(32);
    }
    if bits.take(1) == 1 {
        bits.take(1);
    }
    if bits.take(1) == 0 {
        return None;
    }
    bits.take(3);
    let full = bits.take(1) == 1;
    (bits.take(1) == 1).then(|| (full, [bits.take(8), bits.take(8), bits.take(8)]))
}

struct Bits {
    raw: Vec<u8>,
    at: usize,
}

impl Bits {
    fn take(&mut self, count: usize) -> u32 {
        (0..count).fold(0, |value, _| {
            let bit = self.raw[self.at / 8] >> (7 - self.at % 8) & 1;
            self.at += 1;
            value << 1 | u32::from(bit)
        })
    }
    /// Unsigned exponential Golomb code.
    fn golomb(&mut self) -> u32 {
        let mut zeros = 0;
        while self.take(1) == 0 {
            zeros += 1;
        }
        (1 << zeros) - 1 + self.take(zeros)
    }
}
