//! A model that is open: its roles as calls on plain arrays. Knows no simulation and no step of a solver.

use std::sync::atomic::AtomicBool;

use crate::array::Plain;
use crate::chain::{self, Chain};
use crate::codec::{Codec, answer};
use crate::contract::agree;
use crate::embeddings::{Embeddings, constant_of_model};
use crate::error::NetError;
use crate::files::Folder;
use crate::inputs::{Branch, Conditioning, Own, VelocityInputs};
use crate::library::Runtime;
use crate::manifest::{ImageFill, Manifest, Part, Role, Source, VelocitySpec};
use crate::schedule::Sigma;
use crate::tensor::Tensor;

/// What of a model is opened.
#[derive(Debug, Clone, Copy, Default)]
pub struct OpenOptions<'a> {
    /// The roles that will be called.
    pub roles: &'a [Role],
    /// Bytes the networks may take; what the system has free where it is not said.
    pub available_memory: Option<u64>,
    /// Stops hashing and loading when it becomes true.
    pub cancel: Option<&'a AtomicBool>,
}

/// A model that is open.
#[derive(Debug)]
pub struct Model {
    runtime: Runtime,
    manifest: Manifest,
    encode: Option<Chain>,
    encode_image: Option<Chain>,
    decode: Option<Chain>,
    velocity: Option<Velocity>,
}

/// An open velocity network and the model's own arrays.
#[derive(Debug)]
struct Velocity {
    chain: Chain,
    embeddings: Option<Embeddings>,
    negative: Option<Embeddings>,
    constants: Vec<Option<Plain>>,
}

impl Model {
    /// Opens some roles of a model: files, hashes, memory and tensors are checked before anything is loaded.
    ///
    /// # Errors
    /// A role the model has not, a file that cannot be used, too little memory, a graph that contradicts the
    /// manifest, what ONNX Runtime refuses.
    pub fn open(runtime: &Runtime, manifest: Manifest, options: &OpenOptions<'_>) -> Result<Self, NetError> {
        let obtain = manifest.obtain.clone();
        Self::open_roles(runtime, manifest, options).map_err(|e| match e {
            NetError::MissingFile { path, .. } => NetError::MissingFile { path, obtain },
            other => other,
        })
    }

    fn open_roles(runtime: &Runtime, manifest: Manifest, options: &OpenOptions<'_>) -> Result<Self, NetError> {
        let never = AtomicBool::new(false);
        let cancel = options.cancel.unwrap_or(&never);
        let folder = Folder::new(&manifest.folder);
        let roles: Vec<Role> = Role::ALL.into_iter().filter(|role| options.roles.contains(role)).collect();
        let need = manifest.memory(&roles)?;
        let available = options.available_memory.or_else(free_memory).unwrap_or(u64::MAX);
        if need > available {
            let named: Vec<_> = roles.iter().map(|role| role.name()).collect();
            let what = format!("model {} ({})", manifest.name, named.join(", "));
            return Err(NetError::Memory { what, need, available });
        }
        let open = |role: Role| -> Result<Option<Chain>, NetError> {
            let Some(spec) = manifest.role(role).filter(|_| options.roles.contains(&role)) else { return Ok(None) };
            let checked = |graphs: &[chain::Graph]| agree(&manifest, role, graphs);
            Chain::open(runtime, &folder, spec, checked, cancel).map(Some)
        };
        let (encode, encode_image) = (open(Role::Encode)?, open(Role::EncodeImage)?);
        let (chain, decode) = (open(Role::Velocity)?, open(Role::Decode)?);
        let velocity = match (chain, &manifest.velocity) {
            (Some(chain), Some(spec)) => Some(Velocity::new(chain, spec, &folder)?),
            _ => None,
        };
        Ok(Self { runtime: runtime.clone(), manifest, encode, encode_image, decode, velocity })
    }

    /// What the model's manifest says.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Frames [3, F, H, W] in 0..1 to latents [C, T, h, w]; one frame goes to the network for images, if there is one.
    ///
    /// # Errors
    /// Frames that do not divide into latents, a network that fails, an interruption.
    pub fn encode(&mut self, frames: &Tensor, cancel: &AtomicBool) -> Result<Tensor, NetError> {
        let image = frames.shape.get(1) == Some(&1) && self.encode_image.is_some();
        self.codec(if image { Role::EncodeImage } else { Role::Encode })?.encode(frames, cancel)
    }

    /// Latents [C, T, h, w] to frames [3, F, H, W] in 0..1.
    ///
    /// # Errors
    /// Latents of another size, a network that fails, an interruption.
    pub fn decode(&mut self, latents: &Tensor, cancel: &AtomicBool) -> Result<Tensor, NetError> {
        self.codec(Role::Decode)?.decode(latents, cancel)
    }

    /// Makes everything the velocity network reads besides z and the noise level.
    ///
    /// # Errors
    /// A condition of another size, an embedding that is missing, an encoder that is needed and not open.
    pub fn condition(&mut self, c: Conditioning, cancel: &AtomicBool) -> Result<VelocityInputs, NetError> {
        let grey = if self.wants_grey() { Some(self.encode_grey(&c, cancel)?) } else { None };
        let velocity = self.velocity.as_ref().ok_or_else(|| not_open(&self.manifest, Role::Velocity))?;
        let own = Own {
            embeddings: velocity.embeddings.as_ref(),
            negative: velocity.negative.as_ref(),
            constants: &velocity.constants,
            grey: grey.as_ref(),
        };
        VelocityInputs::new(&self.manifest, &c, &own)
    }

