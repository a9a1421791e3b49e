//! Writes small ONNX files, field by field. Knows only what the tests here need of the format.

/// Element types.
pub const F32: u64 = 1;
pub const I64: u64 = 7;
pub const BOOL: u64 = 9;
pub const F16: u64 = 10;
pub const F64: u64 = 11;
pub const BF16: u64 = 16;

/// A graph in the making.
#[derive(Default)]
pub struct Graph {
    bytes: Vec<u8>,
    nodes: usize,
}

/// An attribute of a node.
pub enum Attribute<'a> {
    Int(i64),
    Ints(&'a [i64]),
    Text(&'a str),
    Graph(Graph),
}

impl Graph {
    /// An input; an axis of -1 is left open.
    pub fn input(mut self, name: &str, element: u64, shape: &[i64]) -> Self {
        self.bytes.extend(field(11, &value_info(name, element, shape)));
        self
    }

    pub fn output(mut self, name: &str, element: u64, shape: &[i64]) -> Self {
        self.bytes.extend(field(12, &value_info(name, element, shape)));
        self
    }

    pub fn node(self, op: &str, inputs: &[&str], output: &str) -> Self {
        self.node_with(op, inputs, &[output], &[])
    }

    pub fn node_with(mut self, op: &str, inputs: &[&str], outputs: &[&str], with: &[(&str, Attribute<'_>)]) -> Self {
        let mut node = Vec::new();
        inputs.iter().for_each(|i| node.extend(field(1, i.as_bytes())));
        outputs.iter().for_each(|o| node.extend(field(2, o.as_bytes())));
        self.nodes += 1;
        node.extend(field(3, format!("{op}_{}", self.nodes).as_bytes()));
        node.extend(field(4, op.as_bytes()));
        for (name, value) in with {
            let mut attribute = field(1, name.as_bytes());
            match value {
                Attribute::Int(i) => attribute.extend([number(3, *i as u64), number(20, 2)].concat()),
                Attribute::Ints(list) => {
                    list.iter().for_each(|i| attribute.extend(number(8, *i as u64)));
                    attribute.extend(number(20, 7));
                }
                Attribute::Text(text) => attribute.extend([field(4, text.as_bytes()), number(20, 3)].concat()),
                Attribute::Graph(graph) => {
                    let named = [graph.bytes.clone(), field(2, b"body")].concat();
                    attribute.extend([field(6, &named), number(20, 5)].concat());
                }
            }
            node.extend(field(5, &attribute));
        }
        self.bytes.extend(field(1, &node));
        self
    }

    pub fn floats(self, name: &str, shape: &[i64], values: &[f32]) -> Self {
        self.weights(name, F32, shape, &values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>())
    }

    pub fn ints(self, name: &str, values: &[i64]) -> Self {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.weights(name, I64, &[values.len() as i64], &bytes)
    }

    /// A number without axes.
    pub fn int(self, name: &str, value: i64) -> Self {
        self.weights(name, I64, &[], &value.to_le_bytes())
    }

    pub fn weights(mut self, name: &str, element: u64, shape: &[i64], raw: &[u8]) -> Self {
        let tensor = [tensor(name, element, shape), field(9, raw)].concat();
        self.bytes.extend(field(5, &tensor));
        self
    }

    /// Floats that lie in another file.
    pub fn external(mut self, name: &str, shape: &[i64], location: &str) -> Self {
        let entry = [field(1, b"location"), field(2, location.as_bytes())].concat();
        let tensor = [tensor(name, F32, shape), field(13, &entry), number(14, 1)].concat();
        self.bytes.extend(field(5, &tensor));
        self
    }

    /// The file.
    pub fn file(self) -> Vec<u8> {
        let graph = [self.bytes, field(2, b"toy")].concat();
        let opset = [field(1, b""), number(2, 18)].concat();
        [number(1, 9), field(7, &graph), field(8, &opset)].concat()
    }
}

fn tensor(name: &str, element: u64, shape: &[i64]) -> Vec<u8> {
    let axes: Vec<u8> = shape.iter().flat_map(|&d| number(1, d as u64)).collect();
    [axes, number(2, element), field(8, name.as_bytes())].concat()
}

fn value_info(name: &str, element: u64, shape: &[i64]) -> Vec<u8> {
    let axis = |(i, &d): (usize, &i64)| {
        let axis = if d < 0 { field(2, format!("{name}_{i}").as_bytes()) } else { number(1, d as u64) };
        field(1, &axis)
    };
    let shape: Vec<u8> = shape.iter().enumerate().flat_map(axis).collect();
    let kind = field(1, &[number(1, element), field(2, &shape)].concat());
    [field(1, name.as_bytes()), field(2, &kind)].concat()
}

fn field(number: u64, bytes: &[u8]) -> Vec<u8> {
    [varint(number << 3 | 2), varint(bytes.len() as u64), bytes.to_vec()].concat()
}

fn number(field: u64, value: u64) -> Vec<u8> {
    [varint(field << 3), varint(value)].concat()
}

fn varint(mut value: u64) -> Vec<u8> {
    let mut out = Vec::new();
    loop {
        let byte = (value & 0x7f) as u8;
        value >>= 7;
        out.push(if value == 0 { byte } else { byte | 0x80 });
        if value == 0 {
            return out;
        }
    }
}
