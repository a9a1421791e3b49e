//! Damaged files, files of another kind and things that are no files: read or refused, never a panic.

mod io_fixtures;

use std::path::Path;

use physvideo_app::io::ReadError;
use physvideo_app::io::read::*;

/// All readers by name; each says whether it took the file.
#[allow(clippy::type_complexity)]
const READERS: [(&str, fn(&Path) -> Result<(), ReadError>); 5] = [
    ("read_color_image", |p| read_color_image(p).map(drop)),
    ("read_label_image", |p| read_label_image(p).map(drop)),
    ("read_scalar_map", |p| read_scalar_map(p).map(drop)),
    ("read_points", |p| read_points(p).map(drop)),
    ("read_mesh", |p| read_mesh(p).map(drop)),
];

/// xorshift64*: the same damage on every run.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) as usize % n
    }
}

/// Readers that take a sound file.
fn takers(path: &Path) -> Vec<usize> {
    (0..READERS.len()).filter(|&i| READERS[i].1(path).is_ok()).collect()
}

#[test]
fn every_sound_file_has_a_reader_and_others_refuse_it() {
    let dir = tempfile::tempdir().unwrap();
    let files = io_fixtures::all(dir.path());
    assert_eq!(files.len(), 14);
    for file in files {
        let taken = takers(&file);
        let most = if file.extension().unwrap() == "png" { 3 } else { 1 };
        assert!(!taken.is_empty() && taken.len() <= most, "{} taken by {taken:?}", file.display());
    }
}

#[test]
fn cut_files_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let cut_path = dir.path().join("cut");
    for file in io_fixtures::all(dir.path()) {
        let bytes = std::fs::read(&file).unwrap();
        let readers = takers(&file);
        let mut refused = 0;
        for length in 0..bytes.len() {
            std::fs::write(&cut_path, &bytes[..length]).unwrap();
            for &i in &readers {
                refused += usize::from(READERS[i].1(&cut_path).is_err());
            }
        }
        let attempts = readers.len() * bytes.len();
        // Text may end early without losing meaning (an OBJ between lines), and so may what nobody reads (a PLY's faces,
        // the padding of a JPEG). Binary data that is needed may not.
        let least = match file.extension().unwrap().to_str().unwrap() {
            "obj" => attempts / 2,
            "ply" | "jpg" | "png" => attempts * 9 / 10,
            _ => attempts,
        };
        assert!(refused >= least, "{}: {refused} of {attempts} cuts refused", file.display());
    }
}

#[test]
fn flipped_bytes_never_panic() {
    let dir = tempfile::tempdir().unwrap();
    let damaged = dir.path().join("damaged");
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for file in io_fixtures::all(dir.path()) {
        let bytes = std::fs::read(&file).unwrap();
        for round in 0..600 {
            let mut bytes = bytes.clone();
            for _ in 0..1 + round % 3 {
                let at = random.below(bytes.len());
                // Single bits, and the values that make numbers large or negative.
                bytes[at] = match random.below(4) {
                    0 => 0xff,
                    1 => 0x00,
                    2 => b'9',
                    _ => bytes[at] ^ (1 << random.below(8)),
                };
            }
            std::fs::write(&damaged, &bytes).unwrap();
            for (name, read) in READERS {
                if let Err(e) = read(&damaged) {
                    assert!(!e.to_string().contains('\n'), "{name}: {e}");
                }
            }
        }
    }
}

#[test]
fn what_is_no_file_is_said_to_be_so() {
    let dir = tempfile::tempdir().unwrap();
    let file = io_fixtures::write(dir.path(), "file.png", "");
    for (name, read) in READERS {
        let missing = read(&dir.path().join("nothing.png")).unwrap_err();
        assert!(matches!(missing, ReadError::Missing { .. }), "{name}: {missing}");
        let through = read(&file.join("nothing.png")).unwrap_err();
        assert!(matches!(through, ReadError::Missing { .. }), "{name}: {through}");
        let folder = read(dir.path()).unwrap_err();
        assert!(matches!(folder, ReadError::Folder { .. }), "{name}: {folder}");
        let empty = read(&file).unwrap_err();
        assert!(matches!(empty, ReadError::Format { .. } | ReadError::Content { .. }), "{name}: {empty}");
        #[cfg(unix)]
        {
            let device = read(Path::new("/dev/zero")).unwrap_err();
            assert!(matches!(device, ReadError::Format { .. }), "{name}: {device}");
        }
    }
}
