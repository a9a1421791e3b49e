//! Scenes with a network, end to end with the shipped small model: what is written and said, the same bits, stopping and
//! going on, and every published model's contract in miniature.

mod cli_flow_scene;
mod cli_scene;

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use cli_flow_scene::{clip, model, scene};
use cli_scene::{FALL, Folder, Said, names};
use serde_json::Value;

fn sha(report: &Value, path: &str) -> String {
    let outputs = report["outputs"].as_array().unwrap();
    let found = outputs.iter().find(|o| o["path"] == path);
    found.unwrap_or_else(|| panic!("{path} is not in {outputs:?}"))["sha256"].as_str().unwrap().to_owned()
}

fn run(folder: &Folder, out: &str, more: &[&str]) -> Said {
    let model = model("small");
    let mut args = vec!["--scene", "scene.toml", "--out", out, "--model", &model];
    args.extend(more);
    folder.run(&args)
}

const FLOW: &str = "[flow]\nmodel = 'elsewhere'\nsteps = 5\ntau_step = 3\niterations = 2\n\n[output]";

#[test]
fn a_scene_with_a_flow_ends_with_two_videos() {
    let folder = Folder::new();
    folder.scene(FALL, &[("[output]", FLOW), ("frames = 3", "frames = 6")]);
    let said = run(&folder, "out", &["--validate"]);
    said.expect(0, &[]);
    assert!(said.out.contains("flow, a chunk") && said.out.contains("4.3 min"), "{}", said.out);
    assert_eq!(names(&folder.path("out")), ["flow", "flow.mp4", "frames", "report.json", "video.mp4"]);
    assert_eq!(names(&folder.path("out/flow")).len(), 6);
    let picture = image::open(folder.path("out/flow/frame_00005.png")).unwrap();
    assert_eq!((picture.width(), picture.height()), (64, 48));

    let report = folder.report("out");
    let flow = &report["flow"];
    assert_eq!(flow["nfe"], serde_json::json!({"inversion": 3, "sde": 2, "generation": 3, "total": 8}));
    assert_eq!((flow["model"].as_str(), flow["size"][0].as_u64()), (Some("small"), Some(64)));
    assert_eq!(flow["chunks"].as_array().unwrap().len(), 1);
    // Before the SDE and after each iteration.
    assert_eq!(flow["chunks"][0]["rms"].as_array().unwrap().len(), 3);
    // σ of step 3 of 5 at shift 2.3, and the paper's β = (1 − σ)/σ.
    let sigma = 2.3 * 0.6 / (1.0 + 1.3 * 0.6);
    assert!((flow["sigma"].as_f64().unwrap() - sigma).abs() < 1e-9);
    assert!((flow["beta"].as_f64().unwrap() - (1.0 - sigma) / sigma).abs() < 1e-9);
    // Part of the picture moves, and not all of it.
    let updated = flow["chunks"][0]["updated"].as_f64().unwrap();
    assert!(updated > 0.02 && updated < 0.98, "{updated}");
    assert!(report["pipelines"].as_array().unwrap().iter().any(|p| p == "latent/sde_step"));
}

#[test]
fn the_same_seed_gives_the_same_flow() {
    let folder = Folder::new();
    folder.scene(FALL, &[("[output]", FLOW)]);
    let frame = |out: &str, more: &[&str]| {
        run(&folder, out, more).expect(0, &[]);
        sha(&folder.report(out), "flow/frame_00002.png")
    };
    let (a, b, c) = (frame("a", &["--quiet"]), frame("b", &["--quiet"]), frame("c", &["--quiet", "--seed", "9"]));
    assert_eq!(a, b);
    assert_ne!(a, c, "another seed is other noise");
}

/// No library is looked for and no model opened where nothing needs one.
#[test]
fn without_a_flow_no_library_is_loaded() {
    let folder = Folder::new();
    folder.scene(FALL, &[]);
    folder.run(&["--scene", "scene.toml", "--quiet", "--ort-lib", "/nowhere/lib.so"]).expect(0, &[]);
    folder.scene(FALL, &[("[output]", FLOW)]);
    let frames = ["--scene", "scene.toml", "--quiet", "--ort-lib", "/nowhere/lib.so", "--output", "frames"];
    folder.run(&frames).expect(0, &[]);
    let report = folder.report("out/scene");
    assert!(report["flow"].is_null());
    assert!(!report["pipelines"].as_array().unwrap().iter().any(|p| p.as_str().unwrap().starts_with("latent/")));
    // It is told before anything is simulated where it is needed.
    let said = folder.run(&["--scene", "scene.toml", "--ort-lib", "/nowhere/lib.so", "--model", &model("small")]);
    said.expect(4, &["/nowhere/lib.so"]);
    assert!(!said.err.contains("frames: 1"), "{}", said.err);
}

