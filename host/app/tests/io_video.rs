//! The video plays: its boxes are right, its pictures decode to what went in, its times are exact.

use std::fs;
use std::path::Path;

use openh264::decoder::Decoder;
use openh264::formats::YUVSource;
use physvideo_app::io::WriteError;
use physvideo_app::io::write::{EncoderThread, VideoWriter, write_png};

/// A box of an MP4: its kind and what is in it.
struct Box4<'a> {
    kind: [u8; 4],
    at: usize,
    body: &'a [u8],
}

fn be32(bytes: &[u8], at: usize) -> usize {
    u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()) as usize
}

fn boxes(bytes: &[u8]) -> Vec<Box4<'_>> {
    let (mut at, mut found) = (0, Vec::new());
    while at < bytes.len() {
        let length = be32(bytes, at);
        assert!(length >= 8 && at + length <= bytes.len(), "box of {length} bytes at {at}");
        found.push(Box4 { kind: bytes[at + 4..at + 8].try_into().unwrap(), at, body: &bytes[at + 8..at + length] });
        at += length;
    }
    found
}

fn inside<'a>(bytes: &'a [u8], path: &[&[u8; 4]]) -> &'a [u8] {
    path.iter().fold(bytes, |bytes, kind| {
        let found = boxes(bytes).into_iter().find(|b| &b.kind == *kind);
        found.unwrap_or_else(|| panic!("no box {}", String::from_utf8_lossy(*kind))).body
    })
}

struct Movie {
    bytes: Vec<u8>,
}

