//! Reads every kernel once: expand imports, validate, reflect, emit one Rust file. Knows nothing of Vulkan.

#[path = "build/emit.rs"]
mod emit;
#[path = "build/expand.rs"]
mod expand;
#[path = "build/layout.rs"]
mod layout;
#[path = "build/reflect.rs"]
mod reflect;

use std::path::{Path, PathBuf};

fn main() {
    println!("cargo:rerun-if-changed=wgsl");
    println!("cargo:rerun-if-changed=build");
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default()).join("wgsl");
    let out = PathBuf::from(std::env::var_os("OUT_DIR").unwrap_or_default()).join("kernels.rs");
    let generated = kernel_names(&root).and_then(|names| {
        let kernels = names
            .iter()
            .map(|name| expand::expand(&root, name).and_then(|source| reflect::reflect(name, &source)))
            .collect::<Result<Vec<_>, _>>()?;
        emit::emit(&kernels, &families(&root)?)
    });
    let written = generated.and_then(|text| std::fs::write(&out, text).map_err(|e| format!("{}: {e}", out.display())));
    if let Err(message) = written {
        // Cargo shows what a failed build script prints; the caret points into the WGSL file.
        eprintln!("{message}");
        std::process::exit(1);
    }
}

/// The families: folders whose first file is a member of one.
fn families(root: &Path) -> Result<Vec<emit::Family>, String> {
    let mut found = Vec::new();
    for folder in expand::sorted(root)?.into_iter().filter(|p| p.is_dir()) {
        let first = expand::sorted(&folder)?.into_iter().next();
        let text = first.and_then(|file| std::fs::read_to_string(file).ok()).unwrap_or_default();
        if text.starts_with("//! member ") {
            let family = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let members = expand::members(root, &family)?.into_iter().map(|m| (m.name, m.kind)).collect();
            found.push((family, members));
        }
    }
    Ok(found)
}

/// Every WGSL file that declares an entry point is a kernel; its name is its path without the ending.
fn kernel_names(root: &Path) -> Result<Vec<String>, String> {
    let mut names = Vec::new();
    for folder in expand::sorted(root)?.into_iter().filter(|p| p.is_dir()) {
        for file in expand::sorted(&folder)? {
            let text = std::fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))?;
            if text.contains("@compute") {
                let name = file.strip_prefix(root).unwrap_or(&file).with_extension("");
                names.push(name.to_string_lossy().replace('\\', "/"));
            }
        }
    }
    Ok(names)
}
