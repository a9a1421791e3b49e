//! What an interrupted flow goes on from: the latents of finished chunks and of the last finished step. One file,
//! written whole; a file that is damaged or of another run is not used.

use std::io::Write;
use std::path::{Path, PathBuf};

use physvideo_net::Tensor;
use serde::{Deserialize, Serialize};

use super::algorithm::{Phase, State};
use crate::io::WriteError;
use crate::io::write::write_whole;

/// Name of the file in the output folder.
pub const FILE: &str = "flow.checkpoint";
const MAGIC: &[u8; 8] = b"pvflow1\n";
/// No header is longer: it is a few hundred bytes.
const MOST_HEADER: u64 = 1 << 20;

/// Where a flow stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checkpoint {
    /// SHA-256 of everything that the result depends on.
    pub fingerprint: String,
    /// z* of every finished chunk, in order of running.
    pub finished: Vec<Tensor>,
    /// The chunk in progress after its last finished step.
    pub state: Option<State>,
}

#[derive(Serialize, Deserialize)]
struct Header {
    fingerprint: String,
    finished: Vec<Vec<usize>>,
    state: Option<(u8, u32, usize, Option<usize>)>,
}

impl Checkpoint {
    /// Writes the file in a folder.
    ///
    /// # Errors
    /// What the system says.
    pub fn write(&self, folder: &Path) -> Result<(), WriteError> {
        let phase = |p: Phase| match p {
            Phase::Inversion => 0,
            Phase::Sde => 1,
            Phase::Generation => 2,
        };
        let header = Header {
            fingerprint: self.fingerprint.clone(),
            finished: self.finished.iter().map(|t| t.shape.clone()).collect(),
            state: self
                .state
                .as_ref()
                .map(|s| (phase(s.phase), s.done, s.latent.len(), s.history.as_ref().map(Vec::len))),
        };
        let path = folder.join(FILE);
        let text = serde_json::to_vec(&header)
            .map_err(|e| WriteError::Io { path: path.clone(), source: std::io::Error::other(e) })?;
        write_whole(&path, |file| {
            file.write_all(MAGIC)?;
            file.write_all(&(text.len() as u64).to_le_bytes())?;
            file.write_all(&text)?;
            let state = self.state.iter().flat_map(|s| std::iter::once(&s.latent).chain(s.history.as_ref()));
            for numbers in self.finished.iter().map(|t| &t.data).chain(state) {
                for number in numbers {
                    file.write_all(&number.to_le_bytes())?;
                }
            }
            Ok(())
        })
    }

    /// Reads the file of a folder: absent when there is none; a sentence when it cannot be used.
    ///
    /// # Errors
    /// Why the file is of no use.
    pub fn read(folder: &Path, fingerprint: &str) -> Result<Option<Self>, String> {
        let path = folder.join(FILE);
        let bytes = match std::fs::read(&path) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(format!("{}: {e}", path.display())),
        };
        let damaged = || format!("{} is damaged", path.display());
        let rest = bytes.strip_prefix(MAGIC).ok_or_else(damaged)?;
        let (length, rest) = rest.split_first_chunk::<8>().ok_or_else(damaged)?;
        let length = u64::from_le_bytes(*length);
        if length > MOST_HEADER || length > rest.len() as u64 {
            return Err(damaged());
        }
        let (text, numbers) = rest.split_at(length as usize);
        let header: Header = serde_json::from_slice(text).map_err(|_| damaged())?;
        if header.fingerprint != fingerprint {
            return Err(format!("{} is of a run with other frames or settings", path.display()));
        }
        let mut numbers = Numbers(numbers);
        let mut finished = Vec::new();
        for shape in header.finished {
            let count = shape.iter().try_fold(1_usize, |n, d| n.checked_mul(*d)).ok_or_else(damaged)?;
            finished.push(Tensor { data: numbers.take(count).ok_or_else(damaged)?, shape });
        }
        let state = match header.state {
            None => None,
            Some((phase, done, latent, history)) => Some(State {
                phase: match phase {
                    0 => Phase::Inversion,
                    1 => Phase::Sde,
                    2 => Phase::Generation,
                    _ => return Err(damaged()),
                },
                done,
                latent: numbers.take(latent).ok_or_else(damaged)?,
                history: history.map(|n| numbers.take(n).ok_or_else(damaged)).transpose()?,
            }),
        };
        if !numbers.0.is_empty() {
            return Err(damaged());
        }
        Ok(Some(Self { fingerprint: header.fingerprint, finished, state }))
    }

    /// Takes the file away: the flow is done.
    pub fn remove(folder: &Path) {
        // A file that stays is refused by its fingerprint or used again for the same result.
        let _ = std::fs::remove_file(folder.join(FILE));
    }

    /// Where it is.
    pub fn path(folder: &Path) -> PathBuf {
        folder.join(FILE)
    }
}

struct Numbers<'a>(&'a [u8]);

impl Numbers<'_> {
    /// The next `count` numbers; `None` when there are not as many, or one is not finite.
    fn take(&mut self, count: usize) -> Option<Vec<f32>> {
        let (taken, rest) = self.0.split_at_checked(count.checked_mul(4)?)?;
        self.0 = rest;
        let numbers: Vec<f32> = taken.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        numbers.iter().all(|n| n.is_finite()).then_some(numbers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Checkpoint {
        Checkpoint {
            fingerprint: "f".into(),
            finished: vec![Tensor { shape: vec![1, 2], data: vec![1.5, -2.0] }],
            state: Some(State { phase: Phase::Sde, done: 3, latent: vec![0.5; 4], history: Some(vec![0.25; 4]) }),
        }
    }

    #[test]
    fn what_was_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(Checkpoint::read(folder.path(), "f"), Ok(None));
        example().write(folder.path()).unwrap();
        assert_eq!(Checkpoint::read(folder.path(), "f"), Ok(Some(example())));
        assert!(Checkpoint::read(folder.path(), "g").unwrap_err().contains("other frames or settings"));
        Checkpoint::remove(folder.path());
        assert_eq!(Checkpoint::read(folder.path(), "f"), Ok(None));
    }

    #[test]
    fn damage_is_told_wherever_it_is() {
        let folder = tempfile::tempdir().unwrap();
        example().write(folder.path()).unwrap();
        let path = Checkpoint::path(folder.path());
        let whole = std::fs::read(&path).unwrap();
        for length in 0..whole.len() {
            std::fs::write(&path, &whole[..length]).unwrap();
            assert!(Checkpoint::read(folder.path(), "f").is_err(), "cut to {length} bytes");
        }
        let mut long = whole.clone();
        long.push(0);
        std::fs::write(&path, &long).unwrap();
        assert!(Checkpoint::read(folder.path(), "f").is_err());
        let mut nan = whole;
        let last = nan.len() - 4;
        nan[last..].copy_from_slice(&f32::NAN.to_le_bytes());
        std::fs::write(&path, &nan).unwrap();
        assert!(Checkpoint::read(folder.path(), "f").is_err());
    }
}
