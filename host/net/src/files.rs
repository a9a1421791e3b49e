//! Files of a model folder: plain files strictly inside it, opened once. Does not know what is in them.

use std::fs::{File, Metadata};
use std::io::{Read, Seek, SeekFrom};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Component, Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use sha2::{Digest, Sha256};

use crate::error::NetError;

/// Whether a relative path stays inside a folder by its words alone.
pub(crate) fn stays_inside(path: &str) -> bool {
    let mut parts = Path::new(path).components().peekable();
    // A separator or a drive in the other system's spelling is not a name either.
    let foreign = path.contains(['\\', ':', '\0']) || path.ends_with('/');
    parts.peek().is_some() && !foreign && parts.all(|part| matches!(part, Component::Normal(_)))
}

/// A folder whose files may be opened.
#[derive(Debug, Clone)]
pub(crate) struct Folder(PathBuf);

impl Folder {
    pub fn new(path: &Path) -> Self {
        Self(path.to_path_buf())
    }

    /// Opens a plain file. No component below the folder may be a link, and no other name may lead to the file.
    pub fn open(&self, relative: &str) -> Result<PlainFile, NetError> {
        let path = self.0.join(relative);
        let refuse = |why: &str| NetError::File { path: path.clone(), why: why.to_owned() };
        if !stays_inside(relative) {
            return Err(refuse("is not inside the model's folder"));
        }
        let mut folder = self.0.clone();
        for part in Path::new(relative).components() {
            folder.push(part);
            let metadata = folder.symlink_metadata().map_err(|e| match e.kind() {
                std::io::ErrorKind::NotFound => NetError::MissingFile { path: path.clone(), obtain: String::new() },
                _ => refuse(&reason(&e)),
            })?;
            if metadata.file_type().is_symlink() {
                let what = if folder == path { String::new() } else { format!("{} ", folder.display()) };
                return Err(refuse(&format!("{what}is a symbolic link; put the file itself there")));
            }
        }
        plain(&path.symlink_metadata().map_err(|e| refuse(&reason(&e)))?).map_err(refuse)?;
        // Not followed and not waited for, should the file have been exchanged since.
        let file = File::options()
            .read(true)
            .custom_flags(libc::O_NOFOLLOW | libc::O_NONBLOCK)
            .open(&path)
            .map_err(|e| refuse(&reason(&e)))?;
        let metadata = file.metadata().map_err(|e| refuse(&reason(&e)))?;
        plain(&metadata).map_err(refuse)?;
        Ok(PlainFile { identity: Identity::of(&metadata), size: metadata.len(), path, file })
    }
}

fn plain(metadata: &Metadata) -> Result<(), &'static str> {
    if metadata.is_dir() {
        return Err("is a folder");
    }
    if !metadata.is_file() {
        return Err("is not a plain file");
    }
    if metadata.nlink() > 1 {
        return Err("is a hard link, a second name of a file elsewhere; copy the file instead");
    }
    Ok(())
}

fn reason(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::NotFound => "is not there".into(),
        std::io::ErrorKind::NotADirectory => "is not there: a part of its path is not a folder".into(),
        std::io::ErrorKind::PermissionDenied => "may not be read".into(),
        _ => format!("cannot be read: {error}"),
    }
}

/// What tells one state of a file from another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Identity {
    device: u64,
    inode: u64,
    size: u64,
    changed: (i64, i64),
}

impl Identity {
    fn of(metadata: &Metadata) -> Self {
        Self {
            device: metadata.dev(),
            inode: metadata.ino(),
            size: metadata.size(),
            changed: (metadata.ctime(), metadata.ctime_nsec()),
        }
    }
}

/// An open file.
#[derive(Debug)]
pub(crate) struct PlainFile {
    pub path: PathBuf,
    pub size: u64,
    file: File,
    identity: Identity,
}

impl PlainFile {
    /// All bytes, if there are at most `most`.
    pub fn read(&mut self, most: u64) -> Result<Vec<u8>, NetError> {
        let mut bytes = Vec::new();
        self.again()?;
        let read = self.file.by_ref().take(most + 1).read_to_end(&mut bytes);
        read.map_err(|e| self.refuse(&reason(&e)))?;
        if bytes.len() as u64 > most {
            return Err(self.refuse(&format!("is larger than {most} bytes")));
        }
        Ok(bytes)
    }