/// A clip longer than a chunk: chunks share a frame, and the last one is short.
#[test]
fn a_long_clip_is_made_of_chunks() {
    let folder = Folder::new();
    clip(&folder, "clip", 16, 16, 40);
    scene(&folder, "steps = 2\ntau_step = 1\niterations = 1", "frames = 'clip/frames'", 40);
    run(&folder, "out", &["--quiet"]).expect(0, &[]);
    let report = folder.report("out");
    let chunks = report["flow"]["chunks"].as_array().unwrap().clone();
    assert_eq!(
        chunks.iter().map(|c| c["frames"].clone()).collect::<Vec<_>>(),
        [serde_json::json!([0, 36]), serde_json::json!([36, 39])]
    );
    assert_eq!(names(&folder.path("out/flow")).len(), 40);
    assert_eq!((report["frames"].as_u64(), report["frames_asked"].as_u64()), (Some(40), Some(40)));
}

#[cfg(unix)]
#[test]
fn an_interrupted_flow_goes_on_where_it_was() {
    let folder = Folder::new();
    clip(&folder, "clip", 32, 32, 37);
    scene(&folder, "iterations = 40", "frames = 'clip/frames'\nmasks = 'clip/masks'", 37);
    run(&folder, "whole", &["--quiet"]).expect(0, &[]);

    let model = model("small");
    let args = ["--scene", "scene.toml", "--out", "cut", "--model", &model, "--json-progress"];
    let mut child = folder.command(&args).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let begun = lines.by_ref().map_while(Result::ok).any(|line| {
        let value: Value = serde_json::from_str(&line).unwrap();
        value["task"].as_str().is_some_and(|t| t.starts_with("flow")) && value["done"].as_u64() > Some(0)
    });
    assert!(begun, "the run ended by itself");
    assert!(std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let rest: Vec<String> = lines.map_while(Result::ok).collect();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{rest:?}");
    assert!(rest.last().is_some_and(|l| l.starts_with("interrupted in ")), "{rest:?}");
    assert_eq!(folder.report("cut")["status"], "interrupted");
    assert_eq!(names(&folder.path("cut")), ["flow.checkpoint", "report.json"]);

    // Not of another run's settings; that run leaves the file of this one alone until it writes its own.
    let said = run(&folder, "cut", &[]);
    said.expect(0, &["going on from the checkpoint"]);
    let report = folder.report("cut");
    assert_eq!(report["flow"]["resumed"], true);
    // What the first run did is in the report of the second.
    assert_eq!(report["flow"]["nfe"], folder.report("whole")["flow"]["nfe"]);
    assert_eq!(report["flow"]["chunks"][0]["rms"], folder.report("whole")["flow"]["chunks"][0]["rms"]);
    for frame in [0, 20, 36] {
        let path = format!("flow/frame_{frame:05}.png");
        assert_eq!(sha(&report, &path), sha(&folder.report("whole"), &path), "{path}");
    }
    assert!(!names(&folder.path("cut")).contains(&"flow.checkpoint".to_owned()));
}

#[test]
fn a_checkpoint_of_another_run_is_not_used() {
    let folder = Folder::new();
    clip(&folder, "clip", 16, 16, 5);
    scene(&folder, "steps = 3\ntau_step = 2\niterations = 1", "frames = 'clip/frames'", 5);
    folder.write("out/flow.checkpoint", "rubbish");
    run(&folder, "out", &[]).expect(0, &["not going on from an earlier run", "damaged"]);
    assert_eq!(folder.report("out")["flow"]["resumed"], false);
    folder.write("out/flow.checkpoint", "rubbish");
    let said = run(&folder, "out", &["--fresh"]);
    said.expect(0, &[]);
    assert!(!said.err.contains("earlier run"), "{}", said.err);
}

/// FramePack (backward and forward, linked by latents), Wan (concatenated; clamped first latent, per-token noise levels,
/// guidance), LTX (packed, stretched schedule), CogVideoX (variance-preserving, one size): the whole way of a clip.
#[test]
fn every_published_model_runs_a_clip_in_miniature() {
    for (name, size, frames, chunks) in [
        ("framepack", [32, 32], 109, 3),
        ("framepack-f1", [32, 32], 60, 2),
        ("wan2.1-i2v-14b", [32, 32], 5, 1),
        ("wan2.2-ti2v-5b", [64, 32], 5, 1),
        ("ltx-video-2b", [64, 64], 9, 1),
        ("cogvideox-5b-i2v", [32, 16], 9, 1),
    ] {
        let folder = Folder::new();
        clip(&folder, "clip", 32, 32, frames);
        let keys = format!("steps = 3\ntau_step = 2\niterations = 2\nsize = [{}, {}]", size[0], size[1]);
        scene(&folder, &keys, "frames = 'clip/frames'\nmasks = 'clip/masks'", frames);
        let model = format!("{}/../../tests/models/{name}", env!("CARGO_MANIFEST_DIR"));
        let said = folder.run(&["--scene", "scene.toml", "--out", "out", "--model", &model, "--quiet"]);
        assert_eq!(said.code, 0, "{name}: {}", said.err);
        let report = folder.report("out");
        assert_eq!(report["flow"]["chunks"].as_array().unwrap().len(), chunks, "{name}");
        assert_eq!(report["flow"]["nfe"]["total"].as_u64(), Some(6 * chunks as u64), "{name}");
        assert_eq!(names(&folder.path("out/flow")).len() as u32, frames, "{name}");
    }
}
