//! The graphs of one role as a chain: what an earlier graph makes feeds the inputs of that name of later ones. Knows
//! files and names, and no meaning of a tensor.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use crate::array::Array;
use crate::error::NetError;
use crate::files::{Folder, PlainFile, sha256};
use crate::library::Runtime;
use crate::manifest::{FileSpec, GraphSpec, Load, Manifest, Role, RoleSpec};
use crate::model::has_no;
use crate::onnx::{self, GraphInfo};
use crate::session::{Feed, Session, copy, copy_floats};

/// Largest graph file: protobuf has no larger message. Weights beyond lie in external data.
const LARGEST_GRAPH: u64 = (1 << 31) - 1;

/// The graphs of a role.
#[derive(Debug)]
pub(crate) struct Chain(Vec<Graph>);

/// A graph and its files.
#[derive(Debug)]
pub(crate) struct Graph {
    pub path: PathBuf,
    pub info: GraphInfo,
    sha256: Option<String>,
    file: PlainFile,
    data: Vec<PlainFile>,
    session: Option<Session>,
}

/// Bytes a role needs when loaded: what its manifest says, else the sizes of its files. Opens them, reads nothing.
pub(crate) fn memory(folder: &Folder, role: &RoleSpec) -> Result<u64, NetError> {
    if let Some(memory) = role.memory {
        return Ok(memory);
    }
    let mut sizes = Vec::new();
    for graph in &role.graphs {
        let mut size = folder.open(&graph.file.file)?.size;
        for data in &graph.data {
            size = size.saturating_add(folder.open(&data.file)?.size);
        }
        sizes.push(size);
    }
    Ok(match role.load {
        Load::Together => sizes.iter().fold(0, |sum, &size| sum.saturating_add(size)),
        Load::InTurn => sizes.iter().copied().max().unwrap_or(0),
    })
}

impl Manifest {
    /// Bytes the networks of these roles take when loaded.
    ///
    /// # Errors
    /// A role the model has not, or a file that is not there.
    pub fn memory(&self, roles: &[Role]) -> Result<u64, NetError> {
        let folder = Folder::new(&self.folder);
        let of = |role: Role| memory(&folder, self.role(role).ok_or_else(|| has_no(self, role))?);
        roles.iter().try_fold(0u64, |sum, &role| Ok(sum.saturating_add(of(role)?))).map_err(|e| match e {
            NetError::MissingFile { path, .. } => NetError::MissingFile { path, obtain: self.obtain.clone() },
            other => other,
        })
    }
}

impl Graph {
    /// Opens the files of a graph, checks their hashes and what the graph says about itself. Loads no session.
    pub fn open(folder: &Folder, spec: &GraphSpec, cancel: &AtomicBool) -> Result<(Self, Vec<u8>), NetError> {
        let mut file = folder.open(&spec.file.file)?;
        let bytes = read_graph(&mut file, spec.file.sha256.as_deref())?;
        let info = onnx::scan(&bytes).map_err(|why| NetError::File { path: file.path.clone(), why })?;
        let mut data = Vec::new();
        for spec in &spec.data {
            data.push(open_hashed(folder, spec, cancel)?);
        }
        // Places are relative to the graph's own folder.
        let beside = Path::new(&spec.file.file).parent().unwrap_or(Path::new(""));
        for place in &info.external {
            let known =
                crate::files::stays_inside(place) && spec.data.iter().any(|d| Path::new(&d.file) == beside.join(place));
            if !known {
                let why = format!("has weights in {place:?}, which the manifest does not name among its `data`");
                return Err(NetError::File { path: file.path.clone(), why });
            }
        }
        let sha256 = spec.file.sha256.clone();
        Ok((Self { path: file.path.clone(), info, sha256, file, data, session: None }, bytes))
    }

    fn load(&self, runtime: &Runtime, bytes: &[u8], cancel: &AtomicBool) -> Result<Session, NetError> {
        let session = Session::load(runtime, &self.path, bytes, cancel)?;
        // ONNX Runtime opened the data by name: it must still be what was hashed.
        self.data.iter().try_for_each(PlainFile::unchanged)?;
        Ok(session)
    }
}

fn open_hashed(folder: &Folder, spec: &FileSpec, cancel: &AtomicBool) -> Result<PlainFile, NetError> {
    let mut file = folder.open(&spec.file)?;
    if let Some(expected) = &spec.sha256 {
        let found = file.sha256(cancel)?;
        same_hash(&file.path, expected, found)?;
    }
    Ok(file)
}

fn read_graph(file: &mut PlainFile, expected: Option<&str>) -> Result<Vec<u8>, NetError> {
    let bytes = file.read(LARGEST_GRAPH)?;
    if let Some(expected) = expected {
        same_hash(&file.path, expected, sha256(&bytes))?;
    }
    Ok(bytes)
}

/// The same at a later call: the file must be the one that was opened.
fn read_again(file: &mut PlainFile, expected: Option<&str>) -> Result<Vec<u8>, NetError> {
    file.unchanged()?;
    read_graph(file, expected)
}

fn same_hash(path: &Path, expected: &str, found: String) -> Result<(), NetError> {
    if expected == found {
        return Ok(());
    }
    Err(NetError::Hash { path: path.to_path_buf(), expected: expected.to_owned(), found })
}

