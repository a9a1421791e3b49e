//! What the program says of bad input: every row by its exit code and its text, and never a panic.

mod cli_scene;

use cli_scene::{FALL, Folder, PHOTO, Said, said};

const RUN: [&str; 3] = ["--scene", "scene.toml", "--quiet"];

fn fall(changes: &[(&str, &str)]) -> Said {
    let folder = Folder::new();
    folder.scene(FALL, changes).run(&RUN)
}

#[test]
fn an_unknown_key_is_named_with_its_place_and_the_nearest_one() {
    fall(&[("density = 1000.0", "densty = 1000.0")]).expect(2, &["scene.toml:17:1", "densty", "`density`"]);
}

#[test]
fn a_wrong_type_is_named() {
    fall(&[("frames = 3", "frames = \"three\"")]).expect(2, &["output.frames", "scene::wrong_type"]);
}

#[test]
fn not_a_number_is_refused() {
    fall(&[("young = 1e4", "young = nan")])
        .expect(2, &["object[0].material.elastic.young", "nan is not a finite number"]);
}

#[test]
fn all_problems_are_told_at_once() {
    let said = fall(&[("young = 1e4", "young = -1"), ("frames = 3", "frames = 0"), ("width = 64", "widht = 64")]);
    said.expect(2, &["3 problems", "young", "frames", "widht"]);
}

#[test]
fn a_missing_scene_is_named() {
    Folder::new().run(&RUN).expect(2, &["scene.toml", "there is no such file"]);
}

#[test]
fn bad_arguments_are_usage_errors() {
    let folder = Folder::new();
    folder.scene(FALL, &[]);
    folder.run(&["--scene", "scene.toml", "--frames", "0"]).expect(2, &["--frames"]);
    folder.run(&["--scene", "scene.toml", "--output", "film"]).expect(2, &["possible values: state, points"]);
    folder.run(&["--quiet"]).expect(2, &["--scene"]);
}

#[test]
fn a_missing_file_is_told_at_its_key() {
    let mesh =
        [("source.box = { min = [-0.05, -0.05, 0.02], max = [0.05, 0.05, 0.12] }", "source.mesh.file = 'a.obj'")];
    fall(&mesh).expect(2, &["scene.toml:15:", "object[0].source.mesh.file", "a.obj", "there is no such file"]);
}

#[test]
fn paths_stay_inside_the_asset_root() {
    let folder = Folder::new();
    folder.write("secret.obj", "v 0 0 0\n");
    for (path, text) in [("../secret.obj", "leaves the asset root"), ("/etc/passwd", "absolute")] {
        let source = format!("source.mesh.file = '{path}'");
        let mesh = [("source.box = { min = [-0.05, -0.05, 0.02], max = [0.05, 0.05, 0.12] }", source.as_str())];
        folder.scene(FALL, &mesh);
        std::fs::create_dir_all(folder.path("inner")).unwrap();
        std::fs::rename(folder.path("scene.toml"), folder.path("inner/scene.toml")).unwrap();
        folder.run(&["check", "inner/scene.toml"]).expect(2, &["object[0].source.mesh.file", text]);
    }
    // With the folder above marked as the root, the same path is one of a file (that is no closed mesh).
    folder.write("assets.toml", "");
    let inner = std::fs::read_to_string(folder.path("inner/scene.toml")).unwrap();
    folder.write("inner/scene.toml", inner.replace("/etc/passwd", "../secret.obj"));
    folder.run(&["check", "inner/scene.toml"]).expect(2, &["secret.obj", "has no faces"]);
}

#[cfg(unix)]
#[test]
fn a_link_out_of_the_asset_root_is_refused() {
    let folder = Folder::new();
    folder.write("outside.obj", "v 0 0 0\n").write("inner/note", "");
    std::os::unix::fs::symlink(folder.path("outside.obj"), folder.path("inner/link.obj")).unwrap();
    let mesh =
        [("source.box = { min = [-0.05, -0.05, 0.02], max = [0.05, 0.05, 0.12] }", "source.mesh.file = 'link.obj'")];
    folder.scene(FALL, &mesh);
    std::fs::rename(folder.path("scene.toml"), folder.path("inner/scene.toml")).unwrap();
    folder.run(&["check", "inner/scene.toml"]).expect(2, &["link.obj", "outside the asset root"]);
}

