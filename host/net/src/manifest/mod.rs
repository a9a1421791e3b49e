//! What a manifest says about a model, as data. Opens no file but the manifest, and runs nothing.

mod constant;
mod grid;
mod inputs;
mod keys;
mod parse;
mod velocity;

use std::path::{Path, PathBuf};

pub use grid::Grid;
pub(crate) use grid::latents_of;
pub use inputs::{Axis, HistorySlots, ImageFill, InputSpec, LatentInput, Part, Per, Source};
pub use keys::{ManifestErrors, Problem};
pub use velocity::{Guidance, VelocitySpec};

use crate::error::NetError;
use crate::files::Folder;

/// Name of the manifest in a model's folder.
pub(crate) const FILE_NAME: &str = "model.toml";

/// Largest manifest that is read.
const LARGEST: u64 = 1 << 20;

/// What a network does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Role {
    /// Frames to latents.
    Encode,
    /// One frame to one latent, for encoders whose export takes only clips.
    EncodeImage,
    /// Noisy latents to a prediction.
    Velocity,
    /// Latents to frames.
    Decode,
}

impl Role {
    /// Every role.
    pub const ALL: [Self; 4] = [Self::Encode, Self::EncodeImage, Self::Velocity, Self::Decode];

    /// Its name in manifests.
    pub fn name(self) -> &'static str {
        match self {
            Self::Encode => "encode",
            Self::EncodeImage => "encode_image",
            Self::Velocity => "velocity",
            Self::Decode => "decode",
        }
    }
}

/// A model: its latents and the networks of its roles.
#[derive(Debug, Clone, PartialEq)]
pub struct Manifest {
    /// Folder of its files; empty for a manifest that was only parsed.
    pub folder: PathBuf,
    /// Short name.
    pub name: String,
    /// What it is.
    pub description: String,
    /// Licence of its files.
    pub licence: String,
    /// How to get or export its files.
    pub obtain: String,
    /// Size of its latents.
    pub latent: LatentSpec,
    /// How much it makes at once.
    pub chunk: ChunkSpec,
    /// Frames to latents.
    pub encode: Option<CodecSpec>,
    /// One frame to one latent; absent: `encode` does it.
    pub encode_image: Option<CodecSpec>,
    /// Latents to frames.
    pub decode: Option<CodecSpec>,
    /// Noisy latents to a prediction.
    pub velocity: Option<VelocitySpec>,
}

/// Size of latents.
#[derive(Debug, Clone, PartialEq)]
pub struct LatentSpec {
    /// Channels.
    pub channels: usize,
    /// Pixels of a latent along x and y.
    pub spatial: usize,
    /// Frames of a latent after the first.
    pub temporal: usize,
    /// What latent 0 is.
    pub first: FirstLatent,
    /// Width and height in latents are multiples of this.
    pub multiple: usize,
    /// The only height and width in latents, for networks that take one size.
    pub size: Option<[usize; 2]>,
}

/// What latent 0 is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FirstLatent {
    /// Made like the others.
    Generated,
    /// Part of the tensor, held at the clean latent of the image, at noise level 0.
    Clamped,
    /// Not part of the tensor.
    Separate,
}

/// How much a model makes at once.
#[derive(Debug, Clone, PartialEq)]
pub struct ChunkSpec {
    /// Frames of a chunk with its first.
    pub frames: usize,
    /// Only this many.
    pub fixed: bool,
    /// Order of chunks.
    pub direction: Direction,
    /// Latents of neighbours that inputs may ask for.
    pub history: usize,
    /// The latent of the image counts as the oldest neighbour.
    pub history_includes_first: bool,
}

/// Order in which chunks are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// First chunk first; history is what precedes.
    Forward,
    /// Last chunk first; history is what follows.
    Backward,
}

/// The files of a role.
#[derive(Debug, Clone, PartialEq)]
pub struct RoleSpec {
    /// When graphs are loaded.
    pub load: Load,
    /// Bytes it needs when loaded, where the sizes of its files do not say.
    pub memory: Option<u64>,
    /// Its graphs, in the order in which they run.
    pub graphs: Vec<GraphSpec>,
}

/// When the graphs of a role are loaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Load {
    /// All, once.
    Together,
    /// One after the other, at each call, so that a big network fits.
    InTurn,
}

/// A graph and the data files it names.
#[derive(Debug, Clone, PartialEq)]
pub struct GraphSpec {
    /// The ONNX file.
    pub file: FileSpec,
    /// Its external data.
    pub data: Vec<FileSpec>,
}

