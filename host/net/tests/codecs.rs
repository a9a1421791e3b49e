//! Encoder and decoder over small graphs: round trips, ranges, graphs for one frame.

mod toy;

use physvideo_net::{Role, Tensor};
use toy::onnx::{Attribute, F32, Graph};
use toy::{ENCODE, Folder, HEAD, NEVER, blocks, difference, toy};

#[test]
fn frames_come_back_from_latents() {
    let mut model = toy().model(&[Role::Encode, Role::Decode]);
    let frames = blocks([3, 2, 5], 1);
    let latents = model.encode(&frames, NEVER).unwrap();
    assert_eq!(latents.shape, [4, 3, 2, 5]);
    // Channel 0 is (red in -1..1 - 0.25) / 1; the frame of latent 1 is frame 1.
    let red = frames.data[10 * 4] * 2.0 - 1.0;
    assert!((latents.data[2 * 5] - (red - 0.25)).abs() < 1e-6);
    let again = model.decode(&latents, NEVER).unwrap();
    assert_eq!(again.shape, frames.shape);
    assert!(difference(&again.data, &frames.data) < 1e-6);
}

#[test]
fn a_clip_of_one_frame_may_have_graphs_of_its_own() {
    // It answers with red alone.
    let one = Graph::default()
        .input("video", F32, &[1, 3, 1, -1, -1])
        .output("latent", F32, &[1, 4, 1, -1, -1])
        .node_with(
            "AveragePool",
            &["video"],
            &["p"],
            &[("kernel_shape", Attribute::Ints(&[1, 2, 2])), ("strides", Attribute::Ints(&[1, 2, 2]))],
        )
        .ints("0", &[0])
        .ints("1", &[1])
        .node("Slice", &["p", "0", "1", "1"], "r")
        .node_with("Concat", &["r", "r", "r", "r"], &["latent"], &[("axis", Attribute::Int(1))]);
    let manifest = [HEAD, ENCODE].concat().replace("[encode]", "[encode]\nsingle_graphs = [{ file = \"one.onnx\" }]");
    let folder = Folder::new(&manifest, &[("encode.onnx", toy::encode()), ("one.onnx", one.file())]);
    let mut model = folder.model(&[Role::Encode]);
    // Channels 0 to 2 before they are scaled.
    let raw = |l: &Tensor| [l.data[0] + 0.25, l.data[l.shape[1]] * 2.0, l.data[2 * l.shape[1]]];
    let of_one = model.encode(&blocks([1, 1, 1], 1), NEVER).unwrap();
    assert_eq!(raw(&of_one), [raw(&of_one)[0]; 3]);
    let of_clip = model.encode(&blocks([2, 1, 1], 1), NEVER).unwrap();
    assert_ne!(raw(&of_clip)[0], raw(&of_clip)[1]);
    let lines = physvideo_net::check(Some(&toy::runtime()), &folder.manifest());
    assert!(lines.iter().any(|l| l.text.starts_with("one.onnx")));
    assert_eq!(folder.manifest().files().count(), 2);
}

#[test]
fn decoded_colours_stay_between_0_and_1() {
    let mut model = toy().model(&[Role::Decode]);
    let decoded = model.decode(&Tensor::filled(vec![4, 1, 1, 1], 7.0).unwrap(), NEVER).unwrap();
    assert_eq!(decoded.data, [1.0; 12]);
}
