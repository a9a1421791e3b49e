//! Everything that ends a command early, and the exit code of each. Knows no command.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;

use miette::{Diagnostic, GraphicalReportHandler};
use physvideo::animate::AnimateError;
use physvideo::scene::{Kind, SceneErrors};
use physvideo::stages::lagrangian::LagrangianError;
use physvideo::stages::render::RenderError;
use physvideo_gpu::GpuError;
use physvideo_net::{Kind as NetKind, NetError};
use thiserror::Error;

use crate::flow::FlowError;
use crate::io::{ReadError, WriteError};

/// Exit code of a fault of the program itself.
pub const INTERNAL: u8 = 1;
/// Exit code of a run that the user stopped.
pub const INTERRUPTED: u8 = 130;

/// Why a command did not end well.
#[derive(Debug, Error)]
pub enum AppError {
    /// What is wrong with a scene or its files, each at its place.
    #[error(transparent)]
    Scene(#[from] SceneErrors),
    /// The scene file itself cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// Arguments that do not go together.
    #[error("{0}")]
    Usage(String),
    /// The device refused.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A network cannot be used.
    #[error(transparent)]
    Net(#[from] NetError),
    /// Some of several models cannot be used; each was told before.
    #[error("{bad} of {all} models cannot be used")]
    Models {
        /// How many cannot.
        bad: usize,
        /// How many were looked at.
        all: usize,
    },
    /// More memory than there is; nothing was allocated.
    #[error(
        "the run needs about {need} bytes of memory and {device} has {available} bytes available. Lower \
         simulation.grid_density or output.width, or choose another device with --device"
    )]
    Memory {
        /// Bytes predicted.
        need: u64,
        /// Bytes available.
        available: u64,
        /// Name of the device.
        device: String,
    },
    /// The clip cannot be made.
    #[error(transparent)]
    Animate(AnimateError),
    /// The flow did not come to its end.
    #[error(transparent)]
    Flow(#[from] FlowError),
    /// The simulation broke down.
    #[error("{0}")]
    Numeric(String),
    /// A result cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The user stopped the run; what was finished is kept.
    #[error("interrupted after {frames} of {total} frames; what was finished is in {}", out.display())]
    Interrupted {
        /// Frames finished.
        frames: u32,
        /// Frames asked for.
        total: u32,
        /// Where they are.
        out: PathBuf,
    },
    /// The validation layer complained.
    #[error("the Vulkan validation layer has {} messages; the first: {}", .0.len(), .0.first().map_or("", |m| m))]
    Validation(Vec<String>),
    /// A fault of the program or of the system below it.
    #[error("{0}")]
    Internal(String),
}

impl From<AnimateError> for AppError {
    fn from(error: AnimateError) -> Self {
        match error {
            AnimateError::Gpu(e)
            | AnimateError::Lagrangian(LagrangianError::Gpu(e))
            | AnimateError::Render(RenderError::Gpu(e)) => Self::Gpu(e),
            other => Self::Animate(other),
        }
    }
}

impl AppError {
    /// 1 internal, 2 scene, usage or input data, 3 device or memory, 4 model, 5 numeric, 7 output, 130 interrupted.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Scene(errors) if errors.iter().all(|e| e.problem().kind == Kind::Memory) => 3,
            Self::Scene(_) | Self::Read(_) | Self::Usage(_) => 2,
            Self::Animate(AnimateError::Render(RenderError::TooDense { .. })) => 3,
            Self::Animate(_) => 2,
            Self::Gpu(GpuError::Compile { .. } | GpuError::Call { .. }) => INTERNAL,
            Self::Gpu(_) | Self::Memory { .. } => 3,
            Self::Flow(FlowError::NotFinite { .. } | FlowError::CodecNotFinite { .. } | FlowError::Diverged { .. })
            | Self::Numeric(_) => 5,
            Self::Net(e) | Self::Flow(FlowError::Net(e)) => match e.kind() {
                NetKind::Usage => 2,
                NetKind::Memory => 3,
                NetKind::Model => 4,
                NetKind::Interrupted => INTERRUPTED,
            },
            Self::Models { .. } => 4,
            Self::Flow(FlowError::Gpu(GpuError::Compile { .. } | GpuError::Call { .. })) => INTERNAL,
            Self::Flow(FlowError::Gpu(_) | FlowError::Memory { .. }) => 3,
            Self::Flow(FlowError::Interrupted { .. }) => INTERRUPTED,
            Self::Flow(FlowError::Sde(_) | FlowError::Input(_)) => 2,
            // What an encoder cannot take was asked for in the scene.
            Self::Write(WriteError::VideoLimit { .. }) => 2,
            Self::Write(WriteError::Shape { .. }) => INTERNAL,
            Self::Write(_) => 7,
            Self::Interrupted { .. } => INTERRUPTED,
            Self::Validation(_) | Self::Internal(_) => INTERNAL,
        }
    }

    /// Tells it on standard error: with a picture of the place on a terminal, as plain lines elsewhere.
    pub fn show(&self) {
        let mut to = std::io::stderr().lock();
        // Nothing is to be done about a closed standard error.
        let _ = match self {
            Self::Scene(errors) if std::io::stderr().is_terminal() => {
                let handler = GraphicalReportHandler::new();
                errors.iter().try_for_each(|error| {
                    let mut text = String::new();
                    // The plain line where the picture cannot be drawn.
                    if handler.render_report(&mut text, error as &dyn Diagnostic).is_err() {
                        text = format!("{}: {error}", error.place());
                    }
                    writeln!(to, "{text}")
                })
            }
            Self::Scene(errors) => writeln!(to, "error: {errors}"),
            Self::Validation(messages) => {
                let shown = messages.iter().try_for_each(|m| writeln!(to, "validation: {m}"));
                shown.and_then(|()| writeln!(to, "error: {self}"))
            }
            Self::Interrupted { .. } | Self::Flow(FlowError::Interrupted { .. }) => writeln!(to, "{self}"),
            _ => writeln!(to, "error: {self}"),
        };
    }
}
