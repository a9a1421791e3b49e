//! use lib/philox
// Standard normal numbers from Philox blocks (Box and Muller 1958). Logarithm, sine and cosine are written out, since
// those of WGSL may be as wrong as 2^-11: here a normal is right to 3e-7 where it is below 1, and to as large a part of
// it above. Largest value: sqrt(66 ln 2) = 6.764.

// -2 ln u for u = (x + 0.5) / 2^32. Above a half it is taken from 1 - u, which f32 still tells from 0.
fn minus_two_log(x: u32) -> f32 {
    let near = x >= 0x80000000u;
    // A positive i32, which software devices turn into f32 faster than a u32.
    let y = (f32(bitcast<i32>(select(x, ~x, near))) + 0.5) * 2.3283064365386963e-10;
    // u = 2^e (1 + f) with f in [-0.5, 0.5).
    let bits = bitcast<u32>(y) - 0x3f400000u;
    let e = select(f32(bitcast<i32>(bits) >> 23u), 0.0, near);
    let f = select(bitcast<f32>((bits & 0x7fffffu) + 0x3f400000u) - 1.0, -y, near);
    // ln (1 + f) = 2 artanh s.
    let s = f / (2.0 + f);
    let q = s * s;
    let log1p = 2.0 * s + s * q * (0.6666663885 + q * (0.4000756145 + q * (0.2823661864 + q * 0.2685149908)));
    // ln 2 in two parts, of which the first is exact in few bits.
    return -2.0 * (e * 0.693359375 + (log1p - e * 2.1219444e-4));
}

// Cosine and sine of 2 pi (x + 0.5) / 2^32.
fn turned(x: u32) -> vec2f {
    // The nearest quarter of a turn, and the angle from there, at most pi / 4.
    let quarter = (x + 0x20000000u) >> 30u;
    let a = (f32(bitcast<i32>(x - (quarter << 30u))) + 0.5) * 1.4629180792671596e-9;
    let q = a * a;
    let s = a + a * q * (-0.16666654611 + q * (8.3321608736e-3 + q * -1.9515295891e-4));
    let c = 1.0 - 0.5 * q + q * q * (4.166664568298827e-2 + q * (-1.388731625493765e-3 + q * 2.443315711809948e-5));
    let odd = (quarter & 1u) != 0u;
    let cosine = bitcast<u32>(select(c, s, odd)) ^ (((quarter + 1u) & 2u) << 30u);
    let sine = bitcast<u32>(select(s, c, odd)) ^ ((quarter & 2u) << 30u);
    return vec2f(bitcast<f32>(cosine), bitcast<f32>(sine));
}

// Four normals from four random words.
fn box_muller(x: vec4u) -> vec4f {
    return vec4f(sqrt(minus_two_log(x.x)) * turned(x.y), sqrt(minus_two_log(x.z)) * turned(x.w));
}

// The noise of elements 4 block .. 4 block + 3: it depends on nothing but these numbers.
fn normals(seed: vec2u, stream: u32, iteration: u32, block: u32) -> vec4f {
    return box_muller(philox(vec4u(block, iteration, stream, 0u), seed));
}
