//! What can be wrong with a network, its library, its files and a driving video: exit codes and words, and nothing lost.

mod cli_flow_scene;
mod cli_scene;
#[path = "../../net/tests/toy/onnx.rs"]
#[allow(dead_code)] // A part of it serves here.
mod onnx;

use cli_flow_scene::{clip, model, scene};
use cli_scene::{Folder, names};
use onnx::{F32, Graph};

const SHORT: &str = "steps = 4\ntau_step = 3\niterations = 2";

/// A folder with a clip, a scene over it and a copy of the small model that may be spoiled.
fn start() -> Folder {
    let folder = Folder::new();
    clip(&folder, "clip", 16, 16, 5);
    scene(&folder, SHORT, "frames = 'clip/frames'\nmasks = 'clip/masks'", 5);
    for file in ["encode.onnx", "decode.onnx", "velocity.onnx", "model.toml"] {
        std::fs::create_dir_all(folder.path("model")).unwrap();
        std::fs::copy(format!("{}/{file}", model("small")), folder.path("model").join(file)).unwrap();
    }
    folder
}

/// The manifest without hashes, with each `from` replaced.
fn manifest(folder: &Folder, changes: &[(&str, &str)]) {
    let mut text = std::fs::read_to_string(folder.path("model/model.toml")).unwrap();
    while let Some(at) = text.find(", sha256 = \"") {
        text.replace_range(at..at + ", sha256 = \"".len() + 64 + 1, "");
    }
    for (from, to) in changes {
        assert!(text.contains(from), "{from:?} is not in the manifest");
        text = text.replace(from, to);
    }
    folder.write("model/model.toml", text);
}

#[track_caller]
fn refused(folder: &Folder, code: i32, parts: &[&str]) {
    folder.run(&["--scene", "scene.toml", "--out", "out", "--model", "model", "--quiet"]).expect(code, parts);
}

#[test]
fn a_good_copy_runs() {
    refused(&start(), 0, &[]);
}

#[test]
fn libraries_that_cannot_serve_are_told() {
    let folder = start();
    folder.write("lib.so", "no library");
    for (library, words) in [("lib.so", "lib.so"), ("absent.so", "absent.so")] {
        let args = ["--scene", "scene.toml", "--model", "model", "--quiet", "--ort-lib", library];
        folder.run(&args).expect(4, &[words]);
    }
    let args = ["--scene", "scene.toml", "--model", "model", "--quiet", "--provider", "cuda"];
    folder.run(&args).expect(4, &["CUDA"]);
}

#[test]
fn models_that_are_not_what_they_say_are_told() {
    let folder = start();
    std::fs::remove_file(folder.path("model/decode.onnx")).unwrap();
    refused(&folder, 4, &["decode.onnx"]);

    let folder = start();
    let whole = std::fs::read(folder.path("model/velocity.onnx")).unwrap();
    manifest(&folder, &[]);
    folder.write("model/velocity.onnx", &whole[..whole.len() / 2]);
    refused(&folder, 4, &["velocity.onnx"]);

    let zeros = "0".repeat(64);
    manifest(&folder, &[("\"velocity.onnx\"", &format!("\"velocity.onnx\", sha256 = \"{zeros}\""))]);
    folder.write("model/velocity.onnx", &whole);
    refused(&folder, 4, &["velocity.onnx", &zeros]);

    let folder = start();
    folder.write("model/model.toml", "schema = 1\nname = ");
    refused(&folder, 4, &["model.toml"]);
    let folder = start();
    manifest(&folder, &[("channels = 16", "channels = 15")]);
    refused(&folder, 4, &["tensor `latent`", "[1, 15, ?, ?, ?] by the manifest"]);
    let folder = start();
    manifest(&folder, &[("name = \"x\"", "name = \"y\"")]);
    refused(&folder, 4, &["`x`", "neither the manifest"]);
    let folder = start();
    manifest(&folder, &[("[velocity]", "[velocity]\nmemory = 999999999999999")]);
    refused(&folder, 3, &["memory"]);
}

