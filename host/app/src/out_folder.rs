//! The folder of a run's results and the names in it. Does not know what the files hold.

use std::path::{Path, PathBuf};

use crate::error::AppError;
use crate::io::write::{WholeFile, create_folder};

/// The encoded clip.
pub const VIDEO: &str = "video.mp4";
/// The clip after the network.
pub const FLOW_VIDEO: &str = "flow.mp4";
/// What happened.
pub const REPORT: &str = "report.json";

/// `out/<name of the scene>`.
pub fn default_for(scene: &Path) -> PathBuf {
    Path::new("out").join(scene.file_stem().unwrap_or("scene".as_ref()))
}

/// Makes the output folder, before any work is done.
///
/// # Errors
/// A folder that cannot be made or written.
pub fn make(out: &Path) -> Result<(), AppError> {
    create_folder(out)?;
    WholeFile::create(&out.join(REPORT)).map(drop).map_err(AppError::from)
}

/// Takes away what an earlier run left under the names this one uses, so that no folder mixes two runs.
pub fn remove_earlier(out: &Path) {
    let ours = |name: &str| {
        let number = name.strip_prefix("frame_").and_then(|rest| rest.split_once('.'));
        number.is_some_and(|(n, e)| {
            n.len() >= 5 && n.bytes().all(|b| b.is_ascii_digit()) && matches!(e, "png" | "exr" | "npz" | "ply")
        })
    };
    for folder in ["frames", "points", "flow"] {
        for entry in std::fs::read_dir(out.join(folder)).into_iter().flatten().flatten() {
            if entry.file_name().to_str().is_some_and(ours) {
                // A file that stays is replaced or refused when its frame is written.
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }
    for name in [VIDEO, FLOW_VIDEO, REPORT] {
        let _ = std::fs::remove_file(out.join(name));
    }
}
