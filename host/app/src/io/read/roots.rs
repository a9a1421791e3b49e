//! Where a scene's files may lie. Does not open them.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::ReadError;

/// The folder a scene's files may not leave, and the folder its paths start from. Both are free of links.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AssetRoot {
    root: PathBuf,
    base: PathBuf,
}

impl AssetRoot {
    /// The root of a scene file: the nearest folder at or above it that holds `assets.toml`, else its own folder.
    pub fn of_scene(scene: &Path) -> Result<Self, ReadError> {
        let scene = real_path(scene)?;
        let base = scene.parent().unwrap_or(&scene).to_path_buf();
        let root = base.ancestors().find(|f| f.join("assets.toml").is_file()).unwrap_or(&base).to_path_buf();
        Ok(Self { root, base })
    }

    /// The folder that files may not leave.
    pub fn folder(&self) -> &Path {
        &self.root
    }

    /// The real path of a file named relative to the scene file's folder. Refused when it is absolute, missing or,
    /// after following links, outside the root.
    pub fn resolve(&self, relative: &Path) -> Result<PathBuf, ReadError> {
        // A leading separator or drive letter counts, also where the system does not call that absolute.
        if relative.has_root() || relative.is_absolute() {
            return Err(ReadError::Absolute { path: relative.into() });
        }
        let outside = || ReadError::Outside { path: relative.into(), root: self.root.clone() };
        let joined = self.base.join(relative);
        match real_path(&joined) {
            Ok(real) if real.starts_with(&self.root) => Ok(real),
            Ok(_) => Err(outside()),
            // Whether something exists outside the root is not told.
            Err(_) if !self.stays_inside(relative) => Err(outside()),
            Err(e) => Err(e),
        }
    }

    /// Whether a path stays in the root by its words alone.
    fn stays_inside(&self, relative: &Path) -> bool {
        let mut folder = self.base.clone();
        for part in relative.components() {
            match part {
                std::path::Component::ParentDir => {
                    folder.pop();
                }
                part => folder.push(part),
            }
            if !folder.starts_with(&self.root) {
                return false;
            }
        }
        true
    }
}

fn real_path(path: &Path) -> Result<PathBuf, ReadError> {
    fs::canonicalize(path).map_err(|source| match source.kind() {
        ErrorKind::NotFound | ErrorKind::NotADirectory => ReadError::Missing { path: path.into() },
        _ => ReadError::Io { path: path.into(), source },
    })
}
