//! Sound files of every kind that is read, made by other means than the code under test wherever there are any.

#![allow(dead_code)]

use std::path::{Path, PathBuf};

use image::{ImageBuffer, ImageFormat, Luma, Rgb};
use ndarray::{Array2, array};

/// Width and height of every image and map here: neither square nor even.
pub const SIZE: (u32, u32) = (7, 5);

/// Value of a map's pixel, exact in every format: 1 at the top left, growing along rows.
pub fn map_value(x: u32, y: u32) -> f32 {
    (1 + x + 10 * y) as f32
}

pub fn photo() -> ImageBuffer<Rgb<u8>, Vec<u8>> {
    ImageBuffer::from_fn(SIZE.0, SIZE.1, |x, y| Rgb([(x * 30) as u8, (y * 50) as u8, 128]))
}

pub fn write(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

pub fn pfm(big_endian: bool) -> Vec<u8> {
    let mut bytes = format!("Pf\n{} {}\n{}\n", SIZE.0, SIZE.1, if big_endian { "1.0" } else { "-1.0" }).into_bytes();
    for y in (0..SIZE.1).rev() {
        for x in 0..SIZE.0 {
            let v = map_value(x, y);
            bytes.extend(if big_endian { v.to_be_bytes() } else { v.to_le_bytes() });
        }
    }
    bytes
}

pub fn map_array() -> Array2<f32> {
    Array2::from_shape_fn((SIZE.1 as usize, SIZE.0 as usize), |(y, x)| map_value(x as u32, y as u32))
}

pub fn exr(names: &[&str]) -> Vec<u8> {
    use exr::prelude::*;
    let channels = names.iter().enumerate().map(|(i, &name)| {
        // Each channel but the last is offset, so that the wrong one is noticed.
        let offset = 1000.0 * (names.len() - 1 - i) as f32;
        let values = (0..SIZE.1).flat_map(|y| (0..SIZE.0).map(move |x| map_value(x, y) + offset)).collect();
        AnyChannel::new(name, FlatSamples::F32(values))
    });
    let layer = Layer::new(
        (SIZE.0 as usize, SIZE.1 as usize),
        LayerAttributes::default(),
        Encoding::FAST_LOSSLESS,
        AnyChannels::sort(channels.collect()),
    );
    let mut bytes = std::io::Cursor::new(Vec::new());
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

pub const POSITIONS: [[f32; 3]; 3] = [[0.0, 1.5, -2.0], [3.25, 0.0, 1.0], [1e-3, -7.0, 9.0]];
pub const COLORS: [[u8; 3]; 3] = [[255, 0, 51], [0, 255, 102], [10, 20, 30]];

pub fn ply_ascii() -> String {
    let mut text = String::from(
        "ply\nformat ascii 1.0\ncomment made by hand\nelement camera 1\nproperty list uchar float axes\n\
         element vertex 3\nproperty float x\nproperty float y\nproperty float nx\nproperty double z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\n\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n2 0.5 0.5\n",
    );
    for (p, c) in POSITIONS.iter().zip(COLORS) {
        text += &format!("{} {} 99 {} {} {} {}\n", p[0], p[1], p[2], c[0], c[1], c[2]);
    }
    text + "3 0 1 2\n"
}

pub fn ply_binary(big_endian: bool) -> Vec<u8> {
    let order = if big_endian { "big" } else { "little" };
    let mut bytes = format!(
        "ply\nformat binary_{order}_endian 1.0\nelement vertex 3\n\
         property float x\nproperty float y\nproperty float z\n\
         property float red\nproperty float green\nproperty float blue\nend_header\n"
    )
    .into_bytes();
    for (p, c) in POSITIONS.iter().zip(COLORS) {
        for v in p.iter().copied().chain(c.iter().map(|&c| f32::from(c) / 255.0)) {
            bytes.extend(if big_endian { v.to_be_bytes() } else { v.to_le_bytes() });
        }
    }
    bytes
}

pub fn npz(path: &Path, compressed: bool) {
    let file = std::fs::File::create(path).unwrap();
    use ndarray_npy::NpzWriter;
    let mut npz = if compressed { NpzWriter::new_compressed(file) } else { NpzWriter::new(file) };
    let positions = Array2::from_shape_fn((3, 3), |(i, c)| f64::from(POSITIONS[i][c]));
    npz.add_array("weights", &array![1u8, 2]).unwrap();
    npz.add_array("positions", &positions).unwrap();
    npz.add_array("colors", &Array2::from_shape_fn((3, 3), |(i, c)| COLORS[i][c])).unwrap();
    npz.finish().unwrap();
}

/// A cube of quads with texture coordinates that part its vertices, a line, a material and two groups.
pub fn obj() -> String {
    let mut text = String::from("mtllib missing.mtl\no cube\n");
    for i in 0..8 {
        text += &format!("v {} {} {}\n", i & 1, i >> 1 & 1, i >> 2 & 1);
    }
    text += "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl red\nl 1 2\n";
    for f in [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]] {
        text += &format!("f {}/1 {}/2 {}/3 {}/4\n", f[0], f[1], f[2], f[3]);
    }
    text + "o flap\nv 2 0 0\nf 1 2 -1\n"
}

/// Every sound file, by name.
pub fn all(folder: &Path) -> Vec<PathBuf> {
    let path = |name: &str| folder.join(name);
    photo().save_with_format(path("photo.png"), ImageFormat::Png).unwrap();
    photo().save_with_format(path("photo.jpg"), ImageFormat::Jpeg).unwrap();
    ImageBuffer::from_fn(SIZE.0, SIZE.1, |x, y| Luma([map_value(x, y) as u16])).save(path("map16.png")).unwrap();
    ImageBuffer::from_fn(SIZE.0, SIZE.1, |x, y| Luma([map_value(x, y) as u8])).save(path("map8.png")).unwrap();
    ndarray_npy::write_npy(path("map.npy"), &map_array()).unwrap();
    npz(&path("points.npz"), false);
    npz(&path("packed.npz"), true);
    let written = ["photo.png", "photo.jpg", "map16.png", "map8.png", "map.npy", "points.npz", "packed.npz"];
    let mut files: Vec<PathBuf> = written.iter().map(|n| path(n)).collect();
    for (name, bytes) in [
        ("map.exr", exr(&["A", "Z"])),
        ("map.pfm", pfm(false)),
        ("big.pfm", pfm(true)),
        ("ascii.ply", ply_ascii().into_bytes()),
        ("little.ply", ply_binary(false)),
        ("big.ply", ply_binary(true)),
        ("mesh.obj", obj().into_bytes()),
    ] {
        files.push(write(folder, name, bytes));
    }
    files
}

/// The text of a refusal, which must name the file and say something to do.
pub fn refusal<T: std::fmt::Debug>(path: &Path, result: Result<T, physvideo_app::io::ReadError>) -> String {
    let error = result.expect_err("must be refused");
    assert_eq!(error.path(), path);
    let text = error.to_string();
    assert!(text.contains(path.file_name().unwrap().to_str().unwrap()), "names the file: {text}");
    assert!(text.trim_end().ends_with('.') && text.matches(". ").count() >= 1, "says what to do: {text}");
    assert!(!text.contains('\n'), "one line: {text}");
    text
}

/// A PNG with the rows given raw, filter byte first.
pub fn png_of(width: u32, height: u32, bits: u8, colour_type: u8, rows: &[&[u8]]) -> Vec<u8> {
    let raw = rows.concat();
    // One stored block of zlib.
    let mut zlib = vec![0x78, 0x01, 0x01];
    zlib.extend((raw.len() as u16).to_le_bytes());
    zlib.extend((!(raw.len() as u16)).to_le_bytes());
    zlib.extend(&raw);
    let (a, b) =
        raw.iter().fold((1u32, 0u32), |(a, b), &v| ((a + u32::from(v)) % 65521, (b + a + u32::from(v)) % 65521));
    zlib.extend((b << 16 | a).to_be_bytes());
    let header = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[bits, colour_type, 0, 0, 0]].concat();
    let mut png = b"\x89PNG\r\n\x1a\n".to_vec();
    let palette: &[(&[u8; 4], &[u8])] = &[(b"PLTE", &[0, 0, 0, 255, 0, 0])];
    let mut chunks: Vec<(&[u8; 4], &[u8])> = vec![(b"IHDR", &header)];
    chunks.extend(palette.iter().filter(|_| colour_type == 3));
    chunks.extend([(b"IDAT", zlib.as_slice()), (b"IEND", &[])]);
    for (kind, body) in chunks {
        let named = [kind.as_slice(), body].concat();
        png.extend((body.len() as u32).to_be_bytes());
        png.extend(&named);
        png.extend(crc32(&named).to_be_bytes());
    }
    png
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 })
    })
}

/// The beginning of an NPY file with a header of one's own.
pub fn npy_bytes(header: &str) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes
}
