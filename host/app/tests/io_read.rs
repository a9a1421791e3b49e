//! Sound files are read right, and unusable ones refused in words a user can act on.

mod io_fixtures;

use image::{ImageBuffer, ImageFormat, Luma};
use io_fixtures::*;
use ndarray::Array2;
use physvideo_app::io::read::*;

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

fn assert_map(map: &ScalarMap, what: &str) {
    assert_eq!((map.width, map.height), SIZE, "{what}");
    for y in 0..SIZE.1 {
        for x in 0..SIZE.0 {
            assert_eq!(map.data[(y * SIZE.0 + x) as usize], map_value(x, y), "{what} at {x}, {y}");
        }
    }
}

#[test]
fn photographs_are_rgb_whatever_their_name() {
    let dir = folder();
    let path = dir.path().join("photo.obj");
    photo().save_with_format(&path, ImageFormat::Png).unwrap();
    let image = read_color_image(&path).unwrap();
    assert_eq!((image.width, image.height), SIZE);
    assert_eq!(image.rgb, photo().into_raw());

    let path = dir.path().join("photo.png");
    photo().save_with_format(&path, ImageFormat::Jpeg).unwrap();
    let image = read_color_image(&path).unwrap();
    // JPEG at the default quality of a smooth picture: a few grey levels.
    let worst = image.rgb.iter().zip(photo().as_raw()).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
    assert!(worst > 0 && worst < 40, "worst difference {worst}");
}

#[test]
fn grey_photographs_are_spread_and_alpha_is_dropped() {
    let dir = folder();
    let path = dir.path().join("grey.png");
    ImageBuffer::from_pixel(2, 1, Luma([77u8])).save(&path).unwrap();
    assert_eq!(read_color_image(&path).unwrap().rgb, [77; 6]);
    let path = dir.path().join("alpha.png");
    ImageBuffer::from_pixel(1, 1, image::Rgba([9u8, 8, 7, 0])).save(&path).unwrap();
    assert_eq!(read_color_image(&path).unwrap().rgb, [9, 8, 7]);
}

#[test]
fn a_turned_jpeg_stands_upright() {
    let dir = folder();
    let mut bytes = std::io::Cursor::new(Vec::new());
    photo().write_to(&mut bytes, ImageFormat::Jpeg).unwrap();
    // EXIF with one entry: orientation 6, to be turned by a quarter clockwise.
    let tiff =
        [b"Exif\0\0MM\0*\0\0\0\x08\0\x01".as_slice(), &[0x01, 0x12, 0, 3, 0, 0, 0, 1, 0, 6, 0, 0], &[0, 0, 0, 0]]
            .concat();
    let mut exif = vec![0xff, 0xe1];
    exif.extend((tiff.len() as u16 + 2).to_be_bytes());
    exif.extend(tiff);
    let mut jpeg = bytes.into_inner();
    jpeg.splice(2..2, exif);
    let image = read_color_image(&write(dir.path(), "turned.jpg", jpeg)).unwrap();
    assert_eq!((image.width, image.height), (SIZE.1, SIZE.0));
}

#[test]
fn labels_are_the_stored_values() {
    let dir = folder();
    let path = dir.path().join("labels.png");
    ImageBuffer::from_fn(SIZE.0, SIZE.1, |x, y| Luma([(x * y) as u8])).save(&path).unwrap();
    let labels = read_label_image(&path).unwrap();
    assert_eq!((labels.width, labels.height), SIZE);
    assert_eq!(labels.labels[(3 * SIZE.0 + 5) as usize], 15);

    // One bit a pixel: rows of a filter byte and eight pixels.
    let mask = png_of(8, 1, 1, 0, &[&[0, 0b0110_0001]]);
    let labels = read_label_image(&write(dir.path(), "mask.png", mask)).unwrap();
    assert_eq!(labels.labels, [0, 1, 1, 0, 0, 0, 0, 1]);
    let two_bits = png_of(4, 1, 2, 0, &[&[0, 0b0001_1011]]);
    assert_eq!(read_label_image(&write(dir.path(), "four.png", two_bits)).unwrap().labels, [0, 1, 2, 3]);
}

#[test]
fn labels_in_colour_are_refused() {
    let dir = folder();
    let path = dir.path().join("colour.png");
    photo().save(&path).unwrap();
    assert!(refusal(&path, read_label_image(&path)).contains("colour image"));

    let palette = png_of(2, 1, 8, 3, &[&[0, 0, 1]]);
    let path = write(dir.path(), "palette.png", palette);
    assert!(refusal(&path, read_label_image(&path)).contains("palette"));

    let path = dir.path().join("deep.png");
    ImageBuffer::from_pixel(1, 1, Luma([300u16])).save(&path).unwrap();
    assert!(refusal(&path, read_label_image(&path)).contains("16 bits"));

    let path = dir.path().join("labels.jpg");
    photo().save(&path).unwrap();
    assert!(refusal(&path, read_label_image(&path)).contains("JPEG"));
}

