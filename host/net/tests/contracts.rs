//! Six published models in miniature (tests/models, made by tools/models/make_contracts.py): the same names, layouts,
//! types and formulas, against answers computed there.

mod toy;

use std::fs::File;
use std::path::{Path, PathBuf};

use ndarray::IxDyn;
use ndarray_npy::{NpzReader, ReadableElement};
use physvideo_net::{Branch, Conditioning, Manifest, Model, OpenOptions, Sigma, Status, StepIndex, Tensor, check};
use toy::{NEVER, runtime};

fn folders(under: &str) -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(under);
    let mut folders: Vec<_> = std::fs::read_dir(root).unwrap().map(|e| e.unwrap().path()).collect();
    folders.retain(|f| f.join("model.toml").is_file());
    folders.sort();
    folders
}

struct Golden(NpzReader<File>);

impl Golden {
    fn of<T: ReadableElement>(&mut self, name: &str) -> (Vec<usize>, Vec<T>) {
        let array: ndarray::Array<T, IxDyn> = self.0.by_name(name).unwrap_or_else(|e| panic!("{name}: {e}"));
        let shape = array.shape().to_vec();
        (shape, array.into_raw_vec_and_offset().0)
    }

    fn has(&mut self, name: &str) -> bool {
        self.0.names().unwrap().iter().any(|n| n == name)
    }

    fn tensor(&mut self, name: &str) -> Tensor {
        let (shape, data) = self.of::<f32>(name);
        Tensor::new(shape, data).unwrap()
    }

    fn number(&mut self, name: &str) -> f64 {
        self.of::<f64>(name).1[0]
    }
}

/// Fails where a number is further from the golden one than the tolerance, which grows with its size.
fn near(what: &str, got: &[f32], want: &[f32], tolerance: f64) {
    assert_eq!(got.len(), want.len(), "{what}");
    let error = |(g, w): (&f32, &f32)| (f64::from(*g) - f64::from(*w)).abs() / (1.0 + f64::from(w.abs()));
    let worst = got.iter().zip(want).map(error).fold(0.0, f64::max);
    assert!(worst <= tolerance, "{what}: {worst} > {tolerance}");
    println!("{what}: {worst:.2e} of {tolerance:.0e}");
}

fn contract(folder: &Path) {
    let name = folder.file_name().unwrap().to_string_lossy().into_owned();
    let mut golden = Golden(NpzReader::new(File::open(folder.join("golden.npz")).unwrap()).unwrap());
    let tolerance = golden.number("tolerance");
    let manifest = Manifest::read(folder).unwrap_or_else(|e| panic!("{e}"));
    let roles = manifest.for_clips();
    let options = OpenOptions { roles: &roles, ..OpenOptions::default() };
    let mut model = Model::open(&runtime(), manifest.clone(), &options).unwrap_or_else(|e| panic!("{name}: {e}"));

    let latents = model.encode(&golden.tensor("frames"), NEVER).unwrap();
    let expected = golden.tensor("latents");
    assert_eq!(latents.shape, expected.shape);
    near(&format!("{name} encode"), &latents.data, &expected.data, tolerance);

    let decoded = model.decode(&golden.tensor("latents_in"), NEVER).unwrap();
    let shape: Vec<i64> = decoded.shape.iter().map(|&d| d as i64).collect();
    assert_eq!(shape, golden.of::<i64>("decoded_shape").1);
    let at = golden.of::<i64>("decoded_at").1;
    let index = |p: &[i64]| p.iter().zip(&shape).fold(0, |at, (i, n)| at * n + i) as usize;
    let got: Vec<f32> = at.chunks(4).map(|p| decoded.data[index(p)]).collect();
    near(&format!("{name} decode"), &got, &golden.of::<f32>("decoded").1, tolerance);

    let z = golden.tensor("z");
    let frame = golden.tensor("image_frame");
    let [height, width] = [frame.shape[2], frame.shape[3]];
    let separate = usize::from(manifest.latent.first == physvideo_net::FirstLatent::Separate);
    let frames = 1 + (z.shape[1] + separate - 1) * manifest.latent.temporal;
    let grid = manifest.grid(frames, height, width).unwrap();
    assert_eq!([grid.frames, grid.height, grid.width], z.shape[1..]);
    let encoded = model.encode(&frame, NEVER).unwrap();
    let expected = golden.tensor("image_encoded");
    assert_eq!(encoded.shape, expected.shape);
    near(&format!("{name} image"), &encoded.data, &expected.data, tolerance);

    let schedule = manifest.schedule(grid).unwrap();
    let sigmas = golden.of::<f64>("schedule").1;
    assert_eq!(schedule.steps() + 1, sigmas.len());
    for (i, expected) in sigmas.iter().enumerate() {
        assert!((schedule.sigma(StepIndex(i)).value() - expected).abs() < 1e-9, "{name} sigma[{i}]");
    }

    let guidance = golden.number("guidance");
    let mut c = Conditioning::on_image(grid, golden.tensor("image"));
    c.image_frame = Some(frame);
    c.padding = golden.of::<i64>("padding").1[0] as usize;
    c.guidance = (guidance > 0.0).then_some(guidance);
    c.history = golden.has("history").then(|| golden.tensor("history"));
    let inputs = model.condition(c, NEVER).unwrap();
    let two = golden.has("v_unconditional");
    assert_eq!(inputs.cfg(), two.then_some(guidance));
    let sigmas = golden.of::<f64>("sigma").1;
    let mut first = Vec::new();
    for (branch, key) in [(Branch::Conditional, "v_conditional"), (Branch::Unconditional, "v_unconditional")] {
        if branch == Branch::Unconditional && !two {
            continue;
        }
        let expected = golden.of::<f32>(key).1;
        for (sigma, expected) in sigmas.iter().zip(expected.chunks(inputs.len())) {
            let sigma = Sigma::new(*sigma).unwrap();
            let mut out = Vec::new();
            model.evaluate(&inputs, &z.data, sigma, branch, &mut out, NEVER).unwrap_or_else(|e| panic!("{name}: {e}"));
            let c = inputs.coefficients(sigma);
            let v = |(p, z): (&f32, &f32)| (c.prediction * f64::from(*p) + c.latent * f64::from(*z)) as f32;
            let v: Vec<f32> = out.iter().zip(&z.data).map(v).collect();
            near(&format!("{name} {key} at {}", sigma.value()), &v, expected, tolerance);
            if sigma.value() == sigmas[0] {
                first.push(v);
            }
        }
    }
    if let [conditional, unconditional] = &first[..] {
        let mixed = |(c, u): (&f32, &f32)| (f64::from(*u) + guidance * (f64::from(*c) - f64::from(*u))) as f32;
        let v: Vec<f32> = conditional.iter().zip(unconditional).map(mixed).collect();
        // Guidance multiplies what differs.
        near(&format!("{name} v"), &v, &golden.of::<f32>("v").1[..v.len()], tolerance * (1.0 + guidance));
    }
}

#[test]
fn every_contract_gives_the_golden_answers() {
    let folders = folders("tests/models");
    assert!(folders.len() >= 6);
    folders.iter().for_each(|folder| contract(folder));
}

#[test]
fn every_contract_passes_the_check() {
    for folder in folders("tests/models") {
        let lines = check(Some(&runtime()), &Manifest::read(&folder).unwrap());
        assert!(lines.iter().all(|l| l.status == Status::Good), "{lines:#?}");
    }
}

#[test]
fn the_manifests_of_published_models_are_right() {
    for folder in folders("assets/models") {
        Manifest::read(&folder).unwrap_or_else(|e| panic!("{e}"));
    }
}
