//! Damaged files, files of another kind and things that are no files: read or refused, never a panic.

mod io_fixtures;

use std::path::Path;

use io_fixtures::{exr, npy_bytes, png_of, refusal, write};
use physvideo_app::io::ReadError;
use physvideo_app::io::read::*;

type Reader = fn(&Path) -> Result<(), ReadError>;

/// All readers by name; each says whether it took the file.
const READERS: [(&str, Reader); 5] = [
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
        // Text may end early without losing meaning (an OBJ between lines), and so may what nobody reads (a PLY's
        // faces). Binary data that is needed may not.
        let least = match file.extension().unwrap().to_str().unwrap() {
            "obj" => attempts / 2,
            "ply" | "png" => attempts * 9 / 10,
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

/// What a file announces is believed only as far as the file goes. Each of these would need more than all memory.
#[test]
fn huge_announcements_are_refused_before_allocation() {
    let dir = tempfile::tempdir().unwrap();
    let path = write(dir.path(), "huge.png", png_of(100_000, 100_000, 8, 2, &[&[0]]));
    assert!(refusal(&path, read_color_image(&path)).contains("100000 × 100000"));
    let path = write(dir.path(), "huge_grey.png", png_of(100_000, 100_000, 8, 0, &[&[0]]));
    assert!(refusal(&path, read_label_image(&path)).contains("100000 × 100000"));
    assert!(refusal(&path, read_scalar_map(&path)).contains("100000 × 100000"));

    let path = write(dir.path(), "huge.pfm", "Pf\n4000000000 4000000000\n-1\n");
    assert!(refusal(&path, read_scalar_map(&path)).contains("4000000000 × 4000000000"));
    // Allowed by the limit, but the bytes are not there.
    let path = write(dir.path(), "short.pfm", "Pf\n10000 10000\n-1\n....");
    assert!(refusal(&path, read_scalar_map(&path)).contains("4 of 400000000 bytes"));

    for shape in ["(1000000, 1000000)", "(18446744073709551615, 2)", "(4294967296, 4294967296)"] {
        let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
        let path = write(dir.path(), "huge.npy", npy_bytes(&header));
        assert!(refusal(&path, read_scalar_map(&path)).contains("announces an array"));
    }
    let nested = format!("{{'descr': {}", "(".repeat(60_000));
    let path = write(dir.path(), "nested.npy", npy_bytes(&nested));
    refusal(&path, read_scalar_map(&path));

    let path = dir.path().join("huge.npz");
    let mut zip = zip::ZipWriter::new(std::fs::File::create(&path).unwrap());
    let deflated = zip::write::SimpleFileOptions::default();
    zip.start_file("positions.npy", deflated).unwrap();
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (1000000000000, 3), }";
    std::io::Write::write_all(&mut zip, &npy_bytes(header)).unwrap();
    zip.finish().unwrap();
    assert!(refusal(&path, read_points(&path)).contains("announces an array"));

    let xyz = "property float x\nproperty float y\nproperty float z\nend_header\n";
    for encoding in ["ascii", "binary_little_endian"] {
        for elements in [
            format!("element vertex 1000000000000\n{xyz}"),
            format!("element vertex 18446744073709551615\n{xyz}"),
            // Elements of no bytes would be counted for ever.
            format!("element nothing 1000000000000\nelement vertex 1\n{xyz}"),
            format!("element lists 1000000000000\nproperty list int int l\nelement vertex 1\n{xyz}"),
            format!("element lists 1\nproperty list uint double l\nelement vertex 1\n{xyz}4294967295 4294967295"),
        ] {
            let text = format!("ply\nformat {encoding} 1.0\n{elements}0 0 0\n");
            let path = write(dir.path(), "huge.ply", text);
            refusal(&path, read_points(&path));
        }
    }

    let mut bytes = exr(&["Z"]);
    let name = b"dataWindow\0box2i\0";
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
    for far in [99_999i32, i32::MAX - 1, i32::MAX] {
        bytes[at + 8..at + 12].copy_from_slice(&far.to_le_bytes());
        bytes[at + 12..at + 16].copy_from_slice(&far.to_le_bytes());
        let path = write(dir.path(), "huge.exr", &bytes);
        refusal(&path, read_scalar_map(&path));
    }
}
