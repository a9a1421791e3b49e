//! Files, hashes, memory and interruption: what must be refused, and how.

mod toy;

use std::os::unix::fs::symlink;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use physvideo_net::{
    Branch, Conditioning, Grid, Kind, Model, NetError, OpenOptions, Role, Sigma, Status, Tensor, check,
};
use toy::onnx::{Attribute, BOOL, F32, F64, Graph, I64};
use toy::{ENCODE, Folder, HEAD, NEVER, VELOCITY, noise, runtime, toy};

fn text(e: &NetError) -> String {
    assert_eq!(e.kind(), Kind::Model, "{e}");
    e.to_string()
}

fn encoder() -> Folder {
    Folder::new(&[HEAD, ENCODE].concat(), &[("encode.onnx", toy::encode())])
}

#[test]
fn links_and_missing_files_are_refused() {
    let folder = encoder();
    let path = folder.path().join("encode.onnx");
    std::fs::rename(&path, folder.path().join("other.onnx")).unwrap();
    assert!(text(&folder.refusal(Role::Encode)).contains("encode.onnx: is not there"));
    symlink("other.onnx", &path).unwrap();
    assert!(text(&folder.refusal(Role::Encode)).contains("symbolic link"));
    std::fs::remove_file(&path).unwrap();
    std::fs::hard_link(folder.path().join("other.onnx"), &path).unwrap();
    assert!(text(&folder.refusal(Role::Encode)).contains("hard link"));
    std::fs::remove_file(&path).unwrap();
    std::fs::create_dir(&path).unwrap();
    assert!(text(&folder.refusal(Role::Encode)).contains("is a folder"));
}

#[test]
fn a_wrong_hash_is_refused() {
    let folder = encoder();
    let hash = "0".repeat(64);
    let manifest = [HEAD, ENCODE].concat().replace("\"encode.onnx\"", &format!("\"encode.onnx\", sha256 = \"{hash}\""));
    folder.write("model.toml", manifest.as_bytes());
    let refusal = folder.refusal(Role::Encode);
    assert!(matches!(&refusal, NetError::Hash { expected, .. } if *expected == hash));
    let NetError::Hash { found, .. } = refusal else { return };
    folder.write("model.toml", manifest.replace(&hash, &found.to_uppercase()).as_bytes());
    folder.model(&[Role::Encode]);
}

#[test]
fn damaged_graphs_are_refused() {
    let whole = toy::encode();
    let folder = encoder();
    for length in [0, 1, 10, whole.len() / 2, whole.len() - 1] {
        folder.write("encode.onnx", &whole[..length]);
        assert!(text(&folder.refusal(Role::Encode)).contains("encode.onnx"));
    }
    folder.write("encode.onnx", b"version https://git-lfs.github.com/spec/v1\n");
    assert!(text(&folder.refusal(Role::Encode)).contains("no ONNX file"));
    // Any one byte changed: refused or loaded, never worse. What loads may be run.
    for at in (0..whole.len()).step_by(3) {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x55;
        folder.write("encode.onnx", &bytes);
        if let Ok(mut model) = folder.open(&[Role::Encode]) {
            let _ = model.encode(&noise(&[3, 3, 4, 4], 1), NEVER);
        }
    }
}

#[test]
fn graphs_that_contradict_the_manifest_are_refused() {
    let graph = |video: &str, element: u64, shape: &[i64], latent: &str| {
        Graph::default()
            .input(video, element, shape)
            .output(latent, element, &[1, 4, -1, -1, -1])
            .ints("one", &[1])
            .node("ReduceMean", &[video, "one"], "mean")
            .node_with("Concat", &["mean", "mean", "mean", "mean"], &[latent], &[("axis", Attribute::Int(1))])
            .file()
    };
    let folder = encoder();
    let refused = |bytes: Vec<u8>, words: &str| {
        folder.write("encode.onnx", &bytes);
        let told = text(&folder.refusal(Role::Encode));
        assert!(told.contains(words), "{told}");
    };
    refused(graph("clip", F32, &[1, 3, -1, -1, -1], "latent"), "`clip`: is needed by the graph");
    refused(graph("video", F32, &[1, 3, -1, -1, -1], "out"), "`latent`: is no output of any graph; there are: out");
    refused(graph("video", F64, &[1, 3, -1, -1, -1], "latent"), "is f64 in the graph and f32 in the manifest");
    refused(graph("video", F32, &[1, 5, -1, -1, -1], "latent"), "has shape [1, 5, ?, ?, ?] in the graph and [1, 3");
    refused(graph("video", F32, &[1, 3, -1, -1], "latent"), "has shape [1, 3, ?, ?] in the graph");
    // A graph of one size refuses another before it is run.
    folder.write("encode.onnx", &graph("video", F32, &[1, 3, 1, 4, 4], "latent"));
    let mut model = folder.model(&[Role::Encode]);
    let refused = model.encode(&noise(&[3, 1, 8, 8], 1), NEVER).unwrap_err();
    assert!(text(&refused).contains("takes [1, 3, 1, 4, 4], and is given [1, 3, 1, 8, 8]"));
    // And one whose answer has another size is told from one that answers.
    let refused = model.encode(&noise(&[3, 1, 4, 4], 1), NEVER).unwrap_err();
    assert!(text(&refused).contains("answers with [1, 4, 1, 4, 4] where the manifest means [1, 4, 1, 2, 2]"));
}

