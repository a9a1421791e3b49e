//! Measures what the demo promises on the files it wrote: prints each figure beside its bound and fails when one is
//! missed. Does not draw or simulate anything itself.
//!
//! `physvideo-check-demo SCENE OUT`: the scene must be a photograph with one simulated object, held by pins, and write
//! its points as NPZ.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use physvideo::assemble::{Assembled, View, assemble};
use physvideo::backdrop::dilate;
use physvideo::geometry;
use physvideo::scene::Source;
use physvideo_app::cli::Overrides;
use physvideo_app::error::AppError;
use physvideo_app::flow::Pixels;
use physvideo_app::io::read::{read_color_image, read_points};
use physvideo_app::io::write::numbered;
use physvideo_app::load::Loaded;
use physvideo_tests::demo::{self, Picture, Still};

/// Around the photographed leaves the background fades from the photograph to what is behind [px]: pixels of two
/// colours by intent.
const RIM: u32 = 11;
/// Tips are the farthest particles from what is held within this distance [m].
const TIP: f32 = 0.05;
/// Swings below this are not counted as a change of sign [px].
const SWING: f32 = 2.0;

fn main() -> ExitCode {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [scene, out] = arguments.as_slice() else {
        eprintln!("usage: physvideo-check-demo SCENE OUT");
        return ExitCode::from(2);
    };
    match check(scene, out) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(sentence) => {
            eprintln!("error: {sentence}");
            ExitCode::FAILURE
        }
    }
}

/// Figures against bounds.
#[derive(Default)]
struct Table {
    missed: bool,
}

impl Table {
    fn row(&mut self, what: &str, value: impl std::fmt::Display, bound: &str, kept: bool) {
        println!("{} {what:<52} {value:>12}   {bound}", if kept { "ok    " } else { "MISSED" });
        self.missed |= !kept;
    }
}

fn check(scene: &Path, out: &Path) -> Result<bool, String> {
    let (loaded, assembled) = load(scene)?;
    let run = Run::read(&loaded, &assembled, out)?;
    let mut table = Table::default();
    let asked = loaded.scene.output.frames;
    table.row("frames", run.frames.len(), &format!("= {asked}"), run.frames.len() == asked as usize);
    table.row("video.mp4 [bytes]", run.video, "> 0", run.video > 0);

    let object = run.leaves.iter().zip(&run.pot).map(|(a, b)| *a || *b).collect::<Vec<_>>();
    let outside: Vec<bool> = object.iter().map(|o| !o).collect();
    let likeness = demo::psnr(&run.frames[0], &run.photo, &object);
    table.row(
        "frame 0 and photograph inside the masks, PSNR [dB]",
        format!("{likeness:.1}"),
        ">= 30",
        likeness >= 30.0,
    );
    let other = demo::changed(&run.frames[0], &run.photo, &outside);
    table.row("pixels of frame 0 changed outside the masks", other, "= 0", other == 0);

    let covered = run.covered()?;
    let mut still = Still::new(run.photo.width, object.len());
    run.frames.iter().zip(&covered).for_each(|(frame, covered)| still.see(frame, covered));
    let uncovered = (0..object.len()).filter(|i| run.leaves[*i] && still.seen[*i] > 0).count();
    table.row("pixels uncovered where leaves were", uncovered, "> 0", uncovered > 0);
    let open = demo::unfilled(&still, &run.photo, &run.leaves);
    table.row("of these unfilled", open, "= 0", open == 0);

    let moved = run.pot_shift(&covered);
    table.row("shift of the pot, worst frame [px]", moved, "<= 1", moved <= 1);
    run.tips(&mut table)?;
    let loose = run.detached(&still, &covered)?;
    table.row("object pixels detached, worst frame [%]", format!("{loose:.3}"), "<= 0.1", loose <= 0.1);
    if let Some(settings) = &loaded.scene.flow {
        // Inversion, SDE, generation; 25 is the schedule of the network that ships, and the paper's.
        let steps = settings.steps.map_or(25, |s| s as usize);
        flow(&run.frames, out, 2 * settings.tau_of(steps) as u64 + u64::from(settings.iterations), &mut table)?;
    }
    Ok(!table.missed)
}

