// Philox4x32-10, a counter-based generator (Salmon et al. 2011): four random words from a counter and a key, without
// state, so that any lane may ask for any of them.

// Upper half of a 64-bit product, by halves of 16 bits: not every device has 64-bit integers.
fn upper_product(a: u32, b: u32) -> u32 {
    let a0 = a & 0xffffu;
    let a1 = a >> 16u;
    let b0 = b & 0xffffu;
    let b1 = b >> 16u;
    let middle = a1 * b0 + ((a0 * b0) >> 16u);
    let other = a0 * b1 + (middle & 0xffffu);
    return a1 * b1 + (middle >> 16u) + (other >> 16u);
}

fn philox_round(c: vec4u, key: vec2u) -> vec4u {
    return vec4u(
        upper_product(0xcd9e8d57u, c.z) ^ c.y ^ key.x,
        0xcd9e8d57u * c.z,
        upper_product(0xd2511f53u, c.x) ^ c.w ^ key.y,
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
