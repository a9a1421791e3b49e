//! use lib/grid
// A place in one word, rounded to 1/256 of a cell and counted modulo 8 cells in x and y, 4 in z: all that can be told of
// two places less than two cells apart. Four of them come by one load, where four places take four.

// Units of a cell.
const SPOTS: f32 = 256.0;
// A difference of two is off by less than a unit an axis, and by what the lower axes leave in its last bits: ¼ in x, ½
// in y. So much further apart two may seem [units].
const OFF: f32 = 2.2;

fn spot(g: Grid, x: vec3f) -> u32 {
    let q = vec3u(vec3i(floor((x - g.origin) * (SPOTS / g.dx))));
    return (q.x << 21u) | ((q.y & 0x7ffu) << 10u) | (q.z & 0x3ffu);
}

// What `near_by` takes for a reach, at most a cell's length.
fn reach_of(g: Grid, reach: f32) -> f32 {
    let most = (SPOTS * (reach / g.dx) + OFF) * 2097152.0;
    return most * most;
}

// Whether two are perhaps within a reach of each other; surely, if they are. Each axis in the upper bits of a signed
// number: what is below is a fraction.
fn near_by(a: u32, b: u32, reach: f32) -> bool {
    let d = a - b;
    let x = f32(bitcast<i32>(d));
    let y = f32(bitcast<i32>(d << 11u));
    let z = 0.5 * f32(bitcast<i32>(d << 22u));
    return x * x + y * y + z * z < reach;
}
