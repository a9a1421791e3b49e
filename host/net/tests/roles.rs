//! The velocity network over small graphs: reading in place, guidance, layouts and types, sizes that do not fit.

mod toy;

use physvideo_net::{Branch, Conditioning, Grid, Manifest, Model, Role, Sigma, Tensor, VelocityInputs};
use toy::onnx::{Attribute, BF16, F16, F32, Graph, I64};
use toy::{ENCODE, Folder, HEAD, NEVER, VELOCITY, blocks, difference, noise, toy};

const GRID: Grid = Grid { frames: 3, height: 3, width: 4 };
const LATENTS: [usize; 4] = [4, 3, 3, 4];

fn sigma(value: f64) -> Sigma {
    Sigma::new(value).unwrap()
}

fn on_image(grid: Grid) -> Conditioning {
    Conditioning::on_image(grid, noise(&[4, 1, grid.height, grid.width], 9))
}

fn evaluate(model: &mut Model, inputs: &VelocityInputs, z: &[f32], s: f64, branch: Branch) -> Vec<f32> {
    let mut out = Vec::new();
    model.evaluate(inputs, z, sigma(s), branch, &mut out, NEVER).unwrap_or_else(|e| panic!("{e}"));
    out
}

#[test]
fn models_may_move_between_threads() {
    fn moves<T: Send>() {}
    moves::<Model>();
    moves::<physvideo_net::Runtime>();
    moves::<VelocityInputs>();
}

#[test]
fn the_velocity_network_is_given_what_the_manifest_says() {
    let mut model = toy().model(&[Role::Velocity]);
    let c = on_image(GRID);
    let image = c.image.data.clone();
    let inputs = model.condition(c, NEVER).unwrap();
    assert_eq!((inputs.grid(), inputs.len(), inputs.cfg()), (GRID, 144, None));
    let z = noise(&LATENTS, 2).data;
    let out = evaluate(&mut model, &inputs, &z, 0.75, Branch::Conditional);
    let plane = 12;
    let expected: Vec<f32> = (0..144)
        .map(|i| {
            let (channel, time, at) = (i / 36, i / plane % 3, i % plane);
            let known = if time == 0 { 2.0 * image[channel * plane + at] + 1.0 } else { 0.0 };
            z[i] * 0.75 + known
        })
        .collect();
    assert!(difference(&out, &expected) < 1e-6);
}

#[test]
fn an_input_read_in_place_gives_the_same_bits() {
    let mut model = toy().model(&[Role::Velocity]);
    let inputs = model.condition(on_image(GRID), NEVER).unwrap();
    let direct = inputs.direct().unwrap();
    assert_eq!((direct.channels, direct.tail.len()), (9, 5 * 36));
    let z = noise(&LATENTS, 3).data;
    let whole = [z.clone(), direct.tail.to_vec()].concat();
    let packed = evaluate(&mut model, &inputs, &z, 0.3, Branch::Conditional);
    let in_place = evaluate(&mut model, &inputs, &whole, 0.3, Branch::Conditional);
    assert!(packed.iter().zip(&in_place).all(|(a, b)| a.to_bits() == b.to_bits()));
    // Read from the slice itself: another tail gives another answer.
    let mut other = whole;
    other[144] += 1.0;
    let changed = evaluate(&mut model, &inputs, &other, 0.3, Branch::Conditional);
    assert_eq!(changed[0], packed[0] + 1.0);
}

