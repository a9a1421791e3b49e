//! What can be wrong with a file that is read. Does not know who asked for it.

use std::path::{Path, PathBuf};

use thiserror::Error;

/// A file that could not be used: which, what is wrong with it, what to do.
#[derive(Debug, Error)]
pub enum ReadError {
    /// Nothing has that name.
    #[error("{path}: there is no such file. Check the name; relative paths start at the scene file's folder.")]
    Missing { path: PathBuf },
    /// A folder where a file is needed.
    #[error("{path}: this is a folder. Name a file in it.")]
    Folder { path: PathBuf },
    /// The system refused.
    #[error("{path}: cannot be read: {source}. Check its permissions and the disk.")]
    Io { path: PathBuf, source: std::io::Error },
    /// Not a file of any kind that is read here.
    #[error("{path}: this is not {expected}. Convert it or name another file.")]
    Format { path: PathBuf, expected: &'static str },
    /// The right kind of file, with contents that do not hold together.
    #[error("{path}: the file is damaged or cut short: {what}. Copy or write it again.")]
    Damaged { path: PathBuf, what: String },
    /// A sound file of a variety that is not read here.
    #[error("{path}: {what}. {advice}")]
    Unsupported { path: PathBuf, what: String, advice: &'static str },
    /// Announced sizes over a limit, refused before allocation.
    #[error("{path}: {what}; the limit is {limit}. Use a smaller file.")]
    TooLarge { path: PathBuf, what: String, limit: String },
    /// A sound file with values that cannot be used.
    #[error("{path}: {what}. {advice}")]
    Content { path: PathBuf, what: String, advice: &'static str },
    /// An absolute path where scenes must stay movable.
    #[error("{path}: the path is absolute. Write it relative to the scene file's folder.")]
    Absolute { path: PathBuf },
    /// A path, or the link it is, that leaves the asset root.
    #[error(
        "{path}: lies outside the asset root {root}. Move the file inside, or put an assets.toml in a folder above."
    )]
    Outside { path: PathBuf, root: PathBuf },
}

impl ReadError {
    pub(super) fn format(path: &Path, expected: &'static str) -> Self {
        Self::Format { path: path.into(), expected }
    }

    pub(super) fn damaged(path: &Path, what: impl ToString) -> Self {
        Self::Damaged { path: path.into(), what: what.to_string() }
    }

    pub(super) fn unsupported(path: &Path, what: impl ToString, advice: &'static str) -> Self {
        Self::Unsupported { path: path.into(), what: what.to_string(), advice }
    }

    pub(super) fn content(path: &Path, what: impl ToString, advice: &'static str) -> Self {
        Self::Content { path: path.into(), what: what.to_string(), advice }
    }

    /// The file the error is about.
    pub fn path(&self) -> &Path {
        match self {
            Self::Missing { path }
            | Self::Folder { path }
            | Self::Io { path, .. }
            | Self::Format { path, .. }
            | Self::Damaged { path, .. }
            | Self::Unsupported { path, .. }
            | Self::TooLarge { path, .. }
            | Self::Content { path, .. }
            | Self::Absolute { path }
            | Self::Outside { path, .. } => path,
        }
    }
}
