//! The stage `flow` of a run: collects frames, runs Φ_CF over them, writes what comes of it. Does not know how frames are
//! made, nor how a chunk is.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use physvideo::animate::Animation;
use physvideo::scene::{Act, Flow, Pool, Scene};
use physvideo::stages::render::Image;
use physvideo_gpu::Gpu;
use physvideo_net::{Model, Tensor};
use sha2::{Digest, Sha256};

use super::algorithm::{Phase, State, Watch};
use super::checkpoint::Checkpoint;
use super::chunk_report::{ChunkReport, ClipReport, Finished};
use super::clip::{Clip, ClipWatch};
use super::model::FlowModel;
use super::pixels::{Driving, Pixels, scale_mask};
use super::settings::Settings;
use super::source::Source;
use super::velocity::FlowError;
use crate::error::AppError;
use crate::interrupt::Interrupt;
use crate::progress::{Progress, Task as Bar};

/// A checkpoint on disk is at most this old, or a step.
const SAVE_EVERY: Duration = Duration::from_secs(5);

/// A flow in a run, from before the first frame on.
pub struct FlowRun {
    model: Model,
    settings: Settings,
    driving: Driving,
    /// Objects that are simulated, by id.
    moving: Vec<bool>,
    out: PathBuf,
    fresh: bool,
    /// Whether the checkpoint of an earlier run was used.
    pub resumed: bool,
    /// What a user should know.
    pub notes: Vec<String>,
}

impl FlowRun {
    /// Takes an opened model for the frames of a scene.
    pub fn new(scene: &Scene, opened: FlowModel, out: &Path, fresh: bool) -> Self {
        let moving = scene.objects.iter().map(|o| o.material.is_some()).collect();
        let FlowModel { model, settings, size } = opened;
        let driving =
            Driving { size, frames: Vec::new(), masks: Vec::new(), image: Vec::new(), background: Vec::new() };
        let (out, notes) = (out.to_path_buf(), Vec::new());
        Self { model, settings, driving, moving, out, fresh, resumed: false, notes }
    }

    /// Size of the frames it makes [px].
    pub fn size(&self) -> (u32, u32) {
        self.driving.size
    }

    /// Name and licence of its model.
    pub fn model(&self) -> (String, String) {
        let manifest = self.model.manifest();
        (manifest.name.clone(), manifest.licence.clone())
    }

    /// Takes the picture without what moves.
    pub fn background(&mut self, animation: &Animation) {
        if let Some(empty) = &animation.empty {
            let whole = Pixels { size: (empty.width, empty.height), rgb: empty.rgb.clone() };
            self.driving.background = whole.scaled(self.driving.size).rgb;
        }
    }

    /// Takes a drawn frame; the first is the image to be consistent with.
    pub fn push(&mut self, image: &Image) {
        let size = (image.width, image.height);
        let scaled = Pixels { size, rgb: image.rgb.clone() }.scaled(self.driving.size).rgb;
        if self.driving.frames.is_empty() {
            self.driving.image.clone_from(&scaled);
        }
        let moves = |id: &u32| id.checked_sub(1).and_then(|i| self.moving.get(i as usize)).copied().unwrap_or(false);
        let mask: Vec<u8> = match (&image.ids, self.settings.act) {
            (Some(ids), Act::Animate) => ids.iter().map(|id| u8::from(moves(id))).collect(),
            // What is drawn of objects is known; what is not, is to be filled.
            (Some(ids), Act::Reconstruct) => ids.iter().map(|id| u8::from(*id != 0)).collect(),
            (None, _) => vec![1; size.0 as usize * size.1 as usize],
        };
        self.driving.masks.push(scale_mask(&mask, size, self.driving.size, self.settings.pool));
        self.driving.frames.push(scaled);
    }

    /// Takes frames from files.
    pub fn take(&mut self, source: &Source) {
        let (size, pool) = (self.driving.size, self.settings.pool);
        self.driving.image = source.image.scaled(size).rgb;
        self.driving.background = source.background.scaled(size).rgb;
        for (frame, mask) in source.frames.iter().zip(&source.masks) {
            self.driving.masks.push(scale_mask(mask, frame.size, size, pool));
            self.driving.frames.push(frame.scaled(size).rgb);
        }
    }

