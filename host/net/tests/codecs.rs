//! Encoder and decoder over small graphs: round trips and ranges.

mod toy;

use physvideo_net::{Role, Tensor};
use toy::{NEVER, blocks, difference, toy};

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
fn decoded_colours_stay_between_0_and_1() {
    let mut model = toy().model(&[Role::Decode]);
    let decoded = model.decode(&Tensor::filled(vec![4, 1, 1, 1], 7.0).unwrap(), NEVER).unwrap();
    assert_eq!(decoded.data, [1.0; 12]);
}
