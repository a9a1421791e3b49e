//! Files that appear whole or not at all. Does not know their formats.
//!
//! Guards against a run that stops midway and against readers that look early, not against a loss of power: the disk
//! is not told to flush.

use std::fs;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::WriteError;

/// A file being written under a temporary name in the folder of its own; dropped before `commit`, it leaves nothing.
pub struct WholeFile {
    path: PathBuf,
    file: BufWriter<NamedTempFile>,
}

impl WholeFile {
    /// Begins a file; an older one of that name stays until `commit`.
    pub fn create(path: &Path) -> Result<Self, WriteError> {
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".").suffix(".part");
        // Temporary files are private by default; results are as readable as the user's other files.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let file = builder.tempfile_in(folder).map_err(|e| WriteError::io(path, e))?;
        Ok(Self { path: path.into(), file: BufWriter::with_capacity(1 << 16, file) })
    }

    /// Writes what is buffered and gives the file its name.
    pub fn commit(self) -> Result<(), WriteError> {
        let Self { path, file } = self;
        let file = file.into_inner().map_err(|e| WriteError::io(&path, e.into_error()))?;
        file.persist(&path).map(drop).map_err(|e| WriteError::io(&path, e.error))
    }

    /// The name the file will have.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for WholeFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

/// Writes a file in one go by `fill`; when that fails there is no new file and an older one is untouched.
pub fn write_whole(path: &Path, fill: impl FnOnce(&mut WholeFile) -> io::Result<()>) -> Result<(), WriteError> {
    let mut file = WholeFile::create(path)?;
    fill(&mut file).map_err(|e| WriteError::io(path, e))?;
    file.commit()
}

/// Makes a folder and those above it, where they are not there yet.
pub fn create_folder(path: &Path) -> Result<(), WriteError> {
    fs::create_dir_all(path).map_err(|e| WriteError::io(path, e))
}
