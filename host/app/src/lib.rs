//! The parts of the program physvideo-engine; `main` only calls them.

pub mod io;
pub mod progress;
