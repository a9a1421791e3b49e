//! use lib/texel
// Latents lie as [channel, time, height, width]; a mask has a weight for each [time, height, width], a cell.

// Weights of the cells of elements 4 i .. 4 i + 3.
fn weights(mask: texture_1d<u32>, i: u32, cells: u32) -> vec4f {
    let cell = (4u * i) % cells;
    if ((cells & 3u) == 0u) { return texel(mask, cell >> 2u); }
    var words = vec4u(0u);
    var c = cell;
    for (var k = 0u; k < 4u; k++) {
        words[k] = word(mask, c);
        c = select(c + 1u, 0u, c + 1u == cells);
    }
    return bitcast<vec4f>(words);
}

// Which are neither infinite nor NaN, by their bits: compilers may assume there are none.
fn finite(x: vec4f) -> vec4<bool> {
    return (bitcast<vec4u>(x) & vec4u(0x7f800000u)) != vec4u(0x7f800000u);
}