/// A file of the model folder.
#[derive(Debug, Clone, PartialEq)]
pub struct FileSpec {
    /// Path relative to the folder.
    pub file: String,
    /// SHA-256 in lower-case hexadecimal, where the manifest says it.
    pub sha256: Option<String>,
}

/// An encoder or decoder.
#[derive(Debug, Clone, PartialEq)]
pub struct CodecSpec {
    /// Its files.
    pub role: RoleSpec,
    /// What it reads.
    pub input: TensorSpec,
    /// What it writes.
    pub output: TensorSpec,
    /// network colour = (colour - mean) / std, for red, green, blue.
    pub colour_mean: [f64; 3],
    /// See `colour_mean`.
    pub colour_std: [f64; 3],
    /// latent = (raw - mean) / std, for each channel.
    pub latent_mean: Vec<f64>,
    /// See `latent_mean`.
    pub latent_std: Vec<f64>,
}

/// A tensor of a graph.
#[derive(Debug, Clone, PartialEq)]
pub struct TensorSpec {
    /// Its name in the graph.
    pub name: String,
    /// Order of its axes.
    pub layout: Layout,
    /// Its numbers.
    pub dtype: Dtype,
}

/// Order of axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// Batch, channels, time, rows, columns.
    Bcthw,
    /// Batch, time, channels, rows, columns.
    Btchw,
    /// Batch, tokens (time, rows, columns), channels.
    Bnc,
}

/// Numbers of a tensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dtype {
    /// 32-bit float.
    F32,
    /// 16-bit float.
    F16,
    /// bfloat16.
    Bf16,
    /// 64-bit integer.
    I64,
    /// 32-bit integer.
    I32,
    /// Truth value.
    Bool,
}

impl Dtype {
    /// Its name in manifests.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F16 => "f16",
            Self::Bf16 => "bf16",
            Self::I64 => "i64",
            Self::I32 => "i32",
            Self::Bool => "bool",
        }
    }
}

impl Manifest {
    /// Reads the manifest of a folder, or the file named.
    ///
    /// # Errors
    /// A file that cannot be read, and everything that is wrong with its text.
    pub fn read(path: &Path) -> Result<Self, NetError> {
        let (folder, name) = if path.is_dir() {
            (path.to_path_buf(), FILE_NAME.to_owned())
        } else {
            let name = path.file_name().and_then(|n| n.to_str()).unwrap_or(FILE_NAME).to_owned();
            let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            (folder.to_path_buf(), name)
        };
        let bytes = Folder::new(&folder).open(&name)?.read(LARGEST)?;
        let file_name = folder.join(&name);
        let text = String::from_utf8(bytes)
            .map_err(|_| NetError::File { path: file_name.clone(), why: "is not UTF-8 text".into() })?;
        let mut manifest = Self::parse(&text, &file_name.display().to_string())?;
        manifest.folder = folder;
        Ok(manifest)
    }

    /// Reads the text of a manifest. `file_name` is only used in messages.
    ///
    /// # Errors
    /// Everything that is wrong with it, each at its place.
    pub fn parse(text: &str, file_name: &str) -> Result<Self, NetError> {
        Ok(parse::parse(text, file_name)?)
    }

    /// The encoder or decoder of a role.
    pub(crate) fn codec(&self, role: Role) -> Option<&CodecSpec> {
        match role {
            Role::Encode => self.encode.as_ref(),
            Role::EncodeImage => self.encode_image.as_ref(),
            Role::Decode => self.decode.as_ref(),
            Role::Velocity => None,
        }
    }

    /// Roles that making a clip takes.
    pub fn for_clips(&self) -> Vec<Role> {
        Role::ALL.into_iter().filter(|role| *role != Role::EncodeImage || self.encode_image.is_some()).collect()
    }

    /// Every graph and data file, in the order of roles.
    pub fn files(&self) -> impl Iterator<Item = &FileSpec> {
        let graphs = Role::ALL.into_iter().filter_map(|role| self.role(role)).flat_map(|role| &role.graphs);
        graphs.flat_map(|graph| std::iter::once(&graph.file).chain(&graph.data))
    }

    /// The files of a role, if the model has it.
    pub fn role(&self, role: Role) -> Option<&RoleSpec> {
        match role {
            Role::Velocity => self.velocity.as_ref().map(|v| &v.role),
            codec => self.codec(codec).map(|c| &c.role),
        }
    }
}

#[cfg(test)]
mod tests;