impl Chain {
    /// Opens the files of a role; loads its graphs unless they are loaded in turn. `agree` is asked before any is.
    pub fn open(
        runtime: &Runtime,
        folder: &Folder,
        role: &RoleSpec,
        agree: impl FnOnce(&[Graph]) -> Result<(), NetError>,
        cancel: &AtomicBool,
    ) -> Result<Self, NetError> {
        let mut graphs = Vec::new();
        let mut held = Vec::new();
        for spec in &role.graphs {
            let (graph, bytes) = Graph::open(folder, spec, cancel)?;
            graphs.push(graph);
            // Graphs loaded in turn are read again then; they may be too big to hold at once.
            held.push(if role.load == Load::Together { bytes } else { Vec::new() });
        }
        agree(&graphs)?;
        if role.load == Load::Together {
            for (graph, bytes) in graphs.iter_mut().zip(held) {
                graph.session = Some(graph.load(runtime, &bytes, cancel)?);
            }
        }
        Ok(Self(graphs))
    }

    /// Loads every graph that is not loaded, one after the other, to see that it can be.
    pub fn try_each(&mut self, runtime: &Runtime, cancel: &AtomicBool) -> Result<(), NetError> {
        for graph in self.0.iter_mut().filter(|graph| graph.session.is_none()) {
            let bytes = read_again(&mut graph.file, graph.sha256.as_deref())?;
            graph.load(runtime, &bytes, cancel)?;
        }
        Ok(())
    }

    /// Runs the graphs. Gives the shape of `wanted` and puts its numbers, as floats, into `out`.
    pub fn run(
        &mut self,
        runtime: &Runtime,
        inputs: &[(&str, Feed<'_>)],
        wanted: &str,
        out: &mut Vec<f32>,
        cancel: &AtomicBool,
    ) -> Result<Vec<usize>, NetError> {
        let mut made: BTreeMap<String, Array> = BTreeMap::new();
        let mut shape = None;
        for i in 0..self.0.len() {
            let later: Vec<String> = self.passed_on(i);
            let graph = &mut self.0[i];
            let feeds = feeds(&graph.path, &graph.info, inputs, &made)?;
            let mut fresh;
            let session = match &mut graph.session {
                Some(session) => session,
                None => {
                    let bytes = read_again(&mut graph.file, graph.sha256.as_deref())?;
                    fresh = graph.load(runtime, &bytes, cancel)?;
                    &mut fresh
                }
            };
            let is_last = graph.info.outputs.iter().any(|o| o.name == wanted);
            let mut names: Vec<&str> = later.iter().map(String::as_str).collect();
            if is_last && !names.contains(&wanted) {
                names.push(wanted);
            }
            let values = session.run(&feeds, &names, cancel)?;
            let told =
                |name: &str, why: String| NetError::Contract { path: graph.path.clone(), tensor: name.to_owned(), why };
            for (name, value) in names.iter().zip(values) {
                if later.iter().any(|l| l == name) {
                    made.insert((*name).to_owned(), copy(&value).map_err(|why| told(name, why))?);
                }
                if *name == wanted {
                    shape = Some(copy_floats(&value, out).map_err(|why| told(name, why))?);
                }
            }
        }
        shape.ok_or_else(|| NetError::Contract {
            path: self.0.last().map(|g| g.path.clone()).unwrap_or_default(),
            tensor: wanted.to_owned(),
            why: "no graph has this output".into(),
        })
    }

    /// Outputs of a graph that later graphs read.
    fn passed_on(&self, i: usize) -> Vec<String> {
        let later = self.0.get(i + 1..).unwrap_or_default();
        let is_read = |name: &str| later.iter().any(|g| g.info.inputs.iter().any(|p| p.name == name));
        let outputs = self.0[i].info.outputs.iter();
        outputs.filter(|o| is_read(&o.name)).map(|o| o.name.clone()).collect()
    }
}

/// What a graph is given, each checked against the shape it declares.
fn feeds<'a>(
    path: &Path,
    info: &'a GraphInfo,
    inputs: &[(&str, Feed<'a>)],
    made: &'a BTreeMap<String, Array>,
) -> Result<Vec<(&'a str, Feed<'a>)>, NetError> {
    let mut feeds = Vec::new();
    for port in &info.inputs {
        let told = |why: String| NetError::Contract { path: path.to_path_buf(), tensor: port.name.clone(), why };
        let given = inputs.iter().find(|(name, _)| *name == port.name).map(|(_, feed)| *feed);
        let Some(feed) = given.or_else(|| made.get(&port.name).map(Feed::Array)) else {
            if port.optional {
                continue;
            }
            return Err(told("is needed by the graph, and neither the manifest nor an earlier graph gives it".into()));
        };
        if let Some(shape) = &port.shape {
            let shape_fits = shape.len() == feed.shape().len()
                && shape.iter().zip(feed.shape()).all(|(want, &have)| want.is_none_or(|w| w as u64 == have as u64));
            if !shape_fits {
                return Err(told(format!("the graph takes {}, and is given {:?}", port.shape_text(), feed.shape())));
            }
        }
        feeds.push((port.name.as_str(), feed));
    }
    Ok(feeds)
}
