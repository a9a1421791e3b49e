//! `--error-budget`: what is chosen, and what is refused.

mod cli_scene;

use cli_scene::{FALL, Folder};

const JELLY: &str = "material.elastic = { young = 1e4, poisson = 0.3 }";

#[test]
fn a_budget_sets_grid_and_courant_number() {
    let folder = Folder::new();
    folder.scene(FALL, &[]);
    let said = folder.run(&["plan", "scene.toml", "--error-budget", "0.25"]);
    said.expect(0, &[]);
    // A box of 0.1 m, of which six particles of 1/64 m are seen: four cells across it, on a grid of its own.
    assert!(said.out.contains("error budget 0.25: 42.7 cells a metre, 4.0 across 'jelly' (0.094 m)"), "{}", said.out);
    assert!(said.out.contains("total Lagrangian"), "{}", said.out);
    let substeps = |out: &str| out.lines().find(|l| l.starts_with("particles")).map(str::to_owned);
    let finer = folder.run(&["plan", "scene.toml", "--error-budget", "0.06"]);
    finer.expect(0, &[]);
    assert!(finer.out.contains("8.0 across"), "{}", finer.out);
    assert_ne!(substeps(&said.out), substeps(&finer.out), "{} {}", said.out, finer.out);
    // The same by the scene's key, in a run, whose report says it; the option goes before the key.
    folder.scene(FALL, &[("grid_density = 32", "grid_density = 32\nerror_budget = 0.4")]);
    folder.run(&["run", "scene.toml", "--output", "state", "--quiet", "--out", "a"]).expect(0, &[]);
    assert!(folder.report("a")["warnings"][0].as_str().unwrap().contains("4.0 across"));
    // By MPM the same error needs more of them.
    folder.scene(FALL, &[("grid_density = 32", "grid_density = 32\nelastic = 'updated_lagrangian'")]);
    let shared = folder.run(&["plan", "scene.toml", "--error-budget", "0.25"]);
    assert!(shared.out.contains("64.0 cells a metre, 6.0 across"), "{}", shared.out);
    folder.scene(FALL, &[("grid_density = 32", "grid_density = 32\nerror_budget = 0.4")]);
    let over = folder.run(&["plan", "scene.toml", "--error-budget", "0.06"]);
    assert!(over.out.contains("8.0 across"), "{}", over.out);
}

#[test]
fn a_budget_of_a_liquid_of_sph_sets_the_size_of_its_particles() {
    let folder = Folder::new();
    folder.scene(FALL, &[(JELLY, "material.sph = {}")]);
    let said = folder.run(&["plan", "scene.toml", "--error-budget", "0.1"]);
    said.expect(0, &[]);
    // Seven particles of 13 mm are seen.
    assert!(said.out.contains("particles a metre") && said.out.contains("across 'jelly' (0.091 m)"), "{}", said.out);
}

#[test]
fn a_budget_that_cannot_be_met_is_refused_with_what_can() {
    let folder = Folder::new();
    folder.scene(FALL, &[]);
    for command in [["plan", "scene.toml"], ["run", "scene.toml"]] {
        let args = [&command[..], &["--error-budget", "1e-6"]].concat();
        folder.run(&args).expect(5, &["out of reach", "the least that was measured", "for 'jelly'"]);
    }
    let args = ["plan", "scene.toml", "--error-budget", "0.5"];
    folder.scene(FALL, &[(JELLY, "material.snow = {}")]);
    folder.run(&args).expect(5, &["no error is known of 'jelly', which is snow"]);
    // Waves of 1.2 m/s, and a fall to 1.5.
    folder.scene(FALL, &[("young = 1e4", "young = 1e3")]);
    folder.run(&args).expect(5, &["no error is known of 'jelly'", "of the speed of its waves"]);
    folder.run(&["plan", "scene.toml", "--error-budget=-1"]).expect(2, &["give a number above 0"]);
    folder.scene(FALL, &[("grid_density = 32", "grid_density = 32\nerror_budget = 0")]);
    folder.run(&["check", "scene.toml"]).expect(2, &["error_budget"]);
}
