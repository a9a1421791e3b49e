use super::*;

/// A manifest with something of everything.
const WHOLE: &str = r#"schema = 1
name = "small"
[latent]
channels = 4
spatial = 8
temporal = 4
[chunk]
frames = 37
history = 3
[encode]
graphs = [{ file = "encode.onnx", sha256 = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789ABCDEF" }]
input = { name = "video", layout = "BTCHW", dtype = "f16" }
output = { name = "latent" }
range = [-1.0, 1.0]
latent_mean = [0.1, 0.2, 0.3, 0.4]
latent_scale = 0.5
[decode]
load = "in_turn"
graphs = [{ file = "a.onnx", data = [{ file = "data/a.bin" }] }, { file = "b.onnx" }]
input = { name = "latent" }
output = { name = "video" }
mean = [0.5, 0.4, 0.3]
std = [0.2, 0.2, 0.2]
[velocity]
graphs = [{ file = "velocity.onnx" }]
prediction = "eps_minus_x0"
guidance = { kind = "embedded", scale = 10.0 }
output = { name = "prediction" }
schedule = { shift = { shift = 7.0 }, steps = 25 }
[[velocity.inputs]]
name = "x"
parts = ["latents", "mask", "image"]
mask_channels = 4
[[velocity.inputs]]
name = "sigma"
source = "sigma"
per = "token"
patch = [1, 2, 2]
[[velocity.inputs]]
name = "guidance"
source = "guidance"
scale = 1000
[[velocity.inputs]]
name = "clean"
parts = ["first", { source = "history", nearest = 0, count = 1 }]
over = "time"
[[velocity.inputs]]
name = "at"
source = "indices"
of = ["first", { source = "history" }, "latents"]
dtype = "i64"
[[velocity.inputs]]
name = "scale"
source = "constant"
value = [0.32, 32.0, 32.0]
"#;

fn errors(text: &str) -> Vec<String> {
    match Manifest::parse(text, "m") {
        Err(NetError::Manifest(errors)) => errors.to_string().lines().map(str::to_owned).collect(),
        Err(other) => panic!("{other}"),
        Ok(_) => Vec::new(),
    }
}

#[test]
fn a_whole_manifest_is_read() {
    let m = Manifest::parse(WHOLE, "m").unwrap();
    let encode = m.encode.as_ref().unwrap();
    assert_eq!((encode.input.layout, encode.input.dtype), (Layout::Btchw, Dtype::F16));
    assert_eq!((encode.colour_mean, encode.colour_std), ([0.5; 3], [0.5; 3]));
    assert_eq!((&encode.latent_mean[..2], &encode.latent_std[..2]), (&[0.1, 0.2][..], &[2.0, 2.0][..]));
    assert!(encode.role.graphs[0].file.sha256.as_ref().unwrap().ends_with("abcdef"));
    let decode = m.decode.as_ref().unwrap();
    assert_eq!((decode.role.load, decode.role.graphs.len()), (Load::InTurn, 2));
    assert_eq!(decode.colour_mean, [0.5, 0.4, 0.3]);
    let velocity = m.velocity.as_ref().unwrap();
    assert_eq!(velocity.inputs.len(), 6);
    assert_eq!(velocity.inputs[1].source, Source::Sigma { scale: 1.0, per: Per::Token { patch: [1, 2, 2] } });
    assert_eq!(m.grid(37, 256, 320).unwrap(), Grid { frames: 10, height: 32, width: 40 });
}

#[test]
fn the_reference_is_a_manifest() {
    let text = include_str!("../../../../assets/models/reference.toml");
    Manifest::parse(text, "reference.toml").unwrap_or_else(|e| panic!("{e}"));
    // Every line that is left out as a comment is one, too.
    for (key, instead) in [
        ("size = [60", ""),
        ("negative = ", "cfg"),
        ("shift = { shift", "by_tokens"),
        ("vp = {", "by_tokens"),
        ("terminal = ", ""),
    ] {
        let taken = |line: &str| match line.strip_prefix("# ") {
            Some(rest) if rest.starts_with(key) => rest.to_owned(),
            _ if instead == "by_tokens" && line.starts_with("by_tokens") => String::new(),
            _ if instead == "cfg" => {
                let line = line.replace("kind = \"embedded\", scale = 10.0", "kind = \"cfg\", scale = 5.0");
                line.replace("source = \"guidance\"", "source = \"frames\"")
            }
            _ => line.to_owned(),
        };
        let text = text.lines().map(taken).collect::<Vec<_>>().join("\n");
        Manifest::parse(&text, key).unwrap_or_else(|e| panic!("{e}"));
    }
}

/// Each: what is replaced in the whole manifest, by what, and what is said, place included.
const PROBLEMS: &[(&str, &str, &str)] = &[
    ("schema = 1", "schema = 2", "m:1:10: schema: must lie between 1 and 1, is 2"),
    ("name = \"small\"\n", "", "m:1:1: `name` is missing"),
    ("name = \"small\"", "name = 3", "m:2:8: name: expected a text, found a number"),
    (
        "name = \"small\"",
        "name = \"small\"\nlicense = \"MIT\"",
        "m:3:1: license: unknown key `license`; did you mean `licence`?",
    ),
    ("channels = 4", "channels = 0", "m:4:12: latent.channels: must lie between 1 and 4096, is 0"),
    ("channels = 4", "channels = 4.0", "m:4:12: latent.channels: expected a whole number, found a number"),
    (
        "temporal = 4",
        "temporal = 4\nfirst = \"held\"",
        "m:7:9: latent.first: `held` is not one of generated, clamped, separate",
    ),
    (
        "temporal = 4",
        "temporal = 4\nmultiple = 2\nsize = [60, 45]",
        "m:8:8: latent.size: must be multiples of `multiple`, 2",
    ),
    ("frames = 37", "frames = 36", "m:8:10: chunk.frames: must be 1 + a multiple of latent.temporal, 4; is 36"),
    ("history = 3", "history = 0", "asks for neighbours that chunk.history = 0 does not keep"),
    (
        "history = 3",
        "history = 3\ndirection = \"backward\"\nhistory_includes_first = true",
        "m:11:26: chunk.history_includes_first: a backward model has no image among what follows",
    ),
    (
        "file = \"encode.onnx\"",
        "file = \"../encode.onnx\"",
        "m:11:20: encode.graphs[0].file: must be a path inside the model's folder, without `..`",
    ),
    (
        "file = \"encode.onnx\"",
        "file = \"/encode.onnx\"",
        "m:11:20: encode.graphs[0].file: must be a path inside the model's folder, without `..`",
    ),
    (
        "\"0123456789abcdef",
        "\"0123456789abcdeg",
        "m:11:44: encode.graphs[0].sha256: is not a SHA-256: 64 hexadecimal digits",
    ),
    ("layout = \"BTCHW\"", "layout = \"BNC\"", "m:12:9: encode.input: frames have no layout BNC"),
    ("dtype = \"f16\"", "dtype = \"i64\"", "m:12:9: encode.input: latents, frames and predictions are floats, not i64"),
    (
        "range = [-1.0, 1.0]",
        "range = [1.0, -1.0]",
        "m:14:9: encode.range: must be [what black becomes, what white becomes], the first below the second",
    ),
    ("range = [-1.0, 1.0]", "range = [-1.0, nan]", "m:14:16: encode.range[1]: is not a finite number"),
    ("range = [-1.0, 1.0]", "range = [-1.0, inf]", "m:14:16: encode.range[1]: is not a finite number"),
    ("range = [-1.0, 1.0]", "range = [-1.0]", "m:14:9: encode.range: must have 2 entries, has 1"),
    (
        "range = [-1.0, 1.0]",
        "range = [-1.0, 1.0]\nmean = [0, 0, 0]",
        "m:14:9: encode.range: `range` excludes `mean` and `std`",
    ),
    (
        "latent_mean = [0.1, 0.2, 0.3, 0.4]",
        "latent_mean = [0.1]",
        "m:15:15: encode.latent_mean: must have 4 entries, one a channel of the latent; has 1",
    ),
    ("latent_scale = 0.5", "latent_scale = 0", "m:16:16: encode.latent_scale: must be greater than 0"),
    (
        "latent_scale = 0.5",
        "latent_scale = 0.5\nlatent_std = 2.0",
        "m:16:16: encode.latent_scale: `latent_scale` excludes `latent_std`",
    ),
    ("load = \"in_turn\"", "load = \"later\"", "m:18:8: decode.load: `later` is not one of together, in_turn"),
    ("std = [0.2, 0.2, 0.2]", "std = [0.2, 0.0, 0.2]", "m:23:7: decode.std: must be greater than 0"),
    ("graphs = [{ file = \"velocity.onnx\" }]", "graphs = []", "m:25:10: velocity.graphs: is empty"),
    (
        "graphs = [{ file = \"velocity.onnx\" }]",
        "graphs = \"velocity.onnx\"",
        "m:25:10: velocity.graphs: expected a list, found a text",
    ),
    (
        "\"eps_minus_x0\"",
        "\"v\"",
        "m:26:14: velocity.prediction: `v` is not one of eps_minus_x0, x0_minus_eps, x0, vp_v",
    ),
    (
        "\"eps_minus_x0\"",
        "\"x0\"\nleast_sigma = 0",
        "m:27:15: velocity.least_sigma: must be greater than 0 and below 1, since x0 has no velocity at 0, is 0",
    ),
    (
        "kind = \"embedded\", scale = 10.0",
        "kind = \"none\"",
        "m:30:1: velocity.inputs: an input with source \"guidance\" needs guidance of kind \"embedded\"",
    ),
    ("kind = \"embedded\", scale = 10.0", "kind = \"embedded\"", "m:27:12: velocity.guidance: `scale` is missing"),
    (
        "guidance = {",
        "negative = \"n.npz\"\nguidance = {",
        "m:27:12: velocity.negative: only guidance of kind \"cfg\" has a negative",
    ),
    (
        "source = \"guidance\"\nscale = 1000",
        "source = \"sigma\"",
        "m:30:1: velocity.inputs: guidance of kind \"embedded\" needs an input with source \"guidance\"",
    ),
    (
        "shift = { shift = 7.0 }",
        "shift = { shift = 0.0 }",
        "m:29:32: velocity.schedule.shift.shift: must be greater than 0, is 0",
    ),
    (
        "shift = { shift = 7.0 }, ",
        "",
        "m:29:12: velocity.schedule: a schedule is exactly one of `shift`, `by_tokens` and `vp`",
    ),
    ("steps = 25", "steps = 0", "m:29:47: velocity.schedule.steps: must lie between 1 and 100000, is 0"),
    ("steps = 25", "steps = 25, terminal = 1.0", "m:29:62: velocity.schedule.terminal: must be between 0 and 1, is 1"),
    (
        "\"latents\", \"mask\"",
        "\"latent\", \"mask\"",
        "m:32:10: velocity.inputs[0].parts[0]: `latent` is not one of latents, mask, image, first",
    ),
    (
        "\"latents\", \"mask\", \"image\"",
        "\"mask\", \"image\"",
        "m:30:1: velocity.inputs: no input has the part \"latents\"",
    ),
    (
        "\"mask\", \"image\"",
        "\"mask\", \"first\"",
        "m:30:1: velocity.inputs[0]: parts joined over channels must have the same length in time",
    ),
    (
        "mask_channels = 4",
        "mask_channels = 4\nover = \"time\"",
        "m:30:1: velocity.inputs[0]: a mask has other channels than latents: it cannot be joined over time",
    ),
    (
        "mask_channels = 4",
        "mask_channels = 4\ndtype = \"i64\"",
        "m:30:1: velocity.inputs[0]: latents are floats, not i64",
    ),
    ("mask_channels = 4", "mask_channels = 4\nscale = 2", "m:34:1: velocity.inputs[0].scale: unknown key `scale`"),
    ("name = \"sigma\"", "name = \"x\"", "m:34:1: velocity.inputs[1]: two inputs are named `x`"),
    (
        "source = \"sigma\"",
        "source = \"timestep\"",
        "m:30:1: velocity.inputs: an input with source \"timestep\" needs a `vp` schedule, whose table it counts in",
    ),
    (
        "source = \"sigma\"",
        "source = \"noise\"",
        "m:36:10: velocity.inputs[1].source: `noise` is not one of latents, mask",
    ),
    (
        "per = \"token\"\npatch = [1, 2, 2]",
        "per = \"batch\"\npatch = [1, 2, 2]",
        "m:38:1: velocity.inputs[1].patch: unknown key `patch`",
    ),
    ("patch = [1, 2, 2]", "patch = [1, 0, 2]", "m:38:13: velocity.inputs[1].patch[1]: must lie between 1 and 64, is 0"),
    (
        "nearest = 0, count = 1",
        "nearest = 3, count = 1",
        "m:45:19: velocity.inputs[3].parts[1]: asks for neighbours that chunk.history = 3 does not keep",
    ),
    ("of = [\"first\",", "of = [\"mask\",", "m:47:1: velocity.inputs[4]: `of` names first, latents and history"),
    (
        "value = [0.32, 32.0, 32.0]",
        "value = [0.32, 32.0]\nshape = [3]",
        "m:55:9: velocity.inputs[5].value: has 2 entries, and its shape 3",
    ),
    (
        "value = [0.32, 32.0, 32.0]",
        "value = 1\nshape = [4000, 4000]",
        "m:55:9: velocity.inputs[5].value: is too large for a manifest: use `file`",
    ),
    ("value = [0.32, 32.0, 32.0]", "", "m:52:1: velocity.inputs[5]: a constant has either `value` or `file`"),
    ("[chunk]", "[chunk", "not valid TOML"),
];

#[test]
fn every_problem_has_its_place() {
    for (old, new, expected) in PROBLEMS {
        assert!(WHOLE.contains(old), "{old}");
        let told = errors(&WHOLE.replacen(old, new, 1));
        assert!(told.iter().any(|line| line.contains(expected)), "{old} -> {new}\n{expected}\n{told:#?}");
        assert!(told.len() <= 2, "one mistake, many complaints: {told:#?}");
    }
}

#[test]
fn all_problems_are_told_at_once_in_their_order() {
    let text = WHOLE
        .replacen("channels = 4", "channels = 0", 1)
        .replace("\"eps_minus_x0\"", "\"v\"")
        .replace("name = \"small\"", "name = \"small\"\nfoo = 1")
        .replace("[0.2, 0.2, 0.2]", "[0.2, 0.2]");
    let lines: Vec<_> = errors(&text).iter().map(|l| l.split(':').nth(1).unwrap().to_owned()).collect();
    assert_eq!(lines, ["3", "5", "24", "27"]);
}

#[test]
fn texts_that_may_be_anything_never_panic() {
    for end in 0..WHOLE.len() {
        let _ = Manifest::parse(&WHOLE[..end], "m");
    }
    for (i, _) in WHOLE.char_indices().step_by(7) {
        for junk in ["[", "}", "\"", "=", "9e999", "[[", "\u{0}", "é"] {
            let _ = Manifest::parse(&format!("{}{junk}{}", &WHOLE[..i], &WHOLE[i..]), "m");
        }
    }
    let deep = format!("schema = {}1{}", "[".repeat(100_000), "]".repeat(100_000));
    assert!(!errors(&deep).is_empty());
    assert!(!errors("").is_empty());
    for number in ["-1", "99999999999999999999", "0x7fffffffffffffff", "1e400", "-0"] {
        let _ = Manifest::parse(&WHOLE.replace("= 4", &format!("= {number}")), "m");
    }
}

#[test]
fn sizes_are_grids_or_the_nearest_is_told() {
    let grid = |text: &str, frames, height, width| match Manifest::parse(text, "m").unwrap().grid(frames, height, width)
    {
        Ok(grid) => format!("{} {} {}", grid.frames, grid.height, grid.width),
        Err(e) => e.to_string(),
    };
    let with = |key: &str| WHOLE.replacen("temporal = 4", &format!("temporal = 4\n{key}"), 1);
    assert_eq!(grid(WHOLE, 5, 64, 8), "2 8 1");
    assert_eq!(grid(WHOLE, 1, 64, 8), "1 8 1");
    assert_eq!(grid(&with("first = \"separate\""), 37, 64, 64), "9 8 8");
    assert!(grid(&with("first = \"separate\""), 1, 64, 64).contains("at least 5 frames, not 1"));
    assert!(grid(WHOLE, 0, 64, 64).contains("nearest: 1"));
    assert!(grid(WHOLE, 4, 64, 64).contains("frames must be 1 + a multiple of 4, are 4; nearest: 1 or 5"));
    assert!(grid(WHOLE, 5, 0, 64).contains("the height must be a multiple of 8 pixels, is 0; nearest: 8"));
    assert!(
        grid(&with("multiple = 2"), 5, 64, 72)
            .contains("the width must be a multiple of 16 pixels, is 72; nearest: 64 or 80")
    );
    assert!(grid(&with("size = [60, 90]"), 5, 480, 640).contains("the width must be 720 pixels, is 640"));
    assert_eq!(grid(&with("size = [60, 90]"), 5, 480, 720), "2 60 90");
    let fixed = WHOLE.replace("frames = 37", "frames = 37\nfixed = true");
    assert!(grid(&fixed, 33, 64, 64).contains("a chunk has 37 frames, not 33"));
}