/// The files cut to a part of their bytes, each told at its key.
#[test]
fn cut_files_are_told_at_their_keys() {
    let folder = Folder::new();
    folder.photo().scene(PHOTO, &[]);
    folder.run(&["check", "scene.toml"]).expect(0, &[]);
    for (file, key) in
        [("image.png", "photo.image"), ("labels.png", "photo.labels"), ("depth.pfm", "photo.depth.metric.file")]
    {
        folder.photo();
        let whole = std::fs::read(folder.path(file)).unwrap();
        folder.write(file, &whole[..whole.len() / 2]);
        folder.run(&RUN).expect(2, &[key, file, "damaged or cut short"]);
    }
}

#[test]
fn cut_meshes_and_points_are_told_at_their_keys() {
    let folder = Folder::new();
    let source = |text: &str| {
        folder.scene(FALL, &[("source.box = { min = [-0.05, -0.05, 0.02], max = [0.05, 0.05, 0.12] }", text)]);
    };
    let points: Vec<[f32; 3]> = (0..50).map(|i| [0.0, 0.0, 0.1 + 0.001 * i as f32]).collect();
    let frame = physvideo_app::io::write::PointFrame { positions: &points, ..Default::default() };
    physvideo_app::io::write::write_npz(&folder.path("a.npz"), &frame).unwrap();
    physvideo_app::io::write::write_ply(&folder.path("a.ply"), &frame).unwrap();
    for file in ["a.npz", "a.ply"] {
        let whole = std::fs::read(folder.path(file)).unwrap();
        folder.write(file, &whole[..whole.len() / 2]);
        source(&format!("source.points.file = '{file}'"));
        folder.run(&RUN).expect(2, &["object[0].source.points.file", file, "damaged or cut short"]);
    }
    // An OBJ cut within its faces names vertices it does not have, or is open.
    folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n");
    source("source.mesh.file = 'a.obj'");
    folder.run(&RUN).expect(2, &["object[0].source.mesh.file", "a.obj", "names a vertex that is not there"]);
    folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder.run(&RUN).expect(2, &["object[0].source", "the mesh is not closed"]);
    folder.write("a.obj", "v 0 0");
    folder.run(&RUN).expect(2, &["object[0].source.mesh.file", "a.obj"]);
}

#[test]
fn a_mask_of_another_size_is_refused() {
    let folder = Folder::new();
    folder.photo().scene(PHOTO, &[]);
    folder.labels(31, 24, |_, _| true);
    folder.run(&RUN).expect(2, &["photo.labels", "31 × 24", "32 × 24", "scene.toml:4:"]);
}

#[test]
fn an_empty_mask_is_told_at_its_label() {
    let folder = Folder::new();
    folder.photo().scene(PHOTO, &[]);
    folder.labels(32, 24, |_, _| false);
    let said = folder.run(&RUN);
    said.expect(2, &["object[0].source.mask.label", "no pixel of the label image is 1", "all background"]);
}

#[test]
fn unknown_depth_is_told_where_it_is() {
    let folder = Folder::new();
    folder.photo().scene(PHOTO, &[]);
    folder.depth(|_, _| 0.0);
    folder.run(&RUN).expect(2, &["photo.depth.metric.file", "no pixel has a known value"]);
    // Known elsewhere, unknown within the object.
    folder.depth(|x, _| if x < 4 { 2.0 } else { f32::NAN });
    folder.run(&RUN).expect(2, &["object[0].source.mask.label", "depth of all 144 pixels of label 1 is unknown"]);
}

#[test]
fn a_body_without_particles_is_refused() {
    let source = "source.box = { min = [-0.05, -0.05, 0.02], max = [0.05, 0.05, 0.12] }";
    // Between the points of a lattice of 1/64 m.
    fall(&[(source, "source.ball = { center = [0, 0, 0.125], radius = 0.001 }")])
        .expect(2, &["object[0].source", "'jelly' got no particles", "grid_density"]);
}