    /// SHA-256 in hexadecimal.
    pub fn sha256(&mut self, cancel: &AtomicBool) -> Result<String, NetError> {
        self.again()?;
        let mut hash = Sha256::new();
        let mut block = vec![0; 1 << 20];
        loop {
            if cancel.load(Ordering::Relaxed) {
                return Err(NetError::Interrupted);
            }
            match self.file.read(&mut block) {
                Ok(0) => return Ok(hexadecimal(&hash.finalize())),
                Ok(n) => hash.update(&block[..n]),
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(e) => return Err(self.refuse(&reason(&e))),
            }
        }
    }

    /// Refuses when the path no longer leads to the file as it was when opened.
    pub fn unchanged(&self) -> Result<(), NetError> {
        let now = self.path.symlink_metadata().map_err(|e| self.refuse(&reason(&e)))?;
        if Identity::of(&now) == self.identity { Ok(()) } else { Err(self.refuse("changed while it was being used")) }
    }

    fn again(&mut self) -> Result<(), NetError> {
        let seek = self.file.seek(SeekFrom::Start(0));
        seek.map(|_| ()).map_err(|e| self.refuse(&reason(&e)))
    }

    fn refuse(&self, why: &str) -> NetError {
        NetError::File { path: self.path.clone(), why: why.to_owned() }
    }
}

/// SHA-256 of bytes that are in memory, in hexadecimal.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn why(folder: &Folder, name: &str) -> String {
        match folder.open(name) {
            Err(NetError::File { why, .. }) => why,
            Err(NetError::MissingFile { .. }) => "is not there".into(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn only_plain_files_inside_are_opened() {
        let temporary = tempfile::tempdir().unwrap();
        let root = temporary.path().join("model");
        std::fs::create_dir_all(root.join("sub")).unwrap();
        std::fs::write(root.join("sub/a.onnx"), b"abc").unwrap();
        std::fs::write(temporary.path().join("outside"), b"x").unwrap();
        std::os::unix::fs::symlink("sub/a.onnx", root.join("link.onnx")).unwrap();
        std::os::unix::fs::symlink("sub", root.join("folder")).unwrap();
        std::fs::hard_link(temporary.path().join("outside"), root.join("hard.onnx")).unwrap();
        let folder = Folder::new(&root);
        assert_eq!(folder.open("sub/a.onnx").unwrap().read(3).unwrap(), b"abc");
        assert!(folder.open("sub/a.onnx").unwrap().read(2).is_err());
        let hash = folder.open("sub/a.onnx").unwrap().sha256(&AtomicBool::new(false)).unwrap();
        assert_eq!((hash.clone(), hash.len()), (sha256(b"abc"), 64));
        assert!(why(&folder, "link.onnx").contains("symbolic link"));
        assert!(why(&folder, "folder/a.onnx").contains("symbolic link"));
        assert!(why(&folder, "hard.onnx").contains("hard link"));
        assert!(why(&folder, "sub").contains("folder"));
        assert!(why(&folder, "none.onnx").contains("not there"));
        for outside in ["../outside", "/etc/passwd", "", ".", "sub/../../outside", "a\\b", "C:x", "sub/"] {
            assert!(why(&folder, outside).contains("inside"), "{outside}");
        }
    }

    #[test]
    fn an_exchanged_file_is_noticed() {
        let temporary = tempfile::tempdir().unwrap();
        let folder = Folder::new(temporary.path());
        std::fs::write(temporary.path().join("a"), b"abc").unwrap();
        let file = folder.open("a").unwrap();
        file.unchanged().unwrap();
        std::fs::write(temporary.path().join("b"), b"abc").unwrap();
        std::fs::rename(temporary.path().join("b"), temporary.path().join("a")).unwrap();
        assert!(file.unchanged().is_err());
    }

    #[test]
    fn hashing_stops_when_asked() {
        let temporary = tempfile::tempdir().unwrap();
        std::fs::write(temporary.path().join("a"), b"abc").unwrap();
        let mut file = Folder::new(temporary.path()).open("a").unwrap();
        assert!(matches!(file.sha256(&AtomicBool::new(true)), Err(NetError::Interrupted)));
    }
}