    /// Runs Φ_CF over the frames there are.
    ///
    /// # Errors
    /// [`FlowError`]; a checkpoint of the last finished step is in the output folder then.
    pub fn refine(
        &mut self,
        gpu: &Gpu,
        progress: &Progress,
        interrupt: &Interrupt,
    ) -> Result<(Vec<Vec<u8>>, ClipReport), AppError> {
        let fingerprint = self.fingerprint();
        let mut kept = Checkpoint { fingerprint, ..Checkpoint::default() };
        match Checkpoint::read(&self.out, &kept.fingerprint) {
            _ if self.fresh => Checkpoint::remove(&self.out),
            Ok(None) => {}
            Ok(Some(found)) => {
                progress.note("going on from the checkpoint of an earlier run (--fresh begins anew)");
                self.resumed = true;
                kept = found;
            }
            Err(why) => self.notes.push(format!("not going on from an earlier run: {why}")),
        }
        let state = kept.state.clone();
        let finished = kept.finished.clone();
        let mut keeper = Keeper {
            kept,
            folder: &self.out,
            saved: Instant::now(),
            interrupt,
            bar: None,
            progress,
            steps: self.settings.steps_of_chunk(),
            failed: None,
        };
        let clip = Clip::new(gpu, &mut self.model, &self.driving, &self.settings, interrupt);
        let ended = clip.make(&finished, state, &mut keeper);
        if let Some(bar) = keeper.bar.take().filter(|_| ended.is_ok()) {
            bar.finish();
        }
        let failed = keeper.failed.take();
        if let Some(failed) = &failed {
            self.notes.push(format!("the checkpoint could not be written: {failed}"));
        }
        match ended {
            Err(FlowError::Interrupted { at, .. }) => {
                // Before the first step there is nothing to keep.
                let kept = failed.is_none() && Checkpoint::path(&self.out).is_file();
                Err(FlowError::Interrupted { at, kept }.into())
            }
            Err(e) => Err(e.into()),
            Ok((frames, report)) => {
                if self.settings.iterations > 0 && report.chunks.iter().all(|c| c.updated == 0.0) {
                    self.notes.push("the SDE updated nothing: the masks leave no cell to it".into());
                }
                Ok((frames, report))
            }
        }
    }

    /// Everything that the frames depend on.
    fn fingerprint(&self) -> String {
        let mut hash = Sha256::new();
        hash.update(format!("{:?} {:?}", self.settings, self.driving.size));
        hash.update(concat!(env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION")));
        let manifest = self.model.manifest();
        hash.update(format!("{manifest:?}"));
        for file in manifest.files() {
            // Manifests need not say hashes: another file of the same name is told by its size and date.
            let meta = std::fs::metadata(manifest.folder.join(&file.file));
            hash.update(format!("{:?}", meta.map(|m| (m.len(), m.modified().ok())).ok()));
        }
        let d = &self.driving;
        for bytes in d.frames.iter().chain(&d.masks).chain([&d.image, &d.background]) {
            hash.update((bytes.len() as u64).to_le_bytes());
            hash.update(bytes);
        }
        hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
    }
}

/// Keeps the checkpoint and tells progress.
struct Keeper<'a> {
    kept: Checkpoint,
    folder: &'a Path,
    saved: Instant,
    interrupt: &'a Interrupt,
    bar: Option<Bar>,
    progress: &'a Progress,
    /// Steps of each phase of a chunk.
    steps: [u32; 3],
    failed: Option<crate::io::WriteError>,
}

impl Keeper<'_> {
    fn save(&mut self) {
        self.saved = Instant::now();
        if let Err(e) = self.kept.write(self.folder) {
            self.failed = Some(e);
        }
    }
}

impl Watch for Keeper<'_> {
    fn finished(
        &mut self,
        phase: Phase,
        done: u32,
        state: &dyn Fn() -> Result<State, FlowError>,
    ) -> Result<(), FlowError> {
        let [inversion, sde, _] = self.steps;
        if let Some(bar) = &mut self.bar {
            bar.set(u64::from(match phase {
                Phase::Inversion => done,
                Phase::Sde => inversion + done,
                Phase::Generation => inversion + sde + done,
            }));
        }
        if self.interrupt.asked() {
            return Err(FlowError::Interrupted { at: format!("{phase} after step {done}"), kept: true });
        }
        if self.saved.elapsed() >= SAVE_EVERY {
            self.kept.state = Some(state()?);
            self.save();
        }
        Ok(())
    }

    fn stopped(&mut self, state: State) {
        self.kept.state = Some(state);
        self.save();
    }
}

impl ClipWatch for Keeper<'_> {
    fn chunk(&mut self, index: usize, count: usize) {
        if let Some(bar) = self.bar.take() {
            bar.finish();
        }
        let total = self.steps.iter().map(|s| u64::from(*s)).sum();
        self.bar = Some(self.progress.task(&format!("flow, chunk {} of {count}", index + 1), total));
    }

    fn latent(&mut self, latent: &Tensor, report: &ChunkReport) {
        self.kept.finished.push(Finished { latent: latent.clone(), report: report.clone() });
        self.kept.state = None;
        self.save();
    }
}

/// When a cell belongs to the mask, as the act wants it unless the scene says otherwise.
pub(super) fn pool_of(flow: &Flow) -> (Pool, u32) {
    let pool = flow.mask.pool.unwrap_or(match flow.act {
        Act::Reconstruct => Pool::All,
        Act::Animate => Pool::Any,
    });
    (pool, flow.mask.reach.unwrap_or(u32::from(pool == Pool::Any)))
}
