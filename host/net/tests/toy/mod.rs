//! A small model for tests: 4 channels, 2 pixels and 2 frames a latent. Its networks are formulas one can follow.
#![allow(dead_code)]

pub mod onnx;

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use onnx::{Attribute, F32, Graph};
use physvideo_net::{LibraryChoice, Manifest, Model, NetError, OpenOptions, Role, Runtime, Tensor};
use tempfile::TempDir;

/// Never asks to stop.
pub static NEVER: &AtomicBool = &ASKED;
static ASKED: AtomicBool = AtomicBool::new(false);

/// The library that `tools/setup` fetches.
pub fn library() -> PathBuf {
    let program = std::env::current_exe().unwrap();
    let found = program.ancestors().map(|f| f.join("onnxruntime/libonnxruntime.so")).find(|p| p.is_file());
    found.expect("target/onnxruntime/libonnxruntime.so is not there: run tools/setup")
}

pub fn runtime() -> Runtime {
    Runtime::load(&LibraryChoice { path: Some(library()), threads: Some(1), ..LibraryChoice::default() }).unwrap()
}

/// A folder with a manifest and files.
pub struct Folder(pub TempDir);

impl Folder {
    pub fn new(manifest: &str, files: &[(&str, Vec<u8>)]) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        folder.write("model.toml", manifest.as_bytes());
        files.iter().for_each(|(name, bytes)| folder.write(name, bytes));
        folder
    }

    pub fn write(&self, name: &str, bytes: &[u8]) {
        let path = self.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    pub fn manifest(&self) -> Manifest {
        Manifest::read(self.path()).unwrap_or_else(|e| panic!("{e}"))
    }

    pub fn open(&self, roles: &[Role]) -> Result<Model, NetError> {
        Model::open(&runtime(), self.manifest(), &OpenOptions { roles, ..OpenOptions::default() })
    }

    pub fn model(&self, roles: &[Role]) -> Model {
        self.open(roles).unwrap_or_else(|e| panic!("{e}"))
    }

    /// Why a role cannot be opened.
    pub fn refusal(&self, role: Role) -> NetError {
        match self.open(&[role]) {
            Err(e) => e,
            Ok(_) => panic!("it was opened"),
        }
    }
}

/// The manifest up to its roles.
pub const HEAD: &str = r#"
schema = 1
name = "toy"
[latent]
channels = 4
spatial = 2
temporal = 2
[chunk]
frames = 5
"#;

pub const ENCODE: &str = r#"
[encode]
graphs = [{ file = "encode.onnx" }]
input = { name = "video" }
output = { name = "latent" }
latent_mean = [0.25, 0.0, 0.0, 0.0]
latent_std = [1.0, 2.0, 1.0, 0.5]
"#;

pub const DECODE: &str = r#"
[decode]
graphs = [{ file = "decode.onnx" }]
input = { name = "latent" }
output = { name = "video" }
latent_mean = [0.25, 0.0, 0.0, 0.0]
latent_std = [1.0, 2.0, 1.0, 0.5]
"#;

/// Velocity: prediction = z sigma + 2 image + mask, all inputs in one tensor.
pub const VELOCITY: &str = r#"
[velocity]
graphs = [{ file = "velocity.onnx" }]
prediction = "eps_minus_x0"
output = { name = "prediction" }
schedule = { shift = { shift = 7.0 }, steps = 25 }
[[velocity.inputs]]
name = "x"
parts = ["latents", "mask", "image"]
[[velocity.inputs]]
name = "sigma"
source = "sigma"
"#;

