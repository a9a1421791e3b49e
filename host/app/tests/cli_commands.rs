//! What plan, check, schema, devices and the help say.

mod cli_scene;

use cli_scene::{FALL, Folder, PHOTO};
use serde_json::Value;

#[test]
fn a_plan_says_what_runs_what_does_not_and_why() {
    let folder = Folder::new();
    folder.scene(FALL, &[]);
    let said = folder.run(&["plan", "scene.toml", "--output", "frames"]);
    said.expect(0, &[]);
    for line in [
        "simulate     run      total Lagrangian",
        "solver       total Lagrangian: one elastic body",
        "surfaces     skipped  the scene has no photograph",
        "photo        skipped  the scene has no photograph",
        "points       skipped  `output.points` is not set",
        "encode       skipped  nothing asked for needs it (`--output frames`)",
    ] {
        assert!(said.out.contains(line), "{line:?} is not in:\n{}", said.out);
    }
    assert!(!folder.path("out").exists(), "a plan writes nothing");
}

#[test]
fn a_plan_predicts_what_the_run_reports() {
    let folder = Folder::new();
    folder.scene(FALL, &[]);
    let plan = folder.run(&["plan", "scene.toml"]).out;
    folder.run(&["run", "scene.toml", "--quiet"]).expect(0, &[]);
    let report = folder.report("out/scene");
    let number_before = |row: &str, words: &str| -> u64 {
        let line = plan.lines().find(|l| l.starts_with(row)).unwrap_or_else(|| panic!("no {row:?} in:\n{plan}"));
        line[..line.find(words).unwrap()].split_whitespace().last().unwrap().parse().unwrap()
    };
    assert!(report["solver"].as_str().unwrap().starts_with("total Lagrangian: one"), "{}", report["solver"]);
    assert_eq!(number_before("jelly", " particles"), report["particles"][0]["count"].as_u64().unwrap());
    assert_eq!(number_before("memory", " bytes ("), report["memory"]["predicted"].as_u64().unwrap());
    assert!(number_before("pipelines", " are compiled") >= report["pipelines"].as_array().unwrap().len() as u64);
    // The elastic limit counts waves only; falling bodies need a few steps more, and a frame is divided evenly.
    let (said, took) = (number_before("particles", " substeps a frame"), report["substeps"].as_u64().unwrap());
    assert!(2 * said <= took && took <= 4 * said, "{said} a frame were said, {took} were taken in two");
}

/// A held board over sand: the plan and the report name the solver of each, and what memory both take.
#[test]
fn a_plan_says_which_body_has_a_grid_of_its_own() {
    let board = "[[object]]\nname = 'board'\nsource.box = { min = [-0.1, -0.05, 0.14], max = [0.1, 0.05, 0.2] }\n\
                 material.elastic = { young = 1e5 }\npins = [{ box = { min = [-0.2, -0.1, 0.1], max = [-0.06, 0.1, 0.3] } }]\n\
                 [output]";
    let sand = ("material.elastic = { young = 1e4, poisson = 0.3 }", "material.sand = { young = 1e5 }");
    let folder = Folder::new();
    folder.scene(FALL, &[sand, ("[output]", board)]);
    let plan = folder.run(&["plan", "scene.toml"]).out;
    let why = "MPM and total Lagrangian: 'board' on a grid of its own (elastic and held), 'jelly' by MPM (has a material that \
               is not elastic)";
    for line in ["simulate     run      MLS-MPM and total Lagrangian", why] {
        assert!(plan.contains(line), "{line:?} is not in:\n{plan}");
    }
    folder.run(&["run", "scene.toml", "--quiet"]).expect(0, &[]);
    let report = folder.report("out/scene");
    assert_eq!(report["solver"], why);
    let memory = &report["memory"];
    assert!(plan.contains(&format!("{} bytes", memory["predicted"])), "{memory}");
    let kernels = report["pipelines"].to_string();
    assert!(kernels.contains("lagrangian/press") && kernels.contains("mpm/receive"), "{kernels}");
    // By MPM alone nothing of it is compiled.
    let all = ("grid_density = 32", "grid_density = 32\nelastic = 'updated_lagrangian'");
    folder.scene(FALL, &[sand, ("[output]", board), all]);
    folder.run(&["run", "scene.toml", "--quiet"]).expect(0, &[]);
    let kernels = folder.report("out/scene")["pipelines"].to_string();
    assert!(!kernels.contains("lagrangian/") && !kernels.contains("mpm/receive"), "{kernels}");
}

