//! Φ_CF, the paper's Consistency-Guided Flow SDE: a driving video becomes one that is consistent with an image. Drives
//! a network and the latent's kernels; knows neither ONNX nor Vulkan beyond their interfaces.
//!
//! `stage` is what `run` calls · `model` opens a network · `source` reads a driving video · `clip` takes the frames through it chunk by
//! chunk (`chunks`, `time`) · `algorithm` is Algorithm 1 for one chunk ·
//! `network` a model of `physvideo-net` as its velocity · `pixels` frames and masks at the network's size ·
//! `checkpoint` what an interrupted run goes on from.

mod algorithm;
mod checkpoint;
mod chunk_report;
mod chunks;
mod clip;
pub mod model;
mod network;
mod outlook;
mod pixels;
mod report;
mod settings;
mod source;
mod stage;
mod time;
mod velocity;

pub use algorithm::{Guide, Outcome, Phase, State, Task, Watch, phi_cf};
pub use checkpoint::Checkpoint;
pub use chunk_report::{ChunkReport, ClipReport, Finished};
pub use clip::{Clip, ClipWatch};
pub use model::{FlowModel, NetChoice};
pub use network::Network;
pub use outlook::Outlook;
pub use pixels::{Driving, Pixels};
pub use report::FlowReport;
pub use settings::Settings;
pub use source::Source;
pub use stage::FlowRun;
pub use velocity::{FlowError, Velocity};