#[test]
fn z_alone_is_read_in_place_too() {
    let manifest = VELOCITY.replace(r#"parts = ["latents", "mask", "image"]"#, r#"source = "latents""#);
    let graph = Graph::default()
        .input("x", F32, &[1, 4, -1, -1, -1])
        .input("sigma", F32, &[1])
        .output("prediction", F32, &[1, 4, -1, -1, -1])
        .node("Mul", &["x", "sigma"], "prediction");
    let folder = Folder::new(&[HEAD, &manifest].concat(), &[("velocity.onnx", graph.file())]);
    let mut model = folder.model(&[Role::Velocity]);
    let inputs = model.condition(on_image(GRID), NEVER).unwrap();
    assert!(inputs.direct().unwrap().tail.is_empty());
    let z = noise(&LATENTS, 3).data;
    let out = evaluate(&mut model, &inputs, &z, 0.5, Branch::Conditional);
    assert!(out.iter().zip(&z).all(|(o, z)| *o == 0.5 * z));
}

#[test]
fn guidance_has_two_branches() {
    let manifest = VELOCITY.replace("prediction =", "guidance = { kind = \"cfg\", scale = 5.0 }\nprediction =")
        + "[[velocity.inputs]]\nname = \"text\"\nsource = \"embedding\"\nkey = \"text\"\noptional_zeros = [1, 2, 3]\n";
    let graph = Graph::default()
        .input("x", F32, &[1, 9, -1, -1, -1])
        .input("sigma", F32, &[1])
        .input("text", F32, &[1, -1, 3])
        .output("prediction", F32, &[1, 4, -1, -1, -1])
        .ints("0", &[0])
        .ints("1", &[1])
        .ints("4", &[4])
        .node("Slice", &["x", "0", "4", "1"], "z")
        .node_with("ReduceSum", &["text"], &["sum"], &[("keepdims", Attribute::Int(0))])
        .node("Add", &["z", "sum"], "zt")
        .node("Mul", &["zt", "sigma"], "prediction");
    let folder = Folder::new(&[HEAD, &manifest].concat(), &[("velocity.onnx", graph.file())]);
    let mut model = folder.model(&[Role::Velocity]);
    let text = |value: f32| {
        let mut e = physvideo_net::Embeddings::default();
        e.insert("text", &Tensor::filled(vec![1, 2, 3], value).unwrap());
        e
    };
    let mut c = on_image(GRID);
    c.embeddings = Some(text(1.0));
    let z = noise(&LATENTS, 4).data;
    let of = |model: &mut Model, c: &Conditioning, branch: Branch| {
        let inputs = model.condition(c.clone(), NEVER).unwrap();
        evaluate(model, &inputs, &z, 1.0, branch)[0] - z[0]
    };
    // Without a negative the unconditional branch takes the embedding itself.
    assert!((of(&mut model, &c, Branch::Conditional) - 6.0).abs() < 1e-6);
    assert!((of(&mut model, &c, Branch::Unconditional) - 6.0).abs() < 1e-6);
    c.negative = Some(text(-1.0));
    assert!((of(&mut model, &c, Branch::Unconditional) + 6.0).abs() < 1e-6);
    c.embeddings = None;
    assert!(of(&mut model, &c, Branch::Conditional).abs() < 1e-6);
    assert_eq!(model.condition(c.clone(), NEVER).unwrap().cfg(), Some(5.0));
    // At scale 1 the branches are one.
    c.guidance = Some(1.0);
    let inputs = model.condition(c, NEVER).unwrap();
    assert_eq!(inputs.cfg(), None);
    let refused = model.evaluate(&inputs, &z, sigma(1.0), Branch::Unconditional, &mut Vec::new(), NEVER);
    assert!(refused.unwrap_err().to_string().contains("no unconditional branch"));
}

#[test]
fn the_unconditional_branch_can_drop_the_image() {
    let cfg = "guidance = { kind = \"cfg\", scale = 3.0, drops = [\"image\", \"mask\"] }\nprediction =";
    let manifest = [HEAD, &VELOCITY.replace("prediction =", cfg)].concat();
    let mut model = Folder::new(&manifest, &[("velocity.onnx", toy::velocity())]).model(&[Role::Velocity]);
    let inputs = model.condition(on_image(GRID), NEVER).unwrap();
    // The tail differs between branches, so there is none to share.
    assert!(inputs.direct().is_none());
    let z = noise(&LATENTS, 5).data;
    let out = evaluate(&mut model, &inputs, &z, 0.5, Branch::Unconditional);
    assert!(out.iter().zip(&z).all(|(o, z)| *o == 0.5 * z));
}

/// A velocity graph that passes z on, and its manifest, in one layout and type.
fn passing(layout: &str, dtype: &str, element: u64) -> Folder {
    let shape: &[i64] = match layout {
        "BCTHW" => &[1, 4, -1, -1, -1],
        "BTCHW" => &[1, -1, 4, -1, -1],
        _ => &[1, -1, 4],
    };
    let tensor = format!("layout = \"{layout}\"\ndtype = \"{dtype}\"");
    let manifest = VELOCITY
        .replace(r#"parts = ["latents", "mask", "image"]"#, &format!("source = \"latents\"\n{tensor}"))
        .replace(
            "output = { name = \"prediction\" }",
            &format!("output = {{ name = \"prediction\", {} }}", tensor.replace('\n', ", ")),
        );
    let graph = Graph::default()
        .input("x", element, shape)
        .input("sigma", F32, &[1])
        .output("prediction", element, shape)
        .node("Identity", &["x"], "prediction");
    Folder::new(&[HEAD, &manifest].concat(), &[("velocity.onnx", graph.file())])
}

#[test]
fn every_layout_and_type_passes_z_on() {
    let z = noise(&LATENTS, 6).data;
    for layout in ["BCTHW", "BTCHW", "BNC"] {
        for (dtype, element, tolerance) in [("f32", F32, 0.0), ("f16", F16, 5e-4), ("bf16", BF16, 4e-3)] {
            let mut model = passing(layout, dtype, element).model(&[Role::Velocity]);
            let inputs = model.condition(on_image(GRID), NEVER).unwrap();
            assert_eq!(inputs.direct().is_some(), layout == "BCTHW" && dtype == "f32");
            let out = evaluate(&mut model, &inputs, &z, 0.5, Branch::Conditional);
            assert!(difference(&out, &z) <= tolerance, "{layout} {dtype}");
        }
    }
}

#[test]
fn latents_reach_the_network_in_its_layout() {
    // The graph adds 1 at channel 2 only: one axis of BTCHW, another of BNC.
    for (layout, shape) in [("BTCHW", vec![1, 1, 4, 1, 1]), ("BNC", vec![1, 1, 4])] {
        let folder = passing(layout, "f32", F32);
        let full: &[i64] = if layout == "BNC" { &[1, -1, 4] } else { &[1, -1, 4, -1, -1] };
        let graph = Graph::default()
            .input("x", F32, full)
            .input("sigma", F32, &[1])
            .output("prediction", F32, full)
            .floats("one", &shape, &[0.0, 0.0, 1.0, 0.0])
            .node("Add", &["x", "one"], "prediction");
        folder.write("velocity.onnx", &graph.file());
        let mut model = folder.model(&[Role::Velocity]);
        let inputs = model.condition(on_image(GRID), NEVER).unwrap();
        let out = evaluate(&mut model, &inputs, &[0.0; 144], 0.5, Branch::Conditional);
        let expected: Vec<f32> = (0..144).map(|i| if i / 36 == 2 { 1.0 } else { 0.0 }).collect();
        assert_eq!(out, expected, "{layout}");
    }
}

#[test]
fn whole_numbers_are_truncated() {
    let manifest = VELOCITY
        .replace(r#"parts = ["latents", "mask", "image"]"#, r#"source = "latents""#)
        .replace("source = \"sigma\"", "source = \"sigma\"\nscale = 1000\nper = \"scalar\"\ndtype = \"i64\"");
    let graph = Graph::default()
        .input("x", F32, &[1, 4, -1, -1, -1])
        .input("sigma", I64, &[])
        .output("prediction", F32, &[1, 4, -1, -1, -1])
        .node_with("Cast", &["sigma"], &["s"], &[("to", Attribute::Int(1))])
        .node("Add", &["x", "s"], "prediction");
    let mut model =
        Folder::new(&[HEAD, &manifest].concat(), &[("velocity.onnx", graph.file())]).model(&[Role::Velocity]);
    let inputs = model.condition(on_image(GRID), NEVER).unwrap();
    let out = evaluate(&mut model, &inputs, &[0.0; 144], 28.0 / 29.0, Branch::Conditional);
    assert_eq!(out[0], 965.0);
}

/// Two graphs: a = z sigma, then prediction = a + 1.
fn chain(load: &str) -> Folder {
    let manifest = VELOCITY.replace(r#"parts = ["latents", "mask", "image"]"#, r#"source = "latents""#).replace(
        "graphs = [{ file = \"velocity.onnx\" }]",
        &format!("load = \"{load}\"\ngraphs = [{{ file = \"a.onnx\" }}, {{ file = \"sub/b.onnx\" }}]"),
    );
    let a = Graph::default()
        .input("x", F32, &[1, 4, -1, -1, -1])
        .input("sigma", F32, &[1])
        .output("a", F32, &[1, 4, -1, -1, -1])
        .node("Mul", &["x", "sigma"], "a");
    let b = Graph::default()
        .input("a", F32, &[1, 4, -1, -1, -1])
        .input("sigma", F32, &[1])
        .output("prediction", F32, &[1, 4, -1, -1, -1])
        .node("Add", &["a", "sigma"], "prediction");
    Folder::new(&[HEAD, &manifest].concat(), &[("a.onnx", a.file()), ("sub/b.onnx", b.file())])
}

#[test]
fn graphs_run_as_a_chain_together_or_in_turn() {
    let z = noise(&LATENTS, 7).data;
    for load in ["together", "in_turn"] {
        let folder = chain(load);
        let mut model = folder.model(&[Role::Velocity]);
        let inputs = model.condition(on_image(GRID), NEVER).unwrap();
        for s in [0.5, 0.25] {
            let out = evaluate(&mut model, &inputs, &z, s, Branch::Conditional);
            assert!(out.iter().zip(&z).all(|(o, z)| *o == z * s as f32 + s as f32), "{load}");
        }
    }
    // A graph that is exchanged between two calls is noticed.
    let folder = chain("in_turn");
    let mut model = folder.model(&[Role::Velocity]);
    let inputs = model.condition(on_image(GRID), NEVER).unwrap();
    folder.write("new.onnx", &toy::velocity());
    std::fs::rename(folder.path().join("new.onnx"), folder.path().join("a.onnx")).unwrap();
    let refused = model.evaluate(&inputs, &z, sigma(0.5), Branch::Conditional, &mut Vec::new(), NEVER);
    assert!(refused.unwrap_err().to_string().contains("changed"));
}

#[test]
fn a_clamped_latent_keeps_its_scale_and_is_told_to_be_clean() {
    let head = HEAD.replace("temporal = 2", "temporal = 2\nfirst = \"clamped\"");
    let manifest = VELOCITY
        .replace(r#"parts = ["latents", "mask", "image"]"#, r#"source = "latents""#)
        .replace("eps_minus_x0", "vp_v")
        .replace("source = \"sigma\"", "source = \"sigma\"\nper = \"token\"\npatch = [1, 3, 4]");
    let graph = Graph::default()
        .input("x", F32, &[1, 4, -1, -1, -1])
        .input("sigma", F32, &[1, -1])
        .output("prediction", F32, &[1, 4, -1, -1, -1])
        .ints("shape", &[1, 1, 3, 1, 1])
        .node("Reshape", &["sigma", "shape"], "s")
        .node("Add", &["x", "s"], "prediction");
    let folder = Folder::new(&[&head, &manifest[..]].concat(), &[("velocity.onnx", graph.file())]);
    let mut model = folder.model(&[Role::Velocity]);
    let inputs = model.condition(on_image(GRID), NEVER).unwrap();
    assert!(inputs.direct().is_none());
    let out = evaluate(&mut model, &inputs, &[1.0; 144], 0.5, Branch::Conditional);
    let n = 0.5_f32.sqrt();
    let expected: Vec<f32> = (0..144).map(|i| if i / 12 % 3 == 0 { 1.0 } else { 1.0 / n + 0.5 }).collect();
    assert!(difference(&out, &expected) < 1e-6);
}

#[test]
fn a_network_is_given_no_less_than_its_least_noise() {
    let manifest = VELOCITY.replace("eps_minus_x0", "x0").replace("prediction =", "least_sigma = 0.01\nprediction =");
    let folder = Folder::new(&[HEAD, &manifest].concat(), &[("velocity.onnx", toy::velocity())]);
    let mut model = folder.model(&[Role::Velocity]);
    let inputs = model.condition(on_image(GRID), NEVER).unwrap();
    let out = evaluate(&mut model, &inputs, &[1.0; 144], 0.0, Branch::Conditional);
    assert!((out[12] - 0.01).abs() < 1e-7);
    assert!((inputs.coefficients(sigma(0.0)).prediction - 100.0).abs() < 1e-9);
}

#[test]
fn the_image_among_grey_frames_is_encoded() {
    let manifest = VELOCITY.replace("name = \"x\"", "name = \"x\"\nimage_fill = \"encoded_grey\"");
    let folder = Folder::new(
        &[HEAD, ENCODE, &manifest].concat(),
        &[("velocity.onnx", toy::velocity()), ("encode.onnx", toy::encode())],
    );
    let mut model = folder.model(&[Role::Encode, Role::Velocity]);
    let frame = blocks([1, 3, 4], 11);
    let mut c = on_image(GRID);
    assert!(model.condition(c.clone(), NEVER).unwrap_err().to_string().contains("needs the image"));
    c.image_frame = Some(frame.clone());
    let inputs = model.condition(c.clone(), NEVER).unwrap();
    let tail = inputs.direct().unwrap().tail;
    let mut video = Tensor::filled(vec![3, 5, 6, 8], 0.5).unwrap();
    for channel in 0..3 {
        video.data[channel * 240..channel * 240 + 48].copy_from_slice(&frame.data[channel * 48..][..48]);
    }
    let latents = model.encode(&video, NEVER).unwrap();
    assert_eq!(tail[36..], latents.data[..]);
    // Without the encoder it cannot be done, and that is said.
    let mut model = folder.model(&[Role::Velocity]);
    assert!(model.condition(c, NEVER).unwrap_err().to_string().contains("encode network of model toy was not opened"));
}

#[test]
fn sizes_that_do_not_fit_are_told() {
    let folder = toy();
    let mut model = folder.model(&[Role::Encode, Role::Velocity]);
    let told = |e: physvideo_net::NetError| {
        assert_eq!(e.kind(), physvideo_net::Kind::Usage);
        e.to_string()
    };
    let frames = Tensor::filled(vec![3, 4, 6, 8], 0.0).unwrap();
    assert!(told(model.encode(&frames, NEVER).unwrap_err()).contains("nearest: 3 or 5"));
    assert!(told(model.encode(&noise(&[1, 5, 6, 8], 1), NEVER).unwrap_err()).contains("3 colours"));
    assert!(told(model.encode(&noise(&[3, 5, 6, 7], 1), NEVER).unwrap_err()).contains("7 x 6"));
    assert!(told(model.decode(&noise(&[4, 1, 1, 1], 1), NEVER).unwrap_err()).contains("decode"));
    let inputs = model.condition(on_image(GRID), NEVER).unwrap();
    let short = model.evaluate(&inputs, &[0.0; 7], sigma(0.5), Branch::Conditional, &mut Vec::new(), NEVER);
    assert!(told(short.unwrap_err()).contains("144 or 324"));
    let mut c = on_image(GRID);
    c.grid.width = 5;
    assert!(told(model.condition(c, NEVER).unwrap_err()).contains("latent of the image"));
    let manifest: Manifest = folder.manifest();
    assert_eq!(manifest.grid(5, 6, 8).unwrap(), GRID);
    assert!(told(manifest.grid(6, 6, 8).unwrap_err()).contains("nearest: 5 or 7"));
    assert!(told(manifest.grid(5, 7, 8).unwrap_err()).contains("nearest: 6 or 8"));
}

/// Published encoders are exported for clips; another graph takes the photograph alone.
#[test]
fn one_frame_goes_to_the_network_for_images() {
    let image =
        ENCODE.replace("[encode]", "[encode_image]").replace("latent_std = [1.0, 2.0, 1.0, 0.5]", "latent_std = 4.0");
    let files = [("encode.onnx", toy::encode())];
    let folder = Folder::new(&[HEAD, ENCODE, &image].concat(), &files);
    let (mut one, mut two) = (
        Folder::new(&[HEAD, ENCODE].concat(), &files).model(&[Role::Encode]),
        folder.model(&[Role::Encode, Role::EncodeImage]),
    );
    assert_eq!(folder.manifest().for_clips().len(), 4);
    let (frame, clip) = (blocks([1, 3, 4], 3), blocks([5, 3, 4], 3));
    let (a, b) = (one.encode(&frame, NEVER).unwrap(), two.encode(&frame, NEVER).unwrap());
    // Channel 0 has standard deviation 1 in one and 4 in the other.
    assert!(a.data[..12].iter().zip(&b.data).all(|(a, b)| (a - 4.0 * b).abs() < 1e-5), "{a:?} {b:?}");
    assert_eq!(one.encode(&clip, NEVER).unwrap(), two.encode(&clip, NEVER).unwrap());
    // It is no role without an encoder beside it.
    let alone = Manifest::parse(&[HEAD, &image].concat(), "model.toml").unwrap_err().to_string();
    assert!(alone.contains("encode_image") && alone.contains("beside `encode`"), "{alone}");
}
