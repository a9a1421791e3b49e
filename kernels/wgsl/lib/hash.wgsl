// PCG4D (Jarzynski & Olano 2020, "Hash functions for GPU rendering"): four words to four that look random. Cheaper than
// `lib/philox` and good enough for what is looked at rather than sampled from.

fn pcg4d(seed: vec4u) -> vec4u {
    var v = seed * 1664525u + 1013904223u;
    for (var turn = 0u; turn < 2u; turn++) {
        v.x += v.y * v.w;
        v.y += v.z * v.x;
        v.z += v.x * v.y;
        v.w += v.y * v.z;
        if (turn == 0u) { v ^= v >> vec4u(16u); }
    }
    return v;
}
