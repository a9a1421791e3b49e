//! Looks whether a model's files are what its manifest says, without running it. Prints nothing.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use crate::chain::Graph;
use crate::contract::{contradictions, expected};
use crate::embeddings::{Embeddings, constant_of_model};
use crate::error::NetError;
use crate::files::Folder;
use crate::library::Runtime;
use crate::manifest::{FileSpec, GraphSpec, Manifest, Role, Source};
use crate::model::{Model, OpenOptions, free_memory};

/// How a look at one thing ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// As the manifest says.
    Good,
    /// Usable, with something to know.
    Warning,
    /// Not usable.
    Bad,
    /// None of the model's files is here.
    Absent,
}

/// One thing that was looked at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CheckLine {
    /// The role it belongs to, or none.
    pub role: Option<Role>,
    /// How it ended.
    pub status: Status,
    /// What was looked at and found.
    pub text: String,
}

/// Reads the manifest of a folder and checks its model; what is wrong with the manifest is a line, too.
pub fn check_folder(runtime: Option<&Runtime>, folder: &Path) -> Vec<CheckLine> {
    match Manifest::read(folder) {
        Ok(manifest) => check(runtime, &manifest),
        Err(NetError::Manifest(errors)) => {
            errors.to_string().lines().map(|l| line(None, Status::Bad, l.to_owned())).collect()
        }
        Err(e) => vec![line(None, Status::Bad, e.to_string())],
    }
}

/// Checks every file of a model, its tensors and the memory it needs. With a runtime, loads each role to see that ONNX
/// Runtime takes it, if the memory suffices.
pub fn check(runtime: Option<&Runtime>, manifest: &Manifest) -> Vec<CheckLine> {
    let never = AtomicBool::new(false);
    let folder = Folder::new(&manifest.folder);
    let mut lines = Vec::new();
    if manifest.files().all(|file| matches!(folder.open(&file.file), Err(NetError::MissingFile { .. }))) {
        let obtain = if manifest.obtain.is_empty() { "the manifest does not say" } else { &manifest.obtain };
        return vec![line(
            None,
            Status::Absent,
            format!("none of its files is here. How to get them:\n{}", obtain.trim()),
        )];
    }
    for role in Role::ALL {
        let Some(spec) = manifest.role(role) else { continue };
        let before = lines.len();
        files(manifest, role, &folder, &never, &mut lines);
        if role == Role::Velocity {
            arrays(manifest, &folder, &mut lines);
        }
        let whole = lines.iter().skip(before).all(|l| l.status != Status::Bad);
        let need = crate::chain::memory(&folder, spec).ok();
        if let Some(need) = need {
            let available = free_memory();
            let enough = available.is_none_or(|available| need <= available);
            let have = available.map_or(String::new(), |a| format!(", {} are available", bytes(a)));
            let status = if enough { Status::Good } else { Status::Warning };
            lines.push(line(Some(role), status, format!("needs about {} of memory{have}", bytes(need))));
            if let Some(runtime) = runtime.filter(|_| whole && enough) {
                lines.push(loads(runtime, manifest, role));
            }
        }
    }
    lines
}

fn files(manifest: &Manifest, role: Role, folder: &Folder, never: &AtomicBool, lines: &mut Vec<CheckLine>) {
    let Some(spec) = manifest.role(role) else { return };
    let mut graphs = Vec::new();
    for spec in &spec.graphs {
        let before = lines.len();
        for file in std::iter::once(&spec.file).chain(&spec.data) {
            lines.push(of_file(role, folder, file, never));
        }
        if lines.iter().skip(before).any(|l| l.status == Status::Bad) {
            continue;
        }
        // The hashes were looked at.
        match Graph::open(folder, &without_hashes(spec), never) {
            Ok((graph, _)) => {
                for data in &spec.data {
                    let beside = Path::new(&spec.file.file).parent().unwrap_or(Path::new(""));
                    if !graph.info.external.iter().any(|place| Path::new(&data.file) == beside.join(place)) {
                        let text = format!("{}: the graph reads nothing from it", data.file);
                        lines.push(line(Some(role), Status::Warning, text));
                    }
                }
                graphs.push(graph);
            }
            Err(e) => lines.push(line(Some(role), Status::Bad, e.to_string())),
        }
    }
    if graphs.len() < spec.graphs.len() {
        return;
    }
    let (inputs, output) = expected(manifest, role);
    let infos: Vec<_> = graphs.iter().map(|g| &g.info).collect();
    let found = contradictions(&infos, &inputs, output.as_ref());
    if found.is_empty() {
        let inputs = if inputs.len() == 1 { "the input".to_owned() } else { format!("{} inputs", inputs.len()) };
        let text = format!("{inputs} and the output are those of the manifest");
        lines.push(line(Some(role), Status::Good, text));
    }
    for c in found {
        let path = graphs.get(c.graph).map(|g| g.path.display().to_string()).unwrap_or_default();
        lines.push(line(Some(role), Status::Bad, format!("{path}: tensor `{}`: {}", c.tensor, c.why)));
    }
}