#[test]
fn ten_thousand_million_particles_are_refused_before_they_are_made() {
    let begun = std::time::Instant::now();
    let many = [("grid_density = 32", "grid_density = 12000")];
    let said = fall(&many);
    said.expect(3, &["object[0].source", "bytes are available", "grid_density", "scene::memory"]);
    let number_before = |words: &str| -> f64 {
        let before = &said.err[..said.err.find(words).unwrap()];
        before.split_whitespace().last().unwrap().parse().unwrap()
    };
    // (0.1 m · 12000 / m)³ · 8, each edge rounded to f32.
    let particles = number_before(" particles");
    assert!((particles / 1.3824e10 - 1.0).abs() < 1e-6, "{particles}");
    assert!(number_before(" bytes, ") > 100.0 * particles && number_before(" bytes are available") > 0.0);
    assert!(begun.elapsed().as_secs() < 20, "refusing took {:?}: were they made?", begun.elapsed());
    fall(&[("grid_density = 32", "grid_density = 1e30")]).expect(3, &["scene::memory"]);
}

#[test]
fn a_grid_that_cannot_be_numbered_is_refused() {
    let wide =
        [("min = [-0.3, -0.3, -0.1], max = [0.3, 0.3, 0.5]", "min = [-1e30, -1e3, -1e3], max = [1e30, 1e3, 1e3]")];
    fall(&wide).expect(2, &["simulation.domain", "blocks"]);
}

#[test]
fn no_vulkan_device_is_told_with_what_to_install() {
    let folder = Folder::new();
    folder.scene(FALL, &[]);
    let mut command = folder.command(&RUN);
    let nowhere = "/nonexistent";
    command.env("VK_DRIVER_FILES", nowhere).env("VK_ICD_FILENAMES", nowhere).env("VK_ADD_DRIVER_FILES", nowhere);
    said(&mut command).expect(3, &["no Vulkan device", "mesa-vulkan-drivers"]);
    // Planning, checking and the schema go without one.
    for args in [&["check", "scene.toml"][..], &["schema"], &["plan", "scene.toml"]] {
        let mut command = folder.command(args);
        command.env("VK_DRIVER_FILES", nowhere).env("VK_ICD_FILENAMES", nowhere);
        let said = said(&mut command);
        said.expect(0, &[]);
        if args[0] == "plan" {
            assert!(said.out.contains("not compared: no Vulkan device"), "{}", said.out);
        }
    }
    let mut command = folder.command(&["devices"]);
    command.env("VK_DRIVER_FILES", nowhere).env("VK_ICD_FILENAMES", nowhere);
    said(&mut command).expect(3, &["no Vulkan device"]);
}

#[test]
fn an_unknown_device_is_told_with_those_there_are() {
    let folder = Folder::new();
    folder.scene(FALL, &[]);
    let known = folder.run(&["devices"]).out;
    let first = known.split_whitespace().nth(1).unwrap();
    for args in [&["run", "scene.toml", "--device", "abacus"], &["plan", "scene.toml", "--device", "abacus"]] {
        folder.run(args).expect(3, &["\"abacus\"", first]);
    }
}

#[test]
fn an_output_folder_that_cannot_be_written_is_told_before_any_work() {
    let folder = Folder::new();
    folder.scene(FALL, &[("frames = 3", "frames = 100000")]).write("file", "");
    for out in ["file/out", "file", "/proc/physvideo/out"] {
        let begun = std::time::Instant::now();
        folder.run(&["run", "scene.toml", "--quiet", "--out", out]).expect(7, &["--out"]);
        assert!(begun.elapsed().as_secs() < 20);
    }
}

#[test]
fn a_video_of_a_size_that_cannot_be_encoded_is_the_scenes_fault() {
    let huge = [("width = 64", "width = 8192"), ("height = 48", "height = 16")];
    fall(&huge).expect(2, &["8192", "output frames only"]);
}

/// What starts outside of the grid would be lost in the first frame.
#[test]
fn a_domain_that_does_not_hold_its_bodies_is_refused() {
    let small = [("domain = { min = [-0.3, -0.3, -0.1]", "domain = { min = [-0.3, 0.0, -0.1]")];
    fall(&small)
        .expect(2, &["scene.toml:11:", "simulation.domain", "particles of object[0] 'jelly' start outside", "enlarge"]);
}

/// A start so fast that a frame would take for ever is refused before it begins.
#[test]
fn a_start_beyond_all_steps_is_refused() {
    let fast = [("density = 1000.0", "density = 1000.0\nvelocity = [0.0, 0.0, -1e20]")];
    fall(&fast).expect(2, &["simulation", "too short for frames", "fast"]);
}