#[test]
fn maps_of_every_format_agree() {
    let dir = folder();
    for path in all(dir.path()) {
        let name = path.file_name().unwrap().to_str().unwrap();
        if ["map16.png", "map8.png", "map.npy", "map.exr", "map.pfm", "big.pfm"].contains(&name) {
            assert_map(&read_scalar_map(&path).unwrap(), name);
        }
    }
}

#[test]
fn npy_maps_of_every_number_type_agree() {
    let dir = folder();
    let path = dir.path().join("map.npy");
    let map = map_array();
    macro_rules! check {
        ($($t:ty),*) => {$(
            ndarray_npy::write_npy(&path, &map.mapv(|v| v as $t)).unwrap();
            assert_map(&read_scalar_map(&path).unwrap(), stringify!($t));
        )*};
    }
    check!(f32, f64, u8, u16, i32, i64);
    // Written as the transpose's rows: Fortran order.
    ndarray_npy::write_npy(&path, &map.t().as_standard_layout().t()).unwrap();
    assert!(String::from_utf8_lossy(&std::fs::read(&path).unwrap()).contains("'fortran_order': True"));
    assert_map(&read_scalar_map(&path).unwrap(), "fortran");

    let mut big = npy_bytes("{'descr': '>f4', 'fortran_order': False, 'shape': (1, 2), }");
    big.extend([1.5f32.to_be_bytes(), 2.5f32.to_be_bytes()].concat());
    assert_eq!(read_scalar_map(&write(dir.path(), "big.npy", big)).unwrap().data, [1.5, 2.5]);
}

#[test]
fn unknown_values_become_zero() {
    let dir = folder();
    let path = dir.path().join("map.npy");
    let values = [f32::NAN, f32::INFINITY, -1.0, -0.0, 0.0, 2.0];
    ndarray_npy::write_npy(&path, &Array2::from_shape_vec((2, 3), values.to_vec()).unwrap()).unwrap();
    let map = read_scalar_map(&path).unwrap();
    assert_eq!(map.data.iter().map(|v| v.to_bits()).collect::<Vec<_>>(), [0, 0, 0, 0, 0, 2.0f32.to_bits()]);
    ndarray_npy::write_npy(&path, &Array2::from_elem((2, 3), f32::NAN)).unwrap();
    assert!(refusal(&path, read_scalar_map(&path)).contains("no pixel has a known value"));
}

#[test]
fn exr_channels_are_chosen_by_name() {
    let dir = folder();
    // The channel whose values are not offset is the last of each list.
    for names in [["A", "Z"], ["Y", "depth"], ["Y", "Z"], ["R", "View Layer.Depth.V"], ["B", "Y"]] {
        let path = write(dir.path(), "map.exr", exr(&names));
        assert_map(&read_scalar_map(&path).unwrap(), names[1]);
    }
    assert_map(&read_scalar_map(&write(dir.path(), "one.exr", exr(&["whatever"]))).unwrap(), "the only one");
    let path = write(dir.path(), "color.exr", exr(&["R", "G", "B"]));
    assert!(refusal(&path, read_scalar_map(&path)).contains("none of the channels Z"));
}

#[test]
fn maps_of_other_kinds_are_refused() {
    let dir = folder();
    let path = dir.path().join("color.png");
    photo().save(&path).unwrap();
    assert!(refusal(&path, read_scalar_map(&path)).contains("one channel"));
    let path = write(dir.path(), "color.pfm", b"PF\n1 1\n-1.0\n000000000000");
    assert!(refusal(&path, read_scalar_map(&path)).contains("colour PFM"));
    let path = dir.path().join("flat.npy");
    ndarray_npy::write_npy(&path, &ndarray::array![1.0f32, 2.0]).unwrap();
    assert!(refusal(&path, read_scalar_map(&path)).contains("shape [2]"));
    let path = dir.path().join("bool.npy");
    ndarray_npy::write_npy(&path, &ndarray::array![[true]]).unwrap();
    assert!(refusal(&path, read_scalar_map(&path)).contains("b1"));
    let mut lossy = exr(&["Z"]);
    let name = b"compression\0compression\0\x01\0\0\0";
    let at = lossy.windows(name.len()).position(|w| w == name).unwrap() + name.len();
    lossy[at] = 6;
    let path = write(dir.path(), "lossy.exr", lossy);
    let text = refusal(&path, read_scalar_map(&path));
    assert!(text.contains("b44"), "{text}");
    let path = write(dir.path(), "notes.txt", "depth: unknown");
    assert!(refusal(&path, read_scalar_map(&path)).contains("not a PNG, EXR, PFM or NPY"));
}

