//! What a scene with mistakes says, as tested text: every file of `tests/bad_scenes` ends with the lines its report
//! must hold, after `#~ `. Knows the public scene API only.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use miette::Diagnostic;
use physvideo::scene::{Kind, Object, Problem, SceneErrors, check_paths, parse, schema};

/// Uses every section and every variant that can stand beside the others.
const GOOD: &str = r#"
gravity = [0, 0, -9.81] # é: columns count characters
seed = 7

[photo]
image = "../images/plant.jpg"
labels = "../images/plant_labels.png"
depth.disparity = { file = "../images/plant.pfm", baseline = 0.16, offset_px = 270.0 }
focal_px = 3740.0
principal_px = [320.0, 240.5]
up = [0, -1, 0]

[camera]
eye = [0, -2, 1]
target = [0, 0, 0.5]

[ground]
height = 0.0

[simulation]
grid_density = 64
force_dt = 1e-4
domain = { min = [-1, -1, 0], max = [1, 1, 2] }

[[object]]
name = "leaves"
source.mask = { label = 1, thickness.extrude = 0.01 }
material.elastic = { young = 2e4 }
pins = [
  { near = { object = "pot", distance = 0.02 } },
  { pixels = { min = [0, 400], max = [640, 480] } },
  { box = { min = [0, 0, 0], max = [1, 1, 1] } },
  { ball = { center = [0, 0, 0], radius = 1 } },
]

[[object]]
name = "pot"
source.mask = { label = 2, thickness.inflate = { max = 0.2 } }

[[object]]
name = "toy"
source.mesh = { file = "toy.obj", yaw = 30 }
material.neo_hookean = {}
velocity = [0, 0, -1]
gravity = [0, 0, 9.81]
prestress = false

[[object]]
name = "cloud"
source.points = { file = "cloud.ply", scale = 0.01 }

[[object]]
name = "clay"
source.ball = { center = [0, 0, 1], radius = 0.1 }
material.plastic = { yield_stress = 500, hardening = 100 }

[[object]]
name = "snowball"
source.ball = { center = [0, 0, 2], radius = 0.1 }
material.snow = { hardening = 5 }

[[object]]
name = "bubbles"
source.ball = { center = [0, 0, 3], radius = 0.1 }
material.foam = {}

[[object]]
name = "castle"
source.ball = { center = [0, 0, 4], radius = 0.1 }
material.sand = { friction = 0.7 }

[[object]]
name = "water"
source.ball = { center = [0, 0, 5], radius = 0.1 }
material.liquid = { viscosity = 1e-3 }

[[object]]
name = "crate"
source.box = { min = [0, 0, 0], max = [1, 1, 1] }
material.snow = {}
velocity = [0, 0, 1]
emitter = { start = 0.5, end = 2, rate = 0.1, lifetime = 1 }
recycle = { region.box = { min = [0, 0, 3], max = [1, 1, 4] }, to = { min = [0, 0, 0], max = [1, 1, 1] } }
color = [1, 0.5, 0]

[[collider]]
shape.plane = { point = [0, 0, 0], normal = [0, 0, 1] }

[[collider]]
shape.ball = { center = [0, 0, 1], radius = 0.1 }
sticky = true
velocity = [1, 0, 0]
end = 0.5

[[field]]
force.wind = { velocity = [3, 0, 0], drag = 2.0, gust = 0.3, frequency = 1.5 }
region.ball = { center = [0, 0, 0], radius = 2 }
start = 0.5
end = 2.5
ramp = 0.25
objects = ["leaves"]

[[field]]
force.point = { center = [0, 0, 1], radius = 0.1, acceleration = [0, 5, 0] }

[[field]]
force.vortex = { center = [0, 0, 0], axis = [0, 0, 1], strength = 2, radius = 0.2, frequency = 1 }

[[field]]
force.noise = { amplitude = 1, growth = 0.5, from = 0.1, length = 0.1, time = 0.2, axes = [1, 1, 0] }

[[field]]
force.damping = { rate = [0, 0, 4] }

[render]
compositing = "alpha"
blend_depth = 0.02

[output]
until = "points"
points = "ply"
exr = true
"#;

fn bad_scenes() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/bad_scenes");
    let mut files: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    files.sort();
    files
}

