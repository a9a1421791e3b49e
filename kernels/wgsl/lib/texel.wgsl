// Buffers read as texels of four words. On a software driver a load from a storage buffer at an address that differs
// from lane to lane walks the lanes one by one; a texel comes by one gather, in a tenth of the time. On GPUs both are
// alike.

fn texel(t: texture_1d<u32>, i: u32) -> vec4f {
    return bitcast<vec4f>(textureLoad(t, i, 0));
}

fn word(t: texture_1d<u32>, i: u32) -> u32 {
    let four = textureLoad(t, i >> 2u, 0);
    let odd = (i & 1u) != 0u;
    return select(select(four.x, four.y, odd), select(four.z, four.w, odd), (i & 2u) != 0u);
}
