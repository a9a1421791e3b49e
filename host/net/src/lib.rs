//! Networks: ONNX Runtime, the manifests that describe models, and the roles encode, velocity and decode. Knows
//! neither the simulation nor Vulkan, and no model by name.

mod array;
mod chain;
mod check;
mod codec;
mod contract;
mod embeddings;
mod error;
mod files;
mod inputs;
mod layout;
mod library;
mod manifest;
mod model;
mod npy;
mod numbers;
mod onnx;
mod prediction;
mod schedule;
mod session;
mod tensor;

pub use check::{CheckLine, Status, check, check_folder};
pub use embeddings::Embeddings;
pub use error::{Kind, NetError};
pub use inputs::{Branch, Conditioning, Direct, VelocityInputs};
pub use library::{LibraryChoice, Provider, Runtime};
pub use manifest::{
    Axis, ChunkSpec, CodecSpec, Direction, Dtype, FileSpec, FirstLatent, GraphSpec, Grid, Guidance, HistorySlots,
    ImageFill, InputSpec, LatentInput, LatentSpec, Layout, Load, Manifest, ManifestErrors, Part, Per, Problem, Role,
    RoleSpec, Source, TensorSpec, VelocitySpec,
};
pub use model::{Model, OpenOptions};
pub use prediction::{Coefficients, Prediction};
pub use schedule::{Schedule, ScheduleKind, ScheduleSpec, Sigma, StepIndex};
pub use tensor::Tensor;
