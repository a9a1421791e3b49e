//! A video encoder beside the simulation. Does not know how a frame is encoded.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};

use super::{VideoSummary, VideoWriter, WriteError};

/// Frames that may wait; one more makes `push` wait, which bounds memory.
const WAITING: usize = 4;

/// A `VideoWriter` on a thread of its own. Dropped before `finish`, it leaves no file.
pub struct EncoderThread {
    path: PathBuf,
    /// `None` once the thread has ended.
    running: Option<(SyncSender<Message>, JoinHandle<Outcome>)>,
}

/// `None`: the video was given up.
type Outcome = Result<Option<VideoSummary>, WriteError>;

enum Message {
    Frame(Vec<u8>),
    Finish,
}

impl EncoderThread {
    /// Begins a video; what can be refused at once is (see `VideoWriter::new`).
    pub fn spawn(path: &Path, width: u32, height: u32, fps: f64) -> Result<Self, WriteError> {
        let writer = VideoWriter::new(path, width, height, fps)?;
        let (sender, receiver) = sync_channel(WAITING);
        let thread = Builder::new()
            .name("encoder".into())
            .spawn(move || encode(writer, receiver))
            .map_err(|source| WriteError::Io { path: path.into(), source })?;
        Ok(Self { path: path.into(), running: Some((sender, thread)) })
    }

    /// Hands over a frame, waiting while too many wait. An error may be an earlier frame's; after one, no frame is
    /// taken.
    pub fn push(&mut self, rgb: Vec<u8>) -> Result<(), WriteError> {
        match &self.running {
            Some((sender, _)) if sender.send(Message::Frame(rgb)).is_ok() => Ok(()),
            // The thread ended early, so it has an error to tell.
            _ => Err(self.ended().err().unwrap_or_else(|| self.stopped())),
        }
    }

    /// Waits for the frames to be encoded and the file to be written.
    pub fn finish(mut self) -> Result<VideoSummary, WriteError> {
        if let Some((sender, _)) = &self.running {
            // A thread that ended early takes no message and tells its error below.
            let _ = sender.send(Message::Finish);
        }
        self.ended()?.ok_or_else(|| self.stopped())
    }

    /// Waits for the thread and takes what it returned.
    fn ended(&mut self) -> Outcome {
        let Some((sender, thread)) = self.running.take() else { return Ok(None) };
        drop(sender);
        thread.join().unwrap_or(Ok(None))
    }

    fn stopped(&self) -> WriteError {
        WriteError::encoder(&self.path, "the encoder has stopped")
    }
}

impl Drop for EncoderThread {
    fn drop(&mut self) {
        // Nobody is left to tell.
        let _ = self.ended();
    }
}

fn encode(mut writer: VideoWriter, frames: Receiver<Message>) -> Outcome {
    for message in frames {
        match message {
            Message::Frame(rgb) => writer.push(&rgb)?,
            Message::Finish => return writer.finish().map(Some),
        }
    }
    Ok(None)
}