/// Least mean likeness of the flow's frames to the drawn ones [dB]: noise of the same colours has about 9, the
/// network that ships 27 at the scene's low noise level. How good it is, is told by its card, not here.
const ALIKE: f64 = 20.0;

/// The frames after the network.
fn flow(drawn: &[Picture], out: &Path, each: u64, table: &mut Table) -> Result<(), String> {
    let said = |e: &dyn std::fmt::Display| e.to_string();
    let text = std::fs::read_to_string(out.join("report.json")).map_err(|e| said(&e))?;
    let report: serde_json::Value = serde_json::from_str(&text).map_err(|e| said(&e))?;
    let (nfe, chunks) = (&report["flow"]["nfe"]["total"], report["flow"]["chunks"].as_array().map_or(0, Vec::len));
    let want = each * chunks as u64;
    table.row("evaluations of the network", nfe, &format!("= {each} x {chunks} chunks"), nfe.as_u64() == Some(want));
    let video = std::fs::metadata(out.join("flow.mp4")).map_or(0, |m| m.len());
    table.row("flow.mp4 [bytes]", video, "> 0", video > 0);
    let mut likeness = Vec::new();
    for (frame, drawn) in drawn.iter().enumerate() {
        let path = out.join("flow").join(numbered(frame as u32, "png"));
        let image = read_color_image(&path).map_err(|e| said(&e))?;
        let flat: Vec<u8> = drawn.rgb.iter().flatten().copied().collect();
        let size = (drawn.width as u32, (drawn.rgb.len() / drawn.width) as u32);
        let small = Pixels { size, rgb: flat }.scaled((image.width, image.height));
        let squares = small.rgb.iter().zip(&image.rgb).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2));
        let mean = squares.sum::<f64>() / image.rgb.len() as f64;
        likeness.push(10.0 * (255.0f64.powi(2) / mean.max(1e-12)).log10());
    }
    let mean = likeness.iter().sum::<f64>() / likeness.len().max(1) as f64;
    let bound = format!(">= {ALIKE}");
    table.row("likeness of flow and drawn frames, PSNR [dB]", format!("{mean:.1}"), &bound, mean >= ALIKE);
    Ok(())
}

fn load(scene: &Path) -> Result<(Loaded, Assembled), String> {
    let said = |e: AppError| e.to_string();
    let loaded = Loaded::open(scene, &Overrides::default()).map_err(said)?;
    let plan = loaded.plan();
    let inputs = loaded.inputs(&plan).map_err(said)?;
    let assembled = assemble(&loaded.scene, &inputs, &plan).map_err(|p| loaded.locate(vec![p]).to_string())?;
    Ok((loaded, assembled))
}

/// What a run wrote, beside what it started from.
struct Run<'a> {
    assembled: &'a Assembled,
    photo: Picture,
    /// Pixels of the simulated object, and of those that stand still.
    leaves: Vec<bool>,
    pot: Vec<bool>,
    frames: Vec<Picture>,
    /// Particles of each frame [m].
    particles: Vec<Vec<[f32; 3]>>,
    /// The object's pixels as points [m], each with its particles.
    points: Vec<[f32; 3]>,
    carriers: Vec<geometry::Carrier>,
    video: u64,
}

