//! use lib/texel lib/grid lib/particle
// The structs that hot kernels read, from texels.

fn load_particle(t: texture_1d<u32>, i: u32) -> Particle {
    let x = texel(t, 6u * i);
    let v = texel(t, 6u * i + 1u);
    return Particle(x.xyz, bitcast<u32>(x.w), v.xyz, v.w, texel(t, 6u * i + 2u), texel(t, 6u * i + 3u),
        texel(t, 6u * i + 4u), texel(t, 6u * i + 5u));
}

fn load_deformation(t: texture_1d<u32>, i: u32) -> Deformation {
    return Deformation(texel(t, 3u * i), texel(t, 3u * i + 1u), texel(t, 3u * i + 2u));
}

fn load_body(t: texture_1d<u32>, i: u32) -> Body {
    let b = textureLoad(t, 3u * i, 0);
    let g = texel(t, 3u * i + 2u);
    return Body(b.x, b.y, bitcast<f32>(b.z), bitcast<f32>(b.w), texel(t, 3u * i + 1u), g.xyz, g.w);
}

fn load_row(t: texture_1d<u32>, i: u32) -> Row {
    let r = textureLoad(t, i, 0);
    return Row(r.x, r.y, r.z, r.w);
}

// First node of the first cell of a row.
fn row_base(row: Row) -> vec3f {
    return vec3f(block_coord(grid, row.block) * 4u + vec3u(0u, row.id & 3u, (row.id >> 2u) & 3u));
}
