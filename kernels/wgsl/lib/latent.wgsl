//! use lib/texel
// Latents lie as [channel, time, height, width]; a mask has a weight for each [time, height, width], a cell. A lane has
// four elements. Lanes behind the last do its work again and write nothing: where every lane runs, software devices
// load constants once for all of them and need no lane masks, which is a fifth of the time of a step.

struct Turn {
    i: u32,             // which four
    live: bool,         // they are this lane's to write
}
fn turn_of(place: u32, count: u32) -> Turn {
    let fours = count >> 2u;
    return Turn(min(place, max(fours, 1u) - 1u), place < fours);
}

// The cell of an element, its remainder by the cells, by way of f32: software devices divide integers lane by lane. With
// fewer than a million channels the quotient is wrong by one at most.
fn cell_of(element: u32, cells: u32) -> u32 {
    let rest = bitcast<i32>(element - u32(f32(element) / f32(cells)) * cells);
    let raised = select(rest, rest + i32(cells), rest < 0);
    return u32(select(raised, raised - i32(cells), raised >= i32(cells)));
}

// Weights of the cells of elements 4 i .. 4 i + 3.
fn weights(mask: texture_1d<u32>, i: u32, cells: u32) -> vec4f {
    var cell = cell_of(4u * i, cells);
    var four = textureLoad(mask, cell >> 2u, 0);
    // Word by word where fours do not start at cells 0, 4, 8, ...; a loop, for software devices leave loops, not branches.
    for (var k = 0u; k < 4u && (cells & 3u) != 0u; k++) {
        four[k] = word(mask, cell);
        cell = select(cell + 1u, 0u, cell + 1u == cells);
    }
    return bitcast<vec4f>(four);
}

// Which are neither infinite nor NaN, by their bits: compilers may assume there are none.
fn finite(x: vec4f) -> vec4<bool> {
    return (bitcast<vec4u>(x) & vec4u(0x7f800000u)) != vec4u(0x7f800000u);
}
