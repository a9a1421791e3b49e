//! The table from which `--error-budget` chooses: error of the sag of beams for each number of cells across them and each
//! Courant number.

use std::path::Path;

use physvideo_gpu::Gpu;
use physvideo_tests::problems::{Setting, cantilever, elastic};

const CELLS: [u32; 4] = [2, 3, 4, 6];
const HEAD: &str = "\
# Error of an elastic body's bending under its own weight (relative, of the sag; the larger of problems M7
# and M7-short) for each number of cells across it and each Courant number. Made by: tools/bench wp budget
cells,courant,error
";

/// Writes `elastic.csv`.
pub fn run(gpu: &Gpu, out: &Path) -> Result<(), String> {
    let mut text = HEAD.to_string();
    for resolution in CELLS {
        for courant in elastic::COURANTS {
            let setting = Setting { method: "updated_lagrangian", resolution, courant };
            let error =
                f64::max((cantilever::SHORT.run)(gpu, setting)?.error, (cantilever::BEAM.run)(gpu, setting)?.error);
            println!("{resolution} cells, Courant number {courant}: {:.2} %", 100.0 * error);
            text += &format!("{resolution},{courant},{error:.4}\n");
        }
    }
    let path = out.join("elastic.csv");
    std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
}
