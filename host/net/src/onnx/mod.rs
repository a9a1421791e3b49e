//! What an ONNX file says about itself: its inputs, outputs and the files it names. Builds no graph and trusts no byte.
//!
//! Read before ONNX Runtime sees the file, since a graph may name any file or address as the place of its weights.

mod wire;

use std::collections::BTreeSet;

use wire::{Damaged, Field, Message};

/// Graphs in attributes of nodes of graphs: deeper than any exporter goes.
const DEEPEST: usize = 48;
/// Most of what is listed.
const MOST: usize = 100_000;

/// What a graph says about itself.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct GraphInfo {
    /// What must be given, and what may be (it has a default in the file).
    pub inputs: Vec<Port>,
    /// What comes out.
    pub outputs: Vec<Port>,
    /// Places of weights outside the file.
    pub external: BTreeSet<String>,
}

/// An input or output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Port {
    pub name: String,
    /// The element type's number in ONNX.
    pub element: i64,
    /// Length of each axis, `None` where it is left open; `None` for an unknown rank.
    pub shape: Option<Vec<Option<i64>>>,
    /// Whether the file has a default.
    pub optional: bool,
}

impl Port {
    /// The shape for people: `[1, 16, ?, 32, 32]`.
    pub fn shape_text(&self) -> String {
        let Some(shape) = &self.shape else { return "of unknown rank".into() };
        let axes: Vec<_> = shape.iter().map(|d| d.map_or("?".into(), |d| d.to_string())).collect();
        format!("[{}]", axes.join(", "))
    }

    /// The element type for people.
    pub fn element_text(&self) -> &'static str {
        const NAMES: [&str; 17] = [
            "nothing",
            "f32",
            "u8",
            "i8",
            "u16",
            "i16",
            "i32",
            "i64",
            "text",
            "bool",
            "f16",
            "f64",
            "u32",
            "u64",
            "complex64",
            "complex128",
            "bf16",
        ];
        usize::try_from(self.element).ok().and_then(|i| NAMES.get(i)).copied().unwrap_or("an unknown type")
    }
}

/// Reads what a graph says about itself.
pub(crate) fn scan(bytes: &[u8]) -> Result<GraphInfo, String> {
    // ONNX Runtime would read another format where these letters stand, whatever else the bytes mean.
    if bytes.get(4..8) == Some(b"ORTM") {
        return Err("is in ONNX Runtime's own format, which cannot be checked; export it as ONNX".into());
    }
    let mut info = GraphInfo::default();
    let mut graphs = 0;
    let outcome = (|| {
        for field in Message::new(bytes) {
            match field? {
                Field::Bytes(7, graph) => {
                    graphs += 1;
                    main_graph(graph, &mut info)?;
                }
                // Functions, and graphs of training.
                Field::Bytes(25, function) => nodes_of(function, &[7], &[11], &mut info, 0)?,
                Field::Bytes(20, training) => {
                    for field in Message::new(training) {
                        if let Field::Bytes(1 | 2, graph) = field? {
                            sub_graph(graph, &mut info, 0)?;
                        }
                    }
                }
                _ => {}
            }
        }
        Ok(())
    })();
    match outcome {
        Err(Damaged(why)) => Err(why.to_owned()),
        Ok(()) if graphs != 1 => Err(if graphs == 0 { "holds no graph" } else { "holds two graphs" }.to_owned()),
        Ok(()) => Ok(info),
    }
}

fn main_graph(graph: &[u8], info: &mut GraphInfo) -> Result<(), Damaged> {
    let mut defaults = BTreeSet::new();
    for field in Message::new(graph) {
        match field? {
            Field::Bytes(11, port) => push(&mut info.inputs, value_info(port)?)?,
            Field::Bytes(12, port) => push(&mut info.outputs, value_info(port)?)?,
            Field::Bytes(5, tensor) => {
                if let Some(name) = text_field(tensor, 8)? {
                    if defaults.len() >= MOST {
                        return Err(Damaged("lists too many tensors"));
                    }
                    defaults.insert(name);
                }
            }
            _ => {}
        }
    }
    info.inputs.iter_mut().for_each(|port| port.optional = defaults.contains(&port.name));
    sub_graph(graph, info, 0)
}

/// Initializers, sparse initializers and nodes of a graph.
fn sub_graph(graph: &[u8], info: &mut GraphInfo, depth: usize) -> Result<(), Damaged> {
    for field in Message::new(graph) {
        match field? {
            Field::Bytes(5, tensor) => weights(tensor, info)?,
            Field::Bytes(15, sparse) => sparse_weights(sparse, info)?,
            _ => {}
        }
    }
    nodes_of(graph, &[1], &[], info, depth)
}