/// p = z log(0.8 − σ): numbers below σ = 0.8, none above. Steps of the schedule at shift 2.3 with 4 steps: 0, 0.434,
/// 0.697, 0.873: the last inversion step starts below, the SDE at σ = 0.873 is the first to see none.
#[test]
fn a_network_that_gives_no_numbers_is_named_with_step_and_noise_level() {
    let folder = start();
    manifest(&folder, &[]);
    let graph = Graph::default()
        .input("x", F32, &[1, 33, -1, -1, -1])
        .input("sigma", F32, &[1])
        .ints("from", &[0])
        .ints("to", &[16])
        .ints("axis", &[1])
        .floats("limit", &[1], &[0.8])
        .node("Slice", &["x", "from", "to", "axis"], "z")
        .node("Sub", &["limit", "sigma"], "rest")
        .node("Log", &["rest"], "factor")
        .node("Mul", &["z", "factor"], "prediction")
        .output("prediction", F32, &[1, 16, -1, -1, -1]);
    folder.write("model/velocity.onnx", graph.file());
    refused(&folder, 5, &["not finite", "step 1 of the SDE", "σ = 0.8734"]);
    // What was finished is kept: the inversion.
    assert_eq!(names(&folder.path("out")), ["flow.checkpoint", "report.json"]);
    let report = folder.report("out");
    assert_eq!(report["status"], "failed");
    assert!(report["message"].as_str().unwrap().contains("not finite"));
}

/// A decoder that gives no numbers would leave a black video, and the next chunk would start from it.
#[test]
fn a_decoder_that_gives_no_numbers_is_named_and_the_latents_are_kept() {
    let folder = start();
    manifest(&folder, &[]);
    let graph = Graph::default()
        .input("latent", F32, &[1, 16, -1, -1, -1])
        .floats("zero", &[1], &[0.0])
        .ints("from", &[0])
        .ints("to", &[3])
        .ints("axis", &[1])
        .floats("scales", &[5], &[1.0, 1.0, 2.5, 8.0, 8.0])
        .node("Slice", &["latent", "from", "to", "axis"], "three")
        .node("Resize", &["three", "", "scales"], "large")
        .node("Mul", &["large", "zero"], "nothing")
        .node("Div", &["nothing", "zero"], "video")
        .output("video", F32, &[1, 3, -1, -1, -1]);
    folder.write("model/decode.onnx", graph.file());
    refused(&folder, 5, &["the network `decode`", "not finite"]);
    assert_eq!(names(&folder.path("out")), ["flow.checkpoint", "report.json"]);
}

/// Keys that the model has no use for are said, in `plan` too.
#[test]
fn keys_without_effect_are_said() {
    let folder = start();
    let keys =
        "steps = 4\ntau_step = 3\niterations = 2\nguidance = 6.0\ninversion_guidance = 2.0\nprompt = 'two balls'";
    scene(&folder, keys, "frames = 'clip/frames'", 5);
    let said = ["flow.guidance has no effect", "flow.inversion_guidance has no effect", "flow.prompt is kept"];
    let run = folder.run(&["--scene", "scene.toml", "--out", "out", "--model", "model"]);
    run.expect(0, &said);
    assert!(said.iter().all(|note| run.err.matches(note).count() == 1), "{}", run.err);
    let plan = folder.run(&["plan", "scene.toml", "--model", "model"]);
    assert!(said.iter().all(|note| plan.out.contains(note)), "{}", plan.out);
    // γ beyond what is stable for any data: σ of step 1 of 4 at shift 2.3 is 0.434.
    scene(&folder, "steps = 4\ntau_step = 1\ngamma = 0.5", "frames = 'clip/frames'", 5);
    let plan = folder.run(&["plan", "scene.toml", "--model", "model"]);
    assert!(plan.out.contains("flow.gamma 0.5 is above 2σ² = 0.376"), "{}", plan.out);
}

