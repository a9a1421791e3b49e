//! Proof of `points/uncover`: an edge pixel fades from the photograph to the filled background with 3s² − 2s³ of how
//! far its point has moved in the image.

use physvideo_gpu::kernels::{EdgePixel, Uncovered};

use super::scenery::turned;
use super::{SIZE, channels, each};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;
use crate::twins::points::View;

pub static CASE: Case = Case {
    kernel: "points/uncover",
    inputs,
    compare,
    tolerance: 0.51,
    reason: "bytes: rounding moves a channel by a half, and the share is known to 1e-5 of 255 in f32",
    unordered: &[],
    bytes: 16.0 + 32.0 + 4.0,
    flops: 70.0,
};

const PAPER: u32 = 0x0102_0304;

/// Items are edge pixels, in any order; there are half as many points.
fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed);
    let camera = turned(SIZE);
    let view = View::of(&camera);
    let mut pixels: Vec<u32> = (0..ask.items as u32 + 50).collect();
    random.shuffle(&mut pixels);
    let count = ask.items / 2 + 1;
    let edge: Vec<EdgePixel> = (0..ask.items)
        .map(|i| EdgePixel {
            pixel: pixels[i],
            point: random.below(count) as u32,
            photo: random.bits() as u32,
            filled: random.bits() as u32,
        })
        .collect();
    let (mut rest, mut points) = (Vec::new(), Vec::new());
    for i in 0..count {
        let at = view.unproject(random.below(37) as u32, random.below(29) as u32, f64::from(random.range(0.8, 2.0)));
        let start = [at.x as f32, at.y as f32, at.z as f32, 0.01];
        // A third stays, the others move by about as much as makes the photograph go.
        let step = if i % 3 == 0 { [0.0; 3] } else { random.vector(0.06) };
        let mut now = [start[0] + step[0], start[1] + step[1], start[2] + step[2], 0.01];
        if ask.poison && i % 16 == 3 {
            // Behind the camera, or far away to its side.
            now[i / 16 % 3] = -1e5;
        }
        rest.push(start);
        points.push(now);
    }
    each(ask.items, ask)
        .immediates(&Uncovered { count: ask.items as u32, full: 3.0 })
        .with("edge", &edge)
        .with("rest", &rest)
        .with("points", &points)
        .with("camera", &[camera])
        .with("background", &vec![PAPER; ask.items + 50])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let (edge, background): (Vec<EdgePixel>, Vec<u32>) = (call.buffers.get("edge"), out.get("background"));
    let (rest, points): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (call.buffers.get("rest"), call.buffers.get("points"));
    let view = View::of(&call.buffers.one("camera"));
    let given: Uncovered = bytemuck::pod_read_unaligned(&call.immediates);
    // What is behind the camera counts as very near, which makes it far away in the image.
    let place = |p: [f32; 4]| {
        let q = view.rotation * glam::DVec3::new(p[0].into(), p[1].into(), p[2].into()) + view.translation;
        view.focal * q.truncate() / q.z.max(1e-6)
    };
    let mut want = vec![PAPER; background.len()].iter().map(|w| [*w; 3].map(|_| 0.0)).collect::<Vec<_>>();
    let mut shown = vec![false; background.len()];
    for e in &edge {
        let moved = (place(points[e.point as usize]) - place(rest[e.point as usize])).length();
        let s = (moved / f64::from(given.full)).min(1.0);
        let share = s * s * (3.0 - 2.0 * s);
        let channel = |word: u32, shift: u32| f64::from((word >> shift) & 0xff);
        want[e.pixel as usize] =
            [0, 8, 16].map(|shift| (1.0 - share) * channel(e.photo, shift) + share * channel(e.filled, shift));
        shown[e.pixel as usize] = true;
    }
    let touched: Vec<usize> = (0..shown.len()).filter(|i| shown[*i]).collect();
    let (rgb, alphas) = channels(&touched.iter().map(|i| background[*i]).collect::<Vec<_>>());
    let others: Vec<u32> = (0..shown.len()).filter(|i| !shown[*i]).map(|i| background[i]).collect();
    vec![
        Compared::near("colours", rgb, touched.iter().flat_map(|i| want[*i]).collect(), 1.0),
        Compared::equal("alphas", &alphas, &vec![255; touched.len()]),
        Compared::equal("other pixels stay", &others, &vec![PAPER; others.len()]),
    ]
}
