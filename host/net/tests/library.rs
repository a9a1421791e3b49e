//! The library: what is found, what is refused, and that nothing of it ends the process.

mod toy;

use std::path::{Path, PathBuf};
use std::process::Command;

use physvideo_net::{Kind, LibraryChoice, NetError, Provider, Runtime};

fn load(path: &Path) -> Result<Runtime, NetError> {
    Runtime::load(&LibraryChoice { path: Some(path.to_path_buf()), ..LibraryChoice::default() })
}

fn refusal(path: &Path) -> String {
    let error = load(path).unwrap_err();
    assert_eq!(error.kind(), Kind::Model);
    error.to_string()
}

/// A library of this process that is not ONNX Runtime.
fn c_library() -> PathBuf {
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
    let name = |line: &str| line.split_whitespace().last().map(str::to_owned).filter(|n| n.contains("/libc"));
    PathBuf::from(maps.lines().find_map(name).expect("this program uses the C library"))
}

/// A library that says it is ONNX Runtime.
fn pretender(folder: &Path, name: &str, base: &str) -> PathBuf {
    let source = folder.join(format!("{name}.rs"));
    let code = format!(
        "use std::ffi::c_void;
        #[repr(C)] pub struct Base {{ api: extern \"C\" fn(u32) -> *const c_void, version: extern \"C\" fn() -> *const u8 }}
        extern \"C\" fn api(_: u32) -> *const c_void {{ std::ptr::null() }}
        extern \"C\" fn version() -> *const u8 {{ b\"{name}\\0\".as_ptr() }}
        static BASE: Base = Base {{ api, version }};
        #[unsafe(no_mangle)] pub extern \"C\" fn OrtGetApiBase() -> *const Base {{ {base} }}"
    );
    std::fs::write(&source, code).unwrap();
    let library = folder.join(format!("lib{name}.so"));
    let rustc = std::env::var_os("RUSTC").unwrap_or("rustc".into());
    let built = Command::new(rustc)
        .args(["-A", "warnings", "--edition", "2024", "--crate-type", "cdylib", "--crate-name", "pretender", "-o"])
        .args([&library, &source])
        .status();
    assert!(built.unwrap().success());
    library
}

/// In this order: once a library is loaded, any other is refused for that reason.
#[test]
fn libraries() {
    what_is_no_library_is_refused();
    one_library_serves_a_process();
    a_provider_that_is_not_there_is_told();
}

fn what_is_no_library_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let told = refusal(&path("none.so"));
    assert!(told.contains("none.so (--ort-lib)") && told.contains("tools/setup"), "{told}");
    assert!(refusal(folder.path()).contains("it is not a file"));
    std::fs::write(path("text.so"), "#!/bin/sh\n").unwrap();
    assert!(refusal(&path("text.so")).ends_with("it is not a shared library"));
    std::fs::write(path("empty.so"), "").unwrap();
    assert!(refusal(&path("empty.so")).ends_with("it is not a shared library"));
    let whole = std::fs::read(toy::library()).unwrap();
    for length in [40, 5000, whole.len() / 2, whole.len() - 1] {
        std::fs::write(path("cut.so"), &whole[..length]).unwrap();
        assert!(refusal(&path("cut.so")).ends_with("it is cut short"), "{length}");
    }
    assert!(refusal(&c_library()).ends_with("it is another library"));
    assert!(
        refusal(&pretender(folder.path(), "1.20.1", "&BASE"))
            .ends_with("its version is 1.20.1, and 1.24 or a later 1.x is needed")
    );
    assert!(refusal(&pretender(folder.path(), "1.99.0", "&BASE")).contains("its version is 1.99.0"));
    assert!(refusal(&pretender(folder.path(), "null", "std::ptr::null()")).ends_with("it offers no API"));
}

fn one_library_serves_a_process() {
    let runtime = toy::runtime();
    assert!(runtime.version().starts_with("1."), "{}", runtime.version());
    assert_eq!(load(&toy::library()).unwrap().path(), runtime.path());
    let folder = tempfile::tempdir().unwrap();
    let second = folder.path().join("second.so");
    std::fs::copy(toy::library(), &second).unwrap();
    let told = refusal(&second);
    assert!(told.contains("a process can load only one") && told.contains("second.so"), "{told}");
}

fn a_provider_that_is_not_there_is_told() {
    let choice = LibraryChoice { path: Some(toy::library()), provider: Provider::Cuda, threads: None };
    match Runtime::load(&choice) {
        Err(e @ NetError::Provider { .. }) => assert!(e.to_string().contains("onnxruntime-gpu"), "{e}"),
        // The library on this machine may have it.
        other => assert!(other.is_ok(), "{other:?}"),
    }
}
