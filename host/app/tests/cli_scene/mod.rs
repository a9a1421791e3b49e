//! A folder of its own for each test: scenes and files are written into it, and the program is run on them.
#![allow(dead_code)] // Each test file uses a part of it.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;

/// A soft box of about 200 particles that falls on the ground, drawn small: a run takes seconds on any device.
pub const FALL: &str = r#"
[camera]
eye = [0.0, -0.8, 0.3]
target = [0.0, 0.0, 0.1]

[ground]
height = 0.0

[simulation]
grid_density = 32
domain = { min = [-0.3, -0.3, -0.1], max = [0.3, 0.3, 0.5] }

[[object]]
name = "jelly"
source.box = { min = [-0.05, -0.05, 0.02], max = [0.05, 0.05, 0.12] }
material.elastic = { young = 1e4, poisson = 0.3 }
density = 1000.0
color = [0.9, 0.2, 0.2]

[output]
width = 64
height = 48
frames = 3
"#;

/// A photograph of one object, without the files it names.
pub const PHOTO: &str = r#"
[photo]
image = "image.png"
labels = "labels.png"
depth.metric.file = "depth.pfm"
focal_px = 40.0

[simulation]
grid_density = 64

[[object]]
name = "leaf"
source.mask = { label = 1, thickness.extrude = 0.05 }
material.elastic = { young = 1e4 }
prestress = false

[output]
width = 32
frames = 2
"#;

pub struct Folder(tempfile::TempDir);

/// What a run of the program said.
pub struct Said {
    pub code: i32,
    pub out: String,
    pub err: String,
}

impl Said {
    /// Fails unless the program ended with this code and said all of this on standard error, without a panic.
    #[track_caller]
    pub fn expect(&self, code: i32, parts: &[&str]) {
        assert_eq!(self.code, code, "stdout:\n{}\nstderr:\n{}", self.out, self.err);
        assert!(!self.err.contains("panicked"), "{}", self.err);
        for part in parts {
            assert!(self.err.contains(part), "{part:?} is not in:\n{}", self.err);
        }
    }
}

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> &Self {
        std::fs::create_dir_all(self.path(name).parent().unwrap()).unwrap();
        std::fs::write(self.path(name), bytes).unwrap();
        self
    }

    /// Writes `scene.toml`, the fall with each `from` replaced; fails when there is nothing to replace.
    pub fn scene(&self, base: &str, changes: &[(&str, &str)]) -> &Self {
        let mut text = base.to_owned();
        for (from, to) in changes {
            assert!(text.contains(from), "{from:?} is not in the scene");
            text = text.replace(from, to);
        }
        self.write("scene.toml", text)
    }

    /// A photograph of 32 × 24 pixels with an object in the middle, one metre away before a wall at two.
    pub fn photo(&self) -> &Self {
        let inside = |x: u32, y: u32| (10..22).contains(&x) && (6..18).contains(&y);
        let image = image::RgbImage::from_fn(32, 24, |x, y| image::Rgb([(8 * x) as u8, (10 * y) as u8, 90]));
        image.save(self.path("image.png")).unwrap();
        self.labels(32, 24, inside);
        self.depth(|x, y| if inside(x, y) { 1.0 } else { 2.0 });
        self
    }

    pub fn labels(&self, width: u32, height: u32, inside: impl Fn(u32, u32) -> bool) {
        let labels = image::GrayImage::from_fn(width, height, |x, y| image::Luma([u8::from(inside(x, y))]));
        labels.save(self.path("labels.png")).unwrap();
    }

    pub fn depth(&self, value: impl Fn(u32, u32) -> f32) {
        let mut bytes = b"Pf\n32 24\n-1\n".to_vec();
        for y in (0..24).rev() {
            for x in 0..32 {
                bytes.extend(value(x, y).to_le_bytes());
            }
        }
        self.write("depth.pfm", bytes);
    }

    pub fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_physvideo-engine"));
        command.current_dir(self.0.path()).args(args).stdin(Stdio::null());
        command.env("XDG_CACHE_HOME", self.path("cache"));
        command
    }

    pub fn run(&self, args: &[&str]) -> Said {
        said(&mut self.command(args))
    }

    pub fn report(&self, out: &str) -> Value {
        serde_json::from_slice(&std::fs::read(self.path(out).join("report.json")).unwrap()).unwrap()
    }
}

pub fn said(command: &mut Command) -> Said {
    let output = command.output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    Said { code: output.status.code().unwrap_or(-1), out: text(output.stdout), err: text(output.stderr) }
}

/// Names of the files in a folder, sorted; none where there is no folder.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}
