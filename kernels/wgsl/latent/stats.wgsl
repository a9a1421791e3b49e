//! use lib/latent
// Sums for norms and ranges: a workgroup takes 2048 elements, a lane 32, and writes one partial; the host adds those
// in f64. Always added in the same order, eight by eight.
//! texels z: vec4f
//! texels mask: f32

struct Partial {
    sum: f32,
    squares: f32,
    smallest: f32,          // 0 where nothing counts
    largest: f32,
    count: u32,             // elements that count: finite, and of a cell whose mask is not 0
    faults: u32,            // elements that would, but are not finite
}
struct Partials { d: array<Partial> }
struct Stats {
    count: u32,             // elements, a multiple of 4
    cells: u32,
}
@group(0) @binding(0) var z: texture_1d<u32>;
@group(0) @binding(1) var mask: texture_1d<u32>;
@group(0) @binding(2) var<storage, read_write> partials: Partials;
var<immediate> call: Stats;

override MASKED: bool = false;      // mask is read, else every cell counts

const FARTHEST = 3.4028234e38;
var<workgroup> parts: array<Partial, 64>;

fn joined(a: Partial, b: Partial) -> Partial {
    return Partial(a.sum + b.sum, a.squares + b.squares, min(a.smallest, b.smallest), max(a.largest, b.largest),
        a.count + b.count, a.faults + b.faults);
}

// Seven more, so far apart; two rounds of it cost software devices less than six of halves.
fn joined_with_others(first: u32, apart: u32) -> Partial {
    var all = parts[first];
    for (var k = 1u; k < 8u; k++) { all = joined(all, parts[first + k * apart]); }
    return all;
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let given = call;
    let part = group.y * groups.x + group.x;
    if (part * 2048u >= given.count) { return; }
    var sum = vec4f(0.0);
    var squares = vec4f(0.0);
    var smallest = vec4f(FARTHEST);
    var largest = vec4f(-FARTHEST);
    var count = vec4u(0u);
    var faults = vec4u(0u);
    for (var k = 0u; k < 8u; k++) {
        let turn = turn_of(part * 512u + 64u * k + lane, given.count);
        let i = turn.i;
        let x = texel(z, i);
        var counts = vec4<bool>(turn.live);
        if (MASKED) { counts &= weights(mask, i, given.cells) != vec4f(0.0); }
        let good = finite(x) & counts;
        let y = select(vec4f(0.0), x, good);
        sum += y;
        squares += y * y;
        smallest = min(smallest, select(vec4f(FARTHEST), x, good));
        largest = max(largest, select(vec4f(-FARTHEST), x, good));
        count += select(vec4u(0u), vec4u(1u), good);
        faults += select(vec4u(0u), vec4u(1u), counts & !good);
    }
    let a = Partial(sum.x + sum.y, squares.x + squares.y, min(smallest.x, smallest.y), max(largest.x, largest.y),
        count.x + count.y, faults.x + faults.y);
    let b = Partial(sum.z + sum.w, squares.z + squares.w, min(smallest.z, smallest.w), max(largest.z, largest.w),
        count.z + count.w, faults.z + faults.w);
    parts[lane] = joined(a, b);
    workgroupBarrier();
    if (lane < 8u) { parts[lane] = joined_with_others(lane, 8u); }
    workgroupBarrier();
    if (lane == 0u) {
        var all = joined_with_others(0u, 1u);
        if (all.count == 0u) {
            all.smallest = 0.0;
            all.largest = 0.0;
        }
        partials.d[part] = all;
    }
}
