//! What is written can be read by others, is the same every time, and is whole or absent.

use std::fs;
use std::io::Write;
use std::path::Path;

use ndarray::{Array1, Array2};
use physvideo_app::io::WriteError;
use physvideo_app::io::read::{read_color_image, read_points, read_scalar_map};
use physvideo_app::io::write::*;

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

/// Names in a folder, hidden ones too.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

const RGB: [u8; 18] = [0, 128, 255, 10, 20, 30, 200, 100, 50, 1, 2, 3, 254, 253, 252, 90, 91, 92];

#[test]
fn a_file_appears_only_when_it_is_whole() {
    let dir = folder();
    let path = dir.path().join("a.bin");
    fs::write(&path, "old").unwrap();
    let mut file = WholeFile::create(&path).unwrap();
    file.write_all(b"new and longer").unwrap();
    file.flush().unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"old");
    drop(file);
    assert_eq!(names(dir.path()), ["a.bin"], "a dropped file leaves nothing");

    let mut file = WholeFile::create(&path).unwrap();
    file.write_all(b"new").unwrap();
    file.commit().unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"new");
    assert_eq!(names(dir.path()), ["a.bin"]);
}

#[test]
fn a_full_disk_is_said_and_leaves_the_old_file() {
    let dir = folder();
    let path = dir.path().join("a.bin");
    fs::write(&path, "old").unwrap();
    let error = write_whole(&path, |file| {
        file.write_all(b"half")?;
        Err(std::io::ErrorKind::StorageFull.into())
    })
    .unwrap_err();
    assert!(matches!(error, WriteError::DiskFull { .. }), "{error}");
    assert!(error.to_string().contains("a.bin") && error.to_string().contains("Free some space"), "{error}");
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(names(dir.path()), ["a.bin"]);
}

#[test]
fn folders_that_cannot_be_written_are_said_by_every_writer() {
    let dir = folder();
    let blocker = dir.path().join("file");
    fs::write(&blocker, "").unwrap();
    type Writer = fn(&Path) -> Result<(), WriteError>;
    let writers: [(&str, Writer); 6] = [
        ("png", |p| write_png(p, 3, 2, &RGB)),
        ("exr", |p| write_exr(p, &ExrFrame { width: 3, height: 2, rgb: &RGB, depth: None, object_id: None })),
        ("npz", |p| write_npz(p, &PointFrame::default())),
        ("ply", |p| write_ply(p, &PointFrame::default())),
        ("json", |p| write_json(p, &1)),
        ("mp4", |p| VideoWriter::new(p, 32, 32, 24.0).map(drop)),
    ];
    for (name, write) in writers {
        let error = write(&dir.path().join("nowhere").join(name)).unwrap_err();
        assert!(matches!(error, WriteError::NoFolder { .. }), "{name}: {error}");
        let error = write(&blocker.join(name)).unwrap_err();
        assert!(matches!(error, WriteError::NoFolder { .. }), "{name}: {error}");
        // Permissions do not stop an administrator, so this asks a folder that nobody may write to.
        #[cfg(target_os = "linux")]
        {
            let path = Path::new("/sys").join(name);
            let error = write(&path).unwrap_err();
            assert!(matches!(error, WriteError::ReadOnly { .. }), "{name}: {error}");
            assert!(error.to_string().contains("--out") && error.path() == path, "{name}: {error}");
        }
        // A folder in the place of the file.
        if name != "mp4" {
            let taken = dir.path().join(format!("taken.{name}"));
            fs::create_dir(&taken).unwrap();
            assert!(write(&taken).is_err(), "{name}");
        }
    }
    assert!(names(dir.path()).iter().all(|n| n == "file" || n.starts_with("taken.")), "{:?}", names(dir.path()));
}

#[cfg(unix)]
#[test]
fn files_are_as_readable_as_others() {
    use std::os::unix::fs::PermissionsExt;
    let dir = folder();
    let (ours, plain) = (dir.path().join("ours"), dir.path().join("plain"));
    write_json(&ours, &1).unwrap();
    fs::write(&plain, "").unwrap();
    let mode = |p| fs::metadata(p).unwrap().permissions().mode();
    assert_eq!(mode(&ours), mode(&plain));
}

