//! Runs of the program end to end: same bits, what is skipped, what is kept when a run ends early, the report.

mod cli_scene;

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::process::Stdio;

use cli_scene::{FALL, Folder, PHOTO, names};
use serde_json::Value;

fn hashes(report: &Value, prefix: &str) -> BTreeMap<String, String> {
    let outputs = report["outputs"].as_array().unwrap();
    let text = |v: &Value| v.as_str().unwrap().to_owned();
    let all = outputs.iter().map(|o| (text(&o["path"]), text(&o["sha256"])));
    all.filter(|(path, _)| path.starts_with(prefix)).collect()
}

fn skipped(report: &Value) -> Vec<&str> {
    let plan = report["plan"].as_array().unwrap();
    plan.iter().filter(|s| s["skipped"] == true).map(|s| s["stage"].as_str().unwrap()).collect()
}

#[test]
fn a_run_leaves_video_frames_points_and_a_report() {
    let folder = Folder::new();
    folder.scene(FALL, &[("frames = 3", "frames = 3\npoints = 'ply'\nexr = true")]);
    let said = folder.run(&["--scene", "scene.toml", "--validate"]);
    said.expect(0, &[]);
    assert!(said.out.starts_with("out/scene/video.mp4 (3 frames"), "{}", said.out);
    let out = folder.path("out/scene");
    assert_eq!(names(&out), ["frames", "points", "report.json", "video.mp4"]);
    let pictures = ["frame_00000.exr", "frame_00000.png", "frame_00001.exr", "frame_00001.png"];
    assert_eq!(names(&out.join("frames"))[..4], pictures);
    assert_eq!(names(&out.join("points")), ["frame_00000.ply", "frame_00001.ply", "frame_00002.ply"]);

    let report = folder.report("out/scene");
    assert_eq!((report["schema_version"].as_u64(), report["status"].as_str()), (Some(1), Some("ok")));
    assert_eq!(report["outputs"].as_array().unwrap().len(), 3 + 2 * 3 + 1);
    for (path, hash) in hashes(&report, "") {
        assert_eq!(physvideo_app::io::write::sha256(&out.join(&path)).unwrap(), hash, "{path}");
    }
    let count = report["particles"][0]["count"].as_u64().unwrap();
    // A box of 0.1 m on a lattice of 1/64 m: 6.4 spacings, so 6 or 7 particles along each axis.
    assert!((216..=343).contains(&count), "{count}");
    assert!(report["substeps"].as_u64().unwrap() >= 2);
    assert!(report["dt"]["min"].as_f64().unwrap() > 0.0);
    assert_eq!(report["clamps"]["quarantined"], 0);
    // Before it is allocated the need is said: at least what is used, and not much more.
    let (predicted, peak) = (&report["memory"]["predicted"], &report["memory"]["peak"]);
    let (predicted, peak) = (predicted.as_u64().unwrap(), peak.as_u64().unwrap());
    assert!(predicted >= peak && predicted < 2 * peak, "{predicted} predicted, {peak} used");
    // Falling for two frames: mass stays, momentum is weight times time, energy does not grow (1 % for rounding and
    // the first touch of the ground).
    let (start, end) = (&report["conservation"][0]["start"], &report["conservation"][0]["end"]);
    assert_eq!(start["mass"], end["mass"]);
    assert!(end["momentum"][2].as_f64().unwrap() < 0.0);
    let energy = |s: &Value| ["kinetic", "elastic", "potential"].iter().map(|k| s[*k].as_f64().unwrap()).sum::<f64>();
    assert!(energy(end) <= 1.01 * energy(start), "{} J became {} J", energy(start), energy(end));
}

#[test]
fn the_same_seed_gives_the_same_bits_whatever_is_written() {
    let folder = Folder::new();
    folder.scene(FALL, &[]);
    let run = |out: &str, output: &str| {
        folder.run(&["run", "scene.toml", "--quiet", "--out", out, "--output", output]).expect(0, &[]);
        folder.report(out)
    };
    let (a, b, c) = (run("a", "video"), run("b", "video"), run("c", "frames"));
    assert_eq!(hashes(&a, ""), hashes(&b, ""), "two identical runs");
    assert_eq!(hashes(&a, "frames/"), hashes(&c, "frames/"), "with and without a video");
    assert_eq!(hashes(&a, "frames/").len(), 3);
    folder.scene(FALL, &[("frames = 3", "frames = 3\npoints = 'npz'\nexr = true")]);
    let (d, e) = (run("d", "video"), run("e", "points"));
    assert_eq!(hashes(&d, "points/"), hashes(&e, "points/"), "with and without frames");
    assert_eq!(hashes(&d, "points/").len(), 3);
    let png = |r: &Value| -> Vec<_> { hashes(r, "frames/").into_iter().filter(|f| f.0.ends_with("png")).collect() };
    assert_eq!(png(&a), png(&d), "with and without EXR and points");
    // The negative control: another scene, other bits.
    folder.scene(FALL, &[("density = 1000.0", "density = 1000.0\nvelocity = [0.1, 0, 0]")]);
    assert_ne!(hashes(&run("f", "video"), "frames/"), hashes(&a, "frames/"));
}

