//! Copies of the kernels' WGSL to edit in tests. Knows nothing of what they say.

use std::path::Path;

/// The WGSL folder of the kernels.
pub const KERNELS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../kernels/wgsl");

/// Copies every WGSL file into a folder.
///
/// # Panics
/// When a file cannot be read or written.
pub fn copy_kernels(to: &Path) {
    for folder in std::fs::read_dir(KERNELS).expect("the WGSL folder").map(|e| e.expect("an entry").path()) {
        let into = to.join(folder.file_name().expect("a name"));
        std::fs::create_dir_all(&into).expect("a folder");
        for file in std::fs::read_dir(&folder).expect("a folder").map(|e| e.expect("an entry").path()) {
            std::fs::copy(&file, into.join(file.file_name().expect("a name"))).expect("a copy");
        }
    }
}

/// Replaces a piece of text in a copy (`file` without ending).
///
/// # Panics
/// When the text is not there: the test that wanted it must be mended.
pub fn edit(folder: &Path, file: &str, from: &str, to: &str) {
    let path = folder.join(format!("{file}.wgsl"));
    let text = std::fs::read_to_string(&path).expect("a WGSL file");
    assert!(text.contains(from), "{file}.wgsl no longer holds `{from}`");
    std::fs::write(&path, text.replace(from, to)).expect("written");
}
