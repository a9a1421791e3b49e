//! The commands, one a file; `run` has a module of its own. Each takes parsed arguments and prints what it found.

mod check;
mod devices;
mod models;
mod plan;
mod schema;

use std::io::Write;

use crate::cli::{Cli, Command};
use crate::error::AppError;
use crate::run;

/// Does what the command line asks.
///
/// # Errors
/// Whatever ended the command early.
pub fn dispatch(cli: Cli) -> Result<(), AppError> {
    match cli.command {
        Some(Command::Run { scene, options }) => run::run(&scene, &options),
        Some(Command::Plan { scene, overrides, device, model }) => {
            plan::plan(&scene, &overrides, device.as_deref(), model.as_ref())
        }
        Some(Command::Check { scene }) => check::check(&scene),
        Some(Command::Schema) => schema::schema(),
        Some(Command::Devices { json }) => devices::devices(json),
        Some(Command::Models { command }) => models::models(command),
        None => match cli.scene {
            Some(scene) => run::run(&scene, &cli.options),
            None => Err(AppError::Usage("no scene was given: use `--scene FILE` or a command (see --help)".into())),
        },
    }
}

/// Prints to standard output. A reader that went away (`| head`) is not an error.
pub(crate) fn print(text: &str) {
    let _ = writeln!(std::io::stdout().lock(), "{text}");
}
