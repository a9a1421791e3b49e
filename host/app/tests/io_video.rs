//! The video plays: its boxes are right, its pictures decode to what went in, its times are exact.

mod io_mp4;

use std::fs;
use std::path::Path;

use io_mp4::{Movie, be32, boxes, inside, vui};
use physvideo_app::io::WriteError;
use physvideo_app::io::write::{EncoderThread, VideoWriter, write_png};

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
            // Half a step of 8-bit chroma is 255/224/2 · 1.86 = 1.1; the quantiser adds about as much again. The wrong
            // matrix (BT.601) is off by 20 and more, the wrong range by 16.
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