impl<'a> Run<'a> {
    fn read(loaded: &Loaded, assembled: &'a Assembled, out: &Path) -> Result<Self, String> {
        let Some(View { photo, surfaces: Some(surfaces), world, .. }) = &assembled.view else {
            return Err("the scene has no photograph, there is nothing to compare with".into());
        };
        let ([body], [index]) = (assembled.world.bodies.as_slice(), assembled.object_of.as_slice()) else {
            return Err("the scene must have one simulated object".into());
        };
        let Source::Mask { label, .. } = loaded.scene.objects[*index].source else {
            return Err(format!("object '{}' is not a mask of the photograph", body.name));
        };
        let still: Vec<u8> = loaded
            .scene
            .objects
            .iter()
            .filter(|o| o.material.is_none())
            .filter_map(|o| if let Source::Mask { label, .. } = o.source { Some(label) } else { None })
            .collect();
        let points = geometry::display_points(surfaces, label, &photo.rgb, geometry::surface_point(surfaces, world))
            .map_err(|e| e.to_string())?
            .positions;
        let spacing = body.particle_volume.cbrt();
        let carriers = geometry::attach(&points, &body.positions, spacing).map_err(|e| e.to_string())?;
        let (frames, particles) = frames(out, (photo.width, photo.height), body.positions.len())?;
        Ok(Self {
            assembled,
            photo: Picture { width: photo.width as usize, rgb: photo.rgb.clone() },
            leaves: photo.labels.iter().map(|l| *l == label).collect(),
            pot: photo.labels.iter().map(|l| still.contains(l)).collect(),
            frames,
            particles,
            points,
            carriers,
            video: std::fs::metadata(out.join("video.mp4")).map_or(0, |m| m.len()),
        })
    }

    /// Pixels that each of `points` carried by the particles of a frame falls on; none outside the picture.
    fn pixels(&self, frame: usize) -> impl Iterator<Item = Option<usize>> {
        let (start, now) = (&self.particles[0], &self.particles[frame]);
        let (w, h) = (self.photo.width, self.photo.rgb.len() / self.photo.width);
        self.points.iter().zip(&self.carriers).map(move |(x, c)| {
            let mut x = *x;
            for (p, weight) in c.particle.iter().zip(c.weight) {
                (0..3).for_each(|a| x[a] += weight * (now[*p as usize][a] - start[*p as usize][a]));
            }
            let at = demo::project(&self.assembled.camera, x);
            let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < w as f32 && at.y < h as f32;
            inside.then(|| at.y as usize * w + at.x as usize)
        })
    }

    fn grown(&self, mask: &[bool], by: u32) -> Result<Vec<bool>, String> {
        let width = self.photo.width as u32;
        dilate(width, mask.len() as u32 / width, mask, by).map_err(|e| e.to_string())
    }

    /// Pixels with leaves on or near them, in each frame. Near: a disc's radius, and half a particle spacing, which is
    /// how far a point may turn about its particles, whose turning is not known here.
    fn covered(&self) -> Result<Vec<Vec<bool>>, String> {
        let camera = &self.assembled.camera;
        let depth = |x: &[f32; 3]| (0..3).map(|a| camera.forward[a] * x[a]).sum::<f32>() + camera.forward[3];
        let mean = self.points.iter().map(depth).sum::<f32>() / self.points.len().max(1) as f32;
        let spacing = self.assembled.world.bodies[0].particle_volume.cbrt() * camera.focal[0] / mean;
        let margin = (1.5 + 0.5 * spacing).ceil() as u32;
        (0..self.frames.len())
            .map(|frame| {
                let mut mask = vec![false; self.photo.rgb.len()];
                self.pixels(frame).flatten().for_each(|i| mask[i] = true);
                self.grown(&mask, margin)
            })
            .collect()
    }

    /// The largest shift of what is seen of the pot against frame 0 [px].
    fn pot_shift(&self, covered: &[Vec<bool>]) -> i32 {
        let shift = |(frame, now): (&Picture, &Vec<bool>)| {
            let seen: Vec<bool> = (0..now.len()).map(|i| self.pot[i] && !now[i] && !covered[0][i]).collect();
            demo::shift(&self.frames[0], frame, &seen).map(i32::abs).into_iter().max()
        };
        self.frames.iter().zip(covered).filter_map(shift).max().unwrap_or(0)
    }