#[test]
fn frames_come_back_bit_for_bit() {
    let dir = folder();
    let path = dir.path().join(numbered(12, "png"));
    assert!(path.ends_with("frame_00012.png"));
    write_png(&path, 3, 2, &RGB).unwrap();
    let image = read_color_image(&path).unwrap();
    assert_eq!((image.width, image.height, image.rgb.as_slice()), (3, 2, RGB.as_slice()));
    assert!(matches!(write_png(&path, 3, 3, &RGB), Err(WriteError::Shape { .. })));
    assert!(matches!(write_png(&path, 0, 0, &[]), Err(WriteError::Shape { .. })));
}

#[test]
fn exr_has_linear_colour_depth_and_object() {
    use exr::prelude::*;
    let dir = folder();
    let path = dir.path().join("frame.exr");
    let depth = [0.0, 1.5, 2.5, 3.0, 1e-3, 1e6];
    let object = [0, 1, 2, 3, 4, u32::MAX];
    let frame = ExrFrame { width: 3, height: 2, rgb: &RGB, depth: Some(&depth), object_id: Some(&object) };
    write_exr(&path, &frame).unwrap();

    assert_eq!(read_scalar_map(&path).unwrap().data, depth);
    let image = read_all_flat_layers_from_file(&path).unwrap();
    let channels = &image.layer_data[0].channel_data.list;
    let find = |name: &str| &channels.iter().find(|c| c.name.eq(name)).unwrap().sample_data;
    assert!(matches!(find("object_id"), FlatSamples::U32(v) if v.as_slice() == object));
    for (channel, first) in [("R", 0), ("G", 1), ("B", 2)] {
        for (i, value) in find(channel).values_as_f32().enumerate() {
            // IEC 61966-2-1 in f64; half floats have 11 bits: 2⁻¹¹ relative, and 2⁻²⁵ near zero.
            let v = f64::from(RGB[3 * i + first]) / 255.0;
            let linear = if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
            let error = (f64::from(value) - linear).abs();
            assert!(error <= linear * 2f64.powi(-11) + 2f64.powi(-25), "{channel}[{i}]: {value} for {linear}");
        }
    }

    let bytes = fs::read(&path).unwrap();
    write_exr(&path, &frame).unwrap();
    assert_eq!(fs::read(&path).unwrap(), bytes, "the same bytes");
    let short = ExrFrame { depth: Some(&depth[..5]), ..frame };
    assert!(matches!(write_exr(&path, &short), Err(WriteError::Shape { .. })));
}

const POSITIONS: [[f32; 3]; 4] = [[0.0, 1.0, 2.0], [-3.5, 4.25, 5e-7], [6.0, 7.0, 8e9], [1.0, 1.0, 1.0]];
const VELOCITIES: [[f32; 3]; 4] = [[0.5; 3], [1.0, 2.0, 3.0], [-1.0, 0.0, 0.0], [9.0; 3]];
const COLORS: [[u8; 3]; 4] = [[255, 0, 51], [1, 2, 3], [0, 0, 0], [255, 255, 255]];
const IDS: [u32; 4] = [0, 1, 70_000, u32::MAX];
const FULL: PointFrame =
    PointFrame { positions: &POSITIONS, velocities: Some(&VELOCITIES), colors: Some(&COLORS), ids: Some(&IDS) };

#[test]
fn npz_is_what_numpy_libraries_read() {
    let dir = folder();
    let path = dir.path().join("points.npz");
    write_npz(&path, &FULL).unwrap();
    let mut npz = ndarray_npy::NpzReader::new(fs::File::open(&path).unwrap()).unwrap();
    assert_eq!(npz.names().unwrap(), ["positions", "velocities", "colors", "ids"]);
    let positions: Array2<f32> = npz.by_name("positions").unwrap();
    assert_eq!(positions.into_raw_vec_and_offset().0, POSITIONS.as_flattened());
    let velocities: Array2<f32> = npz.by_name("velocities").unwrap();
    assert_eq!(velocities.into_raw_vec_and_offset().0, VELOCITIES.as_flattened());
    let colors: Array2<u8> = npz.by_name("colors").unwrap();
    assert_eq!((colors.dim(), colors.into_raw_vec_and_offset().0.as_slice()), ((4, 3), COLORS.as_flattened()));
    let ids: Array1<u32> = npz.by_name("ids").unwrap();
    assert_eq!(ids.as_slice().unwrap(), IDS);
}