#[test]
fn points_of_every_format_agree() {
    let dir = folder();
    let colors: Vec<[f32; 3]> = COLORS.iter().map(|c| c.map(|v| f32::from(v) / 255.0)).collect();
    let mut seen = 0;
    for path in all(dir.path()) {
        let name = path.file_name().unwrap().to_str().unwrap();
        if ["ascii.ply", "little.ply", "big.ply", "points.npz", "packed.npz"].contains(&name) {
            let points = read_points(&path).unwrap();
            assert_eq!(points.positions, POSITIONS, "{name}");
            assert_eq!(points.colors.as_ref(), Some(&colors), "{name}");
            seen += 1;
        }
    }
    assert_eq!(seen, 5);
}

#[test]
fn points_that_cannot_be_used_are_refused() {
    let dir = folder();
    let ply = |name: &str, text: &str| write(dir.path(), name, text);
    let head = "ply\nformat ascii 1.0\nelement vertex";
    let xyz = "property float x\nproperty float y\nproperty float z\n";

    let mut bytes = ply_binary(false);
    let last = bytes.len() - 24;
    bytes[last..last + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let path = write(dir.path(), "nan.ply", bytes);
    assert!(refusal(&path, read_points(&path)).contains("point 2"));
    let path = ply("nan_text.ply", &format!("{head} 2\n{xyz}end_header\n0 0 0\n0 nan 0\n"));
    refusal(&path, read_points(&path));
    let path = ply("none.ply", &format!("{head} 0\n{xyz}end_header\n"));
    assert!(refusal(&path, read_points(&path)).contains("no points"));
    let path = ply("flat.ply", &format!("{head} 1\nproperty float x\nproperty float y\nend_header\n0 0\n"));
    assert!(refusal(&path, read_points(&path)).contains("no x, y and z"));
    let path = ply("faces.ply", "ply\nformat ascii 1.0\nelement face 1\nproperty int a\nend_header\n0\n");
    assert!(refusal(&path, read_points(&path)).contains("no element named vertex"));
    let color = "property float red\nproperty float green\nproperty float blue\n";
    let path = ply("bright.ply", &format!("{head} 1\n{xyz}{color}end_header\n0 0 0 0 0 255\n"));
    assert!(refusal(&path, read_points(&path)).contains("colour of point 0"));

    let path = dir.path().join("points.npz");
    let save = |arrays: &[(&str, Array2<f32>)]| {
        let mut npz = ndarray_npy::NpzWriter::new(std::fs::File::create(&path).unwrap());
        arrays.iter().for_each(|(name, array)| npz.add_array(*name, array).unwrap());
        npz.finish().unwrap();
    };
    save(&[("points", Array2::zeros((1, 3)))]);
    assert!(refusal(&path, read_points(&path)).contains("no array named positions"));
    save(&[("positions", Array2::zeros((3, 2)))]);
    assert!(refusal(&path, read_points(&path)).contains("shape [3, 2]"));
    save(&[("positions", Array2::zeros((0, 3)))]);
    assert!(refusal(&path, read_points(&path)).contains("no points"));
    save(&[("positions", Array2::zeros((2, 3))), ("colors", Array2::zeros((1, 3)))]);
    assert!(refusal(&path, read_points(&path)).contains("1 colours for 2 points"));
    save(&[("positions", Array2::from_elem((1, 3), f32::INFINITY))]);
    assert!(refusal(&path, read_points(&path)).contains("point 0"));
    save(&[]);
    assert!(refusal(&path, read_points(&path)).contains("no array named positions"));
}

#[test]
fn a_mesh_keeps_shared_vertices() {
    let dir = folder();
    let mesh = read_mesh(&write(dir.path(), "mesh.obj", obj())).unwrap();
    // 8 corners of the cube and 3 of the flap's own group, in spite of four texture coordinates.
    assert_eq!(mesh.vertices.len(), 11);
    assert_eq!(mesh.triangles.len(), 13);
    // Closed: the signed volume of the cube is 1, to rounding of eight coordinates that are 0 or 1.
    let volume: f32 = mesh.triangles[..12]
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| glam::Vec3::from(mesh.vertices[i as usize]));
            a.dot(b.cross(c)) / 6.0
        })
        .sum();
    assert!((volume.abs() - 1.0).abs() < 1e-6, "volume {volume}");
}

#[test]
fn meshes_that_cannot_be_used_are_refused() {
    let dir = folder();
    for (name, text, expected) in [
        ("none.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no faces"),
        ("empty.obj", "", "no faces"),
        ("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "not there"),
        ("zero.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "damaged"),
        ("negative.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -9 1 2\n", "damaged"),
        ("nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "vertex 1"),
        ("inf.obj", "v 0 0 0\nv 1e99 0 0\nv 0 1 0\nf 1 2 3\n", "vertex 1"),
        ("words.obj", "v a b c\n", "three numbers"),
    ] {
        let path = write(dir.path(), name, text);
        let text = refusal(&path, read_mesh(&path));
        assert!(text.contains(expected), "{name}: {text}");
    }
    let path = write(dir.path(), "photo.obj", [0xffu8, 0xd8, 0xff, 0x00, 0x80]);
    assert!(refusal(&path, read_mesh(&path)).contains("not an OBJ"));
}
