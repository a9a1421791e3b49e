//! The command line as data. Does not know what the commands do.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use physvideo::scene::Until;
use physvideo_net::Provider;

use crate::progress::ProgressMode;

const EXIT_CODES: &str = "\
Exit codes: 0 done, 1 internal fault, 2 scene, usage or input data, 3 device or memory, 4 model, \
5 numeric trouble, 7 output cannot be written, 130 interrupted.";

/// Photographs and meshes to simulated, point-rendered video.
#[derive(Debug, Parser)]
#[command(name = "physvideo-engine", version, after_help = EXIT_CODES)]
#[command(args_conflicts_with_subcommands = true, arg_required_else_help = true)]
pub struct Cli {
    /// What to do; without it `--scene` runs a scene.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Run this scene.
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// How to run it.
    #[command(flatten)]
    pub options: RunOptions,
}

/// A command.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a scene and write what it asks for.
    Run {
        /// Scene file (TOML).
        scene: PathBuf,
        /// How to run it.
        #[command(flatten)]
        options: RunOptions,
    },
    /// Say what a run would do: stages, those skipped and why, particles, substeps, memory. Writes nothing.
    Plan {
        /// Scene file (TOML).
        scene: PathBuf,
        /// What the scene says otherwise.
        #[command(flatten)]
        overrides: Overrides,
        /// Device to plan for: index or part of a name.
        #[arg(long, value_name = "NAME|INDEX")]
        device: Option<String>,
        /// Folder of a network's model.toml in place of the scene's.
        #[arg(long, value_name = "DIR")]
        model: Option<PathBuf>,
    },
    /// Find everything that is wrong with a scene and its files, without a device.
    Check {
        /// Scene file (TOML).
        scene: PathBuf,
    },
    /// Print the JSON Schema of scene files, for editors.
    Schema,
    /// List the Vulkan devices.
    Devices {
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Look at the models networks come from.
    Models {
        /// What to look for.
        #[command(subcommand)]
        command: ModelsCommand,
    },
}

/// What to look for in models.
#[derive(Debug, Subcommand)]
pub enum ModelsCommand {
    /// List models: what they do, and whether their files are here.
    List {
        /// Folders of models, or folders of such folders [default: assets/models].
        folders: Vec<PathBuf>,
    },
    /// Check files, hashes, tensors and memory of models, and that ONNX Runtime loads them.
    Check {
        /// Folders of models, or folders of such folders [default: assets/models].
        folders: Vec<PathBuf>,
        /// ONNX Runtime's library [default: beside the program, else the system's].
        #[arg(long, value_name = "PATH")]
        ort_lib: Option<PathBuf>,
        /// Where networks run.
        #[arg(long, value_name = "WHERE")]
        provider: Option<ProviderName>,
    },
}

/// What a command line says in place of the scene.
#[derive(Debug, Clone, Default, Args)]
pub struct Overrides {
    /// Seed of every random stream.
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Number of frames.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: Option<u32>,
    /// Largest error that is measured of bodies like those of the scene, relative; sets grid density and Courant number.
    #[arg(long, value_name = "SHARE", value_parser = share)]
    pub error_budget: Option<f32>,
    /// The last thing that is made; what it does not need is skipped.
    #[arg(long, value_name = "WHAT")]
    pub output: Option<Last>,
}

/// A positive number.
fn share(text: &str) -> Result<f32, String> {
    let number = text.parse::<f32>().ok().filter(|x| x.is_finite() && *x > 0.0);
    number.ok_or_else(|| "give a number above 0, for example 0.05 for 5 %".into())
}

/// Options of a run.
#[derive(Debug, Clone, Default, Args)]
pub struct RunOptions {
    /// Folder of the results [default: out/<name of the scene>].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Vulkan device: index or part of a name [default: the first discrete GPU, else the first].
    #[arg(long, value_name = "NAME|INDEX")]
    pub device: Option<String>,
    /// What the scene says otherwise.
    #[command(flatten)]
    pub overrides: Overrides,
    /// ONNX Runtime's library [default: beside the program, else the system's].
    #[arg(long, value_name = "PATH")]
    pub ort_lib: Option<PathBuf>,
    /// Where networks run.
    #[arg(long, value_name = "WHERE")]
    pub provider: Option<ProviderName>,
    /// Folder of a network's model.toml in place of the scene's `flow.model`; it may lie anywhere.
    #[arg(long, value_name = "DIR")]
    pub model: Option<PathBuf>,
    /// Begin the flow anew, whatever an interrupted run left.
    #[arg(long)]
    pub fresh: bool,
    /// Say nothing but warnings and errors.
    #[arg(long, conflicts_with = "json_progress")]
    pub quiet: bool,
    /// Progress as lines of JSON on standard error.
    #[arg(long)]
    pub json_progress: bool,
    /// Run under the Vulkan validation layer and fail on any message of it.
    #[arg(long)]
    pub validate: bool,
}

impl RunOptions {
    /// How progress is told.
    pub fn progress(&self) -> ProgressMode {
        match (self.quiet, self.json_progress) {
            (true, _) => ProgressMode::Quiet,
            (_, true) => ProgressMode::Json,
            _ => ProgressMode::Auto,
        }
    }
}

/// Where networks run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProviderName {
    /// The processor.
    Cpu,
    /// An NVIDIA card, where the library has it.
    Cuda,
}

impl From<ProviderName> for Provider {
    fn from(name: ProviderName) -> Self {
        match name {
            ProviderName::Cpu => Self::Cpu,
            ProviderName::Cuda => Self::Cuda,
        }
    }
}

/// The last thing that is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Last {
    /// Simulate; report only.
    State,
    /// Also write points.
    Points,
    /// Also draw frames.
    Frames,
    /// Also refine the frames by the network, where the scene has one, and encode the videos.
    Video,
}

impl From<Last> for Until {
    fn from(last: Last) -> Self {
        match last {
            Last::State => Until::State,
            Last::Points => Until::Points,
            Last::Frames => Until::Frames,
            Last::Video => Until::Video,
        }
    }
}
