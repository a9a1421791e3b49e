//! The parts of the program physvideo-engine; `main` only calls them.

mod budget;
pub mod cli;
pub mod commands;
pub mod device;
pub mod error;
pub mod flow;
pub mod interrupt;
pub mod io;
pub mod load;
pub mod out_folder;
pub mod progress;
pub mod report;
pub mod run;
mod warm;
pub mod writer;
