//! What can go wrong when a file is written. Does not know what the file is for.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use thiserror::Error;

/// A file that could not be written: which, why, what to do. Files finished before it are kept.
#[derive(Debug, Error)]
pub enum WriteError {
    /// The folder is not there.
    #[error("{path}: its folder does not exist. Create it or choose another with --out.")]
    NoFolder { path: PathBuf },
    /// The folder or disk does not let itself be written.
    #[error("{path}: not writable: {source}. Change the permissions or choose another folder with --out.")]
    ReadOnly { path: PathBuf, source: io::Error },
    /// No room, or the user's share of it is used up.
    #[error("{path}: the disk is full: {source}. Free some space or choose another folder with --out.")]
    DiskFull { path: PathBuf, source: io::Error },
    /// Any other refusal of the system.
    #[error("{path}: cannot be written: {source}. Check the disk or choose another folder with --out.")]
    Io { path: PathBuf, source: io::Error },
    /// Arrays that do not fit together: a fault of the caller.
    #[error("{path}: {what}. Nothing was written.")]
    Shape { path: PathBuf, what: String },
    /// A video needs a frame.
    #[error("{path}: the clip has no frames. Ask for at least one.")]
    EmptyClip { path: PathBuf },
    /// A size or rate that the encoder does not take.
    #[error("{path}: {what}. {advice}")]
    VideoLimit { path: PathBuf, what: String, advice: &'static str },
    /// The encoder or the container refused.
    #[error("{path}: the video could not be encoded: {what}. The frames written so far are kept.")]
    Encoder { path: PathBuf, what: String },
}

impl WriteError {
    /// Names the cause by the kind of an I/O error.
    pub(super) fn io(path: &Path, source: io::Error) -> Self {
        let path = path.into();
        match source.kind() {
            ErrorKind::NotFound | ErrorKind::NotADirectory => Self::NoFolder { path },
            ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => Self::ReadOnly { path, source },
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => Self::DiskFull { path, source },
            _ => Self::Io { path, source },
        }
    }

    pub(super) fn shape(path: &Path, what: impl ToString) -> Self {
        Self::Shape { path: path.into(), what: what.to_string() }
    }

    pub(super) fn encoder(path: &Path, what: impl ToString) -> Self {
        Self::Encoder { path: path.into(), what: what.to_string() }
    }

    /// The file the error is about.
    pub fn path(&self) -> &Path {
        match self {
            Self::NoFolder { path }
            | Self::ReadOnly { path, .. }
            | Self::DiskFull { path, .. }
            | Self::Io { path, .. }
            | Self::Shape { path, .. }
            | Self::EmptyClip { path }
            | Self::VideoLimit { path, .. }
            | Self::Encoder { path, .. } => path,
        }
    }
}
