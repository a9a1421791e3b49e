//! Turns the one-dimensional textures that WGSL can say into uniform texel buffers, which it cannot.
//!
//! A texel buffer is a plain buffer read through the texture unit. On a software driver that is the only fast way to
//! read at an address that differs from lane to lane: a vector comes by one unrolled gather, where a load from a
//! storage buffer walks the lanes in a loop and takes an order of magnitude longer.

const CAPABILITY: u32 = 17;
const TYPE_IMAGE: u32 = 25;
const IMAGE_FETCH: u32 = 95;
const SAMPLED_1D: u32 = 43;
const SAMPLED_BUFFER: u32 = 46;
const DIM_1D: u32 = 0;
const DIM_BUFFER: u32 = 5;
const LOD: u32 = 2;

/// SPIR-V in which every 1D image is a buffer: its type says so, and fetches from it name no level of detail.
pub(crate) fn from_1d_textures(spirv: &[u32]) -> Vec<u32> {
    let (header, mut rest) = spirv.split_at(5.min(spirv.len()));
    let mut out = header.to_vec();
    while let Some(first) = rest.first() {
        let (length, opcode) = ((*first >> 16) as usize, *first & 0xffff);
        let (words, next) = rest.split_at(length.clamp(1, rest.len()));
        rest = next;
        match (opcode, words) {
            (CAPABILITY, [_, SAMPLED_1D]) => out.extend([*first, SAMPLED_BUFFER]),
            (TYPE_IMAGE, [_, id, sampled, DIM_1D, more @ ..]) => {
                out.extend([*first, *id, *sampled, DIM_BUFFER]);
                out.extend(more);
            }
            (IMAGE_FETCH, [_, ty, id, image, at, LOD, _]) => out.extend([5 << 16 | IMAGE_FETCH, *ty, *id, *image, *at]),
            _ => out.extend(words),
        }
    }
    out
}