impl Movie {
    fn open(path: &Path) -> Self {
        Self { bytes: fs::read(path).unwrap() }
    }
    fn stbl(&self, kind: &[u8; 4]) -> &[u8] {
        inside(&self.bytes, &[b"moov", b"trak", b"mdia", b"minf", b"stbl", kind])
    }
    /// The entry `avc1`: width, height and what follows its fixed part.
    fn avc1(&self) -> (usize, usize, &[u8]) {
        let entry = &boxes(&self.stbl(b"stsd")[8..])[0];
        assert_eq!(&entry.kind, b"avc1");
        let size = be32(entry.body, 24);
        (size >> 16, size & 0xffff, inside(&entry.body[78..], &[b"avcC"]))
    }
    /// Durations of all frames, and the clock they count [1/s].
    fn durations(&self) -> (Vec<usize>, usize) {
        let stts = self.stbl(b"stts");
        let runs = (0..be32(stts, 4)).map(|i| (be32(stts, 8 + 8 * i), be32(stts, 12 + 8 * i)));
        let clock = be32(inside(&self.bytes, &[b"moov", b"trak", b"mdia", b"mdhd"]), 12);
        (runs.flat_map(|(n, d)| std::iter::repeat_n(d, n)).collect(), clock)
    }
    /// Frames as a player finds them: sizes from stsz, places from stco and stsc.
    fn samples(&self) -> Vec<&[u8]> {
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
    fn sps(&self) -> &[u8] {
        let avcc = self.avc1().2;
        &avcc[8..8 + usize::from(u16::from_be_bytes([avcc[6], avcc[7]]))]
    }
    fn pps(&self) -> &[u8] {
        let rest = &self.avc1().2[8 + self.sps().len()..];
        &rest[3..3 + usize::from(u16::from_be_bytes([rest[1], rest[2]]))]
    }
    /// All frames as RGB, by BT.709 limited range in f64.
    fn decode(&self) -> Vec<Vec<u8>> {
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

fn psnr(a: &[u8], b: &[u8]) -> f64 {
    assert_eq!(a.len(), b.len());
    let sum: f64 = a.iter().zip(b).map(|(&a, &b)| (f64::from(a) - f64::from(b)).powi(2)).sum();
    10.0 * (255.0f64.powi(2) / (sum / a.len() as f64)).log10()
}

/// A smooth picture that moves.
fn picture(width: u32, height: u32, frame: u32) -> Vec<u8> {
    let wave = |v: f64| (127.5 + 100.0 * v.sin()) as u8;
    let t = f64::from(frame) * 0.1;
    (0..height)
        .flat_map(|y| (0..width).map(move |x| (f64::from(x), f64::from(y))))
        .flat_map(|(x, y)| [wave(x / 17.0 + t), wave(y / 23.0 - t), wave((x + y) / 31.0 + 2.0 * t)])
        .collect()
}

fn encode(path: &Path, width: u32, height: u32, fps: f64, frames: &[Vec<u8>]) {
    let mut video = VideoWriter::new(path, width, height, fps).unwrap();
    frames.iter().for_each(|f| video.push(f).unwrap());
    let summary = video.finish().unwrap();
    assert_eq!(summary.frames, frames.len() as u64);
    assert_eq!((summary.width % 2, summary.height % 2), (0, 0));
}

#[test]
fn a_clip_decodes_to_what_went_in() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("video.mp4");
    let (width, height) = (160, 120);
    let frames: Vec<_> = (0..60).map(|i| picture(width, height, i)).collect();
    encode(&path, width, height, 24.0, &frames);
    let movie = Movie::open(&path);

    let top = boxes(&movie.bytes);
    let kinds: Vec<_> = top.iter().map(|b| b.kind).collect();
    assert_eq!(kinds, [*b"ftyp", *b"moov", *b"mdat"], "the index comes before the data");
    assert!(top[2].at > top[1].at);
    assert_eq!((movie.avc1().0, movie.avc1().1), (160, 120));
    assert_eq!(movie.durations(), (vec![3750; 60], 90_000));
    // Movie duration in its own clock: 60 / 24 s.
    let mvhd = inside(&movie.bytes, &[b"moov", b"mvhd"]);
    assert_eq!(be32(mvhd, 16) * 1000, 2500 * be32(mvhd, 12));
    // Key frames: the first, and one every two seconds.
    let stss = movie.stbl(b"stss");
    let keys: Vec<_> = (0..be32(stss, 4)).map(|i| be32(stss, 8 + 4 * i)).collect();
    assert_eq!(keys, [1, 49]);

    let decoded = movie.decode();
    assert_eq!(decoded.len(), frames.len());
    // 4:2:0 in 8 bits alone leaves about 45 dB here; the quantiser costs the rest.
    let worst = frames.iter().zip(&decoded).map(|(a, b)| psnr(a, b)).fold(f64::INFINITY, f64::min);
    println!("worst PSNR {worst:.1} dB, {} bytes", movie.bytes.len());
    assert!(worst > 35.0, "worst PSNR {worst}");
    // Frames are in order: each is nearest to itself.
    assert!(psnr(&frames[20], &decoded[20]) > psnr(&frames[21], &decoded[20]) + 3.0);

    let again = dir.path().join("again.mp4");
    encode(&again, width, height, 24.0, &frames);
    assert!(fs::read(&again).unwrap() == movie.bytes, "the same frames give the same bytes");
}

#[test]
fn colours_are_right_and_said_to_be_bt709() {
    let dir = tempfile::tempdir().unwrap();
    for color in [[255u8, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255], [0, 0, 0], [200, 120, 40]] {
        let path = dir.path().join("flat.mp4");
        let frames = vec![color.repeat(64 * 48); 3];
        encode(&path, 64, 48, 24.0, &frames);
        let movie = Movie::open(&path);
        for decoded in movie.decode() {
            let worst = decoded.iter().zip(&frames[0]).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
            // Half a step of 8-bit chroma is 255/224/2 · 1.86 = 1.1; the quantiser adds about as much again. The wrong matrix
            // (BT.601) is off by 20 and more, the wrong range by 16.
            assert!(worst <= 4, "{color:?} came back off by {worst}");
        }
        assert_eq!(vui(movie.sps()), Some((false, [1, 1, 1])), "limited range, BT.709 thrice");
    }
}

#[test]
fn odd_sizes_grow_by_a_copy_of_the_edge() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("odd.mp4");
    let frames: Vec<_> = (0..3).map(|i| picture(101, 67, i)).collect();
    encode(&path, 101, 67, 25.0, &frames);
    let movie = Movie::open(&path);
    assert_eq!((movie.avc1().0, movie.avc1().1), (102, 68));
    let decoded = &movie.decode()[2];
    assert_eq!(decoded.len(), 102 * 68 * 3);
    let at = |x: usize, y: usize| &decoded[3 * (y * 102 + x)..][..3];
    let original = |x: usize, y: usize| &frames[2][3 * (y * 101 + x)..][..3];
    for y in [0, 30, 66] {
        for (a, b) in at(101, y).iter().zip(original(100, y)) {
            assert!(a.abs_diff(*b) < 12, "the new column: {a} for {b}");
        }
    }
    let inner: Vec<u8> = (0..67).flat_map(|y| decoded[3 * 102 * y..][..3 * 101].to_vec()).collect();
    let db = psnr(&frames[2], &inner);
    assert!(db > 35.0, "{db}");
}

#[test]
fn times_are_exact_at_any_rate() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("rate.mp4");
    let frame = picture(32, 32, 0);
    for fps in [12.5, 30000.0 / 1001.0, 23.976, 29.97, 7.0, 60.0, 144.0, 1.0] {
        encode(&path, 32, 32, fps, &vec![frame.clone(); 41]);
        let (durations, clock) = Movie::open(&path).durations();
        assert_eq!(durations.len(), 41);
        let mut begins = 0;
        for (i, duration) in durations.iter().enumerate() {
            // Never off by more than half a tick of the clock: nothing adds up.
            let exact = i as f64 / fps * clock as f64;
            assert!((begins as f64 - exact).abs() <= 0.5 + 1e-6, "frame {i} at {fps}: {begins} for {exact}");
            begins += duration;
        }
        assert!((begins as f64 - 41.0 / fps * clock as f64).abs() <= 1.5, "length at {fps}");
    }
}

