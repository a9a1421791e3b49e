//! JSON files and the fingerprints of outputs. Does not know what a report says.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::{WriteError, write_whole};

/// One entry of a report's `outputs`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct OutputFile {
    /// Relative to the output folder, with forward slashes.
    pub path: String,
    /// Hexadecimal, lower case.
    pub sha256: String,
}

impl OutputFile {
    /// Fingerprints a file that lies in `folder`.
    pub fn of(folder: &Path, file: &Path) -> Result<Self, WriteError> {
        let relative = file.strip_prefix(folder).unwrap_or(file);
        let parts: Vec<_> = relative.components().map(|c| c.as_os_str().to_string_lossy()).collect();
        Ok(Self { path: parts.join("/"), sha256: sha256(file)? })
    }
}

/// The SHA-256 of a file's bytes as 64 hexadecimal digits.
pub fn sha256(path: &Path) -> Result<String, WriteError> {
    let failed = |source: io::Error| WriteError::Io { path: path.into(), source };
    let mut file = File::open(path).map_err(failed)?;
    let mut hash = Sha256::new();
    let mut block = vec![0; 1 << 16];
    loop {
        match file.read(&mut block).map_err(failed)? {
            0 => break,
            n => hash.update(&block[..n]),
        }
    }
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Writes a value as indented JSON with a final new line. Numbers that are not finite become `null`.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), WriteError> {
    write_whole(path, |file| {
        serde_json::to_writer_pretty(&mut *file, value)?;
        file.write_all(b"\n")
    })
}
