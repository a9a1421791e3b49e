//! `run`: a scene to files. Drives the animation frame by frame; knows neither how it is made nor how files look.

mod check;
mod refine;

use std::path::Path;
use std::time::Instant;

use physvideo::animate::{Animation, Snapshot};
use physvideo::assemble::{Assembled, assemble};
use physvideo::estimate::estimate;
use physvideo::plan::Plan;
use physvideo::scene::{PointFormat, Scene, Until};
use physvideo::stages::mpm::Method;
use physvideo_gpu::{Feature, Gpu, Options};

use crate::budget;
use crate::cli::RunOptions;
use crate::commands::print;
use crate::device::{self, DeviceEntry};
use crate::error::{AppError, INTERRUPTED};
use crate::flow::FlowRun;
use crate::interrupt::Interrupt;
use crate::io::write::{EncoderThread, OutputFile, create_folder, write_json};
use crate::load::Loaded;
use crate::out_folder::{self, FLOW_VIDEO, REPORT, VIDEO};
use crate::progress::Progress;
use crate::report::{Conservation, ObjectCount, Report, SCHEMA_VERSION, Skipped, Softened, Status, Sums};
use crate::warm;
use crate::writer::{Job, Writer};

/// Runs a scene.
///
/// # Errors
/// Whatever ended the run early. From the first frame on, finished files and a report of them are left.
pub fn run(path: &Path, options: &RunOptions) -> Result<(), AppError> {
    let begun = Instant::now();
    let mut loaded = Loaded::open(path, &options.overrides)?;
    let plan = loaded.plan();
    let out = options.out.clone().unwrap_or_else(|| out_folder::default_for(path));
    out_folder::make(&out)?;
    let progress = Progress::new(options.progress());
    let interrupt = Interrupt::listen()?;
    let mut report = Report {
        schema_version: SCHEMA_VERSION,
        program: concat!("physvideo-engine ", env!("CARGO_PKG_VERSION")).into(),
        scene: path.display().to_string(),
        scene_sha256: loaded.sha256(),
        seed: loaded.scene.seed,
        plan: Report::plan_of(&plan),
        frames_asked: loaded.scene.output.frames,
        fps: loaded.scene.output.fps,
        ..Report::default()
    };

    let kept = warm::read();
    // The device comes before the work on the photograph, so that a missing one is told at once.
    let gpu = if ["simulate", "render", "flow"].iter().any(|s| plan.runs(s)) {
        let asked = Options {
            device: options.device.clone(),
            validation: options.validate,
            pipeline_cache: kept.clone(),
            ..Options::default()
        };
        Some(Gpu::new(asked)?)
    } else {
        None
    };
    let since = Instant::now();
    let mut inputs = loaded.inputs(&plan)?;
    report.took("photo", since);
    if let Some(gpu) = &gpu {
        report.device = Some(DeviceEntry::from(&gpu.info));
        report.memory.available = device::available(&gpu.info);
        inputs.memory = Some(report.memory.available);
    }
    report.warnings.extend(budget::apply(&mut loaded, &inputs, &plan)?);
    let assembled = assemble(&loaded.scene, &inputs, &plan).map_err(|problem| loaded.locate(vec![problem]))?;
    drop(inputs);
    for (stage, ms) in &assembled.wall_ms {
        report.add_ms(stage, *ms);
    }
    report.solver = plan.runs("simulate").then(|| assembled.solver());
    report.warnings.extend(assembled.notes.iter().cloned());
    report.softened = assembled.capped.iter().map(Softened::from).collect();
    for (body, object) in assembled.world.bodies.iter().zip(&assembled.object_of) {
        let count = body.positions.len() as u64;
        report.particles.push(ObjectCount { object: loaded.scene.objects[*object].name.clone(), count });
    }
    report.size = plan.runs("render").then_some([assembled.size.0, assembled.size.1]);

    let mut clip = Clip {
        scene: &loaded.scene,
        plan: &plan,
        assembled: &assembled,
        out: &out,
        report,
        progress,
        flow: None,
        flow_video: None,
        quiet: options.quiet,
    };
    if let Some(gpu) = &gpu {
        clip.check_memory(gpu)?;
    }
    clip.open_flow(&loaded, options, &interrupt)?;
    out_folder::remove_earlier(&out);
    let ended = gpu.as_ref().map_or(Ok(()), |gpu| {
        clip.play(gpu, &interrupt)?;
        clip.refine(gpu, &interrupt, begun)
    });
    if let Some(gpu) = &gpu {
        warm::keep(gpu, kept.len());
    }
    clip.close(ended, gpu.as_ref(), begun)
}