/// A scene is often a copy of another: keys that do nothing here are named by plan and check.
#[test]
fn keys_that_do_nothing_are_named() {
    let folder = Folder::new();
    let settings = ("grid_density = 32", "grid_density = 32\npressure = 'wcsph'\nparticle_size = 0.01");
    let still = "[[object]]\nname = 'shelf'\nsource.box = { min = [1, 1, 0], max = [1.2, 1.2, 0.2] }\nvelocity = [1, 0, 0]\n\
                 [output]";
    let rubs = ("name = \"jelly\"", "name = \"jelly\"\nfriction = 0.7\ndamping = 1e-3");
    let slow = ("young = 1e4", "young = 1.0");
    let late = "[[field]]\nforce.uniform.acceleration = [1, 0, 0]\nobjects = ['shelf']\n\
                [[field]]\nforce.uniform.acceleration = [1, 0, 0]\nstart = 9.0\n\
                [[collider]]\nshape.box = { center = [2, 2, 0], half = [0.1, 0.1, 0.1] }\nsticky = true\nfriction = 0.4\nend = 0.01\n";
    folder.scene(FALL, &[settings, ("[output]", &format!("{late}{still}")), rubs, slow]);
    for command in ["plan", "check"] {
        let said = folder.run(&[command, "scene.toml"]).out;
        for line in [
            "`simulation.pressure` does nothing: no object is a liquid of SPH",
            "`simulation.particle_size` does nothing: no object is a liquid of SPH",
            "`velocity` of 'shelf' does nothing: it has no material and stands still",
            "`friction` of 'jelly' does nothing: it acts where bodies are on grids of their own, and here none is",
            "`damping` of 'jelly' is left out",
            "field[0] does nothing: what it names has no material and stands still",
            "field[1] does nothing: it starts at 9 s, and the last frame is at 0.083 s",
            "`friction` of collider[0] does nothing: it is `sticky`",
            "`start` and `end` of collider[0] do nothing: they say when it moves, and it has no velocity",
        ] {
            assert!(said.contains(line), "{command}: {line:?} is not in:\n{said}");
        }
    }
    folder.scene(FALL, &[]);
    let said = folder.run(&["check", "scene.toml"]).out;
    assert!(!said.contains("does nothing"), "{said}");
}

/// Liquids of SPH would be thrown out of what they start in.
#[test]
fn a_liquid_inside_something_is_refused() {
    let folder = Folder::new();
    let text = |low: f32, more: &str| {
        format!(
            "[camera]\neye = [0, -1, 0.5]\ntarget = [0, 0, 0.1]\n[ground]\nheight = 0.0\n[[object]]\nname = 'water'\n\
             source.box = {{ min = [0, 0, {low}], max = [0.1, 0.1, 0.2] }}\nmaterial.sph = {{}}\ndensity = 1000.0\n{more}"
        )
    };
    let collider = "[[collider]]\nshape.ball = { center = [0.05, 0.05, 0.1], radius = 0.03 }\n";
    let other =
        "[[object]]\nname = 'oil'\nsource.ball = { center = [0.05, 0.05, 0.21], radius = 0.03 }\nmaterial.sph = {}\n";
    let nozzle = other.replace("material.sph", "velocity = [0, 0, -1]\nemitter = {}\nmaterial.sph");
    for (low, more, says) in [
        (0.0, &*nozzle, "'water' and the nozzle of 'oil' overlap"),
        (-0.05, "", "'water' starts inside the ground"),
        (0.0, collider, "'water' starts inside collider[0]"),
        (0.0, other, "'water' and 'oil' overlap"),
    ] {
        folder.scene(&text(low, more), &[]);
        folder.run(&["check", "scene.toml"]).expect(2, &[says, "source", "move them apart"]);
    }
    let narrow = "[[collider]]\nshape.room = { center = [0.05, 0.05, 0.1], half = [0.05, 0.002, 0.1] }\n";
    folder.scene(&text(0.0, narrow), &[]);
    folder.run(&["check", "scene.toml"]).expect(2, &["collider[0].shape.room.half", "0.0040 m wide"]);
    // What its front may be as fast as, 2 √(g 0.195), asks for more steps than its start: plan says how many.
    folder.scene(&text(0.0, ""), &[]);
    let plan = folder.run(&["plan", "scene.toml"]).out;
    assert!(plan.contains("about 10 substeps a frame") && plan.contains("up to 23 a frame at 2.8 m/s"), "{plan}");
    // Beside each of them it is well.
    let beside = collider.replace("0.05, 0.05, 0.1]", "0.05, -0.04, 0.1]");
    folder.scene(&text(0.0, &beside), &[]);
    folder.run(&["check", "scene.toml"]).expect(0, &[]);
}

/// Shifted particles boil at free surfaces.
#[test]
fn shifting_is_for_liquids_that_fill_a_room() {
    let folder = Folder::new();
    let text = |high: f32| {
        format!(
            "[camera]\neye = [0, -1, 0.5]\ntarget = [0, 0, 0.1]\n[simulation]\npressure = 'wcsph'\nshifting = true\n\
             [[collider]]\nshape.room = {{ center = [0, 0, 0.1], half = [0.1, 0.1, 0.1] }}\n[[object]]\nname = 'water'\n\
             source.box = {{ min = [-0.1, -0.1, 0], max = [0.1, 0.1, {high}] }}\nmaterial.sph = {{}}\ndensity = 1000.0\n"
        )
    };
    folder.scene(&text(0.1), &[("shifting = true", "shifting = true\nparticle_size = 0.01")]);
    folder.run(&["check", "scene.toml"]).expect(2, &["simulation.shifting", "fill 0.50 of one"]);
    folder.scene(&text(0.2), &[("shifting = true", "shifting = true\nparticle_size = 0.01")]);
    folder.run(&["check", "scene.toml"]).expect(0, &[]);
}

