//! Files in and out of the program. Knows nothing of scenes, simulation or GPUs: paths and plain arrays only.

pub mod read;
pub mod write;

pub use read::ReadError;
pub use write::WriteError;
