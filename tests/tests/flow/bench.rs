//! `physvideo-bench wp flow` without time: every file is written, and what is missing is named.

use std::path::Path;

#[test]
fn a_budget_of_nothing_names_what_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let command = assert_cmd::Command::new(env!("CARGO_BIN_EXE_physvideo-bench"))
        .args(["wp", "flow", "--budget", "0", "--out", out])
        .assert()
        .success();
    let said = String::from_utf8(command.get_output().stdout.clone()).unwrap();
    for what in ["norms of euler_maruyama at gamma 0.05", "SDE figures of two modes", "paper's accuracy on point"] {
        assert!(said.contains(&format!("left out by --budget: {what}")), "{what}: {said}");
    }
    let text = |name: &str| std::fs::read_to_string(Path::new(out).join(name)).unwrap();
    for name in ["sde_variance", "sde_mean", "sde_stationary", "round_trip", "norms", "sweeps"] {
        let svg = text(&format!("{name}.svg"));
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n") && !svg.contains("NaN"), "{name}");
    }
    for name in ["sde_time", "sde_stationary", "round_trip", "norms", "stability", "sweeps", "paper_accuracy", "cost"] {
        let csv = text(&format!("{name}.csv"));
        let cells = |line: &str| line.split('"').step_by(2).map(|s| s.matches(',').count()).sum::<usize>();
        let wide = cells(csv.lines().next().unwrap());
        assert!(wide > 1 && csv.lines().all(|l| cells(l) == wide), "{name}: {csv}");
    }
    // What needs no measurement is there all the same: AB2 there and back in 25 steps with shift 7.
    assert!(text("round_trip.csv").contains("7,1,ab2,25,40,9.695"), "{}", text("round_trip.csv"));
}