#[test]
fn what_nothing_needs_is_not_there() {
    let folder = Folder::new();
    let run = |out: &str, output: &str| {
        folder.run(&["run", "scene.toml", "--quiet", "--out", out, "--output", output]).expect(0, &[]);
        folder.report(out)
    };
    let pipelines = |r: &Value| -> Vec<String> { serde_json::from_value(r["pipelines"].clone()).unwrap() };
    let buffers = |r: &Value| r["memory"]["buffers"].as_u64().unwrap();

    folder.scene(FALL, &[]);
    let full = run("full", "video");
    let state = run("state", "state");
    // A body without material stands still: it is drawn and not simulated.
    folder.scene(FALL, &[("material.elastic = { young = 1e4, poisson = 0.3 }", "")]);
    let still = run("still", "frames");
    let nothing = run("nothing", "state");

    assert_eq!(skipped(&full), ["photo", "surfaces", "world", "points", "backdrop", "driving", "flow"]);
    assert!(pipelines(&full).iter().any(|p| p.starts_with("points/")));
    assert!(pipelines(&full).iter().any(|p| p.starts_with("mpm/")));
    assert!(
        !pipelines(&full).iter().any(|p| p == "points/unproject" || p == "points/uncover"),
        "{:?}",
        pipelines(&full)
    );

    assert!(pipelines(&state).iter().all(|p| !p.starts_with("points/")), "{:?}", pipelines(&state));
    assert!(skipped(&state).contains(&"render") && skipped(&state).contains(&"encode"));
    assert_eq!(names(&folder.path("state")), ["report.json"]);

    assert!(pipelines(&still).iter().all(|p| p.starts_with("points/")), "{:?}", pipelines(&still));
    assert!(skipped(&still).contains(&"simulate"));
    assert_eq!(names(&folder.path("still")), ["frames", "report.json"], "no encoder was there to leave a video");

    // Nothing to do needs no device.
    assert!(nothing["device"].is_null() && pipelines(&nothing).is_empty());
    assert_eq!(buffers(&nothing), 0);
    assert!(buffers(&state) > 0 && buffers(&still) > 0);
    assert!(buffers(&full) > buffers(&state) && buffers(&full) > buffers(&still));
    let reason = |r: &Value, stage: &str| {
        let plan = r["plan"].as_array().unwrap();
        plan.iter().find(|s| s["stage"] == stage).unwrap()["reason"].as_str().unwrap().to_owned()
    };
    assert_eq!(reason(&still, "simulate"), "no object has a material");
    assert_eq!(reason(&state, "render"), "nothing asked for needs it (`--output state`)");
}

