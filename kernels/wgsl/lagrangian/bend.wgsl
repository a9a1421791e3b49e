//! use lib/rows lib/particle
//! family material
// Energy of the thin parts of cells: that of their boxes (see `lagrangian/thin`) less that of their particles' own points,
// which `mpm/measure` counts. One lane a cell, once a frame.
// A cell of eight boxes: some 25 000 operations, 30 loads and 24 places.
//! texels cells: ElasticCell
//! texels solids: Solid
//! texels thins: ThinCell
//! texels places: Place
//! texels u: vec4f

struct Bodies { d: array<Body> }
struct Energies { d: array<f32> }
@group(0) @binding(0) var cells: texture_1d<u32>;
@group(0) @binding(1) var solids: texture_1d<u32>;
@group(0) @binding(2) var thins: texture_1d<u32>;
@group(0) @binding(3) var places: texture_1d<u32>;
@group(0) @binding(4) var u: texture_1d<u32>;               // displacement of the nodes [m]
@group(0) @binding(5) var<storage, read> bodies: Bodies;
@group(0) @binding(6) var<storage, read_write> energies: Energies;      // of each cell [J]
var<immediate> reference: Reference;

// Energy a volume at a place [J/m³].
fn stored(body: Body, n: Rows, x: vec3f) -> f32 {
    return material(body.material, body, Trial(deformed(derivatives(n, weights(x))), 0.0, mat3x3f())).energy;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= reference.thin) { return; }
    let thin = textureLoad(thins, id.x, 0);
    let low = textureLoad(cells, 3u * thin.x, 0);
    let high = textureLoad(cells, 3u * thin.x + 1u, 0);
    let last = textureLoad(cells, 3u * thin.x + 2u, 0);
    let number = last.y >> 16u;
    let body = bodies.d[number];
    let n = rows(u, low, high, last.x);
    var sum = 0.0;
    for (var i = 0u; i < thin.z; i++) {
        let place = texel(places, thin.y + i);
        if (place.w > 0.0) { sum += place.w * stored(body, n, place.xyz); }
    }
    for (var corner = 0u; corner < 8u; corner++) {
        if (((thin.w >> corner) & 1u) == 0u) { continue; }
        sum -= stored(body, n, select(vec3f(-0.25), vec3f(0.25), (vec3u(corner) & vec3u(1u, 2u, 4u)) != vec3u(0u)));
    }
    energies.d[id.x] = load_solid(solids, number).volume * sum;
}
