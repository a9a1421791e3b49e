//! What `models` says, and how it ends.

mod cli_scene;

use std::path::{Path, PathBuf};

use cli_scene::{Folder, Said};

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A copy of a small model, and what `models check` says of it.
struct Copy(Folder);

impl Copy {
    fn new() -> Self {
        let folder = Folder::new();
        for entry in std::fs::read_dir(repository().join("tests/models/wan2.2-ti2v-5b")).unwrap() {
            let path = entry.unwrap().path();
            folder.write(
                &format!("model/{}", path.file_name().unwrap().to_str().unwrap()),
                std::fs::read(&path).unwrap(),
            );
        }
        Self(folder)
    }

    fn replace(&self, from: &str, to: &str) {
        let path = self.0.path("model/model.toml");
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(from));
        std::fs::write(path, text.replace(from, to)).unwrap();
    }

    fn check(&self) -> Said {
        self.0.run(&["models", "check", "model"])
    }

    /// Fails unless the model is refused, with these words on standard output.
    #[track_caller]
    fn refused(&self, words: &str) {
        let said = self.check();
        said.expect(4, &["1 of 1 models cannot be used"]);
        assert!(said.out.contains(words), "{words:?} is not in:\n{}", said.out);
    }
}

#[test]
fn the_shipped_models_are_listed_and_checked() {
    let folder = Folder::new();
    for (command, words) in [
        ("list", "wan2.2-ti2v-5b  encode + encode_image + velocity + decode, 121 frames a chunk"),
        ("check", "ONNX Runtime 1."),
    ] {
        let said =
            cli_scene::said(folder.command(&["models", command]).current_dir(repository().join("assets/scenes")));
        said.expect(0, &[]);
        assert!(said.out.contains(words), "{}", said.out);
    }
    folder.run(&["models", "list"]).expect(2, &["no folder assets/models is near"]);
    folder.run(&["models", "check", "nowhere"]).expect(4, &["nowhere: is not there"]);
    let models = repository().join("tests/models");
    let said = folder.run(&["models", "check", models.to_str().unwrap()]);
    said.expect(0, &[]);
    assert_eq!(said.out.matches("loads it").count(), 23, "{}", said.out);
    assert!(!said.out.contains("note") && !said.out.contains("bad"), "{}", said.out);
}

#[test]
fn what_is_wrong_with_a_model_is_told_with_exit_code_4() {
    let copy = Copy::new();
    copy.check().expect(0, &[]);
    copy.replace("name = \"timestep\"", "name = \"time\"");
    copy.refused("velocity.onnx: tensor `timestep`: is needed by the graph");
    copy.replace("name = \"time\"\n", "name = \"timestep\"\nfoo = 1\n");
    copy.refused("unknown key `foo`");
    copy.replace("foo = 1\n", "");
    copy.check().expect(0, &[]);
    copy.0.write("model/decode.onnx", b"other");
    copy.refused("decode.onnx: its SHA-256 is d9298a10d1b0735837dc4bd85dac641b0f3cef27a47e5d53a54f2f3f5b2fcffa, the manifest says");
    std::fs::remove_file(copy.0.path("model/velocity.onnx.data")).unwrap();
    copy.refused("velocity.onnx.data: is not there");
    for file in ["encode.onnx", "encode_image.onnx", "velocity.onnx", "decode.onnx"] {
        std::fs::remove_file(copy.0.path("model").join(file)).unwrap();
    }
    copy.refused("absent  none of its files is here. How to get them:\n    python tools/models/make_contracts.py");
}

#[test]
fn a_library_that_is_none_is_told_with_exit_code_4() {
    let copy = Copy::new();
    let said = copy.0.run(&["models", "check", "model", "--ort-lib", "none.so"]);
    said.expect(4, &["ONNX Runtime is not there. Looked for none.so (--ort-lib). Run tools/setup"]);
    // What can be looked at without it was.
    assert!(said.out.contains("3 inputs and the output are those of the manifest"), "{}", said.out);
    copy.0.write("text.so", b"#!/bin/sh");
    let said = copy.0.run(&["models", "check", "model", "--ort-lib", "text.so"]);
    said.expect(4, &["text.so cannot be used as ONNX Runtime: it is not a shared library"]);
    let said = cli_scene::said(copy.0.command(&["models", "check", "model"]).env("ORT_DYLIB_PATH", "gone.so"));
    said.expect(4, &["gone.so (ORT_DYLIB_PATH)"]);
    copy.0.run(&["models", "check", "model", "--provider", "tpu"]).expect(2, &["cpu, cuda"]);
}

#[test]
fn without_a_library_the_places_looked_at_are_told() {
    let copy = Copy::new();
    // A program that lies alone has no library beside it.
    std::fs::copy(env!("CARGO_BIN_EXE_physvideo-engine"), copy.0.path("program")).unwrap();
    let mut alone = std::process::Command::new(copy.0.path("program"));
    alone.args(["models", "check", "model"]).current_dir(copy.0.path("")).env_remove("ORT_DYLIB_PATH");
    let said = cli_scene::said(&mut alone);
    if said.code == 0 {
        // This system has one of its own.
        return assert!(said.out.contains("at libonnxruntime.so"), "{}", said.out);
    }
    let beside = copy.0.path("libonnxruntime.so");
    said.expect(
        4,
        &["ONNX Runtime is not there. Looked for", beside.to_str().unwrap(), "of the system. Run tools/setup"],
    );
}