#[test]
fn a_photograph_becomes_frames() {
    let folder = Folder::new();
    folder.photo().scene(PHOTO, &[]);
    folder.run(&["--scene", "scene.toml", "--quiet", "--output", "frames", "--validate"]).expect(0, &[]);
    let report = folder.report("out/scene");
    assert_eq!(report["frames"], 2);
    assert_eq!(skipped(&report), ["points", "driving", "flow", "encode"]);
    let stages: Vec<&str> = report["stages"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    for stage in ["photo", "surfaces", "bodies", "display", "simulate", "render"] {
        assert!(stages.contains(&stage), "{stage} is not among {stages:?}");
    }
}

#[test]
fn frames_before_an_error_are_kept() {
    let folder = Folder::new();
    folder.scene(FALL, &[("frames = 3", "frames = 6")]);
    // A folder stands where the fourth frame goes.
    folder.write("out/scene/frames/frame_00003.png/x", "");
    folder.run(&["--scene", "scene.toml", "--quiet"]).expect(7, &["frame_00003.png"]);
    let report = folder.report("out/scene");
    assert_eq!(report["status"], "failed");
    assert!(report["message"].as_str().unwrap().contains("frame_00003.png"));
    let kept: Vec<String> = hashes(&report, "frames/").into_keys().collect();
    assert_eq!(kept, ["frames/frame_00000.png", "frames/frame_00001.png", "frames/frame_00002.png"]);
    for (path, hash) in hashes(&report, "") {
        assert_eq!(physvideo_app::io::write::sha256(&folder.path("out/scene").join(&path)).unwrap(), hash, "{path}");
    }
}

/// A lid comes down into a room full of water, one that is wider and one that just fits: either solver says for how much there
/// is how much room.
#[test]
fn a_liquid_without_room_is_named() {
    for (pressure, wide) in [("wcsph", 0.5), ("dfsph", 0.5), ("wcsph", 0.06), ("dfsph", 0.06)] {
        let folder = Folder::new();
        let text = format!(
            "[simulation]\npressure = '{pressure}'\nparticle_size = 0.02\n\
             [[collider]]\nshape.room = {{ center = [0, 0, 0.2], half = [0.06, 0.06, 0.2] }}\n\
             [[collider]]\nshape.box = {{ center = [0, 0, 0.42], half = [{wide}, {wide}, 0.3] }}\nvelocity = [0, 0, -0.5]\n\
             [[object]]\nname = 'water'\nsource.box = {{ min = [-0.06, -0.06, 0], max = [0.06, 0.06, 0.12] }}\n\
             material.sph = {{}}\ndensity = 1000.0\n[output]\nframes = 12\nfps = 50\n"
        );
        folder.scene(&text, &[]);
        let says = ["liquid of 'water' is pressed together between obstacles in frame", "m³ that it needs"];
        folder.run(&["run", "scene.toml", "--output", "state", "--quiet"]).expect(5, &says);
    }
}

#[test]
fn a_lost_body_is_named_and_what_was_drawn_is_kept() {
    let folder = Folder::new();
    // Nothing below it: it leaves the domain of MPM's grid within a few frames.
    folder.scene(
        FALL,
        &[
            ("grid_density = 32", "grid_density = 32\nelastic = \"updated_lagrangian\""),
            ("[ground]\nheight = 0.0\n", ""),
            ("density = 1000.0", "density = 1000.0\nvelocity = [0, 0, -4]"),
            ("frames = 3", "frames = 30"),
        ],
    );
    folder.run(&["--scene", "scene.toml", "--quiet"]).expect(5, &["object 'jelly' is lost in frame", "domain"]);
    let report = folder.report("out/scene");
    assert_eq!(report["status"], "failed");
    assert_eq!(report["clamps"]["quarantined"], report["particles"][0]["count"]);
    assert!(report["warnings"][0].as_str().unwrap().contains("taken out"));
    let frames = report["frames"].as_u64().unwrap();
    assert!((1..30).contains(&frames));
    assert_eq!(hashes(&report, "frames/").len() as u64, frames);
    assert!(folder.path("out/scene/video.mp4").is_file());
}

#[test]
fn a_step_that_is_too_long_is_never_silently_clean() {
    let folder = Folder::new();
    // A hundred times the elastic limit of about 4 ms.
    folder.scene(
        FALL,
        &[
            ("grid_density = 32", "grid_density = 32\nforce_dt = 0.04"),
            ("young = 1e4", "young = 1e7"),
            ("frames = 3", "frames = 12"),
        ],
    );
    let said = folder.run(&["--scene", "scene.toml", "--quiet", "--output", "state"]);
    let report = folder.report("out/scene");
    assert!(said.code == 5 || said.err.contains("warning: "), "code {}, {}", said.code, said.err);
    assert!(!report["warnings"].as_array().unwrap().is_empty());
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_keeps_its_frames_and_a_video_of_them() {
    interrupt("-INT");
    // What batch systems and containers send.
    interrupt("-TERM");
}

#[cfg(unix)]
fn interrupt(signal: &str) {
    let folder = Folder::new();
    folder.scene(FALL, &[("frames = 3", "frames = 100000")]);
    let mut command = folder.command(&["--scene", "scene.toml", "--json-progress"]);
    let mut child = command.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    // Some frames are done when a line says so.
    let begun = lines.by_ref().map_while(Result::ok).any(|line| {
        let value: Value = serde_json::from_str(&line).unwrap();
        value["task"] == "frames" && value["done"].as_u64() > Some(0)
    });
    assert!(begun, "the run ended by itself");
    let kill = std::process::Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    let rest: Vec<String> = lines.map_while(Result::ok).collect();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(rest.last().is_some_and(|l| l.starts_with("interrupted after ")), "{rest:?}");
    let report = folder.report("out/scene");
    assert_eq!(report["status"], "interrupted");
    let frames = report["frames"].as_u64().unwrap();
    assert!(frames > 0 && frames < 100_000);
    assert_eq!(hashes(&report, "frames/").len() as u64, frames);
    assert_eq!(hashes(&report, "video").len(), 1);
    assert_eq!(names(&folder.path("out/scene")), ["frames", "report.json", "video.mp4"]);
}

#[test]
fn a_second_run_does_not_mix_with_the_first() {
    let folder = Folder::new();
    folder.scene(FALL, &[]).write("out/scene/frames/mine.png", "kept").write("out/scene/notes.txt", "kept");
    folder.run(&["--scene", "scene.toml", "--quiet"]).expect(0, &[]);
    folder.run(&["--scene", "scene.toml", "--quiet", "--frames", "1", "--output", "frames"]).expect(0, &[]);
    assert_eq!(names(&folder.path("out/scene/frames")), ["frame_00000.png", "mine.png"]);
    assert_eq!(names(&folder.path("out/scene")), ["frames", "notes.txt", "report.json"]);
    // A run that never begins leaves what is there.
    folder.run(&["--scene", "scene.toml", "--quiet", "--device", "abacus"]).expect(3, &[]);
    assert_eq!(folder.report("out/scene")["status"], "ok");
}

/// Compiled pipelines are kept for the next run; rubbish in their place, or no place at all, does no harm.
#[test]
fn pipelines_are_kept_between_runs() {
    let folder = Folder::new();
    folder.scene(FALL, &[]);
    let kept = "cache/physvideo-engine/pipelines";
    let run = || {
        folder.run(&["--scene", "scene.toml", "--frames", "2", "--output", "frames"]).expect(0, &[]);
        hashes(&folder.report("out/scene"), "frames")
    };
    let first = run();
    assert!(!std::fs::read(folder.path(kept)).unwrap().is_empty());
    folder.write(kept, [0xa5; 1000]);
    assert_eq!(run(), first);
    std::fs::remove_dir_all(folder.path("cache")).unwrap();
    folder.write("cache", "a file where the folder should be");
    assert_eq!(run(), first);
}

/// A frame of very many substeps is given up between two batches; the frames before it are kept.
#[cfg(unix)]
#[test]
fn a_frame_that_takes_long_is_given_up() {
    let folder = Folder::new();
    folder.scene(FALL, &[("grid_density = 32", "grid_density = 32\nforce_dt = 1e-7")]);
    let mut child = folder.command(&["--scene", "scene.toml", "--quiet"]).stderr(Stdio::piped()).spawn().unwrap();
    // The first frame is the start itself, and is drawn at once; the second takes 400,000 substeps.
    while !folder.path("out/scene/frames/frame_00000.png").exists() {
        assert!(child.try_wait().unwrap().is_none(), "the run ended by itself");
        std::thread::yield_now();
    }
    // Twice at once, as `timeout` does, is one request.
    let id = child.id().to_string();
    let kill = std::process::Command::new("kill").args(["-INT", &id, &id]).status().unwrap();
    assert!(kill.success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let report = folder.report("out/scene");
    assert_eq!((report["status"].as_str(), report["frames"].as_u64()), (Some("interrupted"), Some(1)));
}

/// Steps that time in f32 cannot count, and materials with hardly any stiffness, end in a sentence or at once.
#[test]
fn absurd_steps_are_refused_and_endless_ones_are_not_taken() {
    let folder = Folder::new();
    for (from, to) in [("young = 1e4", "young = 1e18"), ("grid_density = 32", "grid_density = 32\nforce_dt = 1e-12")] {
        folder.scene(FALL, &[(from, to)]);
        folder.run(&["plan", "scene.toml"]).expect(2, &["is too short for frames of"]);
        folder.run(&["--scene", "scene.toml", "--quiet"]).expect(2, &["is too short for frames of"]);
    }
    // Where damping is what is too much, its key is named.
    let held = "name = \"jelly\"\ndamping = 1e6\npins = [{ box = { min = [-1, -1, 0.1], max = [1, 1, 1] } }]";
    folder.scene(FALL, &[("name = \"jelly\"", held)]);
    folder.run(&["plan", "scene.toml"]).expect(2, &["object[0].damping", "is too short for frames of"]);
    folder.scene(FALL, &[("young = 1e4", "young = 1e-4")]);
    folder.run(&["--scene", "scene.toml", "--quiet", "--frames", "2", "--output", "state"]).expect(0, &[]);
}