#[test]
fn a_single_frame_lasts_its_time() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("one.mp4");
    encode(&path, 32, 32, 24.0, &[picture(32, 32, 0)]);
    let movie = Movie::open(&path);
    // As two pictures of half the time.
    assert_eq!(movie.durations(), (vec![1875; 2], 90_000));
    assert_eq!(movie.decode().len(), 2);
}

#[test]
fn what_cannot_be_a_video_is_refused_and_leaves_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("video.mp4");
    let empty = VideoWriter::new(&path, 32, 32, 24.0).unwrap().finish().unwrap_err();
    assert!(matches!(empty, WriteError::EmptyClip { .. }), "{empty}");
    assert!(empty.to_string().contains("no frames"), "{empty}");
    for (width, height, fps) in
        [(0, 32, 24.0), (8, 32, 24.0), (4000, 32, 24.0), (3000, 3000, 24.0), (32, 32, 0.0), (32, 32, f64::NAN)]
    {
        let error = VideoWriter::new(&path, width, height, fps).map(drop).unwrap_err();
        assert!(matches!(error, WriteError::VideoLimit { .. }), "{error}");
    }
    let mut video = VideoWriter::new(&path, 32, 32, 24.0).unwrap();
    assert!(matches!(video.push(&[0; 5]), Err(WriteError::Shape { .. })));
    drop(video);
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
}

#[test]
fn the_least_and_a_narrow_size_are_encoded() {
    let dir = tempfile::tempdir().unwrap();
    for (width, height) in [(16, 16), (17, 301)] {
        let path = dir.path().join("small.mp4");
        encode(&path, width, height, 24.0, &[picture(width, height, 0), picture(width, height, 1)]);
        assert_eq!(Movie::open(&path).decode().len(), 2);
    }
}

#[test]
fn the_thread_writes_what_the_writer_does() {
    let dir = tempfile::tempdir().unwrap();
    let (a, b) = (dir.path().join("a.mp4"), dir.path().join("b.mp4"));
    let frames: Vec<_> = (0..30).map(|i| picture(64, 48, i)).collect();
    encode(&a, 64, 48, 30.0, &frames);
    let mut thread = EncoderThread::spawn(&b, 64, 48, 30.0).unwrap();
    for frame in frames {
        thread.push(frame).unwrap();
    }
    assert!(!b.exists(), "whole or absent");
    assert_eq!(thread.finish().unwrap().seconds, 1.0);
    assert!(fs::read(&a).unwrap() == fs::read(&b).unwrap());
}

#[test]
fn the_threads_error_comes_back_and_frames_stay() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("video.mp4");
    let png = dir.path().join("frame.png");
    let frame = picture(32, 32, 0);
    write_png(&png, 32, 32, &frame).unwrap();

    let mut thread = EncoderThread::spawn(&path, 32, 32, 24.0).unwrap();
    thread.push(frame.clone()).unwrap();
    thread.push(vec![0; 7]).unwrap();
    let error = loop {
        // Taken while the thread has not yet come to the bad frame.
        match thread.push(frame.clone()) {
            Ok(()) => std::thread::yield_now(),
            Err(e) => break e,
        }
    };
    assert!(matches!(error, WriteError::Shape { .. }), "{error}");
    let after = thread.push(frame.clone()).unwrap_err();
    assert!(matches!(after, WriteError::Encoder { .. }), "{after}");
    assert!(thread.finish().is_err());

    let mut thread = EncoderThread::spawn(&path, 32, 32, 24.0).unwrap();
    thread.push(vec![0; 7]).unwrap();
    assert!(matches!(thread.finish(), Err(WriteError::Shape { .. })));
    let thread = EncoderThread::spawn(&path, 32, 32, 24.0).unwrap();
    assert!(matches!(thread.finish(), Err(WriteError::EmptyClip { .. })));
    let mut thread = EncoderThread::spawn(&path, 32, 32, 24.0).unwrap();
    thread.push(frame).unwrap();
    drop(thread);

    let left: Vec<_> = fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(left, [png]);
}

/// Full range, and primaries, transfer and matrix, from a sequence parameter set (H.264 7.3.2.1.1 and annex E.1.1).
fn vui(sps: &[u8]) -> Option<(bool, [u32; 3])> {
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
