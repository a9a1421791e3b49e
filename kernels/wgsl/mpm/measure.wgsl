//! use lib/particle
//! family material
// Mass, momentum, angular momentum about the origin and energies of the particles of one body or of all, a partial sum
// for each workgroup; the host adds them in f64.

struct Particles { d: array<Particle> }
struct Bodies { d: array<Body> }
struct Words { d: array<u32> }
struct Deformations { d: array<Deformation> }
struct Sums {
    momentum: vec4f,    // [kg m/s], mass in w [kg]
    spin: vec4f,        // angular momentum [kg m²/s], kinetic energy in w [J]
    elastic: f32,       // [J]
    height: f32,        // Σ m z [kg m], for the energy of gravity
    lost: f32,          // particles in quarantine
    speed: f32,         // largest [m/s]
    potential: f32,     // −Σ m g·x, each body's own gravity [J]
    affine: f32,        // Σ ½ m ‖C‖² [kg/s²]: the energy of the motion in C is dx²/4 times that
}
struct Measures { d: array<Sums> }
@group(0) @binding(0) var<storage, read> particles: Particles;
@group(0) @binding(1) var<storage, read> deformations: Deformations;
@group(0) @binding(2) var<storage, read> bodies: Bodies;
@group(0) @binding(3) var<storage, read_write> sums: Measures;
struct Only { body: u32, count: u32 }
const EVERY: u32 = 0xffffffffu;    // all bodies
var<immediate> only: Only;

var<workgroup> part: array<Sums, 64>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    var s: Sums;
    if (id.x < only.count) {
        let p = particles.d[id.x];
        let own = p.tag & BODY_MASK;
        if (only.body == EVERY || own == only.body) {
            if ((p.tag & QUARANTINED) != 0u) {
                s.lost = select(1.0, 0.0, (p.tag & DORMANT) != 0u);
            } else {
                let d = deformations.d[id.x];
                let body = bodies.d[own];
                let momentum = p.m * p.v;
                s.momentum = vec4f(momentum, p.m);
                // APIC keeps part of the motion in C: its angular momentum is m dx²/4 per unit of C, left to the caller.
                s.spin = vec4f(cross(p.x, momentum), 0.5 * dot(momentum, p.v));
                let trial = Trial(mat3x3f(d.f0.xyz, d.f1.xyz, d.f2.xyz), d.f1.w, mat3x3f());
                s.elastic = d.f0.w * material(body.material, body, trial).energy;
                s.height = p.m * p.x.z;
                s.speed = length(p.v);
                s.potential = -p.m * dot(body.gravity, p.x);
                s.affine = 0.5 * p.m * (dot(p.c0.xyz, p.c0.xyz) + dot(p.c1.xyz, p.c1.xyz) + dot(p.c2.xyz, p.c2.xyz));
            }
        }
    }
    part[lane] = s;
    workgroupBarrier();
    if (lane == 0u) {
        for (var i = 1u; i < 64u; i++) {
            let o = part[i];
            s.momentum += o.momentum;
            s.spin += o.spin;
            s.elastic += o.elastic;
            s.height += o.height;
            s.lost += o.lost;
            s.speed = max(s.speed, o.speed);
            s.potential += o.potential;
            s.affine += o.affine;
        }
        sums.d[group.x] = s;
    }
}
