//! Everything that can go wrong with a network. Knows no exit code: `kind` is what a program maps.

use std::path::PathBuf;

use thiserror::Error;

use crate::manifest::ManifestErrors;

/// Sorts of trouble that a program treats alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
    /// The library, a manifest, a file, its hash, a tensor's name, type or shape.
    Model,
    /// More memory than there is; nothing was loaded.
    Memory,
    /// The caller asked to stop.
    Interrupted,
    /// The caller asked for what the model cannot do, or gave something of another size.
    Usage,
}

/// Why a network cannot be used.
#[derive(Debug, Error)]
pub enum NetError {
    /// No library was found.
    #[error(
        "ONNX Runtime is not there. Looked for {tried}. Run tools/setup, or name the library with --ort-lib or \
         ORT_DYLIB_PATH"
    )]
    LibraryMissing {
        /// The places, in the order they were looked at.
        tried: String,
    },
    /// The file is not a library that can be used.
    #[error("{} cannot be used as ONNX Runtime: {why}", path.display())]
    Library {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// A second library in one process.
    #[error("ONNX Runtime is already loaded from {}; a process can load only one, and {} was asked for", loaded.display(), asked.display())]
    SecondLibrary {
        /// The one in use.
        loaded: PathBuf,
        /// The one asked for now.
        asked: PathBuf,
    },
    /// The library lacks a provider, or its device does.
    #[error("ONNX Runtime at {} cannot use {provider}: {why}", path.display())]
    Provider {
        /// What was asked for.
        provider: &'static str,
        /// The library.
        path: PathBuf,
        /// What it says.
        why: String,
    },
    /// What is wrong with a manifest, each at its place.
    #[error(transparent)]
    Manifest(#[from] ManifestErrors),
    /// A file of a model is not there.
    #[error("{}: is not there{}", path.display(), how_to(obtain))]
    MissingFile {
        /// The file.
        path: PathBuf,
        /// How to get it, where the manifest says.
        obtain: String,
    },
    /// A file of a model cannot be used.
    #[error("{}: {why}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// A file is not the one the manifest means.
    #[error("{}: its SHA-256 is {found}, the manifest says {expected}", path.display())]
    Hash {
        /// The file.
        path: PathBuf,
        /// Of the manifest.
        expected: String,
        /// Of the file.
        found: String,
    },
    /// A graph and the manifest contradict each other, or two graphs of a chain do.
    #[error("{}: tensor `{tensor}`: {why}", path.display())]
    Contract {
        /// The graph.
        path: PathBuf,
        /// Name of the tensor.
        tensor: String,
        /// The contradiction.
        why: String,
    },
    /// ONNX Runtime refused a graph or failed in it.
    #[error("{}: ONNX Runtime says: {why}", path.display())]
    Runtime {
        /// The graph.
        path: PathBuf,
        /// Its words.
        why: String,
    },
    /// More memory than there is; nothing was loaded.
    #[error("{what} needs about {need} bytes of memory and {available} bytes are available")]
    Memory {
        /// The model and its roles.
        what: String,
        /// Bytes needed.
        need: u64,
        /// Bytes available.
        available: u64,
    },
    /// The caller asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// A file of arrays that the user gave cannot be used.
    #[error("{}: {why}", path.display())]
    Arrays {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// The model cannot do what is asked, or was given something of another size.
    #[error("{0}")]
    Usage(String),
}

impl NetError {
    /// Which sort of trouble it is.
    pub fn kind(&self) -> Kind {
        match self {
            Self::LibraryMissing { .. }
            | Self::Library { .. }
            | Self::SecondLibrary { .. }
            | Self::Provider { .. }
            | Self::Manifest(_)
            | Self::File { .. }
            | Self::MissingFile { .. }
            | Self::Hash { .. }
            | Self::Contract { .. }
            | Self::Runtime { .. } => Kind::Model,
            Self::Memory { .. } => Kind::Memory,
            Self::Interrupted => Kind::Interrupted,
            Self::Arrays { .. } | Self::Usage(_) => Kind::Usage,
        }
    }

    pub(crate) fn usage(text: impl Into<String>) -> Self {
        Self::Usage(text.into())
    }
}

fn how_to(obtain: &str) -> String {
    if obtain.is_empty() { String::new() } else { format!(". How to get it: {}", obtain.trim()) }
}