/// Nodes, and attributes that stand beside them, of a graph or function.
fn nodes_of(
    message: &[u8],
    nodes: &[u32],
    attributes: &[u32],
    info: &mut GraphInfo,
    depth: usize,
) -> Result<(), Damaged> {
    for field in Message::new(message) {
        match field? {
            Field::Bytes(number, node) if nodes.contains(&number) => {
                // A node of this kind runs a compiled file of another program.
                if text_field(node, 4)?.as_deref() == Some("EPContext") {
                    return Err(Damaged("holds a compiled part (EPContext), which cannot be checked"));
                }
                nodes_of(node, &[], &[5], info, depth)?;
            }
            Field::Bytes(number, attribute) if attributes.contains(&number) => of_attribute(attribute, info, depth)?,
            _ => {}
        }
    }
    Ok(())
}

fn of_attribute(attribute: &[u8], info: &mut GraphInfo, depth: usize) -> Result<(), Damaged> {
    for field in Message::new(attribute) {
        match field? {
            Field::Bytes(5 | 10, tensor) => weights(tensor, info)?,
            Field::Bytes(22 | 23, sparse) => sparse_weights(sparse, info)?,
            Field::Bytes(6 | 11, _) if depth >= DEEPEST => return Err(Damaged("nests graphs too deeply")),
            Field::Bytes(6 | 11, graph) => sub_graph(graph, info, depth + 1)?,
            _ => {}
        }
    }
    Ok(())
}

fn sparse_weights(sparse: &[u8], info: &mut GraphInfo) -> Result<(), Damaged> {
    for field in Message::new(sparse) {
        if let Field::Bytes(1 | 2, tensor) = field? {
            weights(tensor, info)?;
        }
    }
    Ok(())
}

/// Notes where a tensor's numbers lie, if not in the file.
fn weights(tensor: &[u8], info: &mut GraphInfo) -> Result<(), Damaged> {
    for field in Message::new(tensor) {
        let Field::Bytes(13, entry) = field? else { continue };
        let place = text_field(entry, 2)?;
        if text_field(entry, 1)?.as_deref() == Some("location") {
            if info.external.len() >= MOST {
                return Err(Damaged("names too many files"));
            }
            info.external.insert(place.unwrap_or_default());
        }
    }
    Ok(())
}

fn push(ports: &mut Vec<Port>, port: Port) -> Result<(), Damaged> {
    if ports.len() >= 1024 {
        return Err(Damaged("has more than 1024 inputs or outputs"));
    }
    ports.push(port);
    Ok(())
}

/// ValueInfoProto: 1 name, 2 type { 1 tensor { 1 element type, 2 shape } }.
fn value_info(message: &[u8]) -> Result<Port, Damaged> {
    let mut port = Port { name: String::new(), element: 0, shape: None, optional: false };
    for field in Message::new(message) {
        match field? {
            Field::Bytes(1, name) => port.name = text(name)?,
            Field::Bytes(2, kind) => {
                for field in Message::new(kind) {
                    if let Field::Bytes(1, tensor) = field? {
                        tensor_type(tensor, &mut port)?;
                    }
                }
            }
            _ => {}
        }
    }
    Ok(port)
}

fn tensor_type(message: &[u8], port: &mut Port) -> Result<(), Damaged> {
    for field in Message::new(message) {
        match field? {
            Field::Number(1, element) => port.element = element as i64,
            Field::Bytes(2, shape) => {
                let axes = port.shape.get_or_insert_with(Vec::new);
                for field in Message::new(shape) {
                    if let Field::Bytes(1, axis) = field? {
                        if axes.len() >= 64 {
                            return Err(Damaged("has a tensor of more than 64 axes"));
                        }
                        axes.push(axis_length(axis)?);
                    }
                }
            }
            _ => {}
        }
    }
    Ok(())
}

fn axis_length(message: &[u8]) -> Result<Option<i64>, Damaged> {
    let mut length = None;
    for field in Message::new(message) {
        match field? {
            // Exporters write -1 for an open axis, too.
            Field::Number(1, value) => length = Some(value as i64).filter(|&v| v >= 0),
            Field::Bytes(2, _) => length = None,
            _ => {}
        }
    }
    Ok(length)
}

/// The last text of a field, as protobuf has it.
fn text_field(message: &[u8], number: u32) -> Result<Option<String>, Damaged> {
    let mut last = None;
    for field in Message::new(message) {
        match field? {
            Field::Bytes(n, bytes) if n == number => last = Some(text(bytes)?),
            _ => {}
        }
    }
    Ok(last)
}

fn text(bytes: &[u8]) -> Result<String, Damaged> {
    if bytes.len() > 4096 {
        return Err(Damaged("holds a name of more than 4096 bytes"));
    }
    String::from_utf8(bytes.to_vec()).map_err(|_| Damaged("holds a name that is not UTF-8"))
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
