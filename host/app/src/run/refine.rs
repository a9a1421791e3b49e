//! The flow's part of a run: opened before the first frame, run after the last, its frames and video written.

use std::time::Instant;

use physvideo::scene::Output;
use physvideo_gpu::Gpu;

use super::Clip;
use crate::cli::RunOptions;
use crate::commands::print;
use crate::device::host_memory;
use crate::error::AppError;
use crate::flow::{Checkpoint, FlowError, FlowReport, FlowRun, NetChoice, Outlook, Source, model};
use crate::interrupt::Interrupt;
use crate::io::write::{EncoderThread, OutputFile, create_folder, numbered, write_png};
use crate::load::Loaded;
use crate::out_folder::FLOW_VIDEO;

impl Clip<'_> {
    /// Opens the network and, where the frames come from files, reads them; all before anything takes long.
    pub(super) fn open_flow(
        &mut self,
        loaded: &Loaded,
        options: &RunOptions,
        interrupt: &Interrupt,
    ) -> Result<(), AppError> {
        let Some(flow) = self.scene.flow.as_ref().filter(|_| self.plan.runs("flow")) else { return Ok(()) };
        let choice = NetChoice {
            library: options.ort_lib.clone(),
            provider: options.provider.map_or_else(Default::default, Into::into),
            model: options.model.clone(),
        };
        let source = match &flow.input {
            Some(input) => Some(Source::read(loaded, input, self.scene.output.frames as usize)?),
            None => None,
        };
        let frames = source.as_ref().and_then(|s| s.frames.first()).map_or(self.assembled.size, |f| f.size);
        let count = source.as_ref().map_or(self.scene.output.frames as usize, |s| s.frames.len());
        if let Some(outlook) = Outlook::new(loaded, &choice, frames, count)? {
            let memory = &mut self.report.memory;
            memory.predicted += outlook.latent_bytes;
            let (need, available) = (memory.predicted, memory.available);
            if need > available {
                return Err(FlowError::Memory { of: "device", need, available }.into());
            }
            let need = outlook.frame_bytes + outlook.network_bytes;
            if let Some(available) = host_memory().filter(|available| need > *available) {
                return Err(FlowError::Memory { of: "host", need, available }.into());
            }
            self.report.warnings.extend(outlook.notes);
        }
        let opened = model::open(loaded, flow, &choice, frames, interrupt)?;
        if self.plan.runs("encode") {
            // First, because it may refuse a size.
            let (width, height) = opened.size;
            let fps = f64::from(self.report.fps);
            self.flow_video = Some(EncoderThread::spawn(&self.out.join(FLOW_VIDEO), width, height, fps)?);
        }
        let mut run = FlowRun::new(self.scene, opened, self.out, options.fresh);
        if let Some(source) = &source {
            run.take(source);
            self.report.size = Some([frames.0, frames.1]);
            let (asked, there) = (self.scene.output.frames, source.frames.len() as u32);
            if asked > there && asked != Output::default().frames {
                self.report.warnings.push(format!("{asked} frames were asked for, and flow.input.frames has {there}"));
            }
            self.report.frames_asked = asked.min(there);
        }
        self.flow = Some(run);
        Ok(())
    }

    /// Runs the flow over the frames that were drawn or read, and writes what comes of it.
    pub(super) fn refine(&mut self, gpu: &Gpu, interrupt: &Interrupt, begun: Instant) -> Result<(), AppError> {
        let (Some(flow), Some(mut run)) = (&self.scene.flow, self.flow.take()) else { return Ok(()) };
        let overhead_s = begun.elapsed().as_secs_f64();
        let since = Instant::now();
        let refined = run.refine(gpu, &self.progress, interrupt);
        self.report.warnings.append(&mut run.notes);
        self.report.took("flow", since);
        let (frames, clip) = refined?;
        let (model, licence) = run.model();
        let times = (overhead_s, since.elapsed().as_secs_f64());
        let mut report = FlowReport::new(flow, (&model, &licence), run.size(), clip, times);
        report.resumed = run.resumed;
        if self.report.frames == 0 {
            self.report.frames = frames.len() as u32;
        }
        let since = Instant::now();
        let (width, height) = run.size();
        create_folder(&self.out.join("flow"))?;
        let mut encoder = self.flow_video.take();
        for (frame, rgb) in frames.into_iter().enumerate() {
            let path = self.out.join("flow").join(numbered(frame as u32, "png"));
            write_png(&path, width, height, &rgb)?;
            self.report.outputs.push(OutputFile::of(self.out, &path)?);
            if let Some(encoder) = &mut encoder {
                encoder.push(rgb)?;
            }
        }
        if let Some(encoder) = encoder {
            encoder.finish()?;
            self.report.outputs.push(OutputFile::of(self.out, &self.out.join(FLOW_VIDEO))?);
        }
        // Only now is nothing left to go on from.
        Checkpoint::remove(self.out);
        self.report.took("write", since);
        if !self.quiet {
            print(&report.table());
        }
        self.report.flow = Some(report);
        Ok(())
    }
}
