use super::*;

/// A length-delimited field.
fn field(number: u32, bytes: &[u8]) -> Vec<u8> {
    let mut out = varint(u64::from(number << 3 | 2));
    out.extend(varint(bytes.len() as u64));
    out.extend(bytes);
    out
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

fn external(location: &str) -> Vec<u8> {
    let entry = [field(1, b"location"), field(2, location.as_bytes())].concat();
    [field(8, b"w"), field(13, &entry)].concat()
}

fn in_attribute(graph: &[u8]) -> Vec<u8> {
    field(1, &field(5, &field(6, graph)))
}

fn model(graph: &[u8]) -> Vec<u8> {
    [vec![8, 9], field(7, graph)].concat()
}

fn places(bytes: &[u8]) -> Vec<String> {
    scan(bytes).unwrap().external.into_iter().collect()
}

#[test]
fn every_place_of_external_data_is_found() {
    let sparse = field(1, &external("sparse"));
    let graph = [
        field(5, &external("initializer")),
        field(15, &sparse),
        // A node: a tensor, tensors, a graph with a graph, sparse tensors.
        field(1, &field(5, &field(5, &external("attribute")))),
        field(1, &field(5, &field(10, &external("list")))),
        field(1, &field(5, &field(22, &field(2, &external("indices"))))),
        in_attribute(&in_attribute(&field(5, &external("nested")))),
        field(1, &field(5, &field(11, &field(5, &external("graphs"))))),
    ]
    .concat();
    let function =
        [field(7, &field(5, &field(5, &external("function")))), field(11, &field(5, &external("default")))].concat();
    let training = field(20, &field(2, &field(5, &external("training"))));
    let bytes = [model(&graph), field(25, &function), training].concat();
    let mut expected = vec![
        "initializer",
        "sparse",
        "attribute",
        "list",
        "indices",
        "nested",
        "graphs",
        "function",
        "default",
        "training",
    ];
    expected.sort_unstable();
    assert_eq!(places(&bytes), expected);
}

#[test]
fn an_address_is_a_place_like_any_other() {
    assert_eq!(places(&model(&field(5, &external("*/_ORT_MEM_ADDR_/*")))), ["*/_ORT_MEM_ADDR_/*"]);
    // A location without a value, and two locations of one tensor.
    let empty = field(13, &field(1, b"location"));
    assert_eq!(places(&model(&field(5, &empty))), [""]);
    let two = [external("a"), external("b")].concat();
    assert_eq!(places(&model(&field(5, &two))), ["a", "b"]);
}

#[test]
fn inputs_and_outputs_have_types_and_shapes() {
    let axis = |bytes: &[u8]| field(1, bytes);
    let shape = [axis(&[8, 1]), axis(&field(2, b"n")), axis(&[8, 7]), axis(&[])].concat();
    let kind = field(1, &[vec![8, 10], field(2, &shape)].concat());
    let port = [field(1, b"x"), field(2, &kind)].concat();
    let default = [field(1, b"w"), field(2, &kind)].concat();
    let graph = [field(11, &port), field(11, &default), field(12, &port), field(5, &field(8, b"w"))].concat();
    let info = scan(&model(&graph)).unwrap();
    assert_eq!(info.inputs[0].shape, Some(vec![Some(1), None, Some(7), None]));
    assert_eq!((info.inputs[0].element_text(), info.inputs[0].shape_text()), ("f16", "[1, ?, 7, ?]".into()));
    assert_eq!(info.inputs.iter().map(|p| p.optional).collect::<Vec<_>>(), [false, true]);
    assert_eq!(info.outputs.len(), 1);
}

#[test]
fn cut_bytes_never_panic() {
    let graph = [in_attribute(&field(5, &external("nested"))), field(11, &field(1, b"x"))].concat();
    let bytes = model(&graph);
    scan(&bytes).unwrap();
    for length in 0..bytes.len() {
        // What is cut at a field's end may still be a message, without a graph.
        let _ = scan(&bytes[..length]);
    }
    assert!(scan(&bytes[..bytes.len() - 1]).unwrap_err().contains("cut short"));
    assert_eq!(scan(&[]).unwrap_err(), "holds no graph");
    for byte in 0..bytes.len() {
        for value in [0x00, 0x7f, 0x80, 0xff] {
            let mut bytes = bytes.clone();
            bytes[byte] = value;
            let _ = scan(&bytes);
        }
    }
}

#[test]
fn deep_nesting_is_refused() {
    let mut graph = field(5, &external("deep"));
    for _ in 0..DEEPEST {
        graph = in_attribute(&graph);
    }
    assert_eq!(places(&model(&graph)), ["deep"]);
    for _ in 0..1000 {
        graph = in_attribute(&graph);
    }
    assert!(scan(&model(&graph)).unwrap_err().contains("deeply"));
}

#[test]
fn huge_numbers_are_refused() {
    // A length of 2^64 - 1, a number of eleven bytes, a tenth byte with too many bits, field 0.
    let length = [vec![7 << 3 | 2], varint(u64::MAX)].concat();
    assert!(scan(&length).unwrap_err().contains("cut short"));
    assert!(scan(&[0x80; 11]).unwrap_err().contains("digits"));
    let tenth = [vec![8], vec![0xff; 9], vec![2]].concat();
    assert!(scan(&tenth).unwrap_err().contains("digits"));
    assert!(scan(&[2, 0]).unwrap_err().contains("number"));
    assert!(scan(&[7 << 3 | 3]).unwrap_err().contains("damaged"));
    let long = field(7, &field(1, &field(4, &[b'a'; 5000])));
    assert!(scan(&long).unwrap_err().contains("4096"));
}

#[test]
fn compiled_parts_are_refused() {
    let node = field(1, &field(4, b"EPContext"));
    assert!(scan(&model(&node)).unwrap_err().contains("EPContext"));
}

#[test]
fn the_other_format_is_refused() {
    // A number that hides the letters of the other format in an ONNX file.
    let bytes = [field(15, b"..ORTM"), model(&[])].concat();
    assert!(scan(&bytes).unwrap_err().contains("own format"));
}

#[test]
fn one_graph_is_wanted() {
    assert_eq!(scan(&[model(&[]), model(&[])].concat()).unwrap_err(), "holds two graphs");
}
