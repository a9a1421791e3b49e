//! use lib/particle lib/carrier lib/texel
// Display points carried by up to four particles each: x = Σ w (x_p + F_p (X − X_p0)) / Σ w, with F_p relative to the
// moment they were bound. Summed as displacements, so that points of particles that did not move stay exactly put.
//! texels rest: vec4f
//! texels carriers: Carrier
//! texels particles: Particle
//! texels deformations: Deformation
//! texels bound: Bound

struct Points { d: array<vec4f> }
@group(0) @binding(0) var rest: texture_1d<u32>;           // X [m], radius in w
@group(0) @binding(1) var carriers: texture_1d<u32>;
@group(0) @binding(2) var particles: texture_1d<u32>;
@group(0) @binding(3) var deformations: texture_1d<u32>;
@group(0) @binding(4) var bound: texture_1d<u32>;
@group(0) @binding(5) var<storage, read_write> points: Points;
var<immediate> call: Carried;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let i = (group.y * groups.x + group.x) * 64u + lane;
    if (i >= call.count) { return; }
    var point = texel(rest, i);
    let carrier = Carrier(textureLoad(carriers, 2u * i, 0), texel(carriers, 2u * i + 1u));
    var moved = vec3f(0.0);
    var total = 0.0;
    for (var k = 0u; k < 4u; k++) {
        let w = carrier.weight[k];
        if (w <= 0.0) { continue; }
        let id = carrier.particle[k];
        let now = texel(particles, 6u * id);
        let tag = bitcast<u32>(now.w);
        if ((tag & QUARANTINED) != 0u) { continue; }
        let at = Bound(texel(bound, 4u * id), texel(bound, 4u * id + 1u), texel(bound, 4u * id + 2u), texel(bound, 4u * id + 3u));
        let f = Deformation(texel(deformations, 3u * id), texel(deformations, 3u * id + 1u), texel(deformations, 3u * id + 2u));
        let offset = point.xyz - at.x.xyz;
        let back = vec3f(dot(at.i0.xyz, offset), dot(at.i1.xyz, offset), dot(at.i2.xyz, offset));
        let turned = f.f0.xyz * back.x + f.f1.xyz * back.y + f.f2.xyz * back.z;
        // The F of what flows says how it is strained, not how it has moved.
        let own = select(turned - offset, vec3f(0.0), (tag & FLOWS) != 0u);
        moved += w * ((now.xyz - at.x.xyz) + own);
        total += w;
    }
    if (total > 0.0) {
        point = vec4f(point.xyz + moved / total, point.w);
    } else if (any(carrier.weight > vec4f(0.0))) {
        // All its carriers are in quarantine: it is not drawn.
        point.w = 0.0;
    }
    points.d[i] = point;
}
