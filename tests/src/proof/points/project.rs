//! Proof of `points/project`: pinhole projection to centre, depth and radius; zero for what is not drawn.

use physvideo_gpu::kernels::Screen;

use super::scenery::Scenery;
use super::{SIZE, each};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::twins::points::View;

pub static CASE: Case = Case {
    kernel: "points/project",
    inputs,
    compare,
    tolerance: 5e-7,
    reason: "sums of four numbers and a division in f32, relative to the coordinates that go in",
    unordered: &[],
    bytes: 32.0,
    flops: 30.0,
};

fn inputs(ask: Ask) -> Call {
    let scenery = Scenery::new(ask, SIZE);
    each(ask.items, ask)
        .constant("RADIUS_IN_PIXELS", f64::from(u8::from(scenery.pixels)))
        .immediates(&Screen { width: SIZE[0], height: SIZE[1], points: ask.items as u32 })
        .with("points", &scenery.points)
        .with("camera", &[scenery.camera])
        .with("splats", &vec![[f32::NAN; 4]; ask.items])
        .with("pixels", &[u32::from(scenery.pixels)])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let points: Vec<[f32; 4]> = call.buffers.get("points");
    let view = View::of(&call.buffers.one("camera"));
    let pixels = call.buffers.one::<u32>("pixels") == 1;
    let (mut want, mut scale) = (Vec::new(), Vec::new());
    for p in &points {
        let Some(disc) = view.disc(*p, pixels) else {
            want.extend([0.0; 4]);
            scale.extend([0.0; 4]);
            continue;
        };
        // What rounding goes by: the sizes of the terms of a camera coordinate, relative to the depth.
        let [x, y, z, _] = p.map(f64::from);
        let size = x.abs() + y.abs() + z.abs() + view.translation.length();
        let lost = size / disc[2];
        let away = |axis: usize| (disc[axis] - view.center[axis]).abs() + view.focal[axis];
        want.extend(disc);
        scale.extend([0, 1].map(|axis| away(axis) * lost + view.center[axis]));
        scale.extend([size, disc[3] * lost]);
    }
    let got = out.get::<f32>("splats").into_iter().map(f64::from).collect();
    vec![Compared::close("discs", got, want, scale)]
}
