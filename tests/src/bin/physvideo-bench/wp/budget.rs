//! The tables from which `--error-budget` chooses: error for each number of cells across a body and each Courant number,
//! a file for each kind of body.

use std::path::Path;

use physvideo::accuracy::Kind;
use physvideo_gpu::Gpu;
use physvideo_tests::problems::settle::Block;
use physvideo_tests::problems::{Setting, cantilever};

const BEAM_CELLS: [u32; 3] = [2, 3, 4];
const BEAM: &str = "\
# Error of an elastic body's bending under its own weight, relative, of the sag: the largest of problems M7 and M7-short by
# MPM and in total-Lagrangian form, against the elastica with shear.
";

const BLOCK_CELLS: [u32; 4] = [4, 6, 8, 12];
const COURANTS: [f32; 2] = [0.4, 0.75];
/// Cells of the run that others are compared with.
const FINER: u32 = 24;
const BLOCK: &str = "\
# Error of the path of the centre of mass of a block that comes down on a floor, the larger of a tall and a broad one
# (problems/settle.rs), over its longest way, but no less than its width; of what bounces, the way it fell included. No answer in closed form is known: this is the
# distance from a run with 24 cells (at Courant number 0.75, by SPH 0.4: MPM loses less in few steps), times
# 1/(1 - cells/24) as for errors of first order, and never less than with more cells. How far the method's own limit is
# from nature is another matter.
";

const OWN: &str = "\
# The blocks are on grids of their own, as deep as wide, with nothing beside them.
";

/// Writes the table of every kind, or of one; or measures a block that no table was made with.
pub fn run(gpu: &Gpu, out: &Path, only: Option<&str>, unseen: bool) -> Result<(), String> {
    // Those without a table are measured where they are asked for by name.
    let wanted = |k: &Kind| only.map_or(!k.table().is_empty(), |name| k.name() == name);
    let kinds: Vec<_> = Kind::ALL.into_iter().filter(wanted).collect();
    if kinds.is_empty() {
        return Err(format!("there is no such kind of body; there are {}", Kind::ALL.map(Kind::name).join(", ")));
    }
    for kind in kinds {
        if unseen {
            if kind != Kind::Held {
                blocks(gpu, kind, Block::unseen(kind))?;
            }
            continue;
        }
        let (head, rows) = if kind == Kind::Held { (BEAM, beams(gpu)?) } else { (BLOCK, both(gpu, kind)?) };
        let more = if kind == Kind::FreeOwn { OWN } else { "" };
        let mut text =
            format!("{head}{more}# Made by: tools/bench wp budget --kind {}\ncells,courant,error\n", kind.name());
        for (cells, courant, error) in without_luck(rows) {
            text += &format!("{cells},{courant},{error:.4}\n");
        }
        let path = out.join(format!("{}.csv", kind.name()));
        std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    Ok(())
}

fn beams(gpu: &Gpu) -> Result<Vec<(u32, f32, f64)>, String> {
    let mut rows = Vec::new();
    for resolution in BEAM_CELLS {
        for courant in COURANTS {
            let mut worst = 0.0;
            for method in ["updated_lagrangian", "total_lagrangian"] {
                let setting = Setting { method, resolution, courant };
                let errors =
                    [(cantilever::SHORT.run)(gpu, setting)?.error, (cantilever::BEAM.run)(gpu, setting)?.error];
                println!("held: {method}, {resolution} cells, Courant number {courant}: {errors:.4?}");
                worst = errors.into_iter().fold(worst, f64::max);
            }
            rows.push((resolution, courant, worst));
        }
    }
    Ok(rows)
}

/// The larger of the errors of the two blocks of a kind.
fn both(gpu: &Gpu, kind: Kind) -> Result<Vec<(u32, f32, f64)>, String> {
    let [tall, broad] = Block::measured(kind);
    let rows = blocks(gpu, kind, tall)?.into_iter().zip(blocks(gpu, kind, broad)?);
    Ok(rows.map(|(a, b)| (a.0, a.1, a.2.max(b.2))).collect())
}

fn blocks(gpu: &Gpu, kind: Kind, block: Block) -> Result<Vec<(u32, f32, f64)>, String> {
    let name = kind.name();
    let best = if matches!(kind, Kind::Dfsph | Kind::Wcsph) { COURANTS[0] } else { COURANTS[1] };
    let (limit, wall) = block.path(gpu, FINER, best)?;
    println!("{name}: {FINER} cells, Courant number {best}: {wall:.1} s");
    let mut rows = Vec::new();
    for cells in BLOCK_CELLS {
        for courant in COURANTS {
            let (path, wall) = block.path(gpu, cells, courant)?;
            let error = block.error(&path, cells, &limit, FINER);
            println!("{name}: {cells} cells, Courant number {courant}: {:.2} %, {wall:.1} s", 100.0 * error);
            rows.push((cells, courant, error));
        }
    }
    Ok(rows)
}

/// Errors that are no less than those with more cells at the same Courant number: what is better was so by chance.
fn without_luck(rows: Vec<(u32, f32, f64)>) -> Vec<(u32, f32, f64)> {
    let worst = |cells: u32, courant: f32| {
        let finer = rows.iter().filter(|r| r.0 >= cells && r.1 == courant);
        finer.fold(0.0, |most: f64, r| most.max(r.2))
    };
    rows.iter().map(|(cells, courant, _)| (*cells, *courant, worst(*cells, *courant))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lucky_error_is_not_promised() {
        let rows = vec![(4, 0.4, 0.1), (6, 0.4, 0.01), (8, 0.4, 0.03), (8, 0.75, 0.2)];
        let want = vec![(4, 0.4, 0.1), (6, 0.4, 0.03), (8, 0.4, 0.03), (8, 0.75, 0.2)];
        assert_eq!(without_luck(rows), want);
    }
}
