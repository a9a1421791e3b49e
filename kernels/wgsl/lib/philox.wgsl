// Philox4x32-10, a counter-based generator (Salmon et al. 2011): four random words from a counter and a key, without
// state, so that any lane may ask for any of them.

// Upper halves of 64-bit products with the two multipliers, by halves of 16 bits: not every device has 64-bit integers.
// The middle terms of the first add up to less than 2^32; those of the second need their carry kept apart.
fn upper_of_first(b: u32) -> u32 {
    let b0 = b & 0xffffu;
    let b1 = b >> 16u;
    return 0xd251u * b1 + ((0xd251u * b0 + ((0x1f53u * b0) >> 16u) + 0x1f53u * b1) >> 16u);
}
fn upper_of_second(b: u32) -> u32 {
    let b0 = b & 0xffffu;
    let b1 = b >> 16u;
    let middle = 0xcd9eu * b0 + ((0x8d57u * b0) >> 16u);
    return 0xcd9eu * b1 + (middle >> 16u) + ((0x8d57u * b1 + (middle & 0xffffu)) >> 16u);
}

fn philox_round(c: vec4u, key: vec2u) -> vec4u {
    return vec4u(
        upper_of_second(c.z) ^ c.y ^ key.x,
        0xcd9e8d57u * c.z,
        upper_of_first(c.x) ^ c.w ^ key.y,
        0xd2511f53u * c.x,
    );
}

fn philox(counter: vec4u, key: vec2u) -> vec4u {
    let weyl = vec2u(0x9e3779b9u, 0xbb67ae85u);
    var c = philox_round(counter, key);
    c = philox_round(c, key + weyl);
    c = philox_round(c, key + 2u * weyl);
    c = philox_round(c, key + 3u * weyl);
    c = philox_round(c, key + 4u * weyl);
    c = philox_round(c, key + 5u * weyl);
    c = philox_round(c, key + 6u * weyl);
    c = philox_round(c, key + 7u * weyl);
    c = philox_round(c, key + 8u * weyl);
    return philox_round(c, key + 9u * weyl);
}