/// Means over 2 x 2 x 2, the first frame alone; channel 3 is the mean colour.
pub fn encode() -> Vec<u8> {
    let pool = [
        ("kernel_shape", Attribute::Ints(&[2, 2, 2])),
        ("strides", Attribute::Ints(&[2, 2, 2])),
        ("pads", Attribute::Ints(&[1, 0, 0, 0, 0, 0])),
    ];
    Graph::default()
        .input("video", F32, &[1, 3, -1, -1, -1])
        .output("latent", F32, &[1, 4, -1, -1, -1])
        .ints("axis", &[1])
        .node_with("AveragePool", &["video"], &["pooled"], &pool)
        .node("ReduceMean", &["pooled", "axis"], "mean")
        .node_with("Concat", &["pooled", "mean"], &["latent"], &[("axis", Attribute::Int(1))])
        .file()
}

/// Channels 0 to 2, repeated 2 x 2 x 2, without the frame before the first.
pub fn decode() -> Vec<u8> {
    Graph::default()
        .input("latent", F32, &[1, 4, -1, -1, -1])
        .output("video", F32, &[1, 3, -1, -1, -1])
        .ints("zero", &[0])
        .ints("one", &[1])
        .ints("two", &[2])
        .ints("three", &[3])
        .ints("end", &[1 << 40])
        .floats("scales", &[5], &[1.0, 1.0, 2.0, 2.0, 2.0])
        .node("Slice", &["latent", "zero", "three", "one"], "colours")
        .node_with(
            "Resize",
            &["colours", "", "scales"],
            &["big"],
            &[
                ("mode", Attribute::Text("nearest")),
                ("coordinate_transformation_mode", Attribute::Text("asymmetric")),
                ("nearest_mode", Attribute::Text("floor")),
            ],
        )
        .node("Slice", &["big", "one", "end", "two"], "video")
        .file()
}

/// See `VELOCITY`.
pub fn velocity() -> Vec<u8> {
    Graph::default()
        .input("x", F32, &[1, 9, -1, -1, -1])
        .input("sigma", F32, &[1])
        .output("prediction", F32, &[1, 4, -1, -1, -1])
        .ints("0", &[0])
        .ints("1", &[1])
        .ints("4", &[4])
        .ints("5", &[5])
        .ints("9", &[9])
        .floats("twice", &[], &[2.0])
        .node("Slice", &["x", "0", "4", "1"], "z")
        .node("Slice", &["x", "4", "5", "1"], "mask")
        .node("Slice", &["x", "5", "9", "1"], "image")
        .node("Mul", &["z", "sigma"], "a")
        .node("Mul", &["image", "twice"], "b")
        .node("Add", &["a", "b"], "ab")
        .node("Add", &["ab", "mask"], "prediction")
        .file()
}

/// All three roles.
pub fn toy() -> Folder {
    let manifest = [HEAD, ENCODE, DECODE, VELOCITY].concat();
    Folder::new(&manifest, &[("encode.onnx", encode()), ("decode.onnx", decode()), ("velocity.onnx", velocity())])
}

/// Numbers that repeat nowhere, between -1 and 1.
pub fn noise(shape: &[usize], seed: u32) -> Tensor {
    let mut state = seed.wrapping_mul(2_654_435_761).wrapping_add(1);
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state as f32 / u32::MAX as f32 * 2.0 - 1.0
    };
    let data = (0..shape.iter().product()).map(|_| next()).collect();
    Tensor::new(shape.to_vec(), data).unwrap()
}

/// Frames that are constant over the cells of a latent.
pub fn blocks(latents: [usize; 3], seed: u32) -> Tensor {
    let [t, h, w] = latents;
    let small = noise(&[3, t, h, w], seed);
    let (f, height, width) = (2 * t - 1, 2 * h, 2 * w);
    let mut data = Vec::new();
    for c in 0..3 {
        for frame in 0..f {
            for y in 0..height {
                for x in 0..width {
                    let value = small.data[((c * t + frame.div_ceil(2)) * h + y / 2) * w + x / 2];
                    data.push(value * 0.5 + 0.5);
                }
            }
        }
    }
    Tensor::new(vec![3, f, height, width], data).unwrap()
}

/// The largest difference.
pub fn difference(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}