#[test]
fn bad_scenes_say_what_is_wrong_and_where() {
    let mut failures = Vec::new();
    let files = bad_scenes();
    assert!(files.len() >= 14, "only {} bad scenes were found", files.len());
    for path in files {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let text = fs::read_to_string(&path).unwrap();
        let report = match parse(&text, &name) {
            Ok(_) => "accepted".to_owned(),
            Err(errors) => errors.to_string(),
        };
        // In this order: each expected line is looked for after the one before it.
        let mut rest = report.as_str();
        let mut expected = 0;
        for line in text.lines().filter_map(|line| line.strip_prefix("#~ ")) {
            expected += 1;
            let place = line.starts_with(|first: char| first.is_ascii_digit()) && !line.contains(" problems");
            let fragment = if place { format!("{name}:{line}") } else { line.to_owned() };
            match rest.find(&fragment) {
                Some(at) => rest = &rest[at + fragment.len()..],
                None => failures.push(format!("--- {name} does not say\n{fragment}\n--- but\n{report}\n")),
            }
        }
        assert!(expected > 0, "{name} expects nothing");
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn a_good_scene_is_read_and_survives_being_written() {
    let scene = parse(GOOD, "good.toml").unwrap_or_else(|errors| panic!("{errors}"));
    assert_eq!(scene.objects.len(), 10);
    let starts: Vec<bool> = scene.objects.iter().map(Object::prestressed).collect();
    assert_eq!(starts, std::array::from_fn::<_, 10, _>(|i| i == 0));
    let written = toml::to_string(&scene).unwrap();
    let again = parse(&written, "again.toml").unwrap_or_else(|errors| panic!("{errors}\n{written}"));
    assert_eq!(again, scene);
}

#[test]
fn the_empty_scene_has_the_paper_s_defaults() {
    let scene = parse("", "empty.toml").unwrap();
    assert_eq!((scene.simulation.grid_density, scene.simulation.courant), (128.0, 0.75));
    assert_eq!((scene.output.frames, scene.output.fps, scene.output.width), (109, 24.0, 640));
    let object = "[[object]]\nname = 'a'\nsource.ball = { center = [0, 0, 0], radius = 1 }\n";
    let object = parse(object, "object.toml").unwrap().objects.remove(0);
    assert_eq!((object.density, object.material), (40.0, None));
}

#[test]
fn the_schema_names_every_key_of_a_full_scene() {
    let schema = serde_json::to_string(&schema()).unwrap();
    let document: toml::Table = toml::from_str(GOOD).unwrap();
    let mut keys = BTreeSet::new();
    collect(&toml::Value::Table(document), &mut keys);
    assert!(keys.len() > 60);
    for key in keys {
        assert!(schema.contains(&format!("\"{key}\":")), "the schema does not know `{key}`");
    }
}

fn collect(value: &toml::Value, keys: &mut BTreeSet<String>) {
    match value {
        toml::Value::Table(table) => table.iter().for_each(|(key, value)| {
            keys.insert(key.clone());
            collect(value, keys);
        }),
        toml::Value::Array(items) => items.iter().for_each(|item| collect(item, keys)),
        _ => {}
    }
}

#[test]
fn files_are_listed_with_their_keys_and_refused_outside_the_root() {
    let text = GOOD.replace("toy.obj", "/etc/toy.obj").replace("cloud.ply", "../../cloud.ply");
    let scene = parse(&text, "good.toml").unwrap();
    let keys: Vec<String> = scene.paths().into_iter().map(|(key, _)| key).collect();
    let expected = "photo.image photo.labels photo.depth.disparity.file object[2].source.mesh.file \
                    object[3].source.points.file";
    assert_eq!(keys.join(" "), expected);

    assert_eq!(
        check_paths(&parse(GOOD, "good.toml").unwrap(), GOOD, "good.toml", 1).err().map(|e| e.to_string()),
        None
    );
    let report = check_paths(&scene, &text, "good.toml", 1).unwrap_err().to_string();
    let line = 1 + text[..text.find("/etc/toy").unwrap()].matches('\n').count();
    assert!(report.starts_with("good.toml: 2 problems\n"), "{report}");
    let first = format!("good.toml:{line}:24: object[2].source.mesh.file: absolute paths are refused: /etc/toy.obj");
    assert!(report.contains(&first), "{report}");
    assert!(report.contains("the path leaves the asset root: ../../cloud.ply (scene::path)"), "{report}");
    // In the root itself even the photograph is out of reach.
    assert_eq!(check_paths(&scene, &text, "good.toml", 0).unwrap_err().len(), 5);
}

#[test]
fn miette_draws_the_line_with_a_caret_and_help() {
    let errors = parse("seed = 1\ngravty = [0, 0, 0]\n[output]\nframes = 0\n", "drop.toml").unwrap_err();
    assert_eq!(errors.related().unwrap().count(), 2);
    let error = errors.iter().next().unwrap();
    assert_eq!(
        (error.problem().kind, error.place().as_str(), error.span()),
        (Kind::UnknownKey, "drop.toml:2:1", 9..15)
    );
    let mut drawn = String::new();
    let theme = miette::GraphicalTheme::unicode_nocolor();
    miette::GraphicalReportHandler::new_themed(theme).render_report(&mut drawn, error).unwrap();
    for fragment in ["scene::unknown_key", "gravty: unknown key", "[drop.toml:2:1]", "not known here", "`gravity`?"] {
        assert!(drawn.contains(fragment), "no {fragment} in\n{drawn}");
    }
    let mut whole = String::new();
    let theme = miette::GraphicalTheme::unicode_nocolor();
    miette::GraphicalReportHandler::new_themed(theme).render_report(&mut whole, &errors).unwrap();
    assert!(whole.contains("[drop.toml:4:10]"), "{whole}");
}

#[test]
fn problems_found_later_are_placed_at_their_keys() {
    let problem =
        Problem::new(Kind::Path, "object[2].source.mesh.file", "no such file: toy.obj").help("check the name");
    let report = SceneErrors::locate(GOOD, "good.toml", vec![problem]).to_string();
    let line = 1 + GOOD[..GOOD.find("toy.obj").unwrap()].matches('\n').count();
    let expected = format!(
        "good.toml: 1 problem\ngood.toml:{line}:24: object[2].source.mesh.file: no such file: toy.obj (scene::path)\n  \
         help: check the name"
    );
    assert_eq!(report, expected);
}

/// Reading anything ends in a scene or in errors that can be printed and drawn; it never panics, and the structure
/// check always explains what the deserialiser would refuse (whose own words have no key path).
fn read(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let errors = match parse(&text, "mutant.toml") {
        Ok(_) => return true,
        Err(errors) => errors,
    };
    assert!(!errors.is_empty());
    let mut drawn = String::new();
    for error in &errors {
        assert!(error.span().end <= text.len() && error.place().starts_with("mutant.toml:"));
        let problem = error.problem();
        let explained = problem.kind == Kind::Syntax || !problem.key.is_empty() || problem.kind == Kind::UnknownKey;
        assert!(explained, "the deserialiser refused what the structure check accepted: {errors}\n{text}");
        miette::NarratableReportHandler::new().render_report(&mut drawn, error).unwrap();
    }
    assert!(!errors.to_string().is_empty() && !drawn.is_empty());
    false
}

#[test]
fn truncated_scenes_never_panic() {
    let accepted = (0..=GOOD.len()).filter(|&end| read(&GOOD.as_bytes()[..end])).count();
    // Cuts at line ends between sections leave valid scenes, cuts inside values do not: both must have been met.
    assert!(accepted > 20 && accepted < GOOD.len(), "{accepted} accepted");
}

#[test]
fn mutated_scenes_never_panic() {
    let pieces: [&[u8]; 14] = [
        b"[",
        b"]",
        b"{",
        b"}",
        b"\"",
        b"'",
        b"\n",
        b"-",
        b"nan",
        b"1e400",
        b"\xff",
        b"[[",
        b"0x7fffffffffffffffff",
        b"a.b = ",
    ];
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    // xorshift64*: seeded, so that a failure can be repeated.
    let mut random = move |below: usize| {
        state ^= state >> 12;
        state ^= state << 25;
        state ^= state >> 27;
        (state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) as usize % below
    };
    let mut accepted = 0;
    const ROUNDS: usize = 3000;
    for _ in 0..ROUNDS {
        let mut bytes = GOOD.as_bytes().to_vec();
        for _ in 0..1 + random(3) {
            let at = random(bytes.len());
            match random(4) {
                0 => bytes[at] = random(256) as u8,
                1 => drop(bytes.drain(at..(at + 1 + random(12)).min(bytes.len()))),
                2 => drop(bytes.splice(at..at, pieces[random(pieces.len())].iter().copied())),
                _ => {
                    let digit = bytes[at..].iter().position(u8::is_ascii_digit).map_or(at, |ahead| at + ahead);
                    drop(bytes.splice(digit..=digit, pieces[random(pieces.len())].iter().copied()));
                }
            }
        }
        accepted += usize::from(read(&bytes));
    }
    assert!(accepted > 0 && accepted < ROUNDS, "{accepted} accepted");
}
