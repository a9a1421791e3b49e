//! The driver's compiled pipelines, kept between runs in the user's cache folder, so that a second run starts at once.
//! Everything here may fail without harm: the pipelines are compiled again then.

use std::path::PathBuf;

use physvideo_gpu::Gpu;

use crate::io::write::{create_folder, write_whole};

/// `$XDG_CACHE_HOME/physvideo-engine/pipelines`, or below `~/.cache`; drivers refuse what another device or version wrote.
fn file() -> Option<PathBuf> {
    let absolute = |name| std::env::var_os(name).map(PathBuf::from).filter(|p| p.is_absolute());
    let folder = absolute("XDG_CACHE_HOME").or_else(|| absolute("HOME").map(|home| home.join(".cache")))?;
    Some(folder.join("physvideo-engine").join("pipelines"))
}

/// What the last run left.
pub fn read() -> Vec<u8> {
    file().and_then(|path| std::fs::read(path).ok()).unwrap_or_default()
}

/// Keeps the pipelines of this run, unless the file holds as much already.
pub fn keep(gpu: &Gpu, before: usize) {
    let (Some(path), Ok(data)) = (file(), gpu.pipeline_cache()) else { return };
    if data.len() > before
        && let Some(folder) = path.parent()
        && create_folder(folder).is_ok()
    {
        // A cache that cannot be written is no fault of the run.
        let _ = write_whole(&path, |file| std::io::Write::write_all(file, &data));
    }
}