/// Whether a file is there, and is the one the manifest means.
fn of_file(role: Role, folder: &Folder, spec: &FileSpec, never: &AtomicBool) -> CheckLine {
    let opened = folder.open(&spec.file).and_then(|mut file| match &spec.sha256 {
        None => Ok((file.size, true)),
        Some(expected) => match file.sha256(never)? {
            found if found == *expected => Ok((file.size, false)),
            found => Err(NetError::Hash { path: file.path, expected: expected.clone(), found }),
        },
    });
    match opened {
        Ok((size, true)) => {
            let text = format!("{}: {}, its SHA-256 is not in the manifest", spec.file, bytes(size));
            line(Some(role), Status::Warning, text)
        }
        Ok((size, false)) => {
            line(Some(role), Status::Good, format!("{}: {}, SHA-256 as meant", spec.file, bytes(size)))
        }
        Err(e) => line(Some(role), Status::Bad, e.to_string()),
    }
}

fn without_hashes(spec: &GraphSpec) -> GraphSpec {
    let mut spec = spec.clone();
    std::iter::once(&mut spec.file).chain(&mut spec.data).for_each(|file| file.sha256 = None);
    spec
}

/// The model's own arrays, and whether every key is there.
fn arrays(manifest: &Manifest, folder: &Folder, lines: &mut Vec<CheckLine>) {
    let Some(velocity) = &manifest.velocity else { return };
    let mut keys = Vec::new();
    for file in [&velocity.embeddings, &velocity.negative].into_iter().flatten() {
        match Embeddings::of_model(folder, file) {
            Ok(arrays) => {
                keys.extend(arrays.keys().map(str::to_owned));
                let text = format!("{file}: {}", arrays.keys().collect::<Vec<_>>().join(", "));
                lines.push(line(Some(Role::Velocity), Status::Good, text));
            }
            Err(e) => lines.push(line(Some(Role::Velocity), Status::Bad, e.to_string())),
        }
    }
    for input in &velocity.inputs {
        match &input.source {
            Source::Embedding { key, optional_zeros: None } if !keys.contains(key) => {
                let text = format!("input `{}` needs an embedding `{key}`, which the user must bring", input.name);
                lines.push(line(Some(Role::Velocity), Status::Warning, text));
            }
            Source::ConstantFile { file } => match constant_of_model(folder, file) {
                Ok(array) => {
                    let text = format!("{file}: {:?}", array.shape);
                    lines.push(line(Some(Role::Velocity), Status::Good, text));
                }
                Err(e) => lines.push(line(Some(Role::Velocity), Status::Bad, e.to_string())),
            },
            _ => {}
        }
    }
}

fn loads(runtime: &Runtime, manifest: &Manifest, role: Role) -> CheckLine {
    let options = OpenOptions { roles: &[role], ..OpenOptions::default() };
    let mut manifest = manifest.clone();
    let codecs = [&mut manifest.encode, &mut manifest.encode_image, &mut manifest.decode]
        .into_iter()
        .flatten()
        .map(|codec| &mut codec.role);
    for role in codecs.chain(manifest.velocity.iter_mut().map(|velocity| &mut velocity.role)) {
        role.graphs.iter_mut().for_each(|graph| *graph = without_hashes(graph));
    }
    let never = AtomicBool::new(false);
    match Model::open(runtime, manifest, &options).and_then(|mut model| model.try_each(&never)) {
        Ok(()) => line(Some(role), Status::Good, format!("ONNX Runtime {} loads it", runtime.version())),
        Err(e) => line(Some(role), Status::Bad, e.to_string()),
    }
}

fn line(role: Option<Role>, status: Status, text: String) -> CheckLine {
    CheckLine { role, status, text }
}

fn bytes(n: u64) -> String {
    match n {
        0..10_000 => format!("{n} bytes"),
        10_000..10_000_000 => format!("{:.1} KB", n as f64 / 1e3),
        10_000_000..10_000_000_000 => format!("{:.1} MB", n as f64 / 1e6),
        _ => format!("{:.1} GB", n as f64 / 1e9),
    }
}