/// Explicit steps of honey of 4 mm are 0.125 h²/ν = 2.9e-4 s; gravity allows 0.125 sqrt(h/g) = 2.5e-3 s.
#[test]
fn a_plan_says_how_viscosity_is_found() {
    let plan = |viscosity: &str, way: &str| {
        let folder = Folder::new();
        let text = format!(
            "[camera]\neye = [0.0, -1.0, 0.5]\ntarget = [0.0, 0.0, 0.1]\n[simulation]\nparticle_size = 0.004\n{way}\n\
             [[object]]\nname = 'honey'\nsource.ball = {{ center = [0.0, 0.0, 0.1], radius = 0.02 }}\n\
             material.sph = {{ viscosity = {viscosity} }}\n[output]\nframes = 2\n"
        );
        folder.scene(&text, &[]);
        let said = folder.run(&["plan", "scene.toml", "--output", "state"]);
        said.expect(0, &[]);
        said.out
    };
    let solved = plan("7e-3", "viscosity = 'auto'");
    assert!(
        solved.contains("viscosity is solved for: without it steps would be 2.9e-4 s, 8.8 times as short"),
        "{solved}"
    );
    let short = plan("7e-3", "");
    assert!(short.contains("viscosity shortens steps to 2.9e-4 s"), "{short}");
    assert!(!plan("1e-6", "").contains("viscosity"), "water's viscosity bounds nothing");
}

/// Its lowest particles fall 1.5/64 m: 1000 · 2 · 9.81 · 1.5/64 / 0.1² = 45.98 kPa.
#[test]
fn a_stiffness_cap_is_told_by_plan_and_report() {
    let folder = Folder::new();
    let stiff = ("young = 1e4", "young = 1e6");
    folder.scene(FALL, &[stiff]);
    let hint = folder.run(&["plan", "scene.toml", "--output", "state"]).out;
    assert!(hint.contains("`simulation.stiffness_cap = 0.05` takes that"), "{hint}");
    folder.scene(FALL, &[stiff, ("grid_density = 32", "grid_density = 32\nstiffness_cap = 0.1")]);
    let said = folder.run(&["plan", "scene.toml", "--output", "state"]).out;
    for part in [
        "'jelly' is simulated with `young` 4.598e4 Pa instead of 1.000e6 Pa",
        "2.175e1 times as soft",
        "4.7 times as long",
    ] {
        assert!(said.contains(part), "{part:?} is not in:\n{said}");
    }
    folder.run(&["run", "scene.toml", "--quiet", "--output", "state"]).expect(0, &["simulation.stiffness_cap"]);
    let report = folder.report("out/scene");
    let softened = &report["softened"][0];
    assert_eq!(softened["object"], "jelly");
    let near = |key: &str, value: f64| (softened[key].as_f64().unwrap() / value - 1.0).abs() < 1e-3;
    assert!(near("young", 1e6) && near("effective_young", 45_984.4) && near("factor", 21.747), "{softened}");
    assert!(near("lasts", 4.663), "{softened}");
}

#[test]
fn check_counts_what_it_found_good() {
    let folder = Folder::new();
    folder.photo().scene(PHOTO, &[]);
    let said = folder.run(&["check", "scene.toml"]);
    said.expect(0, &[]);
    assert!(said.out.starts_with("scene.toml: ok, 1 objects, "), "{}", said.out);
}

#[test]
fn only_files_that_the_plan_needs_are_read() {
    let folder = Folder::new();
    // The floor is drawn and not simulated: its mesh is not there and `state` does not miss it.
    let floor = "[[object]]\nname = 'floor'\nsource.mesh.file = 'floor.obj'\n\n[output]";
    folder.scene(FALL, &[("[output]", floor)]);
    folder.run(&["plan", "scene.toml", "--output", "state"]).expect(0, &[]);
    folder.run(&["plan", "scene.toml", "--output", "frames"]).expect(2, &["floor.obj"]);
}

#[test]
fn the_schema_is_json_and_devices_are_listed() {
    let folder = Folder::new();
    let schema: Value = serde_json::from_str(&folder.run(&["schema"]).out).unwrap();
    assert_eq!(schema["title"], "physvideo scene");
    let devices: Value = serde_json::from_str(&folder.run(&["devices", "--json"]).out).unwrap();
    let first = &devices[0];
    assert!(first["name"].is_string() && first["driver"].is_string() && first["memory"].as_u64() > Some(0));
    assert!(["discrete", "integrated", "cpu", "other"].contains(&first["type"].as_str().unwrap()));
    let lines = folder.run(&["devices"]).out;
    assert_eq!(lines.lines().count(), devices.as_array().unwrap().len());
    assert!(lines.contains(first["name"].as_str().unwrap()));
}

#[test]
fn the_help_names_the_exit_codes() {
    let said = Folder::new().run(&["--help"]);
    said.expect(0, &[]);
    assert!(said.out.contains("130 interrupted") && said.out.contains("--output"), "{}", said.out);
}