/// What is missing for a model that takes text is told before anything runs, by `plan` and `check` too.
#[test]
fn embeddings_are_looked_at_before_anything_runs() {
    let folder = start();
    let contract = format!("{}/../../tests/models/framepack", env!("CARGO_MANIFEST_DIR"));
    for entry in std::fs::read_dir(&contract).unwrap().flatten() {
        std::fs::create_dir_all(folder.path("model")).unwrap();
        std::fs::copy(entry.path(), folder.path("model").join(entry.file_name())).unwrap();
    }
    let keys = "steps = 3\ntau_step = 2\nsize = [32, 32]";
    scene(&folder, keys, "frames = 'clip/frames'", 5);
    manifest(&folder, &[("embeddings = \"prompt.npz\"\n", "")]);
    let needs = ["flow.embeddings", "needs the array"];
    refused(&folder, 2, &needs);
    folder.run(&["plan", "scene.toml", "--model", "model"]).expect(2, &needs);
    // An archive of something else.
    scene(&folder, &format!("{keys}\nembeddings = 'golden.npz'"), "frames = 'clip/frames'", 5);
    std::fs::copy(folder.path("model/golden.npz"), folder.path("golden.npz")).unwrap();
    refused(&folder, 2, &["flow.embeddings", "it holds", "and model framepack-contract reads"]);
    folder.write("golden.npz", "rubbish");
    refused(&folder, 2, &["flow.embeddings", "golden.npz"]);
}

#[test]
fn settings_that_do_not_fit_are_told_at_their_keys() {
    let folder = start();
    let input = "frames = 'clip/frames'";
    for (keys, parts) in [
        ("gamma = 0.0", &["scene.toml:3", "flow.gamma"][..]),
        ("gamma = nan", &["flow.gamma"]),
        ("steps = 4\ntau_step = 5", &["flow.tau_step", "5 is beyond"]),
        ("tau_step = 26", &["flow.tau_step 26 is beyond the 25 steps"]),
        ("sde = 'exponential'\nbeta = 0.3", &["flow.beta", "euler_maruyama"]),
        ("sde = 'variance_corrected'\nmask = { pool = 'share' }", &["flow.mask.pool"]),
        ("sde = 'variance_corrected'\ngamma = 1.9", &["gamma 1.9", "2σ²"]),
        ("sde = 'euler'", &["flow.sde", "euler_maruyama"]),
        ("size = [60, 64]", &["flow.size 60 × 64", "multiples of 8", "64 × 64"]),
        ("size = [0, 64]", &["flow.size"]),
        ("size = [8, 8]", &["8"]),
        ("size = [8192, 8192]\nact = 'reconstruct'", &["8192"]),
        ("act = 'animte'", &["animate"]),
        ("iteration = 3", &["iterations"]),
        ("embeddings = 'none.npz'", &["flow.embeddings", "none.npz"]),
    ] {
        scene(&folder, keys, input, 5);
        refused(&folder, 2, parts);
    }
    // A model inside the asset root that is not there, at its line.
    scene(&folder, SHORT, input, 5);
    folder.run(&["check", "scene.toml"]).expect(2, &["scene.toml:2", "elsewhere"]);
}

#[test]
fn driving_videos_that_do_not_fit_are_told_at_their_keys() {
    let folder = start();
    clip(&folder, "few", 16, 16, 4);
    clip(&folder, "small", 8, 8, 5);
    folder.write("empty/readme.txt", "").write("bad/0.png", "no picture");
    for (input, parts) in [
        ("frames = 'absent'", &["flow.input.frames", "absent"][..]),
        ("frames = 'empty'", &["holds no PNG file"]),
        ("frames = 'bad'", &["0.png"]),
        ("frames = '../clip'", &["leaves the asset root"]),
        ("frames = 'clip/frames'\nmasks = 'few/masks'", &["flow.input.masks", "4 masks for 5 frames"]),
        ("frames = 'clip/frames'\nmasks = 'small/masks'", &["the frames are 16 × 16"]),
        ("frames = 'clip/frames'\nimage = 'small/frames/0000.png'", &["flow.input.image", "8 × 8"]),
        ("frames = 'clip/frames'\nbackground = 'clip'", &["flow.input.background"]),
    ] {
        scene(&folder, SHORT, input, 5);
        folder.run(&["--scene", "scene.toml", "--model", "model", "--quiet"]).expect(2, parts);
    }
    folder.write(
        "scene.toml",
        "[camera]\neye = [0, -1, 0]\ntarget = [0, 0, 0]\n[[object]]\nname = 'a'\nsource.ball = { center = [0, 0, 0], radius = 0.1 }\n\
         [flow]\nmodel = 'model'\n[flow.input]\nframes = 'clip/frames'\n",
    );
    folder.run(&["check", "scene.toml"]).expect(2, &["flow.input", "take the place of a simulated scene"]);
}
