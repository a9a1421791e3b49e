//! Encoding what a run makes: every writer takes plain arrays and leaves a whole file or none; none knows the run.

mod encoder_thread;
mod error;
mod exr;
mod frames;
mod points;
mod report;
mod video;
mod whole;
mod yuv;

pub use encoder_thread::EncoderThread;
pub use error::WriteError;
pub use exr::{ExrFrame, write_exr};
pub use frames::{numbered, write_png};
pub use points::{PointFrame, write_npz, write_ply};
pub use report::{OutputFile, sha256, write_json};
pub use video::{VideoSummary, VideoWriter};
pub use whole::{WholeFile, create_folder, write_whole};