    fn tips(&self, table: &mut Table) -> Result<(), String> {
        let held = &self.assembled.world.bodies[0].pinned;
        let tips = demo::tips(&self.particles[0], held, TIP);
        let paths = demo::paths(&self.assembled.camera, &self.particles, &tips);
        let sways: Vec<(f32, usize)> = paths.iter().map(|p| (demo::reach(p), demo::reversals(p, SWING))).collect();
        let good = |(reach, turns): &&(f32, usize)| (10.0..=60.0).contains(reach) && *turns >= 2;
        let all = sways.iter().map(|(reach, turns)| format!("{reach:.0} px × {turns}")).collect::<Vec<_>>().join(", ");
        println!("       leaf tips, farthest from the start × changes of direction: {all}");
        let best = sways.iter().filter(good).map(|s| s.0).fold(0.0, f32::max);
        table.row("a leaf tip that sways [px]", format!("{best:.1}"), "10 to 60, turning twice", best > 0.0);
        Ok(())
    }

    /// Pixels of the object that are not on it any more [% of its pixels], in the worst frame: those drawn where
    /// nothing of it should be, and pieces that no longer hang together with what is held.
    fn detached(&self, still: &Still, covered: &[Vec<bool>]) -> Result<f64, String> {
        let rim = self.grown(&self.leaves, RIM)?;
        let held = &self.assembled.world.bodies[0].pinned;
        let torn = |frame: usize| -> Result<usize, String> {
            let (mut mask, mut root) = (vec![false; self.photo.rgb.len()], vec![false; self.photo.rgb.len()]);
            for (at, c) in self.pixels(frame).zip(&self.carriers) {
                if let Some(i) = at {
                    mask[i] = true;
                    root[i] |= c.particle.iter().any(|p| held[*p as usize]);
                }
            }
            Ok(demo::islands(self.photo.width, &self.grown(&mask, 1)?, &root))
        };
        let before = torn(0)?;
        let mut worst = (0, 0, 0, 0);
        for (frame, (picture, covered)) in self.frames.iter().zip(covered).enumerate() {
            let free: Vec<bool> = (0..covered.len()).map(|i| !covered[i] && (self.leaves[i] || !rim[i])).collect();
            let stray = demo::changed(picture, &still.picture, &free);
            let torn = torn(frame)?.saturating_sub(before);
            worst = worst.max((stray + torn, stray, torn, frame));
        }
        let (all, stray, torn, frame) = worst;
        println!("       detached at most in frame {frame}: {stray} pixels where nothing should be, {torn} torn off");
        Ok(100.0 * all as f64 / self.points.len().max(1) as f64)
    }
}

/// Pictures and particles of every frame that was written.
#[expect(clippy::type_complexity, reason = "two parallel lists")]
fn frames(out: &Path, size: (u32, u32), particles: usize) -> Result<(Vec<Picture>, Vec<Vec<[f32; 3]>>), String> {
    let (mut pictures, mut positions) = (Vec::new(), Vec::new());
    loop {
        let name = format!("frame_{:05}", pictures.len());
        let path = out.join("frames").join(format!("{name}.png"));
        if !path.exists() {
            break;
        }
        let image = read_color_image(&path).map_err(|e| e.to_string())?;
        if (image.width, image.height) != size {
            return Err(format!("{} is not {} × {} pixels", path.display(), size.0, size.1));
        }
        let rgb = image.rgb.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        pictures.push(Picture { width: image.width as usize, rgb });
        let points = read_points(&out.join("points").join(format!("{name}.npz"))).map_err(|e| e.to_string())?;
        if points.positions.len() != particles {
            return Err(format!("frame {name} has {} particles, the scene {particles}", points.positions.len()));
        }
        positions.push(points.positions);
    }
    if pictures.is_empty() {
        return Err(format!("there are no frames in {}", out.join("frames").display()));
    }
    Ok((pictures, positions))
}