    /// Evaluates the network: its raw answer, [C, T, h, w], into `out`. `latents` is z; where `inputs.direct()` is
    /// given it may be the whole input, z first, which is then read in place.
    ///
    /// # Errors
    /// Latents of another length, a network that fails, an interruption.
    pub fn evaluate(
        &mut self,
        inputs: &VelocityInputs,
        latents: &[f32],
        sigma: Sigma,
        branch: Branch,
        out: &mut Vec<f32>,
        cancel: &AtomicBool,
    ) -> Result<(), NetError> {
        let manifest = &self.manifest;
        let (Some(velocity), Some(spec)) = (&mut self.velocity, &manifest.velocity) else {
            return Err(not_open(manifest, Role::Velocity));
        };
        let filled = inputs.fill(latents, sigma, branch)?;
        let feeds = filled.feeds();
        let shape = velocity.chain.run(&self.runtime, &feeds, &spec.output.name, out, cancel)?;
        *out = answer(manifest, &spec.output, shape, std::mem::take(out), inputs.axes())?;
        Ok(())
    }

    /// Loads what is loaded at each call only, one graph after the other, to see that it can be.
    pub(crate) fn try_each(&mut self, cancel: &AtomicBool) -> Result<(), NetError> {
        let velocity = self.velocity.as_mut().map(|velocity| &mut velocity.chain);
        let codecs = [self.encode.as_mut(), self.encode_image.as_mut(), self.decode.as_mut()];
        codecs.into_iter().flatten().chain(velocity).try_for_each(|chain| chain.try_each(&self.runtime, cancel))
    }

    fn codec(&mut self, role: Role) -> Result<Codec<'_>, NetError> {
        let chain = match role {
            Role::Encode => &mut self.encode,
            Role::EncodeImage => &mut self.encode_image,
            _ => &mut self.decode,
        };
        match (self.manifest.codec(role), chain) {
            (Some(spec), Some(chain)) => Ok(Codec { runtime: &self.runtime, manifest: &self.manifest, spec, chain }),
            _ => Err(not_open(&self.manifest, role)),
        }
    }

    fn wants_grey(&self) -> bool {
        let inputs = self.manifest.velocity.iter().flat_map(|v| &v.inputs);
        inputs.into_iter().any(|i| match &i.source {
            Source::Latent(l) => l.image_fill == ImageFill::EncodedGrey && l.parts.contains(&Part::Image),
            _ => false,
        })
    }

    /// The latents of the image followed by grey frames.
    fn encode_grey(&mut self, c: &Conditioning, cancel: &AtomicBool) -> Result<Tensor, NetError> {
        let name = &self.manifest.name;
        let frame = c.image_frame.as_ref();
        let frame =
            frame.ok_or_else(|| NetError::usage(format!("model {name} needs the image, not only its latent")))?;
        let spatial = self.manifest.latent.spatial;
        let axes = frame.axes("the image")?;
        let [height, width] = [c.grid.height, c.grid.width].map(|n| n.saturating_mul(spatial));
        if axes != [3, 1, height, width] {
            let (have, want) = (&frame.shape, [3, 1, height, width]);
            return Err(NetError::usage(format!("model {name}: the image has shape {have:?} and must have {want:?}")));
        }
        let frames = 1 + c.grid.frames.saturating_sub(1).saturating_mul(self.manifest.latent.temporal);
        let mut grey = Tensor::filled(vec![3, frames, height, width], 0.5)?;
        let each = grey.data.chunks_mut(frames * height * width).zip(frame.data.chunks(height * width));
        each.for_each(|(to, from)| to[..height * width].copy_from_slice(from));
        self.encode(&grey, cancel)
    }
}

impl Velocity {
    fn new(chain: Chain, spec: &VelocitySpec, folder: &Folder) -> Result<Self, NetError> {
        let arrays = |name: &Option<String>| name.as_ref().map(|n| Embeddings::of_model(folder, n)).transpose();
        let constant = |source: &Source| match source {
            Source::ConstantFile { file } => constant_of_model(folder, file).map(Some),
            _ => Ok(None),
        };
        Ok(Self {
            chain,
            embeddings: arrays(&spec.embeddings)?,
            negative: arrays(&spec.negative)?,
            constants: spec.inputs.iter().map(|i| constant(&i.source)).collect::<Result<_, _>>()?,
        })
    }
}

pub(crate) fn has_no(manifest: &Manifest, role: Role) -> NetError {
    NetError::usage(format!("model {} has no {} network", manifest.name, role.name()))
}

fn not_open(manifest: &Manifest, role: Role) -> NetError {
    if manifest.role(role).is_none() {
        return has_no(manifest, role);
    }
    NetError::usage(format!("the {} network of model {} was not opened", role.name(), manifest.name))
}

/// Bytes that programs can still have, where the system tells: those of the machine, or of the container if it has
/// fewer.
pub(crate) fn free_memory() -> Option<u64> {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let of = |text: &str, key: &str| {
        let line = text.lines().find_map(|line| line.strip_prefix(key))?;
        line.trim().trim_end_matches("kB").trim().parse::<u64>().ok()
    };
    let machine = of(&read("/proc/meminfo")?, "MemAvailable:")? << 10;
    let container = || {
        let most = read("/sys/fs/cgroup/memory.max")?.trim().parse::<u64>().ok()?;
        // What is cached of files is given back when it is needed.
        Some(most.saturating_sub(of(&read("/sys/fs/cgroup/memory.stat")?, "anon ")?))
    };
    Some(container().map_or(machine, |container| machine.min(container)))
}
