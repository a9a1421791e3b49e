//! What an interrupted flow goes on from: the latents of finished chunks and of the last finished step. One file,
//! written whole; a file that is damaged or of another run is not used.

use std::io::Write;
use std::path::{Path, PathBuf};

use physvideo::stages::latent::LatentStats;
use physvideo_net::Tensor;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::algorithm::{Outcome, Phase, State};
use super::chunk_report::{ChunkReport, Finished};
use crate::io::WriteError;
use crate::io::write::write_whole;

/// Name of the file in the output folder.
pub const FILE: &str = "flow.checkpoint";
const MAGIC: &[u8; 8] = b"pvflow2\n";
/// No header is longer: it is a few hundred bytes.
const MOST_HEADER: u64 = 1 << 20;

/// Where a flow stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checkpoint {
    /// SHA-256 of everything that the result depends on.
    pub fingerprint: String,
    /// Every finished chunk, in order of running.
    pub finished: Vec<Finished>,
    /// The chunk in progress after its last finished step.
    pub state: Option<State>,
}

#[derive(Serialize, Deserialize)]
struct Header {
    fingerprint: String,
    /// SHA-256 of the numbers.
    sha256: String,
    /// Shape of each finished latent, and what was done.
    finished: Vec<(Vec<usize>, ChunkReport)>,
    state: Option<Progress>,
}

#[derive(Serialize, Deserialize)]
struct Progress {
    phase: u8,
    done: u32,
    latent: usize,
    history: Option<usize>,
    nfe: [u32; 3],
    calls: u32,
    /// Mean and root mean square after each iteration.
    stats: Vec<[f64; 2]>,
    /// Seconds inside the network, of arithmetic, of arithmetic with its hand-over.
    seconds: [f64; 3],
}

impl Progress {
    fn of(state: &State) -> Self {
        let Outcome { nfe, calls, stats, network_s, arithmetic_s, latent_s, .. } = &state.so_far;
        Self {
            phase: match state.phase {
                Phase::Inversion => 0,
                Phase::Sde => 1,
                Phase::Generation => 2,
            },
            done: state.done,
            latent: state.latent.len(),
            history: state.history.as_ref().map(Vec::len),
            nfe: *nfe,
            calls: *calls,
            stats: stats.iter().map(|s| [s.mean, s.rms]).collect(),
            seconds: [*network_s, *arithmetic_s, *latent_s],
        }
    }

    fn state(self, numbers: &mut Numbers) -> Option<State> {
        let phase = match self.phase {
            0 => Phase::Inversion,
            1 => Phase::Sde,
            2 => Phase::Generation,
            _ => return None,
        };
        let latent = numbers.take(self.latent)?;
        let history = match self.history {
            Some(n) => Some(numbers.take(n)?),
            None => None,
        };
        let [network_s, arithmetic_s, latent_s] = self.seconds;
        let stats = self.stats.iter().map(|[mean, rms]| LatentStats { faults: 0, mean: *mean, rms: *rms }).collect();
        let (nfe, calls, latent_so_far) = (self.nfe, self.calls, Vec::new());
        let so_far = Outcome { latent: latent_so_far, nfe, calls, stats, network_s, arithmetic_s, latent_s };
        Some(State { phase, done: self.done, latent, history, so_far })
    }
}

impl Checkpoint {
    /// Writes the file in a folder.
    ///
    /// # Errors
    /// What the system says.
    pub fn write(&self, folder: &Path) -> Result<(), WriteError> {
        let state = self.state.iter().flat_map(|s| std::iter::once(&s.latent).chain(s.history.as_ref()));
        let all = self.finished.iter().map(|f| &f.latent.data).chain(state);
        let numbers: Vec<u8> = all.flatten().flat_map(|number| number.to_le_bytes()).collect();
        let header = Header {
            fingerprint: self.fingerprint.clone(),
            sha256: sha256(&numbers),
            finished: self.finished.iter().map(|f| (f.latent.shape.clone(), f.report.clone())).collect(),
            state: self.state.as_ref().map(Progress::of),
        };
        let path = folder.join(FILE);
        let text = serde_json::to_vec(&header)
            .map_err(|e| WriteError::Io { path: path.clone(), source: std::io::Error::other(e) })?;
        write_whole(&path, |file| {
            file.write_all(MAGIC)?;
            file.write_all(&(text.len() as u64).to_le_bytes())?;
            file.write_all(&text)?;
            file.write_all(&numbers)
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
        if header.sha256 != sha256(numbers) {
            return Err(damaged());
        }
        let mut numbers = Numbers(numbers);
        let mut finished = Vec::new();
        for (shape, report) in header.finished {
            let count = shape.iter().try_fold(1_usize, |n, d| n.checked_mul(*d)).ok_or_else(damaged)?;
            let latent = Tensor { data: numbers.take(count).ok_or_else(damaged)?, shape };
            finished.push(Finished { latent, report });
        }
        let state = match header.state {
            None => None,
            Some(progress) => Some(progress.state(&mut numbers).ok_or_else(damaged)?),
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

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
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
            finished: vec![Finished {
                latent: Tensor { shape: vec![1, 2], data: vec![1.5, -2.0] },
                report: ChunkReport {
                    nfe: [20, 10, 20],
                    rms: vec![0.9, 1.1],
                    sigma: 28.0 / 29.0,
                    ..Default::default()
                },
            }],
            state: Some(State {
                phase: Phase::Sde,
                done: 3,
                latent: vec![0.5; 4],
                history: Some(vec![0.25; 4]),
                so_far: Outcome { nfe: [20, 3, 0], network_s: 0.1, ..Default::default() },
            }),
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
        let mut other = whole;
        let last = other.len() - 1;
        other[last] ^= 1;
        std::fs::write(&path, &other).unwrap();
        assert!(Checkpoint::read(folder.path(), "f").unwrap_err().contains("damaged"));
    }
}
