//! Proof of `points/unproject`: the world point of every pixel of known depth, and none for the others.

use physvideo_gpu::kernels::DepthMap;

use super::{each, image, scenery};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;
use crate::twins::points::View;

pub static CASE: Case = Case {
    kernel: "points/unproject",
    inputs,
    compare,
    tolerance: 5e-7,
    reason: "sums of a few products in f32, relative to the distance from the camera and from the origin",
    unordered: &[],
    bytes: 20.0,
    flops: 30.0,
};

/// Items are pixels.
fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed);
    let mut depths: Vec<f32> = (0..ask.items).map(|_| random.range(0.2, 9.0)).collect();
    let unknown =
        if ask.poison { [f32::NAN, f32::INFINITY, -f32::NAN, f32::NEG_INFINITY] } else { [0.0, -0.0, -1.0, 0.0] };
    for (turn, z) in depths.iter_mut().skip(3).step_by(16).enumerate() {
        *z = unknown[turn % 4];
    }
    let [width, height] = image(ask.items);
    each(ask.items, ask)
        .immediates(&DepthMap { width, height, spacing: 0.7 })
        .with("depths", &depths)
        .with("camera", &[scenery::turned([width, height])])
        .with("points", &vec![[f32::NAN; 4]; ask.items])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let depths: Vec<f32> = call.buffers.get("depths");
    let view = View::of(&call.buffers.one("camera"));
    let map: DepthMap = bytemuck::pod_read_unaligned(&call.immediates);
    let (mut want, mut scale) = (Vec::new(), Vec::new());
    for (i, z) in depths.iter().enumerate() {
        if !(z.is_finite() && *z > 0.0) {
            want.extend([0.0; 4]);
            scale.extend([0.0; 4]);
            continue;
        }
        let at = view.unproject(i as u32 % map.width, i as u32 / map.width, f64::from(*z));
        let radius = f64::from(map.spacing) * f64::from(*z) / view.focal.x;
        // All terms are of the size of the camera's or the point's distance.
        let size = (view.rotation * at + view.translation).length() + view.translation.length();
        want.extend([at.x, at.y, at.z, radius]);
        scale.extend([size, size, size, radius]);
    }
    let got = out.get::<f32>("points").into_iter().map(f64::from).collect();
    vec![Compared::close("points", got, want, scale)]
}
