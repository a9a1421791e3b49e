//! The table of stress: every case with every material and solver, what came of it, and what it hit.

use std::fmt::Write;
use std::path::Path;

use physvideo_gpu::Gpu;
use physvideo_tests::stress::{self, Row};

const HEAD: [&str; 13] = [
    "case",
    "material",
    "method",
    "result",
    "substeps",
    "nodes slowed",
    "stretches limited",
    "compressions refused",
    "particles taken out",
    "frames taken back",
    "frames with a gain",
    "energy drift",
    "of the bound",
];

/// Prints the table; writes it where asked to. Fails at the end if a case did.
pub fn bench(gpu: &Gpu, only: &str, out: Option<&Path>) -> Result<(), String> {
    let (mut rows, mut wrong) = (Vec::new(), Vec::new());
    if !stress::all().iter().any(|c| c.name.contains(only)) {
        return Err(format!("no case's name holds '{only}'"));
    }
    // Now, not after half an hour.
    if let Some(folder) = out {
        std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    for case in stress::all().into_iter().filter(|c| c.name.contains(only)) {
        for method in case.solvers {
            for material in case.materials_of(method) {
                match stress::run(gpu, case, material, method) {
                    Ok(row) => {
                        let sunk = if row.sunk > 0 { format!(", {} in obstacles", row.sunk) } else { String::new() };
                        let error = row.error.as_deref().map_or(String::new(), |e| format!(": {e}"));
                        println!("{}{sunk}{error}", cells(&row).join(" | "));
                        rows.push(row);
                    }
                    Err(e) => {
                        println!("WRONG {e}");
                        wrong.push(e);
                    }
                }
            }
        }
    }
    if let Some(folder) = out.filter(|_| wrong.is_empty()) {
        let write =
            |name: &str, text: String| std::fs::write(folder.join(name), text).map_err(|e| format!("{name}: {e}"));
        let csv = |cells: Vec<String>| cells.iter().map(|c| format!("\"{c}\"")).collect::<Vec<_>>().join(",") + "\n";
        let lines: String = rows.iter().map(|r| csv(cells(r))).collect();
        write("stress.csv", csv(HEAD.map(String::from).to_vec()) + &lines)?;
        write("stress.md", markdown(gpu, &rows))?;
    }
    if wrong.is_empty() { Ok(()) } else { Err(format!("{} cases went wrong", wrong.len())) }
}

fn cells(row: &Row) -> Vec<String> {
    let mut cells = vec![row.case.into(), row.material.into(), row.method.into(), row.verdict.word().into()];
    cells.push(row.substeps.to_string());
    cells.extend(row.counts.iter().map(u64::to_string));
    cells.extend([format!("{:+.2e}", row.drift), format!("{:.3}", row.of_bound)]);
    cells
}

fn markdown(gpu: &Gpu, rows: &[Row]) -> String {
    let mut text = format!(
        "# Stress\n\nWritten by `tools/bench stress --out assets/wp` on {}. Every case ran twice with the same bits, but for \
         the million particles and the paper's cube blown up by a forced step: where thousands of particles crowd in one \
         row of cells the software driver, which ends a lane's loops after 65,535 turns, does not put all in order. Nothing \
         that is not a number was left in. *Energy drift* is that of kinetic, elastic and potential energy over what the \
         case had at hand, *of the bound* the largest energy over what the case allows. The energy of a liquid of SPH is \
         that of its motion and height alone.\n\n",
        gpu.info.name
    );
    let mut line = |cells: Vec<String>| {
        // Writing to a string does not fail.
        let _ = writeln!(text, "| {} |", cells.join(" | "));
    };
    line(HEAD.map(String::from).to_vec());
    line(HEAD.map(|_| "---".into()).to_vec());
    rows.iter().for_each(|r| line(cells(r)));
    if rows.iter().any(|r| r.sunk > 0) {
        text.push_str("\nParticles found in obstacles, deeper than half of their size, at the end of a frame:\n\n");
        for r in rows.iter().filter(|r| r.sunk > 0) {
            let _ = writeln!(text, "- {}, {}, {}: {}", r.case, r.material, r.method, r.sunk);
        }
    }
    let refused: Vec<_> = rows.iter().filter_map(|r| r.error.as_ref().map(|e| (r, e))).collect();
    if !refused.is_empty() {
        text.push_str("\nHonest errors:\n\n");
        for (row, error) in refused {
            let _ = writeln!(text, "- {}, {}, {}: {error}", row.case, row.material, row.method);
        }
    }
    text
}
