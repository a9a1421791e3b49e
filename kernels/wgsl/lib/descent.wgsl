// A solve by conjugate gradients in the form of Chronopoulos & Gear (1989), which needs both of its sums at once: one
// pass over neighbours, one sum and one update an iteration. The device itself ends it, as it does pressure solves.

struct Descent {
    groups: vec3u,      // workgroups of 64 of a pass; x = 0 when it is solved
    iterations: u32,    // of this solve
    size: f32,          // γ = Σ ρ z·z of what is left, of the last pass
    along: f32,         // α
    turn: f32,          // β
    first: f32,         // γ at the start
    all: u32,           // iterations since the frame began
    worst: u32,         // most of a solve since the frame began
    unsolved: u32,      // solves since the frame began that ended with too much left
    spare: u32,
}
