//! Frames and points to files on a thread beside the simulation. Does not know how they were made.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};

use physvideo::scene::PointFormat;

use crate::io::WriteError;
use crate::io::write::{ExrFrame, OutputFile, PointFrame, numbered, write_exr, write_npz, write_ply, write_png};

/// Jobs that may wait; one more makes `push` wait, which bounds memory.
const WAITING: usize = 4;

/// Something to write.
pub enum Job {
    /// A drawn frame as PNG, and as EXR when it has layers.
    Picture {
        /// Number of the frame, from 0.
        frame: u32,
        /// Size [px].
        size: (u32, u32),
        /// sRGB, 3 bytes a pixel.
        rgb: Vec<u8>,
        /// Depth [m] and object of each pixel; absent: no EXR.
        layers: Option<(Vec<f32>, Vec<u32>)>,
    },
    /// Particles of a frame.
    Points {
        /// Number of the frame, from 0.
        frame: u32,
        /// File format.
        format: PointFormat,
        /// [m].
        positions: Vec<[f32; 3]>,
        /// [m/s].
        velocities: Vec<[f32; 3]>,
        /// sRGB.
        colors: Vec<[u8; 3]>,
        /// Object of each particle, from 1 on.
        ids: Vec<u32>,
    },
}

/// What was written, in order, and what ended the writing early.
#[derive(Debug, Default)]
pub struct Written {
    /// Every whole file.
    pub files: Vec<OutputFile>,
    /// The first failure; no job after it was done.
    pub failure: Option<WriteError>,
}

/// A thread that writes.
pub struct Writer {
    sender: Option<SyncSender<Job>>,
    thread: Option<JoinHandle<Written>>,
}

impl Writer {
    /// Begins a writer of files in `out`, whose folders must be there.
    ///
    /// # Errors
    /// The system's refusal of a thread.
    pub fn spawn(out: &Path) -> Result<Self, WriteError> {
        let (sender, receiver) = sync_channel(WAITING);
        let folder = out.to_path_buf();
        let thread = Builder::new()
            .name("writer".into())
            .spawn(move || write(&folder, receiver))
            .map_err(|source| WriteError::Io { path: out.into(), source })?;
        Ok(Self { sender: Some(sender), thread: Some(thread) })
    }

    /// Hands over a job, waiting while too many wait. False when the writer has stopped; [`Writer::finish`] says why.
    pub fn push(&mut self, job: Job) -> bool {
        self.sender.as_ref().is_some_and(|sender| sender.send(job).is_ok())
    }

    /// Waits for what was handed over to be written.
    pub fn finish(mut self) -> Written {
        self.sender = None;
        self.thread.take().and_then(|thread| thread.join().ok()).unwrap_or_default()
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        self.sender = None;
        if let Some(thread) = self.thread.take() {
            // What it wrote stays; nobody is left to tell.
            let _ = thread.join();
        }
    }
}

fn write(out: &Path, jobs: Receiver<Job>) -> Written {
    let mut written = Written::default();
    for job in jobs {
        if let Err(failure) = write_job(out, &job, &mut written.files) {
            written.failure = Some(failure);
            break;
        }
    }
    written
}

fn write_job(out: &Path, job: &Job, files: &mut Vec<OutputFile>) -> Result<(), WriteError> {
    let mut keep = |path: PathBuf| OutputFile::of(out, &path).map(|file| files.push(file));
    match job {
        Job::Picture { frame, size: (width, height), rgb, layers } => {
            let path = out.join("frames").join(numbered(*frame, "png"));
            write_png(&path, *width, *height, rgb)?;
            keep(path)?;
            if let Some((depth, ids)) = layers {
                let path = out.join("frames").join(numbered(*frame, "exr"));
                let picture =
                    ExrFrame { width: *width, height: *height, rgb, depth: Some(depth), object_id: Some(ids) };
                write_exr(&path, &picture)?;
                keep(path)?;
            }
        }
        Job::Points { frame, format, positions, velocities, colors, ids } => {
            let points = PointFrame { positions, velocities: Some(velocities), colors: Some(colors), ids: Some(ids) };
            let path = |extension| out.join("points").join(numbered(*frame, extension));
            let path = match format {
                PointFormat::Npz => path("npz"),
                PointFormat::Ply => path("ply"),
            };
            match format {
                PointFormat::Npz => write_npz(&path, &points)?,
                PointFormat::Ply => write_ply(&path, &points)?,
            }
            keep(path)?;
        }
    }
    Ok(())
}