/// A velocity graph z + w, with w in a file.
fn external(location: &str, data: &str) -> Folder {
    let manifest = VELOCITY
        .replace(r#"parts = ["latents", "mask", "image"]"#, r#"source = "latents""#)
        .replace("\"velocity.onnx\"", &format!("\"sub/velocity.onnx\", data = [{data}]"));
    let graph = Graph::default()
        .input("x", F32, &[1, 4, -1, -1, -1])
        .input("sigma", F32, &[1])
        .output("prediction", F32, &[1, 4, -1, -1, -1])
        .external("w", &[1, 1, 1, 1, 64], location)
        .node("Add", &["x", "w"], "prediction");
    let weights: Vec<u8> = (0..64).flat_map(|i| (i as f32).to_le_bytes()).collect();
    let files = [("sub/velocity.onnx", graph.file()), ("sub/w.data", weights.clone()), ("secret", weights)];
    Folder::new(&[HEAD, &manifest].concat(), &files)
}

#[test]
fn weights_in_files_are_read_if_the_manifest_names_them() {
    let folder = external("w.data", "{ file = \"sub/w.data\" }");
    let mut model = folder.model(&[Role::Velocity]);
    let grid = Grid { frames: 1, height: 1, width: 64 };
    let c = Conditioning::on_image(grid, Tensor::filled(vec![4, 1, 1, 64], 0.0).unwrap());
    let inputs = model.condition(c, NEVER).unwrap();
    let mut out = Vec::new();
    let sigma = Sigma::new(0.5).unwrap();
    model.evaluate(&inputs, &[0.0; 256], sigma, Branch::Conditional, &mut out, NEVER).unwrap();
    assert_eq!(out[..3], [0.0, 1.0, 2.0]);
    // Not there, not named, outside, an address.
    std::fs::remove_file(folder.path().join("sub/w.data")).unwrap();
    assert!(text(&folder.refusal(Role::Velocity)).contains("w.data: is not there"));
    for (location, data) in [
        ("w.data", ""),
        ("w.data", "{ file = \"secret\" }"),
        ("../secret", "{ file = \"secret\" }"),
        ("/etc/passwd", "{ file = \"sub/w.data\" }"),
        ("*/_ORT_MEM_ADDR_/*", "{ file = \"sub/w.data\" }"),
    ] {
        let told = text(&external(location, data).refusal(Role::Velocity));
        assert!(told.contains("does not name among its `data`"), "{told}");
    }
    // Cut short: ONNX Runtime says so.
    let folder = external("w.data", "{ file = \"sub/w.data\" }");
    folder.write("sub/w.data", &[0; 10]);
    assert!(text(&folder.refusal(Role::Velocity)).contains("ONNX Runtime says"));
    // A link in place of the data.
    std::fs::remove_file(folder.path().join("sub/w.data")).unwrap();
    symlink("../secret", folder.path().join("sub/w.data")).unwrap();
    assert!(text(&folder.refusal(Role::Velocity)).contains("symbolic link"));
}

#[test]
fn a_model_larger_than_memory_is_not_loaded() {
    let folder = toy();
    let open = |available: u64, roles: &[Role]| {
        let options = OpenOptions { roles, available_memory: Some(available), ..OpenOptions::default() };
        Model::open(&runtime(), folder.manifest(), &options)
    };
    let size = |name: &str| std::fs::metadata(folder.path().join(name)).unwrap().len();
    let need = size("encode.onnx") + size("velocity.onnx");
    assert!(open(need, &[Role::Encode, Role::Velocity]).is_ok());
    let refused = open(need - 1, &[Role::Velocity, Role::Encode]).unwrap_err();
    assert_eq!(refused.kind(), Kind::Memory);
    assert_eq!(
        refused.to_string(),
        format!("model toy (encode, velocity) needs about {need} bytes of memory and {} bytes are available", need - 1)
    );
    // What the manifest says counts more than the sizes of files.
    let manifest = [HEAD, ENCODE].concat().replace("[encode]", "[encode]\nmemory = 1000000");
    folder.write("model.toml", manifest.as_bytes());
    assert_eq!(open(999_999, &[Role::Encode]).unwrap_err().kind(), Kind::Memory);
}

/// Doubles its input a billion times.
fn endless() -> Vec<u8> {
    let body = Graph::default()
        .input("i", I64, &[])
        .input("go", BOOL, &[])
        .input("a", F32, &[1, 4, -1, -1, -1])
        .node("Identity", &["go"], "on")
        .node("Sin", &["a"], "b")
        .output("on", BOOL, &[])
        .output("b", F32, &[1, 4, -1, -1, -1]);
    Graph::default()
        .input("x", F32, &[1, 4, -1, -1, -1])
        .input("sigma", F32, &[1])
        .output("prediction", F32, &[1, 4, -1, -1, -1])
        .int("often", 1_000_000_000)
        .weights("go", BOOL, &[], &[1])
        .node_with("Loop", &["often", "go", "x"], &["prediction"], &[("body", Attribute::Graph(body))])
        .file()
}

#[test]
fn a_call_is_stopped_in_its_middle() {
    let manifest = VELOCITY.replace(r#"parts = ["latents", "mask", "image"]"#, r#"source = "latents""#);
    let folder = Folder::new(&[HEAD, &manifest].concat(), &[("velocity.onnx", endless())]);
    let mut model = folder.model(&[Role::Velocity]);
    let grid = Grid { frames: 3, height: 16, width: 16 };
    let inputs = model.condition(Conditioning::on_image(grid, noise(&[4, 1, 16, 16], 1)), NEVER).unwrap();
    let z = noise(&[4, 3, 16, 16], 2).data;
    let cancel = AtomicBool::new(false);
    let sigma = Sigma::new(0.5).unwrap();
    std::thread::scope(|scope| {
        let asked = scope.spawn(|| {
            std::thread::sleep(Duration::from_millis(200));
            cancel.store(true, Ordering::Relaxed);
            Instant::now()
        });
        let stopped = model.evaluate(&inputs, &z, sigma, Branch::Conditional, &mut Vec::new(), &cancel);
        let ended = Instant::now();
        assert!(matches!(stopped, Err(NetError::Interrupted)), "{stopped:?}");
        let took = ended.saturating_duration_since(asked.join().unwrap());
        // 10 ms between two looks, and room for a loaded machine.
        assert!(took < Duration::from_secs(2), "{took:?}");
        println!("stopped after {took:?}");
    });
    // Nothing is even begun once it was asked.
    let begun = Instant::now();
    let stopped = model.evaluate(&inputs, &z, sigma, Branch::Conditional, &mut Vec::new(), &cancel);
    assert!(matches!(stopped, Err(NetError::Interrupted)) && begun.elapsed() < Duration::from_secs(1));
}

#[test]
fn a_check_says_everything() {
    let folder = toy();
    let lines = check(Some(&runtime()), &folder.manifest());
    assert!(lines.iter().all(|l| l.status != Status::Bad), "{lines:?}");
    assert_eq!(lines.iter().filter(|l| l.text.ends_with("loads it")).count(), 3);
    assert!(lines.iter().any(|l| l.status == Status::Warning && l.text.contains("SHA-256 is not in the manifest")));
    folder.write("encode.onnx", b"x");
    std::fs::remove_file(folder.path().join("decode.onnx")).unwrap();
    let bad: Vec<_> = check(None, &folder.manifest()).into_iter().filter(|l| l.status == Status::Bad).collect();
    assert_eq!(bad.iter().map(|l| l.role.unwrap()).collect::<Vec<_>>(), [Role::Encode, Role::Decode], "{bad:?}");
}

#[test]
fn a_check_loads_graphs_that_are_loaded_in_turn() {
    let folder = encoder();
    folder.write("model.toml", [HEAD, ENCODE].concat().replace("[encode]", "[encode]\nload = \"in_turn\"").as_bytes());
    let text = |folder: &Folder| check(Some(&runtime()), &folder.manifest()).pop().unwrap().text;
    assert!(text(&folder).ends_with("loads it"));
    // Names and shapes as meant, and an operator that nobody knows.
    let graph = Graph::default().input("video", F32, &[1, 3, -1, -1, -1]).output("latent", F32, &[1, 4, -1, -1, -1]);
    folder.write("encode.onnx", &graph.node("NoSuchOperator", &["video"], "latent").file());
    folder.model(&[Role::Encode]);
    assert!(text(&folder).contains("ONNX Runtime says") && text(&folder).contains("NoSuchOperator"));
}

#[test]
fn a_role_the_model_has_not_is_told() {
    let folder = encoder();
    let refused = folder.open(&[Role::Decode]).unwrap_err();
    assert_eq!((refused.kind(), refused.to_string()), (Kind::Usage, "model toy has no decode network".into()));
}
