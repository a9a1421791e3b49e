//! `--error-budget`: what is chosen, and what is refused.

mod cli_scene;

use cli_scene::{FALL, Folder};

#[test]
fn a_budget_sets_grid_and_courant_number() {
    let folder = Folder::new();
    folder.scene(FALL, &[]);
    let said = folder.run(&["plan", "scene.toml", "--error-budget", "0.1"]);
    said.expect(0, &[]);
    // A box of 0.1 m, of which six particles of 1/64 m are seen: two cells across it.
    assert!(said.out.contains("error budget 0.1: 2 cells across 'jelly'"), "{}", said.out);
    let substeps = |out: &str| out.lines().find(|l| l.starts_with("particles")).map(str::to_owned);
    let finer = folder.run(&["plan", "scene.toml", "--error-budget", "0.03"]);
    finer.expect(0, &[]);
    assert!(finer.out.contains("3 cells across"), "{}", finer.out);
    assert_ne!(substeps(&said.out), substeps(&finer.out), "{} {}", said.out, finer.out);
    // The same by the scene's key, in a run, whose report says it; the option goes before the key.
    folder.scene(FALL, &[("grid_density = 32", "grid_density = 32\nerror_budget = 0.1")]);
    folder.run(&["run", "scene.toml", "--output", "state", "--quiet", "--out", "a"]).expect(0, &[]);
    assert!(folder.report("a")["warnings"][0].as_str().unwrap().contains("2 cells across"));
    let over = folder.run(&["plan", "scene.toml", "--error-budget", "0.03"]);
    assert!(over.out.contains("3 cells across"), "{}", over.out);
}

#[test]
fn a_budget_that_cannot_be_met_is_refused_with_what_can() {
    let folder = Folder::new();
    folder.scene(FALL, &[]);
    for command in [["plan", "scene.toml"], ["run", "scene.toml"]] {
        let args = [&command[..], &["--error-budget", "1e-6"]].concat();
        folder.run(&args).expect(5, &["out of reach", "the least that was measured", "across 'jelly'"]);
    }
    folder.scene(FALL, &[("material.elastic = { young = 1e4, poisson = 0.3 }", "material.sand = {}")]);
    let args = ["plan", "scene.toml", "--error-budget", "0.1"];
    folder.run(&args).expect(5, &["no error is known of 'jelly', which is sand"]);
    folder.run(&["plan", "scene.toml", "--error-budget=-1"]).expect(2, &["give a number above 0"]);
    folder.scene(FALL, &[("grid_density = 32", "grid_density = 32\nerror_budget = 0")]);
    folder.run(&["check", "scene.toml"]).expect(2, &["error_budget"]);
}
