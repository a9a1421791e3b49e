//! The program: reads the command line, runs one command, turns its outcome into an exit code. Knows nothing else.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;

use clap::Parser;
use physvideo_app::cli::Cli;
use physvideo_app::commands;
use physvideo_app::error::INTERNAL;

fn main() -> ExitCode {
    let cli = Cli::parse();
    // A fault of the program ends like any other error: with its own exit code and finished files kept.
    match catch_unwind(AssertUnwindSafe(|| commands::dispatch(cli))) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(error)) => {
            error.show();
            ExitCode::from(error.exit_code())
        }
        Err(_) => ExitCode::from(INTERNAL),
    }
}