#[test]
fn npz_bytes_depend_on_the_points_alone() {
    let dir = folder();
    let (a, b) = (dir.path().join("a.npz"), dir.path().join("b.npz"));
    write_npz(&a, &FULL).unwrap();
    write_npz(&b, &FULL).unwrap();
    let bytes = fs::read(&a).unwrap();
    assert_eq!(bytes, fs::read(&b).unwrap());
    // Time and date of the first file in the archive: midnight, 1 January 1980.
    assert_eq!(bytes[10..14], [0, 0, 0x21, 0]);
    // NumPy's headers end at multiples of 64 bytes, so that arrays can be mapped into memory.
    let header = usize::from(u16::from_le_bytes([bytes[30 + 13 + 8], bytes[30 + 13 + 9]]));
    assert_eq!(&bytes[30..43], b"positions.npy");
    assert_eq!((10 + header) % 64, 0);
}

#[test]
fn points_come_back() {
    let dir = folder();
    let colors: Vec<[f32; 3]> = COLORS.iter().map(|c| c.map(|v| f32::from(v) / 255.0)).collect();
    for (name, write) in [("p.npz", write_npz as fn(&Path, &PointFrame) -> _), ("p.ply", write_ply)] {
        let path = dir.path().join(name);
        write(&path, &FULL).unwrap();
        let points = read_points(&path).unwrap();
        assert_eq!(points.positions, POSITIONS, "{name}");
        assert_eq!(points.colors.as_ref(), Some(&colors), "{name}");
        write(&path, &PointFrame { positions: &POSITIONS, ..Default::default() }).unwrap();
        assert_eq!(read_points(&path).unwrap().colors, None, "{name}");
        let short = PointFrame { ids: Some(&IDS[1..]), ..FULL };
        assert!(matches!(write(&path, &short), Err(WriteError::Shape { .. })), "{name}");
        // More than one buffer of the writer.
        let many: Vec<[f32; 3]> = (0..5000).map(|i| [i as f32, 0.5, -1.0]).collect();
        write(&path, &PointFrame { positions: &many, ..Default::default() }).unwrap();
        assert_eq!(read_points(&path).unwrap().positions, many, "{name}");
    }
}

#[test]
fn ply_is_what_its_header_says() {
    let dir = folder();
    let path = dir.path().join("p.ply");
    write_ply(&path, &FULL).unwrap();
    let bytes = fs::read(&path).unwrap();
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8_lossy(&bytes[..end]);
    assert!(header.starts_with("ply\nformat binary_little_endian 1.0\nelement vertex 4\n"), "{header}");
    for property in ["float vz", "uchar blue", "uint id"] {
        assert!(header.contains(&format!("property {property}\n")), "{header}");
    }
    // Six floats, three bytes and an integer a point.
    assert_eq!(bytes.len() - end, 4 * (24 + 3 + 4));
    assert_eq!(bytes[bytes.len() - 4..], u32::MAX.to_le_bytes());
}

#[test]
fn reports_are_json_and_fingerprints_are_sha256() {
    let dir = folder();
    let frames = dir.path().join("frames");
    create_folder(&frames).unwrap();
    create_folder(&frames).unwrap();
    let file = frames.join("abc.png");
    fs::write(&file, "abc").unwrap();
    let output = OutputFile::of(dir.path(), &file).unwrap();
    assert_eq!(output.path, "frames/abc.png");
    // FIPS 180-4, example B.1.
    assert_eq!(output.sha256, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");

    let report = dir.path().join("report.json");
    write_json(&report, &serde_json::json!({ "outputs": [output], "dt": f32::NAN })).unwrap();
    let text = fs::read_to_string(&report).unwrap();
    assert!(text.ends_with("}\n"), "{text}");
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(value["outputs"][0]["path"], "frames/abc.png");
    assert!(value["dt"].is_null());
    assert!(sha256(&dir.path().join("nothing")).is_err());
}