/// A run from its first frame on.
struct Clip<'a> {
    scene: &'a Scene,
    plan: &'a Plan,
    assembled: &'a Assembled,
    out: &'a Path,
    report: Report,
    progress: Progress,
    flow: Option<FlowRun>,
    flow_video: Option<EncoderThread>,
    quiet: bool,
}

impl Clip<'_> {
    /// Refuses what does not fit, before anything is allocated.
    fn check_memory(&mut self, gpu: &Gpu) -> Result<(), AppError> {
        let two_pass = !(gpu.has(Feature::Int64Atomic) && gpu.has(Feature::Int64));
        let estimate = estimate(self.scene, self.assembled, self.plan, two_pass);
        let available = self.report.memory.available;
        self.report.memory.predicted = estimate.bytes;
        if estimate.bytes > available {
            return Err(AppError::Memory { need: estimate.bytes, available, device: gpu.info.name.clone() });
        }
        if !self.plan.runs("simulate") && !self.plan.runs("render") {
            return Ok(());
        }
        let particles: u64 = self.report.particles.iter().map(|p| p.count).sum();
        self.progress.note(&format!(
            "{}, {particles} particles, {} MiB on {}",
            match self.report.particles.len() {
                1 => "1 body".to_owned(),
                n => format!("{n} bodies"),
            },
            estimate.bytes.div_ceil(1 << 20),
            gpu.info.name
        ));
        Ok(())
    }

    /// Simulates, draws and hands over every frame.
    fn play(&mut self, gpu: &Gpu, interrupt: &Interrupt) -> Result<(), AppError> {
        if self.plan.runs("driving") {
            // The frames were read.
            self.report.deterministic = true;
            return Ok(());
        }
        // First, because it may refuse a size.
        let mut encoder = match self.plan.runs("encode") {
            true => {
                let (width, height) = self.assembled.size;
                Some(EncoderThread::spawn(&self.out.join(VIDEO), width, height, f64::from(self.report.fps))?)
            }
            false => None,
        };
        let mut writer = Writer::spawn(self.out)?;
        let deterministic = self.scene.simulation.deterministic;
        let method = Method { deterministic, sleep: self.scene.simulation.sleep, ..Method::default() };
        let mut animation = Animation::new(gpu, self.scene, self.assembled, self.plan, method)?;
        for (stage, ms) in &animation.wall_ms {
            self.report.add_ms(stage, *ms);
        }
        self.report.deterministic = animation.deterministic();
        if let Some(flow) = &mut self.flow {
            flow.background(&animation);
        }
        let start = self.measure(&animation)?;
        let points = self.points();
        if points.is_some() {
            create_folder(&self.out.join("points"))?;
        }
        if self.plan.runs("render") {
            create_folder(&self.out.join("frames"))?;
        }
        if let Some(solver) = &mut animation.solver {
            solver.stop_when(interrupt.flag());
        }
        let played = self.frames(&mut animation, interrupt, points, &mut writer, &mut encoder);
        // Whatever happened, what was finished is kept.
        let since = Instant::now();
        let written = writer.finish();
        self.report.outputs = written.files;
        self.report.took("write", since);
        let encoded = self.finish_video(encoder);
        self.report.simulated_s = animation.solver.as_ref().map_or(0.0, |s| s.time());
        let naps = animation.solver.as_ref().map_or_else(Vec::new, |s| s.left_out());
        let named = self.report.particles.iter().map(|p| p.object.clone()).zip(naps);
        self.report.skipped = named
            .filter(|(_, naps)| !naps.is_empty())
            .map(|(object, naps)| Skipped { object, asleep: naps.iter().map(Into::into).collect() })
            .collect();
        let end = self.measure(&animation);
        if let Some(failure) = written.failure {
            return Err(failure.into());
        }
        played?;
        encoded?;
        self.conserve(start, end?);
        self.check_finite(&animation)
    }

    fn points(&self) -> Option<PointFormat> {
        self.plan.runs("points").then(|| self.scene.output.points.unwrap_or(PointFormat::Npz))
    }

    fn frames(
        &mut self,
        animation: &mut Animation,
        interrupt: &Interrupt,
        points: Option<PointFormat>,
        writer: &mut Writer,
        encoder: &mut Option<EncoderThread>,
    ) -> Result<(), AppError> {
        let total = self.scene.output.frames;
        let mut task = self.progress.task("frames", u64::from(total));
        for frame in 0..total {
            let since = Instant::now();
            let stats = animation.advance()?;
            self.report.took("simulate", since);
            self.report.count(frame, &stats);
            if stats.stopped {
                return Err(AppError::Interrupted { frames: frame, total, out: self.out.into() });
            }
            self.check_frame(animation, frame, &stats)?;
            if let Some(format) = points {
                let since = Instant::now();
                let Snapshot { positions, velocities, bodies, numbers } = animation.particles()?;
                self.refuse_not_finite(frame, &positions, &velocities, &bodies)?;
                let ids = bodies.iter().map(|b| self.assembled.object_of[*b as usize] as u32 + 1).collect();
                let colors = numbers.iter().map(|i| self.assembled.colors[*i as usize].map(byte)).collect();
                writer.push(Job::Points { frame, format, positions, velocities, colors, ids });
                self.report.took("points", since);
            }
            let since = Instant::now();
            if let Some(image) = animation.draw()? {
                self.report.took("render", since);
                if let Some(flow) = &mut self.flow {
                    flow.push(&image);
                }
                let since = Instant::now();
                if let Some(encoder) = encoder {
                    encoder.push(image.rgb.clone())?;
                }
                self.report.took("encode", since);
                let size = (image.width, image.height);
                let layers = image.depth.zip(image.ids).filter(|_| self.scene.output.exr);
                let since = Instant::now();
                if !writer.push(Job::Picture { frame, size, rgb: image.rgb, layers }) {
                    // The writer's own failure is told by whoever ends it.
                    return Ok(());
                }
                self.report.took("write", since);
            }
            self.report.frames = frame + 1;
            task.advance(1);
            if interrupt.asked() && frame + 1 < total {
                return Err(AppError::Interrupted { frames: frame + 1, total, out: self.out.into() });
            }
        }
        task.finish();
        Ok(())
    }

    fn measure(&self, animation: &Animation) -> Result<Vec<Sums>, AppError> {
        let Some(solver) = &animation.solver else { return Ok(Vec::new()) };
        let bodies = self.assembled.world.bodies.iter().enumerate();
        bodies
            .map(|(index, body)| {
                let gravity = body.gravity.unwrap_or(self.scene.gravity);
                Ok(Sums::new(&solver.measure(index).map_err(AppError::Gpu)?, gravity))
            })
            .collect()
    }

    fn conserve(&mut self, start: Vec<Sums>, end: Vec<Sums>) {
        let names = self.report.particles.iter().map(|p| p.object.clone());
        self.report.conservation = names
            .zip(start.into_iter().zip(end))
            .map(|(object, (start, end))| Conservation { object, start, end })
            .collect();
    }

    /// Ends the video with the frames there are; one without frames is no video.
    fn finish_video(&mut self, encoder: Option<EncoderThread>) -> Result<(), AppError> {
        let Some(encoder) = encoder else { return Ok(()) };
        if self.report.frames == 0 {
            return Ok(());
        }
        let since = Instant::now();
        encoder.finish()?;
        self.report.outputs.push(OutputFile::of(self.out, &self.out.join(VIDEO))?);
        self.report.took("encode", since);
        Ok(())
    }

    /// Writes the report, tells what a user should know and passes on how the run ended.
    fn close(mut self, ended: Result<(), AppError>, gpu: Option<&Gpu>, begun: Instant) -> Result<(), AppError> {
        if let Some(gpu) = gpu {
            self.report.pipelines = gpu.compiled().into_iter().map(str::to_owned).collect();
            self.report.memory.peak = gpu.memory_used().1;
            self.report.memory.buffers = gpu.buffers().len();
        }
        let messages = gpu.map(Gpu::messages).unwrap_or_default();
        let ended = ended.and(if messages.is_empty() { Ok(()) } else { Err(AppError::Validation(messages)) });
        self.report.status = match &ended {
            Ok(()) => Status::Ok,
            Err(e) if e.exit_code() == INTERRUPTED => Status::Interrupted,
            Err(_) => Status::Failed,
        };
        self.report.message = ended.as_ref().err().map(ToString::to_string);
        self.report.warn_of_clamps();
        self.report.wall_s = begun.elapsed().as_secs_f64();
        let simulate = self.report.stages.iter().find(|s| s.name == "simulate").map(|s| s.wall_ms / 1e3);
        self.report.simulate_wall_s_per_simulated_s =
            simulate.filter(|_| self.report.simulated_s > 0.0).map(|s| s / self.report.simulated_s);
        for warning in &self.report.warnings {
            eprintln!("warning: {warning}");
        }
        let path = self.out.join(REPORT);
        let written = write_json(&path, &self.report);
        // What ended the run says more than a report that could not be written after it.
        ended?;
        written?;
        if !self.quiet {
            let video = if self.report.flow.is_some() { FLOW_VIDEO } else { VIDEO };
            let result = if self.plan.until == Until::Video { self.out.join(video) } else { path };
            print(&format!("{} ({} frames, {:.1} s)", result.display(), self.report.frames, self.report.wall_s));
        }
        Ok(())
    }
}

fn byte(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0).round() as u8
}
